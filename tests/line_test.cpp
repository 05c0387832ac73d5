// The line that data follows, arrow by arrow, on the null backend: bake, pack, upload, trace_frame, judge, time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <new>

#include "kernels/base/file_error.h"
#include "tests/faulty_device.h"
#include "tests/temp_folder.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/timing.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

const Scene kSmallScene{.view = view_presets()[1], .width_px = 24, .height_px = 16};

Heightfield terrain() { return load_heightmap({.source = "fbm", .width = 16, .height = 12}); }

TEST(Line, bake_rounds_heights_and_asks_the_kinds_own_baker) {
  const BakeSpec spec = bake_spec(parse_setting("cone?format=rg8"), Wrap::clamp);
  const BakedMap map = bake(spec, terrain());
  EXPECT_EQ(map.heights.texels, quantise_heights(terrain(), TexelType::unorm8).texels);
  EXPECT_EQ(map.values, spec.storage.map.bake({.heights = map.heights,
                                               .wrap = Wrap::clamp,
                                               .correction = spec.storage.correction,
                                               .max_ratio = spec.storage.max_ratio}));
  EXPECT_GT(map.bake_time_ns, 0);
  EXPECT_NE(map.key, bake(bake_spec(parse_setting("cone?format=rg8"), Wrap::repeat), terrain()).key);
}

TEST(Line, bake_takes_any_baker_and_none_for_heights_alone) {
  std::vector<std::string> asked;
  const Baker baker = [&](const MapRow& map, const BakeRequest&, const std::string& key) {
    asked.push_back(key);
    return BakedValues{.time_ns = 7, .values = std::vector<float>(3, static_cast<float>(map.ratios))};
  };
  const BakedMap cones = bake(bake_spec(parse_setting("cone"), Wrap::repeat), terrain(), baker);
  EXPECT_THAT(asked, ElementsAre(cones.key));
  EXPECT_THAT(cones.values, ElementsAre(1, 1, 1));
  EXPECT_EQ(cones.bake_time_ns, 7);
  const BakedMap heights = bake(bake_spec(parse_setting("relief"), Wrap::repeat), terrain(), baker);
  EXPECT_EQ(asked.size(), 1U);
  EXPECT_TRUE(heights.values.empty());
  EXPECT_NE(heights.key, "");
}

TEST(Line, cached_makes_once_and_again_what_does_not_read_back) {
  const TempFolder folder;
  const Cache cache(folder / "cache");
  int made = 0;
  const Codec<int> codec{.write = [](int value) { return std::vector<std::byte>(static_cast<std::size_t>(value)); },
                         .read = [](std::span<const std::byte> bytes) -> std::optional<int> {
                           return bytes.size() == 5 ? std::optional(5) : std::nullopt;
                         }};
  const auto ask = [&](int value) { return cached(cache, "key", codec, [&] { return ++made, value; }).is_new; };
  EXPECT_TRUE(ask(4));  // is read back as nothing
  EXPECT_TRUE(ask(5));
  EXPECT_FALSE(ask(5));
  EXPECT_EQ(made, 2);
}

TEST(Line, recent_values_are_made_once_until_others_were_asked_for) {
  std::string made;
  Recent<char> recent(2);
  const auto ask = [&](const std::string& keys) {
    for (const char key : keys) EXPECT_EQ(recent.get({key}, [&] { return made.push_back(key), key; }), key);
  };
  ask("abab");
  EXPECT_EQ(made, "ab");
  ask("cbab");  // c drives a out, a drives c out
  EXPECT_EQ(made, "abca");
}

TEST(Line, pack_is_pack_map_and_nothing_where_no_map_is_read) {
  const Settings cone = parse_setting("cone?format=rg16");
  const BakedMap map = bake(bake_spec(cone, Wrap::repeat), terrain());
  const std::optional<MapTextures> textures = pack(cone, map, kSmallScene);
  ASSERT_TRUE(textures);
  const MapStorage storage = storage_of(cone);
  EXPECT_EQ(textures->relief.texels, pack_map({.map = storage.map, .heights = map.heights, .values = map.values},
                                              storage.format, storage.encoding)
                                         .relief.texels);
  EXPECT_FALSE(pack(parse_setting("flat"), map, kSmallScene));
}

TEST(Line, upload_names_textures_for_every_sampler_of_a_technique) {
  const std::unique_ptr<Backend> backend = open_null(0, {});
  const UploadedScene scene = upload(*backend, kSmallScene, terrain());
  EXPECT_THAT(scene.frame.sizes, ElementsAre(24, 16, 16, 12));
  const Frame flat = upload(*backend, std::nullopt, scene);
  EXPECT_EQ(flat.relief, nullptr);
  for (const char* sampler : {kReliefMap, kNormalMap, kExtraMap})
    EXPECT_EQ(flat.draw.textures.at(sampler), scene.normals.get());
  const Settings quad = parse_setting("interval");
  const Frame frame = upload(*backend, pack(quad, bake(bake_spec(quad, Wrap::repeat), terrain()), kSmallScene), scene);
  EXPECT_EQ(frame.draw.textures.at(kReliefMap), frame.relief.get());
  EXPECT_EQ(frame.draw.textures.at(kExtraMap), frame.extra ? frame.extra.get() : scene.normals.get());
  EXPECT_EQ(frame.draw.pipeline, nullptr);
}

TEST(Line, a_frame_is_traced_and_judged_against_its_own_rays) {
  WallSplit split;
  Session session(find_backend("null"), 0, split, {.audits = Audits::none});
  const Heightfield heights = terrain();
  const Settings settings = parse_setting("relief");
  const UploadedScene scene = upload(session.backend(), kSmallScene, heights);
  const Frame frame = upload(session.backend(),
                             pack(settings, bake(bake_spec(settings, kSmallScene.wrap), heights), kSmallScene), scene);
  const Draw draw = frame.with(*session.pipeline(settings, Target::score, kSmallScene).pipeline);
  std::vector<ScorePixel> pixels = trace_frame(session.backend(), draw);
  ASSERT_EQ(pixels.size(), 24U * 16);
  pixels.front().status = static_cast<float>(PixelStatus::no_ray);

  const ReferenceTracer tracer(heights, kSmallScene.wrap);
  const std::vector<ReferenceHit> hits = exact_hits(tracer, pixels);
  ASSERT_EQ(hits.size(), pixels.size());
  EXPECT_EQ(hits.front().t_enter, 0);
  EXPECT_EQ(hits.back().t_enter, tracer.trace(pixels.back().ray).t_enter);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].t = static_cast<float>(hits[i].t_enter);
  const JudgedFrame judged = judge(pixels, hits, heights.width, heights.height);
  EXPECT_LT(judged.score.at("e_xy.max"), 1e-5);
  EXPECT_EQ(judged.pixels.front().verdict, Verdict::no_ray);
}

/// Two cases on a device of the null backend.
class TimedLine : public ::testing::Test {
 protected:
  void open() {
    session_.emplace(find_backend("null"), 0, split_, SessionOptions{.open = devices_.opener()});
    session_->calibrate(measure_.batch_ms, nullptr);
    scene_ = upload(session_->backend(), kSmallScene, terrain());
    frame_ = upload(session_->backend(), std::nullopt, scene_);
    draw_ = frame_.with(*session_->pipeline(parse_setting("flat"), Target::color, kSmallScene).pipeline);
    book_.emplace(SampleBook::Control{.id = "control@null", .reference_ns = session_->calibration().reference_ns});
    records_[0].case_id = "a";
    records_[1].case_id = "b";
  }
  [[nodiscard]] Timing timing() { return {.session = *session_, .book = *book_, .measure = measure_, .split = split_}; }
  [[nodiscard]] std::vector<TimedCase> warm() {
    return {warm_up(timing(), records_[0], std::span(&draw_, 1)), warm_up(timing(), records_[1], std::span(&draw_, 1))};
  }

  FaultyDevices devices_;
  MeasureSpec measure_{.batch_ms = 0.1, .warmup_batches_max = 1, .control_every = 1};
  WallSplit split_;
  std::optional<Session> session_;
  UploadedScene scene_;
  Frame frame_;
  Draw draw_;
  std::optional<SampleBook> book_;
  std::array<Record, 2> records_;
};

TEST_F(TimedLine, a_round_is_one_batch_a_case_between_those_of_the_control_case) {
  open();
  const std::vector<TimedCase> cases = warm();
  for (int round = 0; round < 3; ++round) time(timing(), cases);
  EXPECT_EQ(book_->control_samples().size(), 3U * 3);
  for (const TimedCase& one : cases) {
    const std::string& id = one.record->case_id;
    const std::vector<Sample>& samples = book_->samples(id);
    ASSERT_EQ(samples.size(), 3U);
    for (int round = 0; round < 3; ++round) EXPECT_EQ(samples[static_cast<std::size_t>(round)].round, round);
    EXPECT_EQ(samples[0].frames, one.frames);
    EXPECT_EQ(book_->times(id),
              corrected_times_ns(samples, book_->control_samples(), session_->calibration().reference_ns));
    const FrameTime whole =
        frame_time(samples, book_->control_samples(), session_->calibration().reference_ns, "fenced_wall");
    EXPECT_EQ(whole.summary.median, summarise(book_->times(id)).median);
    EXPECT_EQ(whole.summary.n, 3);
    EXPECT_EQ(whole.raw_median, median(raw_times(samples)));
    EXPECT_EQ(whole.timer, "fenced_wall");
  }
  EXPECT_THAT(book_->control_samples(), Each(::testing::Field(&Sample::round, 0)));
}

TEST_F(TimedLine, what_fails_is_the_cases_own_or_the_control_cases) {
  open();
  const std::vector<TimedCase> cases = warm();
  const int next = devices_.calls(FaultyDevices::draw);
  devices_.fail(FaultyDevices::draw, next + 3, Fault::out_of_memory);  // control, a, control, b
  try {
    time(timing(), cases);
    FAIL() << "it was timed";
  } catch (const CaseFailed& failed) {
    EXPECT_EQ(failed.record.case_id, "b");
    EXPECT_EQ(failed.record.status, Status::out_of_memory);
    EXPECT_EQ(failed.record.reason, "injected");
  }
  EXPECT_EQ(book_->samples("a").size(), 1U);  // counts
  EXPECT_EQ(book_->samples("b").size(), 0U);
  devices_.fail(FaultyDevices::draw, next + 4, Fault::other);
  EXPECT_THROW(
      try { time(timing(), cases); } catch (const CaseFailed&) { FAIL() << "no case was drawn"; }, Error);
}

TEST(Failures, become_a_status_and_a_reason) {
  const auto entered = [](const auto& fail) {
    Record record;
    try {
      fail();
    } catch (...) {
      enter_failure(record, Status::compile_error);
    }
    return std::pair(record.status, record.reason);
  };
  const auto fault = [](Fault kind) { return [kind] { fail_device(kind, "words"); }; };
  EXPECT_EQ(entered(fault(Fault::other)), std::pair(Status::compile_error, std::string("words")));
  EXPECT_EQ(entered(fault(Fault::device_lost)).first, Status::device_lost);
  EXPECT_EQ(entered(fault(Fault::timeout)).first, Status::timeout);
  EXPECT_EQ(entered(fault(Fault::invalid_timer)).first, Status::invalid_timer);
  EXPECT_EQ(entered(fault(Fault::out_of_memory)).first, Status::out_of_memory);
  EXPECT_EQ(entered([] { throw std::bad_alloc(); }),
            std::pair(Status::out_of_memory, std::string("the host's memory is used up")));
  EXPECT_THROW(entered([] { throw FileError(Exit::environment, "a full disk"); }), FileError);
  EXPECT_THROW(entered([] { throw std::logic_error("a bug"); }), std::logic_error);
}

}  // namespace
}  // namespace reliefbench
