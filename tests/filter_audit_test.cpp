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

using FilterAuditTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, FilterAuditTest, ::testing::Values("opengl", "vulkan"), backend_name);

// Vulkan asks for four bits at least.
TEST_P(FilterAuditTest, every_device_filters_every_type) {
  on_every_device([](const Rig& rig) {
    const std::vector<FilterAudit> audits = audit_filter(*rig.backend, rig.row.dialect);
    ASSERT_EQ(audits.size(), 4);
    for (const FilterAudit& audit : audits) {
      SCOPED_TRACE(texel_type_id(audit.type));
      EXPECT_GE(audit.precision.bits, 4);
      EXPECT_LE(audit.precision.worst(), 1.0 / 16);
    }
  });
}

}  // namespace
}  // namespace reliefbench
