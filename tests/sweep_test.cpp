// The sweep as a whole, on the null backend: which measures in no time and makes up the same numbers in every run.
#include "tuner/measure/sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/faulty_device.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tuner/plan/config.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Key;

class SweepTest : public ::testing::Test {
 protected:
  [[nodiscard]] static Config smoke() {
    return load_config(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json");
  }
  [[nodiscard]] SweepSummary sweep(const std::string& name, int device = 0, Pictured pictures = Pictured::shown) const {
    return run_sweep(
        smoke(),
        {.output = folder_ / name, .backends = {"null"}, .device = device, .pictures = pictures, .quiet = true});
  }
  [[nodiscard]] std::map<std::string, std::string> pictures(const std::string& run) const {
    std::map<std::string, std::string> texts;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / run / kImagesFolder))
      texts[entry.path().filename()] = file_text(entry.path());
    return texts;
  }
  [[nodiscard]] std::vector<std::string> lines(const std::string& run, std::string_view file) const {
    std::vector<std::string> out;
    std::ifstream in((folder_ / run) / file);
    for (std::string line; std::getline(in, line);) out.push_back(line);
    return out;
  }
  /// Keeps the first lines of a file, and a torn piece of the next: as a kill in the middle of a write leaves it.
  void cut(const std::string& run, std::string_view file, std::size_t keep) const {
    const std::vector<std::string> all = lines(run, file);
    std::ofstream out((folder_ / run) / file, std::ios::trunc);
    for (std::size_t i = 0; i < keep; ++i) out << all[i] << '\n';
    out << all[keep].substr(0, all[keep].size() / 2);
  }
  [[nodiscard]] std::set<std::string> case_ids(const std::string& run) const {
    std::set<std::string> ids;
    for (const Record& record : load_run(folder_ / run).records) ids.insert(record.case_id);
    return ids;
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(SweepTest, leaves_a_whole_run) {
  const SweepSummary summary = sweep("run");
  EXPECT_EQ(summary.statuses, (std::map<std::string, int>{{"ok", summary.cases}}));
  for (const std::string_view file : {kRunFile, kResultsFile, kSamplesFile, kBenchmarkFile, kFrontFile})
    EXPECT_TRUE(std::filesystem::exists((folder_ / "run") / file)) << file;
  const auto run = load_run(folder_ / "run");
  ASSERT_EQ(run.records.size(), static_cast<std::size_t>(summary.cases));
  for (const Record& record : run.records) {
    EXPECT_EQ(record.frame_time->summary.n, smoke().measure.samples) << record.case_id;
    EXPECT_GT(record.frame_time->summary.median, 0);
    EXPECT_TRUE(record.error);
  }
  EXPECT_TRUE(run.info.at("finished").is_string());
}

TEST_F(SweepTest, every_file_keeps_to_its_schema) {
  static_cast<void>(sweep("run"));
  const auto document = [&](std::string_view file) {
    return nlohmann::json::parse(std::ifstream((folder_ / "run") / file));
  };
  EXPECT_EQ(schema_errors(document(kRunFile), "run"), "");
  EXPECT_EQ(schema_errors(document(kFrontFile), "front"), "");
  for (const std::string& line : lines("run", kResultsFile))
    EXPECT_EQ(schema_errors(nlohmann::json::parse(line), "results"), "");
  for (const std::string& line : lines("run", kSamplesFile))
    EXPECT_EQ(schema_errors(nlohmann::json::parse(line), "samples"), "");
}

TEST_F(SweepTest, benchmark_json_is_google_benchmarks_and_has_every_sample) {
  static_cast<void>(sweep("run"));
  std::ifstream in((folder_ / "run") / kBenchmarkFile);
  const nlohmann::json benchmark = nlohmann::json::parse(in);
  EXPECT_TRUE(benchmark.at("context").contains("num_cpus"));
  std::map<std::string, int> repetitions;
  for (const nlohmann::json& entry : benchmark.at("benchmarks")) {
    EXPECT_EQ(entry.at("run_type"), "iteration");
    EXPECT_EQ(entry.at("time_unit"), "ns");
    EXPECT_GT(entry.at("real_time").get<double>(), 0);
    repetitions[entry.at("run_name").get<std::string>()] += 1;
  }
  for (const std::string& id : case_ids("run")) EXPECT_EQ(repetitions[id], smoke().measure.samples) << id;
  EXPECT_THAT(repetitions, Contains(Key("control@null")));
}

TEST_F(SweepTest, bakes_traces_and_compiles_nothing_twice) {
  const SweepSummary first = sweep("first");
  EXPECT_EQ(first.bakes, 3);  // cone rg16, relaxed_cone rg8 and rg16f, and no more; heights alone are no bake
  EXPECT_EQ(first.bakes_cached, 0);
  EXPECT_EQ(first.references, 2);  // of what is measured, and of its pictures, which have more pixels
  const SweepSummary second = sweep("second");
  EXPECT_EQ(second.bakes, 0);
  EXPECT_EQ(second.references, 0);
  EXPECT_EQ(second.references_cached, 2);
  EXPECT_EQ(second.shaders, first.shaders);
}

TEST_F(SweepTest, continues_where_a_kill_stopped_it) {
  static_cast<void>(sweep("whole"));
  static_cast<void>(sweep("killed"));
  const std::size_t results = lines("killed", kResultsFile).size();
  const std::vector<std::string> samples = lines("killed", kSamplesFile);
  for (std::size_t keep = 0; keep < results; ++keep) {
    cut("killed", kResultsFile, keep);
    // Samples are written before the results of their block: some of the unfinished cases have theirs already.
    cut("killed", kSamplesFile, samples.size() - 1 - keep);
    const SweepSummary summary = sweep("killed");
    EXPECT_EQ(summary.resumed, static_cast<int>(keep));
    EXPECT_EQ(case_ids("killed"), case_ids("whole"));
    std::map<std::string, int> counts;
    for (const Sample& sample : load_run(folder_ / "killed").samples) counts[sample.case_id] += 1;
    for (const std::string& id : case_ids("whole")) EXPECT_EQ(counts[id], smoke().measure.samples) << id;
  }
}

TEST_F(SweepTest, a_finished_run_is_not_measured_again) {
  static_cast<void>(sweep("run"));
  const std::vector<std::string> results = lines("run", kResultsFile);
  const std::vector<std::string> samples = lines("run", kSamplesFile);
  const SweepSummary again = sweep("run");
  EXPECT_EQ(again.resumed, again.cases);
  EXPECT_EQ(again.shaders, 0);
  EXPECT_EQ(lines("run", kResultsFile), results);
  EXPECT_EQ(lines("run", kSamplesFile), samples);
}

TEST_F(SweepTest, a_failing_case_gets_its_status_and_the_sweep_goes_on) {
  const SweepSummary summary = sweep("run", 1);  // the null backend's device 1 refuses relaxed_cone
  EXPECT_EQ(summary.statuses.at("compile_error"), 2);
  EXPECT_EQ(summary.statuses.at("ok"), summary.cases - 2);
  for (const Record& record : load_run(folder_ / "run").records) {
    if (record.technique != "relaxed_cone") continue;
    EXPECT_EQ(record.status, Status::compile_error);
    EXPECT_FALSE(record.reason.empty());
    EXPECT_FALSE(record.frame_time);
  }
}

TEST_F(SweepTest, another_device_does_not_continue_a_run) {
  static_cast<void>(sweep("run"));
  try {
    static_cast<void>(sweep("run", 1));
    FAIL() << "it was continued";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(), HasSubstr("device"));
  }
}

TEST_F(SweepTest, other_kernels_do_not_continue_a_run) {
  static_cast<void>(sweep("run"));
  const std::filesystem::path path = (folder_ / "run") / kRunFile;
  nlohmann::json info = nlohmann::json::parse(std::ifstream(path));
  ASSERT_TRUE(info["identity"]["kernels_sha256"].is_string());
  info["identity"]["kernels_sha256"] = std::string(64, '0');
  std::ofstream(path) << info;
  try {
    static_cast<void>(sweep("run"));
    FAIL() << "it was continued";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(), HasSubstr("kernels_sha256"));
  }
}

TEST_F(SweepTest, keeps_the_pictures_of_the_front_alone) {
  static_cast<void>(sweep("run"));
  std::set<std::string> pictures;
  for (const auto& entry : std::filesystem::directory_iterator((folder_ / "run") / "images"))
    pictures.insert(entry.path().filename());
  const nlohmann::json front = nlohmann::json::parse(std::ifstream((folder_ / "run") / kFrontFile));
  const nlohmann::json& points = front.at("fronts").at(0).at("points");
  ASSERT_FALSE(points.empty());
  for (const nlohmann::json& point : points)
    EXPECT_TRUE(pictures.contains(image_path(point.at("case").get<std::string>(), "error").filename()));
  EXPECT_TRUE(pictures.contains(image_path(reference_image_key("fbm_32x32/oblique", "null"), "frame").filename()));

  const std::filesystem::path dominated = (folder_ / "run") / image_path("a dominated case", "error");
  std::ofstream(dominated) << "x";
  static_cast<void>(sweep("run"));
  EXPECT_FALSE(std::filesystem::exists(dominated));
}

TEST_F(SweepTest, a_finished_run_gets_the_pictures_that_it_lacks) {
  static_cast<void>(sweep("run"));
  const auto whole = pictures("run");
  const std::vector<std::string> results = lines("run", kResultsFile);
  ASSERT_GE(whole.size(), 3U);
  for (const auto& [name, text] : whole) {
    std::filesystem::remove(folder_ / "run" / kImagesFolder / name);
    static_cast<void>(sweep("run"));
    EXPECT_TRUE(pictures("run") == whole) << name;
  }
  EXPECT_EQ(lines("run", kResultsFile), results);
}

TEST_F(SweepTest, pictures_are_of_the_cases_that_are_asked_for) {
  const SweepSummary summary = sweep("run", 0, Pictured::none);
  EXPECT_TRUE(pictures("run").empty());
  static_cast<void>(sweep("run", 0, Pictured::all));
  EXPECT_EQ(pictures("run").size(), 3U * static_cast<std::size_t>(summary.cases) + 1);  // one exact picture for all
  static_cast<void>(sweep("run"));
  static_cast<void>(sweep("fresh"));
  EXPECT_TRUE(pictures("run") == pictures("fresh"));
}

TEST_F(SweepTest, a_case_whose_picture_fails_keeps_its_record) {
  const auto sweep_on = [&](FaultyDevices& devices, Pictured pictures) {
    return run_sweep(smoke(), {.output = folder_ / "run",
                               .backends = {"null"},
                               .pictures = pictures,
                               .quiet = true,
                               .open = devices.opener()});
  };
  static_cast<void>(sweep("run"));
  const std::size_t whole = pictures("run").size();
  const std::vector<std::string> results = lines("run", kResultsFile);
  FaultyDevices good;
  static_cast<void>(sweep_on(good, Pictured::none));
  for (const FaultyDevices::Call call : {FaultyDevices::upload, FaultyDevices::compile, FaultyDevices::draw})
    for (const Fault fault : {Fault::out_of_memory, Fault::device_lost}) {
      FaultyDevices devices;
      devices.fail(call, good.calls(call), fault);  // the first that is not of the audit
      const SweepSummary summary = sweep_on(devices, Pictured::shown);
      EXPECT_EQ(summary.statuses.at("ok"), summary.cases);
      EXPECT_EQ(lines("run", kResultsFile), results);
      EXPECT_EQ(pictures("run").size(), whole - 3);
      std::filesystem::remove_all(folder_ / "run" / kImagesFolder);
    }
}

TEST_F(SweepTest, removes_no_picture_that_is_not_its_own) {
  const std::filesystem::path images = (folder_ / "run") / kImagesFolder;
  std::filesystem::create_directories(images / "2026");
  for (const char* name : {"holiday.png", "0123456789abcdef.png", "0123456789abcdef-error.jpg", "2026/a.png"})
    std::ofstream(images / name) << "mine";
  static_cast<void>(sweep("run"));
  for (const char* name : {"holiday.png", "0123456789abcdef.png", "0123456789abcdef-error.jpg", "2026/a.png"})
    EXPECT_TRUE(std::filesystem::exists(images / name)) << name;
}

TEST_F(SweepTest, pictures_behind_a_link_are_safe) {
  std::filesystem::create_directories(folder_ / "album");
  const std::filesystem::path picture = (folder_ / "album") / image_path("a", "frame").filename();
  std::ofstream(picture) << "mine";
  std::filesystem::create_directories(folder_ / "run");
  std::filesystem::create_directory_symlink(folder_ / "album", (folder_ / "run") / kImagesFolder);
  EXPECT_THROW(static_cast<void>(sweep("run")), Error);
  EXPECT_TRUE(std::filesystem::exists(picture));
}

TEST(TwoDevices, are_told_where_both_have_an_address_and_it_differs) {
  const auto device = [](const char* backend, const char* pci) {
    DeviceInfo info;
    info.backend = backend;
    info.name = std::string("GPU of ") + backend;
    info.pci = pci;
    return info;
  };
  const DeviceInfo opengl = device("opengl", "0000:65:00.0");
  const auto note = [&](const char* pci) { return two_devices_note(std::vector{opengl, device("vulkan", pci)}); };
  EXPECT_EQ(note("0000:65:00.0"), "");
  EXPECT_EQ(note(""), "");
  EXPECT_EQ(
      note("0000:17:00.0"),
      "device 0 is GPU of opengl (0000:65:00.0) on opengl and GPU of vulkan (0000:17:00.0) on vulkan: their times "
      "are of different hardware");
  EXPECT_EQ(two_devices_note({}), "");
}

}  // namespace
}  // namespace reliefbench
