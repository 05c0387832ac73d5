#include "backends/timer_audit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;

/// A device that takes exactly 0.05 ns a pixel and step, and clocks that may lie about it.
struct Clocks {
  double (*wall_ns)(double true_ns, int batch) = [](double true_ns, int) { return true_ns; };
  std::optional<double> (*device_ns)(double true_ns) = [](double true_ns) { return std::optional(true_ns); };
};

struct StepsPipeline final : Pipeline {
  int steps = 0;
};

class ClockedBackend final : public Backend {
 public:
  explicit ClockedBackend(Clocks clocks) : clocks_(clocks) {
    info_.timers = {Timer::fenced_wall, Timer::gl_time_elapsed};
  }
  const DeviceInfo& device() const override { return info_; }
  std::unique_ptr<Texture> upload(const TextureDesc&) override { return std::make_unique<Texture>(); }
  std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    auto pipeline = std::make_unique<StepsPipeline>();
    for (const SpecConstant& constant : desc.constants)
      if (constant.id == 0) pipeline->steps = constant.value;
    return pipeline;
  }
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    const Draw& draw = frame.front();
    const double pixels = 1.0 * draw.frame.sizes[0] * draw.frame.sizes[1];
    const double true_ns = 0.05 * pixels * frames * dynamic_cast<const StepsPipeline&>(*draw.pipeline).steps;
    BatchTime time{.wall_ns = clocks_.wall_ns(true_ns, batches_++)};
    if (timer != Timer::fenced_wall) time.device_ns = clocks_.device_ns(true_ns);
    return time;
  }
  std::span<const std::uint8_t> read(std::string_view) override { return {}; }
  std::unique_ptr<Pipeline> compile_compute(const ComputeDesc&) override { return nullptr; }
  ComputeResult compute(const ComputeJob&) override { return {}; }
  std::vector<std::string> debug_messages() const override { return {}; }

 private:
  DeviceInfo info_;
  Clocks clocks_;
  int batches_ = 0;
};

std::vector<TimerAudit> audited(Clocks clocks) {
  ClockedBackend backend(clocks);
  return audit_timers(backend, Dialect::vulkan);
}

TEST(TimerAudit, BelievesAnHonestTimer) {
  const auto audits = audited({});
  ASSERT_EQ(audits.size(), 2U);
  EXPECT_EQ(audits[0].timer, Timer::fenced_wall);
  for (const TimerAudit& audit : audits) {
    EXPECT_TRUE(audit.valid) << audit.reason;
    EXPECT_DOUBLE_EQ(audit.wall_ratio, 1);
    EXPECT_DOUBLE_EQ(audit.doubling, 2);
    EXPECT_EQ(audit.reason, "");
  }
  EXPECT_EQ(choose_timer(audits), Timer::gl_time_elapsed);
}

TEST(TimerAudit, AllowsFivePercentBesideTheWallClock) {
  EXPECT_TRUE(audited({.device_ns = [](double ns) { return std::optional(0.96 * ns); }})[1].valid);
  EXPECT_TRUE(audited({.device_ns = [](double ns) { return std::optional(1.04 * ns); }})[1].valid);
  EXPECT_FALSE(audited({.device_ns = [](double ns) { return std::optional(0.94 * ns); }})[1].valid);
  EXPECT_FALSE(audited({.device_ns = [](double ns) { return std::optional(1.06 * ns); }})[1].valid);
}

// llvmpipe's GL_TIME_ELAPSED counts the last bin only: it doubles, and is 20 times too short.
TEST(TimerAudit, RejectsATimerThatSeesAPartOfTheWork) {
  const auto audits = audited({.device_ns = [](double ns) { return std::optional(0.05 * ns); }});
  EXPECT_TRUE(audits[0].valid);
  EXPECT_FALSE(audits[1].valid);
  EXPECT_NEAR(audits[1].wall_ratio, 0.05, 1e-12);
  EXPECT_NEAR(audits[1].doubling, 2, 1e-12);
  EXPECT_THAT(audits[1].reason, HasSubstr("where the fenced wall clock says"));
  EXPECT_EQ(choose_timer(audits), Timer::fenced_wall);
}

TEST(TimerAudit, RejectsSilenceZeroAndNonsenseWithFiniteNumbers) {
  for (const auto lie : {+[](double) -> std::optional<double> { return std::nullopt; },
                         +[](double) { return std::optional(0.0); }, +[](double) { return std::optional(-1.0); },
                         +[](double) { return std::optional(std::numeric_limits<double>::quiet_NaN()); },
                         +[](double) { return std::optional(std::numeric_limits<double>::infinity()); }}) {
    const TimerAudit audit = audited({.device_ns = lie})[1];
    EXPECT_FALSE(audit.valid);
    EXPECT_TRUE(std::isfinite(audit.wall_ratio));
    EXPECT_TRUE(std::isfinite(audit.doubling));
    EXPECT_NE(audit.reason, "");
  }
}

// A timer may see draws, and miss what compute shaders do.
TEST(TimerAudit, ATimerThatLiesAboutComputeIsNotValidWhereThereIsSome) {
  const auto draws = audited({});
  const auto compute = audited({.device_ns = [](double) { return std::optional(1e3); }});
  const auto both = with_compute(draws, compute);
  EXPECT_TRUE(both[0].valid);
  EXPECT_FALSE(both[1].valid);
  EXPECT_THAT(both[1].reason, HasSubstr("compute: says 0.001 ms where the fenced wall clock says"));
  EXPECT_EQ(choose_timer(both), Timer::fenced_wall);
  EXPECT_EQ(choose_timer(with_compute(draws, draws)), Timer::gl_time_elapsed);
  EXPECT_EQ(with_compute(compute, draws)[1].reason, compute[1].reason);
}

// Short work on one core, longer work on two, as a system may have it: the audit looks at longer work then.
TEST(TimerAudit, TakesMoreWorkWhereTheWallClockDoesNotDouble) {
  const auto spread = [](double ns, int) { return ns < 40e6 ? ns : std::max(40e6, ns / 2); };
  const auto audits = audited({.wall_ns = spread, .device_ns = [](double ns) {
                                 return std::optional(ns < 40e6 ? ns : std::max(40e6, ns / 2));
                               }});
  for (const TimerAudit& audit : audits) {
    EXPECT_TRUE(audit.valid) << audit.reason;
    EXPECT_NEAR(audit.doubling, 2, 0.2);
  }
}

// A fixed cost of a fifth of 2N: right to 5 % at 2N, yet it does not tell work from overhead.
TEST(TimerAudit, RejectsATimerThatAgreesButDoesNotDouble) {
  const auto audits = audited({.device_ns = [](double ns) { return std::optional(ns < 30e6 ? 1.3 * ns : ns); }});
  // The calibrated batch at N lies between 20 and 40 ms, at 2N above 40 ms.
  EXPECT_TRUE(audits[0].valid);
  EXPECT_FALSE(audits[1].valid);
  EXPECT_NEAR(audits[1].wall_ratio, 1, 1e-12);
  EXPECT_THAT(audits[1].reason, HasSubstr("twice the work takes 1.54 times"));
}

TEST(TimerAudit, NothingIsValidBesideABrokenWallClock) {
  const auto audits =
      audited({.wall_ns = [](double, int) { return 50e6; }, .device_ns = [](double) { return std::optional(50e6); }});
  for (const TimerAudit& audit : audits) {
    EXPECT_FALSE(audit.valid);
    EXPECT_NE(audit.reason, "");
  }
  try {
    static_cast<void>(choose_timer(audits));
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::environment);
    EXPECT_THAT(error.what(), HasSubstr("no valid timer"));
  }
}

// A machine that is busy with something else for a while: every second batch of the first half takes twice as long.
TEST(TimerAudit, MeasuresAgainAfterADisturbance) {
  const auto busy = [](double ns, int batch) { return batch < 45 && batch % 2 == 0 ? 2 * ns : ns; };
  const auto audits = audited({.wall_ns = busy});
  EXPECT_TRUE(audits[0].valid) << audits[0].reason;
  EXPECT_EQ(choose_timer(audits), Timer::gl_time_elapsed);
}

// Something else adds a tenth to the wall clock for most of the time, and the timer is right.
TEST(TimerAudit, OneThatNearlyAgreesIsJudgedByTheQuietestRounds) {
  const auto busy = [](double ns, int batch) { return batch % 100 < 75 ? 1.1 * ns : ns; };
  for (const double share : {1.0, 0.97, 1.03}) {
    const auto told = [](double by) -> std::optional<double> (*)(double) {
      if (by < 1) return [](double ns) { return std::optional(0.97 * ns); };
      if (by > 1) return [](double ns) { return std::optional(1.03 * ns); };
      return [](double ns) { return std::optional(ns); };
    };
    const auto audits = audited({.wall_ns = busy, .device_ns = told(share)});
    EXPECT_TRUE(audits[1].valid) << share << ": " << audits[1].reason;
    EXPECT_NEAR(audits[1].wall_ratio, share, 1e-9);
  }
}

// However often it is measured: the wall clock that a busy machine adds to never bears it out.
TEST(TimerAudit, ALiarThatIsOffByLittleIsNotBelieved) {
  const auto busy = [](double ns, int batch) { return batch % 100 < 40 ? 1.1 * ns : ns; };
  EXPECT_FALSE(audited({.wall_ns = busy, .device_ns = [](double ns) { return std::optional(0.9 * ns); }})[1].valid);
  EXPECT_FALSE(audited({.device_ns = [](double ns) { return std::optional(1.1 * ns); }})[1].valid);
  EXPECT_FALSE(audited({.device_ns = [](double ns) { return std::optional(1.19 * ns); }})[1].valid);
}

// Both clocks wander: the readings that are told are those of one round, and have the ratio that it was judged by.
TEST(TimerAudit, TellsReadingsThatBearOutItsVerdict) {
  const auto wander = [](double ns, int batch) { return ns * (1 + 0.37 * (batch * 7 % 5)); };
  const auto audit = audited({.wall_ns = wander, .device_ns = [](double ns) {
                                static int n = 0;
                                return std::optional(ns * (0.2 + 0.13 * (n++ * 11 % 7)));
                              }})[1];
  ASSERT_FALSE(audit.valid);
  double said_ms = 0;
  double wall_ms = 0;
  ASSERT_EQ(
      std::sscanf(audit.reason.c_str(), "says %lf ms where the fenced wall clock says %lf ms", &said_ms, &wall_ms), 2)
      << audit.reason;
  EXPECT_NEAR(said_ms / wall_ms, audit.wall_ratio, 0.01 * audit.wall_ratio);
}

TEST(TimerAudit, ChoosesTheFirstValidDeviceTimer) {
  const TimerAudit wall{.timer = Timer::fenced_wall, .valid = true, .reason = {}};
  const TimerAudit bad{.timer = Timer::gl_time_elapsed, .valid = false, .reason = "says 0 ms"};
  const TimerAudit good{.timer = Timer::gl_timestamp, .valid = true, .reason = {}};
  EXPECT_EQ(choose_timer({wall, bad, good}), Timer::gl_timestamp);
  EXPECT_EQ(choose_timer({wall, bad}), Timer::fenced_wall);
  EXPECT_THROW(static_cast<void>(choose_timer({})), Error);
}

}  // namespace
}  // namespace reliefbench
