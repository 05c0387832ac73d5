#include "tuner/results/store.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <functional>

#include "kernels/base/atomic_file.h"
#include "kernels/base/file_error.h"
#include "kernels/base/stop_signals.h"
#include "reports/pages/report_data.h"
#include "tests/full_record.h"
#include "tests/synthetic_run.h"
#include "tests/written_tables.h"
#include "tuner/results/case_table.h"
#include "tuner/results/run_files.h"
#include "tuner/results/t4.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

const json kIdentity = {{"schema", kSchemaVersion},
                        {"config_sha256", "ab"},
                        {"devices", {{{"backend", "opengl"}, {"index", 0}, {"driver", "Mesa 22.3.6"}}}}};

class Store : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::path(testing::TempDir()) / fmt::format("store_test_{}_{}", info->name(), ::getpid());
    fs::remove_all(root_);
    fs::create_directories(root_);
    folder_ = root_ / "run";
  }
  void TearDown() override { fs::remove_all(root_); }

  static Record record(const std::string& case_id) {
    Record r = full_record();
    r.case_id = case_id;
    return r;
  }
  static std::string text_of(const fs::path& path) { return read_file(path); }
  static void write(const fs::path& path, std::string_view text) { std::ofstream(path, std::ios::binary) << text; }
  static void write_run(const fs::path& folder) {
    RunStore store(folder, kIdentity);
    store.append(record("a"));
    store.append(record("b"));
    store.append(Sample{.case_id = "a", .round = 0, .frames = 4, .frame_time_ns = 2.5, .at_ns = 10});
    store.append(Sample{.case_id = "b", .round = 1, .frames = 4, .frame_time_ns = 3.5, .at_ns = 20});
  }

  fs::path root_;
  fs::path folder_;
};

TEST_F(Store, WhatIsAppendedIsReadBack) {
  {
    RunStore store(folder_, kIdentity);
    EXPECT_TRUE(store.earlier().records.empty());
    store.append(record("a"));
    store.append(Sample{.case_id = "a", .round = 2, .frames = 4, .frame_time_ns = 2.5, .at_ns = 10});
    EXPECT_EQ(load_run(folder_).records.size(), 1U);  // a line is there when append() returns
    store.write_info({{"name", "nightly"}});
  }
  const auto run = load_run(folder_);
  EXPECT_EQ(run.info["name"], "nightly");
  EXPECT_EQ(run.info["identity"], kIdentity);
  ASSERT_EQ(run.records.size(), 1U);
  EXPECT_EQ(json(run.records[0]), json(record("a")));
  ASSERT_EQ(run.samples.size(), 1U);
  EXPECT_EQ(run.samples[0].round, 2);
}

// A kill at any moment of the last write: whatever of the line is there, the run resumes and the line can be written
// again.
TEST_F(Store, ATornLastLineIsCutOff) {
  write_run(folder_);
  const std::string whole = text_of(folder_ / kResultsFile);
  const std::size_t last = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t size = last; size < whole.size(); ++size) {
    write(folder_ / kResultsFile, whole.substr(0, size));
    EXPECT_EQ(load_run(folder_).records.size(), 1U) << size;
    EXPECT_EQ(text_of(folder_ / kResultsFile).size(), size) << "reading changes nothing";
    RunStore store(folder_, kIdentity);
    ASSERT_EQ(store.earlier().records.size(), 1U) << size;
    EXPECT_EQ(store.earlier().records[0].case_id, "a");
    EXPECT_EQ(store.earlier().samples.size(), 2U);
    store.append(record("b"));
    EXPECT_EQ(text_of(folder_ / kResultsFile), whole) << size;
  }
}

TEST_F(Store, ATornSampleIsCutOff) {
  write_run(folder_);
  const std::string whole = text_of(folder_ / kSamplesFile);
  write(folder_ / kSamplesFile, whole.substr(0, whole.size() - 5));
  EXPECT_EQ(RunStore(folder_, kIdentity).earlier().samples.size(), 1U);
  EXPECT_EQ(text_of(folder_ / kSamplesFile), whole.substr(0, whole.find('\n') + 1));
}

TEST_F(Store, AnyOtherBrokenLineIsNamed) {
  write_run(folder_);
  const std::string whole = text_of(folder_ / kResultsFile);
  const std::string file = (folder_ / kResultsFile).string();
  write(folder_ / kResultsFile, "{\"case\n" + whole);
  EXPECT_THAT([&] { (void)load_run(folder_); }, ThrowsMessage<Error>(StartsWith(file + ":1: not JSON")));
  write(folder_ / kResultsFile, whole + "{}\n");
  EXPECT_THAT([&] { (void)load_run(folder_); }, ThrowsMessage<Error>(StartsWith(file + ":3: 'schema' is missing")));
  write(folder_ / kResultsFile, whole + "\n");
  EXPECT_THAT([&] { (void)RunStore(folder_, kIdentity); }, ThrowsMessage<Error>(StartsWith(file + ":3:")));
}

TEST_F(Store, OfTwoRecordsOfACaseTheLaterCounts) {
  {
    RunStore store(folder_, kIdentity);
    Record failed = record("a");
    failed.status = Status::device_lost;
    store.append(failed);
    store.append(record("b"));
    store.append(record("a"));
  }
  const auto run = load_run(folder_);
  ASSERT_EQ(run.records.size(), 2U);
  EXPECT_EQ(run.records[0].case_id, "a");
  EXPECT_EQ(run.records[0].status, Status::ok);
}

TEST_F(Store, AnotherIdentityIsRefusedByItsFirstKey) {
  write_run(folder_);
  const std::string before = text_of(folder_ / kResultsFile);
  const auto refused = [&](const std::string& pointer, const json& value, const std::string& message) {
    json other = kIdentity;
    other[json::json_pointer(pointer)] = value;
    EXPECT_THAT([&] { (void)RunStore(folder_, other); },
                ThrowsMessage<Error>(AllOf(HasSubstr(message), HasSubstr("choose another folder"))));
  };
  refused("/devices/0/driver", "Mesa 23", R"(its 'devices[0].driver' is "Mesa 22.3.6", now it is "Mesa 23")");
  refused("/config_sha256", "cd", R"('config_sha256' is "ab", now it is "cd")");
  refused("/schema", kSchemaVersion + 1,
          fmt::format("'schema' is {}, now it is {}", kSchemaVersion, kSchemaVersion + 1));
  refused("/filter", "x", R"('filter' is null, now it is "x")");
  refused("/devices/1", {{"backend", "vulkan"}}, "its 'devices' is [");
  EXPECT_EQ(text_of(folder_ / kResultsFile), before);
}

TEST_F(Store, OneProcessAtATime) {
  const RunStore first(folder_, kIdentity);
  EXPECT_THAT([&] { (void)RunStore(folder_, kIdentity); }, ThrowsMessage<Error>(HasSubstr("another process")));
}

TEST_F(Store, NoRunIsSaidSo) {
  EXPECT_THAT([&] { (void)load_run(root_ / "nothing"); }, ThrowsMessage<Error>(HasSubstr("is not a run folder")));
  fs::create_directories(folder_);
  write(folder_ / kRunFile, "{}");
  EXPECT_THAT([&] { (void)load_run(folder_); }, ThrowsMessage<Error>(HasSubstr("'identity' is missing")));
  write(folder_ / kRunFile, "{\"identity\": {\"schema\": 99}}");
  EXPECT_THAT([&] { (void)load_run(folder_); },
              ThrowsMessage<Error>(HasSubstr(fmt::format("is 99, this reliefbench reads {}", kSchemaVersion))));
  write(folder_ / kRunFile, "{\"identity\": ");
  EXPECT_THAT([&] { (void)load_run(folder_); }, ThrowsMessage<Error>(HasSubstr("not JSON")));
  fs::remove(folder_ / kRunFile);
  write(folder_ / kResultsFile, "precious");
  EXPECT_THAT([&] { (void)RunStore(folder_, kIdentity); }, ThrowsMessage<Error>(HasSubstr("but no run.json")));
  EXPECT_EQ(text_of(folder_ / kResultsFile), "precious");
}

TEST_F(Store, AFolderThatCannotBeWrittenLeavesNothingBehind) {
  write(root_ / "file", "");
  EXPECT_THAT([&] { (void)RunStore(root_ / "file" / "run", kIdentity); }, ThrowsMessage<Error>(HasSubstr("file/run")));
  EXPECT_THROW((void)RunStore("/proc/no/such/run", kIdentity), Error);
  // The folder is good, but run.json cannot be written.
  fs::create_directories(root_ / "c");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit full{.rlim_cur = 16, .rlim_max = before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &full);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const char* name : {"c", "new/run"}) EXPECT_THROW((void)RunStore(root_ / name, kIdentity), FileError);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_TRUE(fs::is_empty(root_ / "c")) << "it was there before";
  EXPECT_FALSE(fs::exists(root_ / "new"));
}

// A start that is killed before its run.json leaves files without a line.
TEST_F(Store, AStartThatWasKilledAtOnceGoesOn) {
  for (const auto& left : {std::vector{kResultsFile}, {kResultsFile, kSamplesFile}, {kSamplesFile}, {kMarkFile}}) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    for (const std::string_view name : left) write(folder_ / name, "");
    RunStore(folder_, kIdentity).append(record("a"));
    EXPECT_EQ(load_run(folder_).records.size(), 1U);
  }
}

TEST_F(Store, FilesOfSomethingElseAreLeftAlone) {
  for (const std::string_view name : {kResultsFile, kSamplesFile, kFrontFile, kBenchmarkFile, kTableFile, kT4File}) {
    fs::create_directories(folder_);
    write(folder_ / name, "precious");
    EXPECT_THAT([&] { (void)RunStore(folder_, kIdentity); }, ThrowsMessage<Error>(HasSubstr("choose another folder")));
    EXPECT_EQ(text_of(folder_ / name), "precious");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1) << name;
    fs::remove_all(folder_);
  }
}

TEST_F(Store, PicturesDoNotGoThroughALink) {
  fs::create_directories(folder_);
  fs::create_directories(root_ / "album");
  fs::create_directory_symlink(root_ / "album", folder_ / kImagesFolder);
  EXPECT_THAT([&] { (void)RunStore(folder_, kIdentity); }, ThrowsMessage<Error>(HasSubstr("is a symbolic link")));
  fs::remove(folder_ / kImagesFolder);
  { const RunStore store(folder_, kIdentity); }
  fs::create_directory_symlink(root_ / "album", folder_ / kImagesFolder);
  EXPECT_THAT([&] { (void)RunStore(folder_, kIdentity); }, ThrowsMessage<Error>(HasSubstr("is a symbolic link")));
}

TEST_F(Store, AnEndlessLineIsNoRecord) {
  write_run(folder_);
  write(folder_ / kResultsFile, std::string(2 << 20, '[') + "\n");
  EXPECT_THAT([&] { (void)load_run(folder_); },
              ThrowsMessage<Error>(HasSubstr("results.jsonl:1: a line of over 1048576 bytes")));
  write(folder_ / kRunFile, std::string(1 << 20, '['));
  EXPECT_THAT([&] { (void)load_run(folder_); }, ThrowsMessage<Error>(HasSubstr("run.json: over 64 levels deep")));
}

// Whatever a key of run.json holds, the message names file and key.
TEST_F(Store, AKeyOfAnotherTypeIsNamed) {
  write_run(folder_);
  const json good = synthetic_run({}).info;
  const json whole = good.flatten();
  for (const auto& [key, value] : whole.items())
    for (const json& wrong : {json(nullptr), json(7), json("x"), json::array({1}), json::object({{"a", 1}})}) {
      json info = good;
      info["identity"]["schema"] = kSchemaVersion;
      info[json::json_pointer(key)] = wrong;
      write(folder_ / kRunFile, info.dump());
      try {
        const reliefbench::Run run = load_run(folder_);
        (void)case_table(run);
        (void)t4_json(run, {}, {});
        (void)report_data(std::span(&run, 1));
      } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::Not(HasSubstr("json.exception"))) << key;
      } catch (const std::exception& error) {
        ADD_FAILURE() << key << " as " << wrong << ": " << error.what();
      }
    }
}

TEST_F(Store, LinesSayOfWhichSchemaTheyAre) {
  write_run(folder_);
  const json line = json::parse(text_of(folder_ / kResultsFile).substr(0, text_of(folder_ / kResultsFile).find('\n')));
  EXPECT_EQ(line.at("schema"), kSchemaVersion);
  json older = line;
  older["schema"] = kSchemaVersion - 1;
  write(folder_ / kResultsFile, older.dump() + "\n");
  EXPECT_THAT([&] { (void)load_run(folder_); }, ThrowsMessage<Error>(HasSubstr("results.jsonl:1: 'schema' is")));
}

/// How the mark says that a process ended which did this with it. The one who asks ends like kill -9, so that the file
/// stays for the next.
std::string death_after(const fs::path& path, const std::function<void(CaseMark&)>& act) {
  std::string told;
  const pid_t child = fork();
  if (child == 0) {
    CaseMark mark(path);
    act(mark);
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);
  const std::string text = read_file(path);
  {
    const CaseMark mark(path);
    if (mark.death()) told = fmt::format("{} times {}", mark.death()->case_id, mark.death()->times);
  }
  EXPECT_FALSE(fs::exists(path)) << "an orderly end leaves no mark";
  std::ofstream(path) << text;
  return told;
}

TEST_F(Store, TheCaseInHandIsKnownAfterADeath) {
  const fs::path path = root_ / "mark";
  const auto kill_in = [](const char* id) {
    return [id](CaseMark& mark) {
      { const auto hold = mark.hold("a case with a longer name"); }
      const auto hold = mark.hold(id);
      raise(SIGKILL);
    };
  };
  EXPECT_EQ(death_after(path, [](CaseMark& mark) { const auto hold = mark.hold("a"); }), "") << "between cases";
  for (int pair = 0; pair < 6; ++pair) {
    EXPECT_EQ(death_after(path, kill_in("a")), "a times 1") << pair;
    EXPECT_EQ(death_after(path, kill_in("a")), "a times 2") << pair;
  }
  EXPECT_EQ(death_after(path, kill_in("a")), "a times 1");
  EXPECT_EQ(death_after(path, kill_in("b")), "b times 1");
  for (const int earlier : {2, 3, 8, 9}) {  // earlier builds counted on
    write(path, fmt::format("{} a\n", earlier));
    EXPECT_EQ(CaseMark(path).death()->is_its_fault(), earlier % 2 == 1) << earlier;
  }
  write(path, "no mark at all");
  EXPECT_EQ(death_after(path, [](CaseMark&) {}), "");
}

TEST_F(Store, WhoStopsTheProcessSaysNothingOfTheCase) {
  const fs::path path = root_ / "mark";
  for (const int signal : kStopSignals) {
    const pid_t child = fork();
    if (child == 0) {
      std::signal(signal, SIG_DFL);
      CaseMark mark(path);
      { const CaseMark other(root_ / "other"); }
      const auto hold = mark.hold("a");
      raise(signal);
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal) << "it ends as it would have done without a mark";
    EXPECT_FALSE(CaseMark(path).death()) << signal;
  }
}

TEST_F(Store, NestedFoldersAreMade) {
  { const RunStore store(root_ / "a" / "b" / "run/", kIdentity); }
  EXPECT_TRUE(fs::exists(root_ / "a" / "b" / "run" / kRunFile));
}

TEST_F(Store, WritingIsWholeOrNotAtAll) {
  write_atomically(root_ / "x", "one");
  write_atomically(root_ / "x", "two");
  EXPECT_EQ(text_of(root_ / "x"), "two");
  fs::create_directories(root_ / "folder" / "full");
  EXPECT_THROW(write_atomically(root_ / "folder", "three"), Error);
  EXPECT_THROW(write_atomically(root_ / "none" / "x", "three"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(root_), fs::directory_iterator()), 2) << "no temporary file stays";
}

TEST_F(Store, BytesThatAreNoTextDoNotStopARun) {
  {
    RunStore store(folder_, kIdentity);
    Record r = record("a");
    r.device = "GPU \xff\xfe";
    store.append(r);
  }
  EXPECT_THAT(load_run(folder_).records.at(0).device, StartsWith("GPU "));
}

}  // namespace
}  // namespace reliefbench
