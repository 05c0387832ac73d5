#include "backends/worker/server.h"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <functional>
#include <mutex>
#include <new>
#include <set>
#include <thread>

#include "backends/backend.h"
#include "backends/worker/protocol.h"

namespace reliefbench {
namespace {

constexpr std::chrono::seconds kLeastBetweenSigns(1);

/// Puts what a call returns into its reply.
using Answer = std::function<void(WireWriter&)>;

template <typename Object>
class Objects {
 public:
  ObjectId add(ObjectId id, std::unique_ptr<Object> object) {
    const std::lock_guard lock(mutex_);
    objects_[id] = std::move(object);
    return id;
  }
  void remove(ObjectId id) {
    const std::lock_guard lock(mutex_);
    objects_.erase(id);
  }
  [[nodiscard]] const Object* at(ObjectId id) const {
    if (id == kNoObject) return nullptr;
    const std::lock_guard lock(mutex_);
    const auto found = objects_.find(id);
    if (found == objects_.end()) fail_environment("a worker has no object {}", id);
    return found->second.get();
  }

 private:
  mutable std::mutex mutex_;
  std::map<ObjectId, std::unique_ptr<Object>> objects_;
};

class Server {
 public:
  Server(Channel& channel, SharedMemory& memory) : channel_(channel), memory_(memory) {}

  void run() {
    do {
      while (std::optional<Packet> packet = channel_.next()) take(std::move(*packet));
    } while (channel_.fill());
    // Nobody waits for them, and what they compile with must not go before.
    if (compilations_ > 0) std::_Exit(EXIT_SUCCESS);
  }

 private:
  void take(Packet packet) {
    WireReader request(packet.message, &memory_);
    const auto call = request.get<Call>();
    for (const ObjectId id : request.get<std::vector<ObjectId>>()) {
      pipelines_.remove(id);
      textures_.remove(id);
    }
    if (call != Call::compile || !backend_ || !backend_->device().compiles_in_parallel)
      return reply(packet.number, &memory_, [&] { return answer(call, request, packet.number); });
    // Pipelines that are asked for at once are compiled at once; what they are made of is not in shared memory.
    ++compilations_;
    std::thread([this, held = std::move(packet)] {
      reply(held.number, nullptr, [&] {
        WireReader own(held.message, nullptr);
        static_cast<void>(own.get<Call>());
        static_cast<void>(own.get<std::vector<ObjectId>>());
        return answer(Call::compile, own, held.number);
      });
      --compilations_;
    }).detach();
  }

  template <typename Work>
  void reply(std::uint64_t number, SharedMemory* bulk, const Work& work) {
    const auto failed = [&](const WireError& error) {
      WireWriter message(nullptr);
      send(number, message(Outcome::failed, error));
    };
    try {
      const Answer put = work();
      if (bulk != nullptr) bulk->clear();
      WireWriter message(bulk);
      message(Outcome::done);
      put(message);
      send(number, message);
    } catch (const Error& error) {
      failed({.code = error.code(), .fault = error.fault(), .text = error.what()});
    } catch (const std::bad_alloc&) {
      failed({.fault = Fault::out_of_memory, .text = "the host's memory is used up"});
    } catch (const std::exception& error) {
      failed({.text = error.what()});
    }
  }

  void send(std::uint64_t number, const WireWriter& message) {
    const std::lock_guard lock(send_mutex_);
    // A host that is gone is noticed where its next request is waited for.
    static_cast<void>(channel_.send(number, message.message()));
  }
  void send_sign_of_life(std::uint64_t number) { send(number, WireWriter(nullptr)); }

  Answer answer(Call call, WireReader& request, std::uint64_t number) {
    switch (call) {
      case Call::list: {
        const auto id = request.get<std::string>();
        request.end();
        return [devices = find_backend(id).devices()](WireWriter& out) { out(devices); };
      }
      case Call::open:
        return open(request);
      case Call::upload: {
        const auto desc = request.get<TextureDesc>();
        request.end();
        return [id = textures_.add(++last_id_, backend().upload(desc))](WireWriter& out) { out(id); };
      }
      case Call::compile: {
        auto desc = request.get<PipelineDesc>();
        request.end();
        for (Attachment& attachment : desc.target.attachments) attachment.name = kept(attachment.name);
        std::unique_ptr<Pipeline> made = backend().compile(desc);
        const bool is_from_cache = made->is_from_cache;
        const double keeping_ns = made->keeping_ns;
        const ObjectId id = pipelines_.add(++last_id_, std::move(made));
        return [=](WireWriter& out) { out(id, is_from_cache, keeping_ns); };
      }
      case Call::compile_compute: {
        const auto desc = request.get<ComputeDesc>();
        request.end();
        return [id = pipelines_.add(++last_id_, backend().compile_compute(desc))](WireWriter& out) { out(id); };
      }
      case Call::render:
        return render(request);
      case Call::read: {
        const auto attachment = request.get<std::string>();
        request.end();
        return [bytes = backend().read(attachment)](WireWriter& out) { out(bytes); };
      }
      case Call::compute:
        return compute(request, number);
      case Call::debug_messages:
        request.end();
        return [messages = backend().debug_messages()](WireWriter& out) { out(messages); };
    }
    fail_environment("a worker has no call {}", static_cast<int>(call));
  }

  Answer open(WireReader& request) {
    std::string id;
    int device = 0;
    BackendOptions options;
    request(id, device, options).end();
    backend_ = find_backend(id).open(device, options);
    return [this](WireWriter& out) { out(backend_->device()); };
  }

  Answer render(WireReader& request) {
    std::vector<WireDraw> wire;
    int frames = 0;
    Timer timer{};
    request(wire, frames, timer).end();
    std::vector<Draw> draws;
    draws.reserve(wire.size());
    for (const WireDraw& one : wire) {
      if (one.frame.size() != 1) fail_environment("a draw of {} frames", one.frame.size());
      Draw& draw = draws.emplace_back(
          Draw{.pipeline = pipelines_.at(one.pipeline), .frame = one.frame.front(), .vertices = one.vertices});
      for (const auto& [name, texture] : one.textures) draw.textures[name] = textures_.at(texture);
    }
    return [time = backend().render(draws, frames, timer)](WireWriter& out) { out(time); };
  }

  Answer compute(WireReader& request, std::uint64_t number) {
    using Clock = std::chrono::steady_clock;
    ComputeJob job;
    std::vector<ObjectId> pipelines;
    request(job.buffers, job.passes, pipelines, job.result).end();
    if (pipelines.size() != job.passes.size())
      fail_environment("a job of {} passes with {} pipelines", job.passes.size(), pipelines.size());
    for (std::size_t i = 0; i < pipelines.size(); ++i) job.passes[i].pipeline = pipelines_.at(pipelines[i]);
    const Clock::time_point start = Clock::now();
    job.on_progress = [this, number, last = start]() mutable {
      if (Clock::now() - last < kLeastBetweenSigns) return;
      last = Clock::now();
      send_sign_of_life(number);
    };
    ComputeResult result = backend().compute(job);
    const std::chrono::duration<double, std::nano> taken = Clock::now() - start;
    return [result = std::move(result), ns = taken.count()](WireWriter& out) {
      out(std::span<const std::byte>(result.bytes), result.times, ns);
    };
  }

  Backend& backend() {
    if (!backend_) fail_environment("a worker without a device");
    return *backend_;
  }

  /// The same name, for as long as this lives: pipelines' targets only look at theirs.
  std::string_view kept(std::string_view name) {
    const std::lock_guard lock(names_mutex_);
    return *names_.emplace(name).first;
  }

  Channel& channel_;
  SharedMemory& memory_;
  std::mutex send_mutex_;
  std::mutex names_mutex_;
  std::set<std::string> names_;
  std::unique_ptr<Backend> backend_;  // outlives what it made
  Objects<Pipeline> pipelines_;
  Objects<Texture> textures_;
  std::atomic<ObjectId> last_id_ = kNoObject;
  std::atomic<int> compilations_ = 0;
};

}  // namespace

void serve(Channel& channel, SharedMemory& memory) { Server(channel, memory).run(); }

}  // namespace reliefbench
