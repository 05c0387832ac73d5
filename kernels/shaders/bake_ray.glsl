// The rays of [PO07], as kernels/maps/bake_relaxed_po07.cpp has them: from the top plate over an owner, through a
// target, and on below it until they leave the relief. They are walked in float, whose error is bounded; double
// precision decides where that is not enough.

layout(BINDING(FIRST_BUFFER_BINDING + 4)) uniform samplerBuffer corners;               // bake_corners.comp
layout(BINDING(FIRST_BUFFER_BINDING + 5), std430) buffer Targets { uint targets[]; };  // of owners' least keys, packed

const uint NO_TARGET = 0xffffffffu;

const float Z_ERROR = 5e-7;        // of heights along a ray in float
const float OFFSET_ERROR = 1e-6;   // as a share of the way from the owner
const float PLACE_ERROR = 2.5e-7;  // and of a coordinate

float search_steps = float(bake.search_steps);
float step_share = bake.step_share;

// Owners, or packets of them, are made grid by grid. The first grid's are WIDEST_STRIDE apart along both axes, and each
// other one halves that: so that the targets of near ones are good first guesses. Without, a search walks six to twelve
// times as many steps.
int stride = abs(argument);
bool is_first_grid = stride == WIDEST_STRIDE;
// Along which axes an owner is half-way between those that are done.
ivec2 is_between = is_first_grid ? ivec2(0) : ivec2((gl_WorkGroupID.z + 1u) & 1u, (gl_WorkGroupID.z + 1u) >> 1);

ivec2 on_grid(ivec2 i) { return is_first_grid ? stride * i : stride * (2 * i + is_between); }

uint packed(ivec2 place) { return uint(place.x) | (uint(place.y) << 16); }
ivec2 unpacked(uint place) { return ivec2(place & 0xffffu, place >> 16); }

// A ray below its target. Steps count from the target, down to the bottom plate at search_steps.
struct Ray {
  vec2 owner;
  vec2 offset;   // texels from the owner to the target; under repeat to the nearest image, in (-side/2, side/2]
  float height;  // the owner's
  float top;     // the target's
  float distance2;
  float fall;    // of a step
  float travel;  // what the way from the owner grows by, as a share of that to the target, while z falls by 1
  vec2 error;    // of the height over the surface: x + y * what the way grows by
};

// What a ray does.
const int ENDED = 0;
const int GOES_ON = 1;
const int UNDECIDED = 2;  // by float: it has left the relief or goes on
const int HAS_LEFT = 3;

vec2 offset_between(ivec2 from, ivec2 to) {
  ivec2 d = to - from;
  if (repeats) {
    d -= sides * ivec2(greaterThan(2 * d, sides));
    d += sides * ivec2(lessThanEqual(2 * d, -sides));
  }
  return vec2(d);
}

Ray ray_between(ivec2 owner, float height, ivec2 target) {
  Ray ray;
  ray.owner = vec2(owner);
  ray.offset = offset_between(owner, target);
  ray.height = height;
  ray.top = texelFetch(corners, index_of(target)).x;
  ray.distance2 = aspect * ray.offset.x * ray.offset.x + ray.offset.y * ray.offset.y;
  ray.fall = ray.top * step_share;
  ray.travel = ray.top < 1.0 ? 1.0 / (1.0 - ray.top) : 0.0;
  // A surface between heights of 0 and 1 is no steeper than 1 a texel along an axis.
  ray.error = vec2(2.0 * Z_ERROR + PLACE_ERROR * (ray.owner.x + ray.owner.y),
                   (OFFSET_ERROR + PLACE_ERROR) * (abs(ray.offset.x) + abs(ray.offset.y)));
  return ray;
}

// At the top plate itself a ray runs level and enters nothing: the cone ends at the target.
int state_at_target(Ray ray) { return ray.top < 1.0 ? GOES_ON : HAS_LEFT; }

vec2 inverse_sides = repeats ? 1.0 / vec2(sides) : vec2(0.0);
vec2 first_place = repeats ? vec2(-WIDE) : vec2(0.0);
vec2 last_place = repeats ? vec2(WIDE) : vec2(sides - 1);

float surface(vec2 place) {
  place = mix(place, first_place, lessThan(place, first_place));
  place = mix(place, last_place, greaterThan(place, last_place));
  vec2 low = floor(place);
  vec2 within = place - low;
  low -= vec2(sides) * floor((low + 0.5) * inverse_sides);
  vec4 heights = texelFetch(corners, index_of(ivec2(low)));
  vec2 along = mix(heights.xz, heights.yw, within.x);
  return mix(along.x, along.y, within.y);
}

// limit: keys from here on are no better than the best. most_steps: rays that have not left by then are not followed
int state_at(Ray ray, float at, float limit, float most_steps) {
  float fallen = ray.fall * at;
  float z = ray.top - fallen;
  float rise = z - ray.height + Z_ERROR;
  float scale = 1.0 + fallen * ray.travel;
  // Farther on the ray is lower and farther away, so that the key only grows.
  bool is_in_vain = rise <= 0.0 || ray.distance2 * (scale * scale) >= limit * (rise * rise);
  float error = ray.error.x + ray.error.y * scale;
  float above = z - surface(ray.owner + ray.offset * scale);
  int next = at < most_steps ? GOES_ON : ENDED;
  int state = above < -error ? next : UNDECIDED;
  if (above > error || at == search_steps) state = HAS_LEFT;
  return is_in_vain ? ENDED : state;
}

// Bounds of the cone's key where its ray leaves the relief, in units of weight_y.
vec2 key_bounds(Ray ray, float at) {
  float fallen = ray.fall * at;
  float rise = ray.top - fallen - ray.height;
  float scale = 1.0 + fallen * ray.travel;
  float distance2 = ray.distance2 * (scale * scale);
  float low_rise = rise - Z_ERROR;
  float high_rise = rise + Z_ERROR;
  return vec2(distance2 / (high_rise * high_rise) * (1.0 - 4.0 * KEY_ERROR),
              low_rise > 0.0 ? distance2 / (low_rise * low_rise) * (1.0 + 4.0 * KEY_ERROR) : WIDE);
}

// The same along one axis, without rounding.
struct ExactCell {
  int low;
  double fraction;
};

ExactCell exact_cell(double coordinate, int side) {
  if (!repeats) coordinate = clamp(coordinate, 0.0lf, double(side - 1));
  double whole = floor(coordinate);
  // Exact but for the quotient, which may be one off.
  precise double low = whole - double(side) * floor(whole / double(side));
  if (low < 0.0lf) low += double(side);
  if (low >= double(side)) low -= double(side);
  return ExactCell(int(low), coordinate - whole);
}

double lerp(double a, double b, double fraction) {
  precise double value = a + fraction * (b - a);
  return value;
}

double exact_surface(double x, double y) {
  ExactCell column = exact_cell(x, sides.x);
  ExactCell row = exact_cell(y, sides.y);
  dvec4 heights = dvec4(texelFetch(corners, index_of(ivec2(column.low, row.low))));
  double top = lerp(heights.x, heights.y, column.fraction);
  double bottom = lerp(heights.z, heights.w, column.fraction);
  return lerp(top, bottom, row.fraction);
}

// What is exact at a step.
struct ExactPoint {
  double z;
  double scale;
};

ExactPoint exact_point(Ray ray, float at) {
  double top = double(ray.top);
  if (at == 0.0) return ExactPoint(top, 1.0lf);
  precise double z = top * (1.0lf - divide(double(at), double(search_steps)));
  precise double scale = 1.0lf + (top - z) * divide(1.0lf, 1.0lf - top);
  return ExactPoint(z, scale);
}

bool exact_has_left(Ray ray, float at) {
  ExactPoint point = exact_point(ray, at);
  precise double x = double(ray.owner.x) + double(ray.offset.x) * point.scale;
  precise double y = double(ray.owner.y) + double(ray.offset.y) * point.scale;
  return exact_surface(x, y) < point.z;
}

// The cone's key where its ray leaves the relief at this step.
double exact_key(Ray ray, float at) {
  ExactPoint point = exact_point(ray, at);
  precise double rise = point.z - double(ray.height);
  if (rise <= 0.0lf) return widest_key;
  dvec2 offset = dvec2(ray.offset);
  precise double distance2 = offset.x * offset.x * weight_x + offset.y * offset.y * weight_y;
  precise double scaled2 = distance2 * (point.scale * point.scale);
  precise double rise2 = rise * rise;
  return min(divide(scaled2, rise2), widest_key);
}
