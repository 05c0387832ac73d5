#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <numeric>
#include <thread>

#include "backends/backend.h"
#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/base/sha256.h"
#include "kernels/judge/reference.h"
#include "kernels/trace/technique.h"

namespace reliefbench {
namespace {

// The fake devices. Device 0 always works; device 1 refuses to compile one technique, so that a case's failure can be
// tested without a broken driver; device 2 lets the time pass that it tells of, so that a sweep's wall time is divided
// as on a GPU.
constexpr int kFailing = 1;
constexpr int kWaiting = 2;
constexpr std::string_view kFailingLabel = "relaxed_cone";

constexpr double kPassNs = 0.5;       ///< a pixel of a technique without steps
constexpr double kStepNs = 0.25;      ///< a pixel and step, before the technique's own factor
constexpr double kLoadStepNs = 0.05;  ///< a pixel and iteration of load.glsl
constexpr double kNoise = 0.01;       ///< largest relative deviation of a batch
constexpr double kWaitingSpeed = 55;  ///< times as fast as the others: 1 ms a frame, the quickstart's mean at 1080p

/// The same in every run and on every machine, evenly spread over [0, 1).
double fraction_of(std::string_view text) {
  const std::string hex = sha256(text).substr(0, 8);
  return static_cast<double>(std::stoul(hex, nullptr, 16)) / 4294967296.0;
}

struct NullTexture final : Texture {
  TextureImage image;
  Wrap wrap = Wrap::repeat;
};

struct NullPipeline final : Pipeline {
  std::string label;
  std::vector<SpecConstant> constants;
  Target target = Target::color;

  [[nodiscard]] double steps() const {
    return std::accumulate(constants.begin(), constants.end(), 0.0, [](double sum, const SpecConstant& constant) {
      return sum + (constant.id >= kFirstOwnConstant ? constant.value : 0);
    });
  }
  [[nodiscard]] double pixel_ns() const {
    if (label == "load") return kLoadStepNs * (constants.empty() ? 0 : constants.front().value);
    return kPassNs + kStepNs * (0.5 + fraction_of(label)) * steps();
  }
};

/// What score frames of one camera on one texture have in common.
struct ExactFrame {
  std::vector<ScorePixel> rays;     ///< of each pixel, t = 0
  std::vector<ReferenceHit> exact;  ///< none where the texture is no map
  FrameUniforms frame{};
  Wrap wrap = Wrap::repeat;
  std::vector<float> heights;

  [[nodiscard]] bool is_of(const FrameUniforms& other, const NullTexture& relief) const {
    return frame == other && wrap == relief.wrap && heights == read_channel(relief.image, 0);
  }
};

ExactFrame exact_frame(const FrameUniforms& frame, const NullTexture& relief) {
  const auto width = static_cast<std::size_t>(frame.sizes[0]);
  const std::size_t count = width * static_cast<std::size_t>(frame.sizes[1]);
  ExactFrame made{.rays = std::vector<ScorePixel>(count),
                  .exact = {},
                  .frame = frame,
                  .wrap = relief.wrap,
                  .heights = read_channel(relief.image, 0)};
  std::vector<TextureRay> rays(count);
  for_each_share(count, [&](std::size_t, std::size_t first, std::size_t size) {
    for (std::size_t i = first; i < first + size; ++i) {
      made.rays[i] = pixel_ray(frame, relief.wrap, static_cast<int>(i % width), static_cast<int>(i / width));
      rays[i] = made.rays[i].ray;
    }
  });
  if (relief.image.width < 2 || relief.image.height < 2) return made;
  const Heightfield heights{.width = relief.image.width, .height = relief.image.height, .texels = made.heights};
  made.exact = ReferenceTracer(heights, relief.wrap).trace(rays);
  return made;
}

/// Hits that come nearer to the exact ones with every step: t = exact * steps / (1 + steps).
void make_up_score(const ExactFrame& frame, double steps, std::vector<ScorePixel>& pixels) {
  pixels.resize(frame.rays.size());
  for_each_share(pixels.size(), [&](std::size_t, std::size_t first, std::size_t size) {
    for (std::size_t i = first; i < first + size; ++i) {
      ScorePixel& pixel = pixels[i] = frame.rays[i];
      if (steps <= 0 || frame.exact.empty() || pixel.status == static_cast<float>(PixelStatus::no_ray)) continue;
      pixel.t = static_cast<float>(frame.exact[i].t_enter * steps / (1 + steps));
      pixel.taps = pixel.steps = static_cast<float>(steps);
    }
  });
}

/// A gradient; the third channel comes nearer to that of the exact picture ("reference") with every step.
void make_up_color(const FrameUniforms& frame, const NullPipeline& pipeline, std::vector<std::uint8_t>& color) {
  const double error = pipeline.label == "reference" ? 0 : 1 / (1 + pipeline.steps());
  const auto code = [](double value) { return static_cast<std::uint8_t>(std::lround(255 * value)); };
  const std::uint8_t blue = code(0.5 + 0.5 * error);
  const int width = frame.sizes[0];
  const int height = frame.sizes[1];
  color.resize(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<std::uint8_t> reds(static_cast<std::size_t>(width));
  for (int x = 0; x < width; ++x) reds[static_cast<std::size_t>(x)] = code(1.0 * x / width);
  parallel_for(height, 0, [&](int y) {
    const std::uint8_t green = code(1.0 * y / height);
    std::uint8_t* pixel = color.data() + 4 * static_cast<std::size_t>(y) * reds.size();
    for (const std::uint8_t red : reds) {
      const std::array<std::uint8_t, 4> rgba{red, green, blue, 255};
      pixel = std::ranges::copy(rgba, pixel).out;
    }
  });
}

struct ColorFrame {
  NullPipeline pipeline;
  FrameUniforms frame;
};

class NullBackend final : public Backend {
 public:
  explicit NullBackend(DeviceInfo device) : device_(std::move(device)) {}

  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

  [[nodiscard]] std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    auto texture = std::make_unique<NullTexture>();
    texture->image = {.width = desc.width,
                      .height = desc.height,
                      .layout = desc.layout,
                      .levels = desc.levels,
                      .texels = {desc.texels.begin(), desc.texels.end()}};
    texture->wrap = desc.wrap;
    return texture;
  }

  [[nodiscard]] std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    if (device_.index == kFailing && desc.label == kFailingLabel)
      fail_environment("null: {} does not compile on this device", desc.label);
    auto pipeline = std::make_unique<NullPipeline>();
    pipeline->label = desc.label;
    pipeline->constants = desc.constants;
    pipeline->target = desc.target;
    return pipeline;
  }

  /// The last draw of a frame is what is seen; each takes its time.
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    if (timer != Timer::fenced_wall) fail_environment("null: there is no timer {}", timer_id(timer));
    double frame_ns = 0;
    for (const Draw& draw : frame) {
      const auto& pipeline = static_cast<const NullPipeline&>(*draw.pipeline);
      if (is_score(pipeline.target))
        draw_score(draw, pipeline.steps());
      else
        color_ = ColorFrame{.pipeline = pipeline, .frame = draw.frame};
      frame_ns += 1.0 * draw.frame.sizes[0] * draw.frame.sizes[1] * pipeline.pixel_ns();
    }
    const double noise = kNoise * (2 * fraction_of(fmt::format("batch {}", batches_++)) - 1);
    const bool waits = device_.index == kWaiting;
    const double wall_ns = frames * frame_ns * (1 + noise) / (waits ? kWaitingSpeed : 1);
    if (waits) std::this_thread::sleep_for(std::chrono::duration<double, std::nano>(wall_ns));
    return {.wall_ns = wall_ns};
  }

  [[nodiscard]] std::span<const std::uint8_t> read(std::string_view attachment) override {
    if (attachment == Target::color.attachments[0].name && color_) {
      make_up_color(color_->frame, color_->pipeline, read_);
      return read_;
    }
    const auto is_output = [&](const Feature& feature) { return feature.value && feature.value->output == attachment; };
    if (std::ranges::any_of(all_features(), is_output) && !score_.empty()) return ones();
    for (std::size_t half = 0; half < 2; ++half)
      if (attachment == Target::score.attachments[half].name && !score_.empty()) return score_attachment(half);
    fail_not_drawn("null", attachment);
  }
  [[nodiscard]] std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    fail_environment("null: no compute, asked for {}", desc.label);
  }
  [[nodiscard]] ComputeResult compute(const ComputeJob& /*job*/) override { fail_environment("null: no compute"); }
  [[nodiscard]] std::vector<std::string> debug_messages() const override { return {}; }

 private:
  void draw_score(const Draw& draw, double steps) {
    const auto& relief = static_cast<const NullTexture&>(texture_of(draw, kReliefMap));
    FrameUniforms frame = draw.frame;
    frame.argument() = 0;  // all passes have the same rays
    if (!exact_ || !exact_->is_of(frame, relief)) exact_ = exact_frame(frame, relief);
    make_up_score(*exact_, steps, score_);
  }

  /// Features of the scene change nothing here: each has the value 1 everywhere.
  [[nodiscard]] std::span<const std::uint8_t> ones() {
    const std::vector<float> values(score_.size(), 1.0F);
    read_.resize(values.size() * sizeof(float));
    std::memcpy(read_.data(), values.data(), read_.size());
    return read_;
  }
  /// One half of every pixel: rays or hits.
  [[nodiscard]] std::span<const std::uint8_t> score_attachment(std::size_t half) {
    constexpr std::size_t kHalf = sizeof(ScorePixel) / 2;
    read_.resize(score_.size() * kHalf);
    const auto* const from = reinterpret_cast<const std::uint8_t*>(score_.data()) + half * kHalf;
    for_each_share(score_.size(), [&](std::size_t, std::size_t first, std::size_t size) {
      for (std::size_t i = first; i < first + size; ++i)
        std::memcpy(read_.data() + i * kHalf, from + i * sizeof(ScorePixel), kHalf);
    });
    return read_;
  }

  DeviceInfo device_;
  std::optional<ExactFrame> exact_;  ///< of the last score frame
  std::vector<ScorePixel> score_;
  std::optional<ColorFrame> color_;  ///< painted only when it is read: most frames are only timed
  std::vector<std::uint8_t> read_;
  std::uint64_t batches_ = 0;  ///< seed of the noise
};

}  // namespace

std::vector<DeviceInfo> null_devices() {
  std::vector<DeviceInfo> devices;
  for (const char* name : {"null", "null, failing", "null, waiting"})
    devices.push_back({.backend = "null",
                       .index = static_cast<int>(devices.size()),
                       .name = name,
                       .vendor = "reliefbench",
                       .type = "other",
                       .driver = "none",
                       .api_version = "none",
                       .software = true,
                       .timers = {Timer::fenced_wall},
                       .blocks = {TexelType::rgtc, TexelType::eac, TexelType::bc7, TexelType::astc}});
  return devices;
}

std::unique_ptr<Backend> open_null(int device_index, const BackendOptions& /*options*/) {
  std::vector<DeviceInfo> devices = null_devices();
  if (device_index < 0 || static_cast<std::size_t>(device_index) >= devices.size())
    fail_environment("null: no device {}, there are {}", device_index, devices.size());
  return std::make_unique<NullBackend>(std::move(devices[static_cast<std::size_t>(device_index)]));
}

}  // namespace reliefbench
