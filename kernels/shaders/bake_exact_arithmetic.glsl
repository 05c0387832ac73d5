// Double arithmetic that is rounded to nearest wherever additions and products are: APIs let a device's own divisions
// and roots be some ulps off.

// a - q b without error, q within an ulp or so of a / b: Dekker's product of Veltkamp's halves.
double residual(double a, double b, double q) {
  const double SPLIT = 134217729.0lf;  // 2^27 + 1
  precise double scaled_q = q * SPLIT;
  precise double high_q = scaled_q - (scaled_q - q);
  precise double low_q = q - high_q;
  precise double scaled_b = b * SPLIT;
  precise double high_b = scaled_b - (scaled_b - b);
  precise double low_b = b - high_b;
  precise double product = q * b;
  precise double error = ((high_q * high_b - product) + high_q * low_b + low_q * high_b) + low_q * low_b;
  precise double rest = (a - product) - error;
  return rest;
}

// The double after q > 0, or the one before it.
double neighbour(double q, bool above) {
  uvec2 bits = unpackDouble2x32(q);
  if (above) {
    bits.x += 1u;
    if (bits.x == 0u) bits.y += 1u;
  } else {
    if (bits.x == 0u) bits.y -= 1u;
    bits.x -= 1u;
  }
  return packDouble2x32(bits);
}

// a / b, for a, b > 0.
double divide(double a, double b) {
  precise double q = a / b;
  q = q + residual(a, b, q) / b;  // now the nearest double or, close to a tie, its neighbour
  double rest = residual(a, b, q);
  if (rest == 0.0lf) return q;
  double other = neighbour(q, rest > 0.0lf);
  return abs(residual(a, b, other)) < abs(rest) ? other : q;
}

// The square root of a > 0.
double square_root(double a) {
  precise double root = sqrt(a);
  for (int i = 0; i < 2; ++i) root = root + 0.5lf * residual(a, root, root) / root;  // now at most a neighbour of it
  double rest = residual(a, root, root);
  // The root is over root + ulp / 2 where a is over root^2 + root ulp + ulp^2 / 4. In units of ulp^2 all these are
  // whole numbers but for the quarter.
  double ulp = neighbour(root, true) - root;
  precise double half_way = root * ulp;
  if (rest > half_way) return neighbour(root, true);
  return rest <= -half_way ? neighbour(root, false) : root;
}

// The greatest float that is not above x >= 0.
float rounded_down(double x) {
  float nearest = float(x);
  if (nearest == 0.0) return nearest;
  if (double(nearest) > x) return uintBitsToFloat(floatBitsToUint(nearest) - 1u);
  float next = uintBitsToFloat(floatBitsToUint(nearest) + 1u);
  return double(next) > x ? nearest : next;
}
