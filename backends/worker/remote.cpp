#include "backends/worker/remote.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <utility>

#include "backends/worker/protocol.h"
#include "kernels/base/console.h"

namespace reliefbench {
namespace {

// A driver that is loaded for the first time, or on a busy machine, takes seconds.
constexpr double kOpeningLimit_s = 120;
// What is asked beside frames: times the limit of a batch. A shader may take long.
constexpr double kPatience = 10;
constexpr double kLeastPatience_s = 60;

/// The arguments of a reply that says `done`. throws: the Error that it says else
WireReader opened(std::span<const std::byte> reply, SharedMemory* bulk) {
  WireReader reader(reply, bulk);
  if (reader.get<Outcome>() == Outcome::done) return reader;
  const auto error = reader.get<WireError>();
  throw Error(error.code, error.text, error.fault);
}

/// Ids of objects that are no longer used, freed together with the next request.
class Unused {
 public:
  void add(ObjectId id) {
    const std::lock_guard lock(mutex_);
    ids_.push_back(id);
  }
  [[nodiscard]] std::vector<ObjectId> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(ids_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<ObjectId> ids_;
};

template <typename Base>
struct Remote final : Base {
  Remote(Unused& made_by, ObjectId its_id) : unused(made_by), id(its_id) {}
  ~Remote() override { unused.add(id); }
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;
  Unused& unused;
  ObjectId id;
};

template <typename Base>
ObjectId id_of(const Base* object) {
  return object == nullptr ? kNoObject : static_cast<const Remote<Base>*>(object)->id;
}

class RemoteBackend final : public Backend {
 public:
  RemoteBackend(std::unique_ptr<Worker> worker, const BackendRow& row, int device_index, const BackendOptions& options)
      : worker_(std::move(worker)), name_(row.id) {
    device_ = ask("the opening of the device", kOpeningLimit_s, Call::open, std::string(row.id), device_index, options)
                  .template get<DeviceInfo>();
  }

  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

  [[nodiscard]] std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    return std::make_unique<Remote<Texture>>(
        unused_, ask("the upload of a texture", patience_s(), Call::upload, desc).template get<ObjectId>());
  }

  [[nodiscard]] std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    // On several threads at once: without the shared memory, of which there is one, and without frees.
    WireWriter request(nullptr);
    request(Call::compile, std::vector<ObjectId>{}, desc);
    const std::vector<std::byte> reply = call(request, fmt::format("the shaders of {}", desc.label), patience_s());
    WireReader made = opened(reply, nullptr);
    auto pipeline = std::make_unique<Remote<Pipeline>>(unused_, made.get<ObjectId>());
    made(pipeline->is_from_cache, pipeline->keeping_ns).end();
    return pipeline;
  }

  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    std::vector<WireDraw> wire;
    wire.reserve(frame.size());
    for (const Draw& draw : frame) {
      WireDraw& one = wire.emplace_back(WireDraw{.pipeline = id_of(draw.pipeline),
                                                 .textures = {},
                                                 .frame = std::span(&draw.frame, 1),
                                                 .vertices = draw.vertices});
      for (const auto& [name, texture] : draw.textures) one.textures.emplace_back(name, id_of(texture));
    }
    return ask("the frames", render_limit_s(), Call::render, wire, frames, timer).template get<BatchTime>();
  }

  [[nodiscard]] std::span<const std::uint8_t> read(std::string_view attachment) override {
    const auto bytes =
        ask("the reading of a frame", patience_s(), Call::read, attachment).get<std::span<const std::byte>>();
    return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
  }

  [[nodiscard]] std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    return std::make_unique<Remote<Pipeline>>(
        unused_, ask(fmt::format("the shader {}", desc.label), patience_s(), Call::compile_compute, desc)
                     .template get<ObjectId>());
  }

  [[nodiscard]] ComputeResult compute(const ComputeJob& job) override {
    std::vector<ObjectId> pipelines;
    pipelines.reserve(job.passes.size());
    for (const ComputePass& pass : job.passes) pipelines.push_back(id_of(pass.pipeline));
    const auto start = std::chrono::steady_clock::now();
    WireReader reply = ask("a band of the compute job", render_limit_s(), Call::compute, job.buffers, job.passes,
                           pipelines, job.result);
    std::span<const std::byte> bytes;
    ComputeResult result;
    double taken_ns = 0;
    reply(bytes, result.times, taken_ns).end();
    result.bytes.assign(bytes.begin(), bytes.end());
    const std::chrono::duration<double, std::nano> whole = std::chrono::steady_clock::now() - start;
    result.transport_ns = std::max(whole.count() - taken_ns, 0.0);
    return result;
  }

  [[nodiscard]] std::vector<std::string> debug_messages() const override {
    WireWriter request(nullptr);
    request(Call::debug_messages, std::vector<ObjectId>{});
    const std::vector<std::byte> reply = worker_->call(request.message(), name_, kOpeningLimit_s);
    return opened(reply, nullptr).get<std::vector<std::string>>();
  }

 private:
  [[nodiscard]] double patience_s() const { return std::max(kPatience * render_limit_s(), kLeastPatience_s); }

  /// For the calls that come one at a time. The reply is valid until the next one.
  template <typename... Arguments>
  WireReader ask(const std::string& what, double limit_s, Call of, const Arguments&... arguments) {
    worker_->memory().clear();
    WireWriter request(&worker_->memory());
    request(of, unused_.take(), arguments...);
    reply_ = call(request, what, limit_s);
    try {
      return opened(reply_, &worker_->memory());
    } catch (const Error& error) {
      if (error.fault() != Fault::device_lost && error.fault() != Fault::out_of_memory) throw;
      throw Error(error.code(), error.what() + worker_->last_words(), error.fault());
    }
  }

  std::vector<std::byte> call(const WireWriter& request, const std::string& what, double limit_s) {
    try {
      return worker_->call(request.message(), fmt::format("{}: {}", name_, what), limit_s);
    } catch (const Error&) {
      if (worker_->is_dead()) set_gone();
      throw;
    }
  }

  std::unique_ptr<Worker> worker_;
  std::string name_;
  DeviceInfo device_;
  Unused unused_;
  std::vector<std::byte> reply_;
};

bool is_in_process(const BackendRow& row) {
  const char* const given = std::getenv(kInProcess);
  const std::string_view value = given == nullptr ? "" : given;
  return !row.real || (!value.empty() && value != "0");
}

std::unique_ptr<Backend> opened_with(const BackendOptions& options, const BackendRow& row, int device_index) {
  if (is_in_process(row)) return row.open(device_index, options);
  return open_remote(std::make_unique<Worker>(), row, device_index, options);
}

std::vector<DeviceInfo> listed(const BackendRow& row) {
  Worker worker;
  WireWriter request(nullptr);
  request(Call::list, std::vector<ObjectId>{}, row.id);
  const std::vector<std::byte> reply =
      worker.call(request.message(), fmt::format("{}: the list of devices", row.id), kOpeningLimit_s);
  return opened(reply, nullptr).get<std::vector<DeviceInfo>>();
}

}  // namespace

std::unique_ptr<Backend> open_remote(std::unique_ptr<Worker> worker, const BackendRow& row, int device_index,
                                     const BackendOptions& options) {
  return std::make_unique<RemoteBackend>(std::move(worker), row, device_index, options);
}

std::unique_ptr<Backend> open_isolated(const BackendRow& row, int device_index) {
  return opened_with({.keeps_pipelines = true}, row, device_index);
}

std::unique_ptr<Backend> open_isolated_uncached(const BackendRow& row, int device_index) {
  return opened_with({}, row, device_index);
}

std::vector<DeviceInfo> isolated_devices(const BackendRow& row) {
  if (is_in_process(row)) return row.devices();
  for (bool is_again = false;; is_again = true) {
    try {
      return listed(row);
    } catch (const Error& error) {
      if (!is_again && error.fault() == Fault::device_lost) continue;
      print_error(error.what());
      return {};
    }
  }
}

}  // namespace reliefbench
