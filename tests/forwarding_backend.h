#pragma once
#include <memory>
#include <type_traits>
#include <utility>

#include "backends/backend.h"
#include "kernels/base/error.h"

namespace reliefbench {

/// A device that is another one, but for what a test overrides. Where that one is gone, so is this.
class ForwardingBackend : public Backend {
 public:
  explicit ForwardingBackend(std::unique_ptr<Backend> inner) : inner_(std::move(inner)), info_(inner_->device()) {}
  const DeviceInfo& device() const override { return info_; }
  std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    return told([&] { return inner_->upload(desc); });
  }
  std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    return told([&] { return inner_->compile(desc); });
  }
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    inner_->set_render_limit(render_limit_s());
    return told([&] { return inner_->render(frame, frames, timer); });
  }
  std::span<const std::uint8_t> read(std::string_view attachment) override {
    return told([&] { return inner_->read(attachment); });
  }
  std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    return told([&] { return inner_->compile_compute(desc); });
  }
  ComputeResult compute(const ComputeJob& job) override {
    return told([&] { return inner_->compute(job); });
  }
  std::vector<std::string> debug_messages() const override { return inner_->debug_messages(); }

 protected:
  std::unique_ptr<Backend> inner_;
  DeviceInfo info_;  ///< what this one says of itself

 private:
  template <typename Work>
  std::invoke_result_t<Work> told(const Work& work) {
    try {
      return work();
    } catch (const Error&) {
      if (inner_->is_gone()) set_gone();
      throw;
    }
  }
};

}  // namespace reliefbench
