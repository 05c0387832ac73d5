// Omni-directional displacement: exact hits of rays from OMNI_X x OMNI_Y positions in OMNI_A x OMNI_B directions,
// looked up by the ray's own position and direction. [RTM] 5.9
//
// Every read is inside the table, whatever the ray: a vertical one is the middle direction, one flatter than the
// outermost is read as that.

const float STEEPEST = 1e15;  // slope in heights whose square is a float

// By variables, so that they are no specialization constants: what validators make of vectors of those is not valid.
ivec2 positions() {
  int x = OMNI_X;
  int y = OMNI_Y;
  return ivec2(x, y);
}
ivec2 directions() {
  int a = OMNI_A;
  int b = OMNI_B;
  return ivec2(a, b);
}

// The ray's direction as if the relief were as deep as OMNI_TILE says; z is down.
vec3 direction_of(Ray ray) { return vec3(clamp(ray.slope * OMNI_TILE, -STEEPEST, STEEPEST), 1.0); }

// The coordinates of a direction, in [0, 1]. The listing has acos(x / sqrt(1 - y y)) for the first angle, which is 0 /
// 0 at the poles and the cosine of nothing where rounding leads beyond 1; atan is the same angle for every direction.
vec2 coordinates_of(vec3 direction) {
  if (OMNI_DIRECTIONS == OMNI_DIRECTIONS_SPHERICAL)
    return vec2(atan(direction.z, direction.x), atan(length(direction.xz), direction.y)) / (2.0 * HALF_PI);
  vec2 p = direction.xy / (abs(direction.x) + abs(direction.y) + direction.z);
  return 0.5 + 0.5 * vec2(p.x + p.y, p.x - p.y);
}

// The direction that has these coordinates; z = 1.
vec3 direction_at(vec2 coordinates) {
  if (OMNI_DIRECTIONS == OMNI_DIRECTIONS_SPHERICAL) {
    vec2 angles = coordinates * (2.0 * HALF_PI);
    vec2 cotangents = cos(angles) / sin(angles);
    return vec3(cotangents.x, cotangents.y / sin(angles.x), 1.0);
  }
  vec2 e = 2.0 * coordinates - 1.0;
  return vec3(0.5 * vec2(e.x + e.y, e.x - e.y) / (1.0 - max(abs(e.x), abs(e.y))), 1.0);
}

float entry(ivec2 position, ivec2 direction, inout Hit hit) {
  hit.taps += 1;
  position = wrapped(position, ivec2(OMNI_X, OMNI_Y));
  direction = clamp(direction, ivec2(0), directions() - 1);
  ivec2 texel =
      OMNI_ORDER == OMNI_ORDER_ABXY ? direction * positions() + position : position * directions() + direction;
  return texelFetch(extra_map, texel, 0).x;
}

// The corners of a cell round x: the lower one, and the place between them; both the nearest where nothing is
// interpolated.
struct Between {
  ivec2 low;
  vec2 f;
};
Between between(vec2 x, bool is_interpolated) {
  vec2 low = floor(is_interpolated ? x - 0.5 : x);
  return Between(ivec2(low), is_interpolated ? x - 0.5 - low : vec2(0.0));
}

// Of one position.
float from_directions(ivec2 position, Between d, bool is_interpolated, inout Hit hit) {
  float t00 = entry(position, d.low, hit);
  if (!is_interpolated) return t00;
  float t10 = entry(position, d.low + ivec2(1, 0), hit);
  float t01 = entry(position, d.low + ivec2(0, 1), hit);
  float t11 = entry(position, d.low + ivec2(1, 1), hit);
  return mix(mix(t00, t10, d.f.x), mix(t01, t11, d.f.x), d.f.y);
}

float fetched(Ray ray, vec2 coordinates, inout Hit hit) {
  bool by_position = INTERPOLATION == INTERPOLATION_POSITION || INTERPOLATION == INTERPOLATION_BOTH;
  bool by_direction = INTERPOLATION == INTERPOLATION_DIRECTION || INTERPOLATION == INTERPOLATION_BOTH;
  Between p = between(ray.uv * vec2(positions()), by_position);
  Between d = between(coordinates * vec2(directions()), by_direction);
  float t00 = from_directions(p.low, d, by_direction, hit);
  if (!by_position) return t00;
  float t10 = from_directions(p.low + ivec2(1, 0), d, by_direction, hit);
  float t01 = from_directions(p.low + ivec2(0, 1), d, by_direction, hit);
  float t11 = from_directions(p.low + ivec2(1, 1), d, by_direction, hit);
  return mix(mix(t00, t10, p.f.x), mix(t01, t11, p.f.x), p.f.y);
}

// The table through the sampler's filter, which knows of no borders between positions or directions.
float filtered(vec2 uv, inout Hit hit) {
  if (FILTER == FILTER_HARDWARE) {
    hit.taps += 1;
    return textureLod(extra_map, uv, 0.0).x;
  }
  hit.taps += 4;
  ivec2 size = positions() * directions();
  vec2 x = uv * vec2(size) - 0.5;
  vec2 low = floor(x);
  vec2 f = x - low;
  ivec2 i = ivec2(low);
  ivec2 from = wrapped(i, size);
  ivec2 to = wrapped(i + 1, size);
  return mix(mix(texelFetch(extra_map, from, 0).x, texelFetch(extra_map, ivec2(to.x, from.y), 0).x, f.x),
             mix(texelFetch(extra_map, ivec2(from.x, to.y), 0).x, texelFetch(extra_map, to, 0).x, f.x), f.y);
}

// [RTM] listing 5.9 for abxy, its text for xyab. What it has is a way along the ray, in the units of the tile.
float published(Ray ray, vec3 direction, vec2 coordinates, inout Hit hit) {
  vec2 position = WRAP == WRAP_CLAMP ? clamp(ray.uv, 0.0, 1.0) : ray.uv - trunc(ray.uv);  // fmod
  vec2 of_directions = coordinates * vec2(directions());
  vec2 place = OMNI_ORDER == OMNI_ORDER_ABXY ? (floor(of_directions) + position) / vec2(directions())
                                             : (floor(position * vec2(positions())) + coordinates) / vec2(positions());
  vec2 nearest = min(floor(of_directions), vec2(directions() - 1));
  float way = filtered(place, hit) * length(direction_at((nearest + 0.5) / vec2(directions())));
  return way / length(direction);
}

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_HIT, 0, 0);
  vec3 direction = direction_of(ray);
  vec2 coordinates = coordinates_of(direction);
  float t = LOOKUP == LOOKUP_FETCHED ? fetched(ray, coordinates, hit) : published(ray, direction, coordinates, hit);
  hit.t = clamp(t, 0.0, 1.0);
  return hit;
}
