// A session's pipelines: compiled once, beforehand where that is asked for.
#include "tuner/measure/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/faulty_device.h"
#include "tuner/results/device_json.h"

namespace reliefbench {
namespace {

const Scene kAnyScene{.view = {}};

std::vector<PipelineSource> wanted_of(const Session& session, const std::vector<Settings>& settings) {
  std::vector<PipelineSource> wanted;
  for (const Settings& one : settings)
    for (const Target* target : {&Target::color, &Target::score})
      wanted.push_back(session.source_of(one, *target, kAnyScene));
  return wanted;
}

std::vector<Settings> every_technique() {
  std::vector<Settings> all;
  for (const Technique& technique : techniques()) all.emplace_back(technique);
  return all;
}

TEST(Session, what_is_compiled_ahead_is_not_compiled_again) {
  WallSplit split;
  FaultyDevices devices;
  Session session(find_backend("vulkan"), 0, split, {.audits = Audits::none, .open = devices.opener()});
  const std::vector<Settings> settings = every_technique();
  session.pipelines().compile_ahead(wanted_of(session, settings));
  const int compiled = session.pipelines().count_compiled();
  EXPECT_EQ(compiled, static_cast<int>(2 * settings.size()));
  for (const PipelineSource& one : wanted_of(session, settings)) {
    const Compiled& pipeline = session.pipelines().get(one);
    EXPECT_NE(pipeline.pipeline, nullptr);
    EXPECT_GT(pipeline.compile_ns, 0);
    EXPECT_EQ(pipeline.spirv_sha256, session.pipelines().fragment_sha256(one));
  }
  session.pipelines().compile_ahead(wanted_of(session, settings));
  EXPECT_EQ(session.pipelines().count_compiled(), compiled);
}

TEST(Session, what_fails_ahead_is_left_for_the_case_that_asks_for_it) {
  WallSplit split;
  FaultyDevices devices;
  Session session(find_backend("vulkan"), 0, split, {.audits = Audits::none, .open = devices.opener()});
  const std::vector<Settings> settings = every_technique();
  const int before = devices.calls(FaultyDevices::compile);
  devices.fail(FaultyDevices::compile, before, Fault::other);
  const std::vector<PipelineSource> first = {wanted_of(session, settings).front()};
  session.pipelines().compile_ahead(first);
  EXPECT_EQ(session.pipelines().count_compiled(), 0);
  EXPECT_NE(session.pipeline(settings.front(), Target::color, kAnyScene).pipeline, nullptr);
  EXPECT_EQ(session.pipelines().count_compiled(), 1);
}

TEST(Session, a_shader_that_cannot_be_compiled_ahead_keeps_no_other_from_it) {
  WallSplit split;
  Session session(find_backend("vulkan"), 0, split, {.audits = Audits::none});
  const PipelineSource refused{.shader = "no_such_shader", .vertex = "fullscreen", .target = Target::color};
  std::vector<PipelineSource> wanted = wanted_of(session, every_technique());
  wanted.insert(wanted.begin() + 1, refused);
  session.pipelines().compile_ahead(wanted);
  EXPECT_EQ(session.pipelines().count_compiled(), static_cast<int>(wanted.size()) - 1);
  EXPECT_THAT([&] { static_cast<void>(session.pipelines().get(refused)); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("no_such_shader")));
}

// Whoever asks for an audit later has things on the device, which are to be gone before it is opened again.
TEST(Session, an_audit_that_comes_later_does_not_reopen_the_device) {
  for (const auto audit : {&Session::audit_timers, &Session::audit_compute_timers}) {
    WallSplit split;
    FaultyDevices devices;
    Session session(find_backend("null"), 0, split, {.audits = Audits::none, .open = devices.opener()});
    devices.fail(FaultyDevices::draw, devices.calls(FaultyDevices::draw), Fault::device_lost);
    EXPECT_THROW((session.*audit)(), Error);
    EXPECT_EQ(devices.calls(FaultyDevices::open), 1);
  }
}

// A device need not filter every kind of texel that maps are stored in.
TEST(Session, a_type_that_is_not_filtered_leaves_the_others_usable) {
  WallSplit split;
  FaultyDevices devices;
  devices.fail(FaultyDevices::upload, 1, Fault::other);
  const Session session(find_backend("vulkan"), 0, split, {.audits = Audits::none, .open = devices.opener()});
  const std::vector<FilterAudit>& audits = session.filter_audit();
  ASSERT_EQ(audits.size(), 4 + session.device().blocks.size());
  for (std::size_t i = 0; i < audits.size(); ++i) {
    EXPECT_EQ(audits[i].refusal, i == 1 ? "injected" : "");
    EXPECT_EQ(audits[i].precision.bits > 0, i != 1);
  }
  EXPECT_EQ(filter_json(audits)[1],
            (nlohmann::json{{"texels", texel_type_id(audits[1].type)}, {"refusal", "injected"}}));
}

TEST(Session, a_device_that_is_lost_while_its_filter_is_audited_is_not_one_without_a_filter) {
  WallSplit split;
  FaultyDevices once;
  once.fail(FaultyDevices::upload, 1, Fault::device_lost);
  const Session session(find_backend("vulkan"), 0, split, {.audits = Audits::none, .open = once.opener()});
  EXPECT_EQ(once.calls(FaultyDevices::open), 2);
  EXPECT_FALSE(session.filter_audit().empty());
  for (const FilterAudit& audit : session.filter_audit()) EXPECT_EQ(audit.refusal, "");

  FaultyDevices twice;
  for (const int nth : {1, 2}) twice.fail(FaultyDevices::upload, nth, Fault::device_lost);
  EXPECT_THROW(Session(find_backend("vulkan"), 0, split, {.audits = Audits::none, .open = twice.opener()}), Error);
}

TEST(Session, lets_go_of_the_pipelines_that_were_used_longest_ago) {
  WallSplit split;
  FaultyDevices devices;
  Session session(find_backend("null"), 0, split, {.audits = Audits::none, .open = devices.opener()});
  const std::vector<Settings> settings = every_technique();
  ASSERT_GT(settings.size(), 4U);
  const auto is_there = [&](std::size_t i) {
    return session.pipelines().has(session.source_of(settings[i], Target::score, kAnyScene));
  };
  const auto use = [&](std::size_t i) { static_cast<void>(session.pipeline(settings[i], Target::score, kAnyScene)); };
  for (const std::size_t i : {0, 1, 2, 3, 1}) use(i);
  session.pipelines().drop_old(4);
  for (const std::size_t i : {0, 1, 2, 3}) EXPECT_TRUE(is_there(i)) << i;
  session.pipelines().drop_old(2);
  for (const std::size_t i : {0, 1, 2, 3}) EXPECT_EQ(is_there(i), i == 1 || i == 3) << i;
  const int compiled = session.pipelines().count_compiled();
  use(1);
  EXPECT_EQ(session.pipelines().count_compiled(), compiled);
  use(0);
  EXPECT_EQ(session.pipelines().count_compiled(), compiled + 1);
  session.pipelines().drop_old(0);
  for (const std::size_t i : {0, 1, 2, 3}) EXPECT_FALSE(is_there(i)) << i;
}

TEST(Session, opengl_compiles_nothing_ahead) {
  WallSplit split;
  Session session(find_backend("opengl"), 0, split, {.audits = Audits::none});
  const std::vector<Settings> settings = every_technique();
  session.pipelines().compile_ahead(wanted_of(session, settings));
  EXPECT_EQ(session.pipelines().count_compiled(), 0);
}

}  // namespace
}  // namespace reliefbench
