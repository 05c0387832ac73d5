// Devices in processes of their own: how a worker starts, ends and with whom.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <set>
#include <thread>

#include "backends/worker/protocol.h"
#include "kernels/base/stop_signals.h"
#include "tests/backend_rig.h"
#include "tests/remote_device.h"
#include "tests/thorough.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Eventually: processes end in their own time.
bool comes_true(const std::function<bool()>& condition) {
  for (int i = 0; i < 500; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}
/// Or waits for somebody to take note.
bool is_gone(pid_t process) {
  const std::string status = file_text("/proc/" + std::to_string(process) + "/stat");
  return status.empty() || status.find(") Z ") != std::string::npos;
}

/// The frames of a technique in color and score, with a map, read back.
std::vector<std::vector<std::uint8_t>> frames_of(Backend& backend, Dialect dialect) {
  const Spirv vertex = compile_vertex(dialect);
  std::vector<std::byte> texels(32 * 32 * 4);
  for (std::size_t i = 0; i < texels.size(); ++i) texels[i] = static_cast<std::byte>(i * i / 97);
  std::vector<std::vector<std::uint8_t>> read;
  for (const bool is_large : {false, true}) {
    const auto relief = backend.upload({.width = 32, .height = 32, .texels = texels});
    Scene scene = kScene;
    if (is_large) scene.width_px = 640;
    Target dispatched = Target::score;
    dispatched.by_compute = true;
    for (const Target* target : {&Target::color, &Target::score, &std::as_const(dispatched)}) {
      const auto pipeline = backend.compile({.label = "relief",
                                             .vertex = vertex,
                                             .fragment = compile_fragment("relief", *target, dialect),
                                             .constants = {},
                                             .target = *target});
      Textures textures;
      for (const char* const name : {kReliefMap, kNormalMap, kReferenceMap, kExtraMap}) textures[name] = relief.get();
      const Draw draw{.pipeline = pipeline.get(), .textures = textures, .frame = frame_uniforms(scene, 32, 32)};
      EXPECT_GT(backend.render(draw, 2, Timer::fenced_wall).wall_ns, 0);
      for (const Attachment& attachment : target->attachments) {
        const std::span<const std::uint8_t> bytes = backend.read(attachment.name);
        read.emplace_back(bytes.begin(), bytes.end());
      }
    }
  }
  return read;
}

TEST(RemoteDevice, frames_are_those_of_a_device_in_this_process) {
  for (const BackendRow& row : backends()) {
    if (row.devices().empty()) continue;
    SCOPED_TRACE(row.id);
    const auto direct = row.open(0, {});
    ThreadedDevice threaded(row);
    const auto process = open_in_worker(row, 0);
    const auto expected = frames_of(*direct, row.dialect);
    EXPECT_EQ(frames_of(*threaded, row.dialect), expected);
    EXPECT_EQ(frames_of(*process, row.dialect), expected);
    EXPECT_EQ(process->device().name, direct->device().name);
    EXPECT_EQ(process->device().timers, direct->device().timers);
    EXPECT_THAT(process->debug_messages(), ::testing::IsEmpty());
  }
}

TEST(RemoteDevice, errors_come_with_their_code_fault_and_words) {
  const BackendRow& null = find_backend("null");
  EXPECT_EQ(message_of([&] { static_cast<void>(open_in_worker(null, 99)); }),
            message_of([&] { static_cast<void>(null.open(99, {})); }));
  ThreadedDevice device(null);
  EXPECT_THAT(message_of([&] { static_cast<void>((*device).read("none")); }), HasSubstr("attachment none"));
  EXPECT_THAT(message_of([&] { static_cast<void>((*device).compute({})); }), HasSubstr("no compute"));
  EXPECT_FALSE((*device).is_gone());
  EXPECT_EQ((*device).device().name, "null");
}

TEST(RemoteDevice, shaders_are_compiled_on_several_threads) {
  const BackendRow& row = find_backend("vulkan");
  if (row.devices().empty()) GTEST_SKIP();
  const auto device = open_in_worker(row, 0);
  const Spirv vertex = compile_vertex(row.dialect);
  const Spirv fragment = compile_fragment("flat", Target::color, row.dialect);
  std::vector<std::unique_ptr<Pipeline>> made(8);
  std::vector<std::jthread> threads;
  for (std::size_t first = 0; first < 4; ++first)
    threads.emplace_back([&, first] {
      for (std::size_t i = first; i < made.size(); i += 4)
        made[i] = device->compile(
            {.label = "flat", .vertex = vertex, .fragment = fragment, .constants = {}, .target = Target::color});
    });
  threads.clear();
  for (const auto& one : made) EXPECT_NE(one, nullptr);
}

class WorkerEnd : public ::testing::Test {
 protected:
  WorkerEnd() : worker_(start_worker()), process_(worker_->process()) {
    device_ = open_remote(std::move(worker_), find_backend("null"), 0, {});
  }
  /// The words of the error that the next call ends in.
  template <typename Failure>
  [[nodiscard]] std::string failure(Fault fault) {
    try {
      static_cast<void>(device_->upload({.width = 1, .height = 1, .texels = std::vector<std::byte>(4)}));
    } catch (const Failure& error) {
      EXPECT_EQ(error.fault(), fault) << error.what();
      EXPECT_TRUE(device_->is_gone());
      EXPECT_TRUE(comes_true([&] { return is_gone(process_); }));
      return error.what();
    }
    ADD_FAILURE() << "no such error";
    return "";
  }

  std::unique_ptr<Worker> worker_;
  pid_t process_;
  std::unique_ptr<Backend> device_;
};

TEST_F(WorkerEnd, a_crash_is_told_with_its_signal) {
  kill(process_, SIGABRT);
  EXPECT_THAT(failure<WorkerCrashed>(Fault::device_lost),
              AllOf(HasSubstr("null: the upload of a texture: the driver crashed"), HasSubstr("Aborted")));
  // What is asked afterwards fails, too, and waits for nothing.
  EXPECT_THAT(failure<Error>(Fault::device_lost), HasSubstr("has ended before"));
}

TEST_F(WorkerEnd, a_kill_from_outside_is_memory_that_ran_out) {
  kill(process_, SIGKILL);
  EXPECT_THAT(failure<Error>(Fault::out_of_memory), HasSubstr("where memory runs out"));
}

TEST_F(WorkerEnd, one_that_does_not_answer_is_killed) {
  device_->set_render_limit(0.3);
  kill(process_, SIGSTOP);
  const auto start = std::chrono::steady_clock::now();
  try {
    Draw draw;
    draw.frame.sizes = {4, 4, 1, 1};
    device_->render(draw, 1, Timer::fenced_wall);
    FAIL() << "it was drawn";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::timeout);
    EXPECT_THAT(error.what(), HasSubstr("null: the frames did not end within 0.3 s"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(3));
  EXPECT_TRUE(device_->is_gone());
  EXPECT_TRUE(comes_true([&] { return is_gone(process_); }));
}

TEST_F(WorkerEnd, it_ends_with_its_device) {
  device_ = nullptr;
  EXPECT_TRUE(is_gone(process_));
}

TEST_F(WorkerEnd, signals_to_the_whole_group_leave_it) {
  for (const int signal : kStopSignals) kill(process_, signal);
  EXPECT_NE(device_->upload({.width = 1, .height = 1, .texels = std::vector<std::byte>(4)}), nullptr);
}

TEST(WorkerStart, signals_to_the_whole_group_leave_it) {
  for (int i = 0; i < 24; ++i) {
    auto worker = start_worker();
    std::this_thread::sleep_for(std::chrono::microseconds(i / 3 * 1000));
    for (const int signal : kStopSignals) kill(worker->process(), signal);
    EXPECT_NO_THROW(static_cast<void>(open_remote(std::move(worker), find_backend("null"), 0, {}))) << i;
  }
}

TEST_F(WorkerEnd, it_has_no_descriptors_of_its_host) {
  std::set<std::string> open;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/" + std::to_string(process_) + "/fd"))
    open.insert(std::filesystem::read_symlink(entry.path()).string().substr(0, 6));
  EXPECT_THAT(open, ::testing::IsSubsetOf({"/dev/n", "pipe:[", "socket", "/memfd"}));
}

// However its host ends, and also while it hangs.
TEST(WorkerOfAHost, ends_when_its_host_does) {
  for (const bool hangs : {false, true})
    for (const int ending : {SIGINT, SIGTERM, SIGKILL}) {
      std::array<int, 2> told{};
      ASSERT_EQ(pipe(told.data()), 0);
      const pid_t host = fork();
      if (host == 0) {
        signal(ending, SIG_DFL);
        auto worker = start_worker();
        const pid_t process = worker->process();
        const auto device = open_remote(std::move(worker), find_backend("null"), 0, {});
        if (hangs) kill(process, SIGSTOP);
        if (write(told[1], &process, sizeof(process)) != sizeof(process)) _exit(1);
        for (;;) pause();
      }
      pid_t process = 0;
      ASSERT_EQ(read(told[0], &process, sizeof(process)), static_cast<ssize_t>(sizeof(process)));
      for (const int end : told) close(end);
      EXPECT_FALSE(is_gone(process));
      kill(host, ending);
      waitpid(host, nullptr, 0);
      EXPECT_TRUE(comes_true([&] { return is_gone(process); })) << ending << (hangs ? " while it hangs" : "");
    }
}

TEST(WorkerMemory, past_its_limit_is_out_of_memory) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer's shadow is past any limit";
  const GivenVariables limited(Variables{{kWorkerMemory, "128"}});
  const auto device = open_in_worker(find_backend("null"), 0);
  std::vector<std::byte> texels(std::size_t{130} << 20U);
  const auto upload = [&](std::size_t bytes) {
    return device->upload(
        {.width = static_cast<int>(bytes / 4), .height = 1, .texels = std::span(texels).first(bytes)});
  };
  EXPECT_NE(upload(4096), nullptr);
  try {
    static_cast<void>(upload(texels.size()));
    FAIL() << "it was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::out_of_memory) << error.what();
  }
  EXPECT_FALSE(device->is_gone());
  EXPECT_NE(upload(4096), nullptr);
}

}  // namespace
}  // namespace reliefbench
