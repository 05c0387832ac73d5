// Messages to a worker and back: what crosses, and how long is waited for it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <random>
#include <thread>

#include "backends/worker/protocol.h"
#include "tests/remote_device.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

template <typename Value>
Value through_wire(const Value& value, SharedMemory* bulk, std::vector<std::byte>& kept) {
  WireWriter writer(bulk);
  writer(value);
  kept.assign(writer.message().begin(), writer.message().end());
  WireReader reader(kept, bulk);
  auto read = reader.get<Value>();
  reader.end();
  return read;
}

DeviceInfo some_device() {
  return {.backend = "vulkan",
          .index = 3,
          .name = "a \"device\"\n",
          .vendor = "",
          .type = "discrete",
          .driver = "1.2",
          .api_version = "1.3",
          .software = true,
          .timers = {Timer::fenced_wall, Timer::vk_timestamp},
          .subtexel_bits = 8,
          .float64 = true,
          .blocks = {TexelType::rgtc, TexelType::eac, TexelType::bc7, TexelType::astc},
          .compiles_in_parallel = true,
          .pci = "0000:65:00.0"};
}

TEST(Wire, values_come_back) {
  std::vector<std::byte> kept;
  const DeviceInfo device = some_device();
  const auto same = through_wire(device, nullptr, kept);
  EXPECT_EQ(same.name, device.name);
  EXPECT_EQ(same.timers, device.timers);
  EXPECT_EQ(same.pci, device.pci);
  EXPECT_EQ(same.index, 3);
  EXPECT_TRUE(same.software && same.float64 && same.takes(TexelType::eac) && same.compiles_in_parallel);

  const std::vector<std::uint32_t> vertex = {1, 2, 3};
  const std::vector<std::uint32_t> fragment(5000, 7);
  const PipelineDesc pipeline = through_wire(PipelineDesc{.label = "cone",
                                                          .vertex = vertex,
                                                          .fragment = fragment,
                                                          .constants = {{.id = 4, .value = -5}},
                                                          .target = Target::score},
                                             nullptr, kept);
  EXPECT_TRUE(std::ranges::equal(pipeline.vertex, vertex));
  EXPECT_TRUE(std::ranges::equal(pipeline.fragment, fragment));
  EXPECT_EQ(pipeline.constants.at(0).value, -5);
  EXPECT_EQ(pipeline.target, Target::score);

  SharedMemory memory;
  for (const std::size_t bytes : {0U, 1U, 4095U, 4096U, 5000000U}) {
    std::vector<std::byte> texels(bytes, std::byte{9});
    memory.clear();
    const TextureDesc desc{.width = 7,
                           .height = 5,
                           .layout = {.type = TexelType::float16, .channels = 2},
                           .levels = 2,
                           .texels = texels,
                           .wrap = Wrap::clamp,
                           .filter = Filter::nearest};
    const auto read = through_wire(desc, &memory, kept);
    EXPECT_TRUE(std::ranges::equal(read.texels, texels)) << bytes;
    EXPECT_LT(kept.size(), kLeastBulk + 200);
    EXPECT_EQ(read.layout, desc.layout);
    EXPECT_EQ(read.wrap, Wrap::clamp);
    EXPECT_EQ(read.filter, Filter::nearest);
  }
  EXPECT_FALSE(through_wire(BatchTime{.wall_ns = 1}, nullptr, kept).device_ns);
  EXPECT_EQ(through_wire(BatchTime{.wall_ns = 1, .device_ns = 0.5}, nullptr, kept).device_ns, 0.5);
}

// Whatever the bytes are, reading them ends in a value or in an Error.
TEST(Wire, torn_messages_are_refused) {
  SharedMemory memory;
  const std::vector<std::byte> texels(10000, std::byte{1});
  WireWriter writer(&memory);
  writer(some_device(), TextureDesc{.texels = texels}, std::vector<std::pair<std::string, ObjectId>>{{"a", 1}});
  const std::vector<std::byte> whole(writer.message().begin(), writer.message().end());
  const auto read = [&](const std::vector<std::byte>& message) {
    WireReader reader(message, &memory);
    static_cast<void>(reader.get<DeviceInfo>());
    const auto texture = reader.get<TextureDesc>();
    static_cast<void>(reader.get<std::vector<std::pair<std::string, ObjectId>>>());
    reader.end();
    return std::count(texture.texels.begin(), texture.texels.end(), std::byte{1});  // touches all
  };
  EXPECT_EQ(read(whole), 10000);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_THROW(read({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}), Error) << size;
  std::vector<std::byte> longer = whole;
  longer.push_back({});
  EXPECT_THROW(read(longer), Error);
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 5000; ++i) {
    std::vector<std::byte> changed = whole;
    changed[random() % changed.size()] = static_cast<std::byte>(random());
    try {
      read(changed);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 250);
}

TEST(Wire, what_is_no_message_is_told) {
  auto [ours, theirs] = socket_ends();
  ASSERT_EQ(write(theirs.get(), "HTTP/1.1 404 Not Found\r\n\r\n", 26), 26);
  Worker worker(std::move(ours), Descriptor(dup(SharedMemory().descriptor())));
  EXPECT_THAT(
      [&] { static_cast<void>(worker.call({}, "a test", 10)); },
      ::testing::ThrowsMessage<WorkerCrashed>(HasSubstr("a test: the driver's process wrote what is no reply")));
  EXPECT_TRUE(worker.is_dead());
}

// As where a driver crashes while shaders compile on several threads: one thread reads what the worker says, and
// another finds that it takes no more.
TEST(Wire, one_thread_alone_buries_a_worker) {
  auto [ours, theirs] = socket_ends();
  Worker worker(std::move(ours), Descriptor(dup(SharedMemory().descriptor())));
  constexpr double kLong_s = 20;
  std::string said;
  std::thread reader([&] {
    try {
      static_cast<void>(worker.call({}, "the first", kLong_s));
    } catch (const WorkerCrashed& error) {
      said = error.what();
    } catch (const Error& error) {
      said = fmt::format("no crash: {}", error.what());
    }
  });
  std::array<char, 64> request{};
  ASSERT_GT(read(theirs.get(), request.data(), request.size()), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // until it waits
  ASSERT_EQ(shutdown(theirs.get(), SHUT_RD), 0);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THAT([&] { static_cast<void>(worker.call({}, "the second", kLong_s)); },
              ::testing::ThrowsMessage<Error>(HasSubstr("the second: the driver's process has ended before")));
  reader.join();
  EXPECT_THAT(said, HasSubstr("the first: the driver ended its process"));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::duration<double>(kLong_s / 2));
}

// As by Ctrl-Z and fg: it is not the frame that takes the time.
TEST(Wire, time_in_which_the_host_is_stopped_does_not_count) {
  auto [ours, theirs] = socket_ends();
  const pid_t host = fork();
  if (host == 0) {
    Worker worker(std::move(ours), Descriptor(dup(SharedMemory().descriptor())));
    try {
      _exit(static_cast<int>(worker.call({}, "a test", 0.8).size()));
    } catch (const Error&) {
      _exit(99);
    }
  }
  std::array<char, 64> request{};
  ASSERT_GT(read(theirs.get(), request.data(), request.size()), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // until it waits
  kill(host, SIGSTOP);
  waitpid(host, nullptr, WUNTRACED);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  kill(host, SIGCONT);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  Channel channel(std::move(theirs));
  EXPECT_TRUE(channel.send(1, std::vector<std::byte>(3)));
  int status = 0;
  waitpid(host, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 3);
}

TEST(Wire, a_call_may_take_longer_while_there_are_signs_of_life) {
  for (const bool replies : {true, false}) {
    auto [ours, theirs] = socket_ends();
    std::jthread at_work([replies, end = std::move(theirs)]() mutable {
      Channel channel(std::move(end));
      if (!channel.fill()) return;
      for (int band = 0; band < 6; ++band) {
        std::this_thread::sleep_for(std::chrono::milliseconds(150));
        static_cast<void>(channel.send(1, {}));
      }
      if (replies) static_cast<void>(channel.send(1, std::vector<std::byte>(3)));
      while (channel.fill()) {
      }
    });
    Worker worker(std::move(ours), Descriptor(dup(SharedMemory().descriptor())));  // ends first, and with it the thread
    try {
      EXPECT_EQ(worker.call({}, "a band", 0.7).size(), 3U);
      EXPECT_TRUE(replies);
    } catch (const Error& error) {
      EXPECT_FALSE(replies);
      EXPECT_EQ(error.fault(), Fault::timeout);
      EXPECT_THAT(error.what(), HasSubstr("a band did not end within 0.7 s"));
    }
  }
}

}  // namespace
}  // namespace reliefbench
