#include "kernels/judge/reference.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "kernels/base/error.h"
#include "tests/slow_reference.h"

namespace reliefbench {
namespace {

constexpr double kNoExit = std::numeric_limits<double>::infinity();
using Twister = std::mt19937;

struct FieldSize {
  int width;
  int height;
};

template <typename Height>
Heightfield make_field(FieldSize size, const Height& height) {
  Heightfield map{.width = size.width, .height = size.height, .texels = {}};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) map.texels.push_back(static_cast<float>(height(x, y)));
  }
  return map;
}

double uniform(Twister& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
int pick(Twister& random, int count) { return std::uniform_int_distribution<int>(0, count - 1)(random); }

struct MapKindRow {
  const char* name;
  Heightfield (*make)(FieldSize, Twister&);
};
const MapKindRow kMapKinds[] = {
    {"constant", [](FieldSize s, Twister&) { return make_field(s, [](int, int) { return 0.625; }); }},
    {"zero", [](FieldSize s, Twister&) { return make_field(s, [](int, int) { return 0.0; }); }},
    {"full", [](FieldSize s, Twister&) { return make_field(s, [](int, int) { return 1.0; }); }},
    {"ramp", [](FieldSize s, Twister&) { return make_field(s, [&](int x, int) { return x / (s.width - 1.0); }); }},
    {"cliff",
     [](FieldSize s, Twister&) { return make_field(s, [&](int, int y) { return 2 * y < s.height ? 0.0 : 1.0; }); }},
    {"spike",
     [](FieldSize s, Twister&) { return make_field(s, [&](int x, int y) { return x == s.width / 2 && y == 1; }); }},
    {"checker", [](FieldSize s, Twister&) { return make_field(s, [](int x, int y) { return (x + y) % 2; }); }},
    {"noise", [](FieldSize s, Twister& r) { return make_field(s, [&](int, int) { return uniform(r, 0, 1); }); }},
    {"sparse",
     [](FieldSize s, Twister& r) { return make_field(s, [&](int, int) { return uniform(r, 0, 1) > 0.95; }); }},
    {"quantised", [](FieldSize s, Twister& r) { return make_field(s, [&](int, int) { return pick(r, 5) / 4.0; }); }},
    {"waves",
     [](FieldSize s, Twister& r) {
       const double phase = uniform(r, 0, 6);
       return make_field(
           s, [&](int x, int y) { return 0.5 + 0.25 * std::sin(0.7 * x + phase) + 0.25 * std::sin(0.3 * y); });
     }},
};
constexpr FieldSize kFieldSizes[] = {{2, 2}, {3, 2}, {2, 5}, {7, 5}, {8, 8}, {17, 16}, {33, 31}, {64, 16}};

TextureRay random_ray(FieldSize size, Twister& random) {
  const auto centre = [&](int side) { return static_cast<float>((pick(random, 3 * side) - side + 0.5) / side); };
  const auto anywhere = [&] { return static_cast<float>(uniform(random, -1.5, 2.5)); };
  const auto slope = [&] {
    const double length = std::exp(uniform(random, std::log(0.01), std::log(30.0)));
    return static_cast<float>(pick(random, 2) == 0 ? length : -length);
  };
  const auto width = static_cast<float>(size.width);
  const auto height = static_cast<float>(size.height);
  switch (pick(random, 10)) {
    case 0:
      return {anywhere(), anywhere(), 0, 0};  // straight down
    case 1:
      return {centre(size.width), centre(size.height), 0, -0.0F};  // down through a texel
    case 2:
      return {anywhere(), anywhere(), slope(), 0};  // parallel to an axis
    case 3:
      return {centre(size.width), anywhere(), 0, slope()};  // along a cell's edge
    case 4:
      return {centre(size.width), centre(size.height), slope(), 0};  // along an edge, from a texel
    case 5:
      return {centre(size.width), anywhere(), slope(), slope()};  // from an edge
    case 6: {                                                     // through the corners
      const float s = slope();
      return {centre(size.width), centre(size.height), s,
              pick(random, 2) == 0 ? s * width / height : -s * width / height};
    }
    case 7:
      return {1000 * anywhere(), 1000 * anywhere(), slope(), slope()};  // far away
    case 8:
      return {anywhere(), anywhere(), slope(), 1e-40F};  // denormal slope
    default:
      return {anywhere(), anywhere(), slope(), slope()};
  }
}

/// How far rounding in double may move the height above the surface: positions are texels with 53 bits.
double height_tolerance(const Heightfield& map, const TextureRay& ray) {
  const double x = map.width * (1.0 + std::abs(ray.u) + std::abs(ray.slope_u));
  const double y = map.height * (1.0 + std::abs(ray.v) + std::abs(ray.slope_v));
  return 1e-15 * (1 + x + y);
}

/// Holds a result to the definition of the first solid interval, touches and all.
void check_is_first_solid(const Heightfield& map, Wrap wrap, const TextureRay& ray, const ReferenceHit& hit) {
  const SlowReference slow(map, wrap, ray);
  const double tolerance = height_tolerance(map, ray);
  ASSERT_GE(hit.t_enter, 0);
  ASSERT_LE(hit.t_enter, 1);
  ASSERT_GE(hit.t_exit, hit.t_enter);
  EXPECT_GE(static_cast<double>(slow.range(0, hit.t_enter).lowest), -tolerance) << "solid before t_enter";
  EXPECT_LE(slow.above(hit.t_enter), tolerance) << "t_enter is in the air";
  const double end = hit.t_exit == kNoExit ? 1 : hit.t_exit;
  EXPECT_LE(static_cast<double>(slow.range(hit.t_enter, end).highest), tolerance) << "air before t_exit";
  if (hit.t_exit != kNoExit) {
    EXPECT_GE(slow.above(hit.t_exit), -tolerance) << "t_exit is in the solid";
  }
}

/// Whether both ends are the oracle's. They may differ where the ray grazes: there t is as good as undefined.
bool is_same(const ReferenceHit& hit, const SlowReference::Hit& slow) {
  const auto near = [](double a, double b) { return a == b || std::abs(a - b) < 1e-9; };
  return near(hit.t_enter, static_cast<double>(slow.enter)) && near(hit.t_exit, static_cast<double>(slow.exit));
}

class EveryMapAndRay : public testing::TestWithParam<MapKindRow> {};

TEST_P(EveryMapAndRay, AgreesWithTheOracle) {
  Twister random(1);
  int rays = 0;
  int differing = 0;
  for (const FieldSize size : kFieldSizes) {
    const Heightfield map = GetParam().make(size, random);
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      const ReferenceTracer tracer(map, wrap);
      for (int i = 0; i < 24; ++i, ++rays) {
        const TextureRay ray = random_ray(size, random);
        SCOPED_TRACE(testing::Message() << size.width << "x" << size.height << " wrap " << static_cast<int>(wrap)
                                        << std::hexfloat << " ray " << ray.u << " " << ray.v << " " << ray.slope_u
                                        << " " << ray.slope_v);
        const ReferenceHit hit = tracer.trace(ray);
        check_is_first_solid(map, wrap, ray, hit);
        if (!is_same(hit, SlowReference(map, wrap, ray).trace())) ++differing;
        if (HasFailure()) return;
      }
    }
  }
  EXPECT_LE(differing, rays / 50) << "only grazing rays may differ";
}
INSTANTIATE_TEST_SUITE_P(Reference, EveryMapAndRay, testing::ValuesIn(kMapKinds),
                         [](const auto& row) { return std::string(row.param.name); });

TEST(Reference, OracleAgreesOnExtremeSlopesAndPlaces) {
  Twister random(7);
  const Heightfield map = kMapKinds[7].make({4, 3}, random);
  const float slopes[] = {1e4F, -777.7F, 0};
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
    const ReferenceTracer tracer(map, wrap);
    for (const float slope_u : slopes) {
      for (const float slope_v : slopes) {
        for (const float uv : {0.3F, -1000.1F}) {
          const TextureRay ray{uv, 0.5F * uv, slope_u, slope_v};
          const ReferenceHit hit = tracer.trace(ray);
          check_is_first_solid(map, wrap, ray, hit);
        }
      }
    }
  }
}

TEST(Reference, FlatSurfaceIsHitAtItsHeight) {
  for (const double h : {0.0, 0.25, 0.7, 1.0}) {
    const Heightfield map = make_field({5, 3}, [&](int, int) { return h; });
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      for (const TextureRay& ray : {TextureRay{0.5F, 0.5F, 0, 0}, TextureRay{-3, 7, 900, -0.01F}}) {
        const ReferenceHit hit = ReferenceTracer(map, wrap).trace(ray);
        EXPECT_EQ(hit.t_enter, 1 - static_cast<double>(map.at(0, 0)));
        EXPECT_EQ(hit.t_exit, kNoExit);
      }
    }
  }
}

TEST(Reference, RampIsHitWhereTheLinesMeet) {
  // Surface x/8 over texels x = 0..8; the ray starts at x = 1 and goes 4 texels per unit of height.
  const Heightfield map = make_field({9, 4}, [](int x, int) { return x / 8.0; });
  const ReferenceHit hit = ReferenceTracer(map, Wrap::clamp).trace({1.5F / 9, 0.5F, 4.0F / 9, 0});
  EXPECT_NEAR(hit.t_enter, (1 - 1.0 / 8) / (1 + 4.0 / 8), 1e-7);  // float uv
  EXPECT_EQ(hit.t_exit, kNoExit);
}

TEST(Reference, StepIsHitOnItsFlank) {
  // 0 up to texel 3, 1 from texel 4: the flank between them is x - 3.
  const Heightfield map = make_field({8, 8}, [](int x, int) { return x > 3; });
  const ReferenceHit hit = ReferenceTracer(map, Wrap::clamp).trace({1.5F / 8, 0.5F, 0.5F, 0});
  EXPECT_DOUBLE_EQ(hit.t_enter, 3.0 / 5);  // 1 - t = 1 + 4 t - 3
  EXPECT_EQ(hit.t_exit, kNoExit);
}

TEST(Reference, SpikeIsEnteredAndLeft) {
  // 1 - |x - 4| along the spike's row; 8 texels per unit of height from x = 2.
  const Heightfield map = make_field({8, 8}, [](int x, int y) { return x == 4 && y == 4; });
  const TextureRay ray{2.5F / 8, 4.5F / 8, 1, 0};
  const ReferenceHit hit = ReferenceTracer(map, Wrap::repeat).trace(ray);
  EXPECT_DOUBLE_EQ(hit.t_enter, 2.0 / 9);  // 1 - t = 1 - (4 - x), x = 2 + 8 t
  EXPECT_DOUBLE_EQ(hit.t_exit, 2.0 / 7);   // 1 - t = 1 - (x - 4)
  const ReferenceHit beside = ReferenceTracer(map, Wrap::repeat).trace({2.5F / 8, 2.5F / 8, 1, 0});
  EXPECT_EQ(beside.t_enter, 1);
}

TEST(Reference, SaddleIsHitOnItsDiagonal) {
  // S = 2 f (1 - f) along the diagonal of the cell, and f = t.
  const Heightfield map = make_field({2, 2}, [](int x, int y) { return x != y; });
  const ReferenceHit hit = ReferenceTracer(map, Wrap::clamp).trace({0.25F, 0.25F, 0.5F, 0.5F});
  EXPECT_DOUBLE_EQ(hit.t_enter, 0.5);
  EXPECT_EQ(hit.t_exit, kNoExit);
}

TEST(Reference, BulgeIsEnteredAndLeftInOneCell) {
  // S = 2 f (1 - f) again, but seen from lower slopes: f = 1/2 + 8 (t - 1/2) keeps both crossings inside the cell.
  const Heightfield map = make_field({2, 2}, [](int x, int y) { return x != y; });
  const float start = (0.5F - 4 + 0.5F) / 2;
  const TextureRay ray{start, start, 4, 4};
  const ReferenceHit hit = ReferenceTracer(map, Wrap::clamp).trace(ray);
  const SlowReference::Hit slow = SlowReference(map, Wrap::clamp, ray).trace();
  EXPECT_NEAR(hit.t_enter, static_cast<double>(slow.enter), 1e-14);
  EXPECT_NEAR(hit.t_exit, static_cast<double>(slow.exit), 1e-14);
  EXPECT_LT(hit.t_exit, 1);
}

TEST(Reference, TopPlateIsHitAtOnce) {
  const Heightfield spike = make_field({8, 8}, [](int x, int y) { return x == 4 && y == 4; });
  const ReferenceTracer tracer(spike, Wrap::repeat);
  const ReferenceHit along = tracer.trace({4.5F / 8, 4.5F / 8, 1.0F / 16, 0});
  EXPECT_EQ(along.t_enter, 0);
  EXPECT_EQ(along.t_exit, kNoExit);
  const ReferenceHit touch = tracer.trace({4.5F / 8, 4.5F / 8, 1, 0});  // the flank falls faster than the ray
  EXPECT_EQ(touch.t_enter, 0);
  EXPECT_EQ(touch.t_exit, 0);
}

TEST(Reference, RepeatSeesTheNextTileAndClampTheBorder) {
  const Heightfield map = make_field({4, 4}, [](int x, int) { return x == 0; });
  const TextureRay ray{0.625F, 0.5F, 1, 0};  // from texel 2 over the seam to texel 4 = texel 0
  EXPECT_DOUBLE_EQ(ReferenceTracer(map, Wrap::repeat).trace(ray).t_enter, 2.0 / 5);  // 1 - t = x - 3, x = 2 + 4 t
  EXPECT_EQ(ReferenceTracer(map, Wrap::clamp).trace(ray).t_enter, 1);
  const ReferenceHit outside = ReferenceTracer(map, Wrap::clamp).trace({-7, 0.5F, 0.25F, 0});
  EXPECT_EQ(outside.t_enter, 0);
  EXPECT_EQ(outside.t_exit, kNoExit);
}

TEST(Reference, RaysWithoutAPlaceAreParallelToThePlate) {
  const Heightfield map = make_field({4, 4}, [](int x, int) { return x / 4.0; });
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
    const ReferenceTracer tracer(map, wrap);
    for (const TextureRay& ray :
         {TextureRay{nan, 0, 0, 0}, TextureRay{0, kInfinity, 0, 0}, TextureRay{0, 0, nan, 0},
          TextureRay{0, 0, 0, -kInfinity}, TextureRay{0, 0, 1e38F, 0}, TextureRay{0, 0, 0, -1e10F}}) {
      const ReferenceHit hit = tracer.trace(ray);
      EXPECT_EQ(hit.t_enter, 0.25);
      EXPECT_EQ(hit.t_exit, kNoExit);
    }
    // Huge places are places.
    const ReferenceHit far = tracer.trace({3e38F, -3e38F, 0, 0});
    EXPECT_GE(far.t_enter, 0.25);
    EXPECT_LE(far.t_enter, 1);
  }
}

TEST(Reference, ManyRaysAreTheSameOnAnyThreads) {
  Twister random(3);
  const FieldSize size{33, 31};
  const Heightfield map = kMapKinds[7].make(size, random);
  const ReferenceTracer tracer(map, Wrap::repeat);
  std::vector<TextureRay> rays(5000);
  for (TextureRay& ray : rays) ray = random_ray(size, random);
  const std::vector<ReferenceHit> one = tracer.trace(rays, 1);
  const std::vector<ReferenceHit> many = tracer.trace(rays, 4);
  ASSERT_EQ(one.size(), rays.size());
  ASSERT_EQ(many.size(), rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const ReferenceHit single = tracer.trace(rays[i]);
    ASSERT_EQ(one[i].t_enter, single.t_enter);
    ASSERT_EQ(one[i].t_exit, single.t_exit);
    ASSERT_EQ(many[i].t_enter, single.t_enter);
    ASSERT_EQ(many[i].t_exit, single.t_exit);
    ASSERT_EQ(tracer.first_hit(rays[i]), single.t_enter);
  }
  EXPECT_TRUE(tracer.trace(std::span<const TextureRay>()).empty());
}

TEST(Reference, RefusesMapsWithoutACell) {
  EXPECT_THROW(ReferenceTracer(make_field({1, 1}, [](int, int) { return 0; }), Wrap::repeat), Error);
  EXPECT_THROW(ReferenceTracer(make_field({1, 9}, [](int, int) { return 0; }), Wrap::clamp), Error);
}

// A march by samples, over any map and ray: nothing solid before t_enter, nothing but solid up to t_exit.
RC_GTEST_PROP(ReferenceProperty, AMarchFindsNothingEarlier, ()) {
  Twister random(*rc::gen::arbitrary<unsigned>());
  const FieldSize size{*rc::gen::inRange(2, 40), *rc::gen::inRange(2, 40)};
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  const Heightfield map = kMapKinds[static_cast<std::size_t>(*rc::gen::inRange(0, 11))].make(size, random);
  const ReferenceTracer tracer(map, wrap);
  for (int i = 0; i < 4; ++i) {
    const TextureRay ray = random_ray(size, random);
    const ReferenceHit hit = tracer.trace(ray);
    const SlowReference slow(map, wrap, ray);
    const double tolerance = height_tolerance(map, ray);
    RC_ASSERT(hit.t_enter >= 0 && hit.t_enter <= 1);
    RC_ASSERT(hit.t_exit >= hit.t_enter);
    for (int sample = 0; sample <= 200; ++sample) {
      const double t = sample / 200.0;
      if (t < hit.t_enter) RC_ASSERT(slow.above(t) >= -tolerance);
      if (t >= hit.t_enter && t <= hit.t_exit) RC_ASSERT(slow.above(t) <= tolerance);
    }
  }
}

// Only a touch has t_exit == t_enter: just behind it is air.
RC_GTEST_PROP(ReferenceProperty, AnEmptySolidIsATouch, ()) {
  Twister random(*rc::gen::arbitrary<unsigned>());
  const FieldSize size{*rc::gen::inRange(2, 20), *rc::gen::inRange(2, 20)};
  const Heightfield map = kMapKinds[9].make(size, random);
  const ReferenceTracer tracer(map, Wrap::repeat);
  for (int i = 0; i < 20; ++i) {
    const TextureRay ray = random_ray(size, random);
    const ReferenceHit hit = tracer.trace(ray);
    if (hit.t_exit != hit.t_enter || hit.t_enter > 1 - 1e-9) continue;
    const SlowReference slow(map, Wrap::repeat, ray);
    const double step = 1e-6 / (1 + 20.0 * std::abs(ray.slope_u) + 20.0 * std::abs(ray.slope_v));
    RC_ASSERT(slow.above(hit.t_enter + step) > -height_tolerance(map, ray));
  }
}

}  // namespace
}  // namespace reliefbench
