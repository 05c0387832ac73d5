// Guarantees on samplers with weights of few bits, which shaders simulate: no GPU is needed for what GPUs do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "backends/filter_audit.h"
#include "kernels/judge/score.h"
#include "kernels/trace/guarantee.h"
#include "tests/technique_rig.h"
#include "tuner/measure/run_info.h"
#include "tuner/measure/stress.h"
#include "tuner/plan/extremes.h"

namespace reliefbench {
namespace {

/// Where an NVIDIA H200's 8 bits broke guarantees.
constexpr std::array<std::string_view, 4> kFoundOnH200{"checker", "depth_10", "grazing_0.1", "grazing_1"};
/// Of these, the two that say most in little time; `stress --simulate-filter` has the others.
constexpr std::array<std::string_view, 2> kBrief{"checker", "grazing_1"};

std::vector<SimulatedFilter> simulated_filters(std::initializer_list<int> bits) {
  std::vector<SimulatedFilter> list;
  for (const int count : bits)
    for (const bool rounds : {true, false}) list.push_back({.bits = count, .rounds = rounds});
  return list;
}

/// A trace of an extreme, made ready once for all samplers.
class ExtremeTrace {
 public:
  ExtremeTrace(const Extreme& extreme, const Settings& settings)
      : scene_(extreme.scene.scene),
        settings_(settings),
        map_(store_map(settings, load_heightmap(extreme.scene.heightmap), scene_.wrap)),
        tracer_(map_.surface, scene_.wrap) {}

  /// Pixels whose guarantee is broken.
  [[nodiscard]] int broken(const Rig& rig, const MapSampler& sampler) const {
    const auto pixels = trace_frame(rig, settings_, map_, scene_, sampler);
    const std::vector<ReferenceHit> exact = exact_hits(tracer_, pixels);
    const JudgedFrame frame = judge(pixels, exact, map_.surface.width, map_.surface.height);
    int count = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i)
      if (keeps(guarantee_of(settings_), pixels[i], frame.pixels[i], exact[i], map_.surface, scene_.wrap) == Kept::no)
        ++count;
    return count;
  }

 private:
  Scene scene_;
  Settings settings_;
  StoredMap map_;
  ReferenceTracer tracer_;
};

FilterError error_of(const std::vector<FilterAudit>& audits, const Settings& settings) {
  return std::ranges::find(audits, storage_of(settings).format.type, &FilterAudit::type)->precision.error();
}

/// A setting that reads with the sampler, as the extremes have it.
Settings sampled(std::string_view technique, std::vector<std::pair<std::string_view, std::string_view>> values = {}) {
  values.insert(values.end(), {{"cone_steps", "512"}, {"filter", "hardware"}});
  return settings_of(technique, values);
}

std::vector<Settings> sampled_promises() {
  return {sampled("cone"),
          sampled("cone", {{"step", "plain"}}),
          sampled("cone", {{"correction", "min4"}}),
          sampled("cone", {{"format", "rg8"}, {"encoding", "atan"}}),
          sampled("cone", {{"lod", "footprint"}, {"encoding", "h_tan"}}),
          sampled("quad_cone"),
          sampled("sector_cone"),
          sampled("sector_cone", {{"ratios_a_texel", "2"}, {"over_relaxation", "auto"}})};
}

std::vector<Extreme> extremes_of(std::span<const std::string_view> ids) {
  std::vector<Extreme> list = built_in_extremes().list;
  std::erase_if(list, [&](const Extreme& extreme) { return std::ranges::find(ids, extreme.id) == ids.end(); });
  return list;
}

using SimulatedFilterTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, SimulatedFilterTest, ::testing::Values("opengl", "vulkan"), backend_name);

TEST_P(SimulatedFilterTest, is_audited_as_a_devices_own) {
  on_every_device([](const Rig& rig) {
    for (const SimulatedFilter& simulated : simulated_filters({8, 6, 4}))
      for (const FilterAudit& audit : audit_filter(*rig.backend, rig.row.dialect, simulated)) {
        SCOPED_TRACE(fmt::format("{} of {}", filter_text(simulated), texel_type_id(audit.type)));
        EXPECT_EQ(audit.precision.bits, simulated.bits);
        EXPECT_EQ(audit.precision.rounds, simulated.rounds);
        // A device may decode a block's values of BC4 and BC5 to a code less, of EAC to more bits, of ASTC to 8.
        const bool is_rough = audit.type == TexelType::rgtc || audit.type == TexelType::astc;
        EXPECT_LE(audit.precision.value, is_rough ? 1 / 255.0 : static_cast<double>(value_spread(audit.type)));
        const double most = std::ldexp(simulated.rounds ? 0.5 : 1.0, -simulated.bits);
        EXPECT_GE(audit.precision.error().shift, most);
        EXPECT_LE(audit.precision.error().shift, most + 2.0 / (1 << kMostFilterBits));
      }
  });
}

// What is subtracted is needed: weights of 8 bits break guarantees, as they did on a GPU.
TEST_P(SimulatedFilterTest, breaks_guarantees_unless_its_shift_is_made_up_for) {
  on_every_device([](const Rig& rig) {
    for (const SimulatedFilter& simulated : simulated_filters({8})) {
      const std::vector<FilterAudit> audits = audit_filter(*rig.backend, rig.row.dialect, simulated);
      int without = 0;
      for (const Settings& settings : {sampled("cone"), sampled("quad_cone")})
        for (const Extreme& extreme : extremes_of(kFoundOnH200)) {
          const ExtremeTrace trace(extreme, settings);
          const int here = trace.broken(rig, {.simulated = simulated});
          RecordProperty(fmt::format("{}_{}_{}", settings.technique().id, extreme.id, filter_text(simulated)), here);
          without += here;
          EXPECT_EQ(trace.broken(rig, {.error = error_of(audits, settings), .simulated = simulated}), 0)
              << settings.technique().id << " at " << extreme.id << ", " << filter_text(simulated);
        }
      EXPECT_GT(without, 0) << filter_text(simulated);
    }
  });
}

// Of few bits, and the device's own: llvmpipe rounds what it filters of 8-bit texels to 8 bits.
TEST_P(SimulatedFilterTest, keeps_every_guarantee) {
  const std::vector<SimulatedFilter> samplers{{}, {.bits = 6, .rounds = false}, {.bits = 4, .rounds = true}};
  on_every_device([&](const Rig& rig) {
    std::vector<std::vector<FilterAudit>> audits;
    for (const SimulatedFilter& simulated : samplers)
      audits.push_back(audit_filter(*rig.backend, rig.row.dialect, simulated));
    std::size_t number = 0;
    for (const Settings& settings : sampled_promises()) {
      ASSERT_TRUE(makes_up_for_filter(settings)) << settings.text();
      ++number;  // so that each extreme is tried on both
      for (const Extreme& extreme : extremes_of(kBrief)) {
        if (!is_tried_here(rig, number++)) continue;
        const ExtremeTrace trace(extreme, settings);
        for (std::size_t i = 0; i < samplers.size(); ++i)
          EXPECT_EQ(trace.broken(rig, {.error = error_of(audits[i], settings), .simulated = samplers[i]}), 0)
              << settings.text() << " at " << extreme.id << ", " << filter_text(samplers[i]);
      }
    }
  });
}

TEST_P(SimulatedFilterTest, a_session_looks_at_its_filter_and_keeps_what_it_saw) {
  WallSplit split;
  Session session(row(), row().devices().front().index, split, {.audits = Audits::none});
  const Settings settings = sampled("cone");
  const std::size_t types = 4 + session.device().blocks.size();
  EXPECT_EQ(session.filter_audit().size(), types);
  EXPECT_EQ(session.sampler_of(settings).error.shift, error_of(session.filter_audit(), settings).shift);
  EXPECT_EQ(device_json(session).at("filter").size(), types);
  const std::string key = session.sampler_key(settings);
  session.simulate_filter({.bits = 6, .rounds = false});
  EXPECT_GE(session.sampler_of(settings).error.shift, 1.0 / 64);
  EXPECT_NE(session.sampler_key(settings), key);
  EXPECT_EQ(session.sampler_key(sampled("relaxed_cone")), "");
}

// Where nothing is guaranteed there is nothing to make up for: the papers' own steps stay as they are.
TEST(SimulatedFilter, is_made_up_for_by_what_guarantees_something) {
  EXPECT_FALSE(makes_up_for_filter(settings_of("cone", {{"filter", "manual"}})));
  EXPECT_FALSE(makes_up_for_filter(sampled("cone", {{"step", "cell_max"}})));
  EXPECT_FALSE(makes_up_for_filter(sampled("cone", {{"correction", "none"}})));
  EXPECT_FALSE(makes_up_for_filter(sampled("relaxed_cone")));
  for (const Technique& technique : techniques()) {
    const Settings settings(technique);
    const auto constants = constants_of(&settings, Wrap::repeat, {.error = {.shift = 0.25, .value = 0.5}});
    const auto shift = std::ranges::find(constants, std::uint32_t{kSamplerShiftConstant}, &SpecConstant::id);
    EXPECT_EQ(shift != constants.end(), makes_up_for_filter(settings)) << technique.id;
  }
}

TEST(SimulatedFilter, of_stress_reads_everything_with_it) {
  Extremes extremes = built_in_extremes();
  extremes.list.resize(1);
  const StressReport report = run_stress(extremes, {.backends = {"null"},
                                                    .filter = "cone/*",
                                                    .simulated = SimulatedFilter{.bits = 6, .rounds = false},
                                                    .quiet = true});
  EXPECT_THAT(report.devices.at(0), ::testing::HasSubstr("6 bits, truncated"));
  const auto sampled = std::ranges::count_if(report.results, [](const StressResult& result) {
    return result.settings.find("filter=hardware") != std::string::npos;
  });
  EXPECT_EQ(sampled, static_cast<std::ptrdiff_t>(report.results.size()) - 1);  // one of them tries the manual filter
}

}  // namespace
}  // namespace reliefbench
