// The precision of a sampler's filter: of simulated samplers, and of every device that is here.
#include "backends/filter_audit.h"

#include <cmath>

#include "tests/backend_rig.h"

namespace reliefbench {
namespace {

constexpr int kPlaces = 1 << kMostFilterBits;

/// What a sampler shows whose weights have so many bits.
std::vector<float> simulated_weights(int bits, bool rounds) {
  std::vector<float> weights;
  for (int i = 0; i < kPlaces; ++i) {
    const double asked = std::ldexp(static_cast<double>(i) / kPlaces, bits);
    weights.push_back(static_cast<float>(std::ldexp(rounds ? std::round(asked) : std::floor(asked), -bits)));
  }
  return weights;
}

TEST(FilterPrecision, is_read_off_simulated_samplers) {
  for (const int bits : {4, 6, 8, 10})
    for (const bool rounds : {true, false}) {
      SCOPED_TRACE(fmt::format("{} bits, {}", bits, rounds));
      const FilterPrecision precision = filter_precision(simulated_weights(bits, rounds));
      EXPECT_EQ(precision.bits, bits);
      EXPECT_EQ(precision.rounds, rounds);
      const double most = std::ldexp(rounds ? 0.5 : 1.0, -bits);
      EXPECT_LE(precision.worst(), most);
      EXPECT_GE(precision.worst(), most - 1.0 / kPlaces);
    }
}

TEST(FilterPrecision, of_a_perfect_filter_is_as_fine_as_is_asked) {
  const FilterPrecision precision = filter_precision(simulated_weights(kMostFilterBits, true));
  EXPECT_EQ(precision.bits, kMostFilterBits);
  EXPECT_EQ(precision.worst(), 0);
}

TEST(FilterPrecision, of_no_filter_has_no_bits_but_one_step) {
  const FilterPrecision nearest = filter_precision(simulated_weights(0, true));
  EXPECT_EQ(nearest.bits, 0);
  EXPECT_EQ(nearest.worst(), 0.5);
  EXPECT_EQ(filter_precision(std::vector<float>(kPlaces, 0.0F)).bits, 0);
}

TEST(FilterPrecision, of_a_result_is_what_its_weights_do_not_explain) {
  constexpr int kSide = 16;
  constexpr double kStep = 1.0 / 256;
  const auto plane_read = [](double shift, double rounded_to) {
    std::vector<float> values;
    for (int i = 0; i < kSide * kSide; ++i) {
      double value = 0.5 + (static_cast<double>(i % kSide + i / kSide) / kSide + 2 * shift) * kStep;
      if (rounded_to > 0) value = std::round(value / rounded_to) * rounded_to;
      values.push_back(static_cast<float>(value));
    }
    return values;
  };
  EXPECT_EQ(filter_value_error(plane_read(0, 0), 0.5, kStep, 0), 0);
  EXPECT_EQ(filter_value_error(plane_read(0.25, 0), 0.5, kStep, 0.25), 0);
  EXPECT_NEAR(filter_value_error(plane_read(0.25, 0), 0.5, kStep, 0.125), 0.25 * kStep, 1e-6);
  EXPECT_NEAR(filter_value_error(plane_read(0, kStep), 0.5, kStep, 0), kStep / 2, 1e-6);
}

TEST(FilterPrecision, is_coarse_where_a_gpus_is_not) {
  EXPECT_FALSE(filter_precision(simulated_weights(8, true)).is_coarse());
  EXPECT_TRUE(filter_precision(simulated_weights(8, false)).is_coarse());
  EXPECT_TRUE(filter_precision(simulated_weights(7, true)).is_coarse());
}

using FilterAuditTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, FilterAuditTest, ::testing::Values("opengl", "vulkan"), backend_name);

// Vulkan asks for four bits at least.
TEST_P(FilterAuditTest, every_device_filters_every_type) {
  on_every_device([](const Rig& rig) {
    const std::vector<FilterAudit> audits = audit_filter(*rig.backend, rig.row.dialect);
    ASSERT_EQ(audits.size(), 4 + rig.backend->device().blocks.size());
    for (const FilterAudit& audit : audits) {
      SCOPED_TRACE(texel_type_id(audit.type));
      EXPECT_GE(audit.precision.bits, 4);
      EXPECT_LE(audit.precision.worst(), 1.0 / 16);
    }
  });
}

}  // namespace
}  // namespace reliefbench
