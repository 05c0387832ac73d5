#include <cmath>
#include <numeric>

#include "backends/backend.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/judge/reference.h"
#include "kernels/trace/technique.h"

namespace reliefbench {
namespace {

// The fake device. Device 0 always works; device 1 refuses to compile one technique, so that a case's failure can be
// tested without a broken driver.
constexpr std::string_view kFailingLabel = "relaxed_cone";

constexpr double kPassNs = 0.5;       ///< a pixel of a technique without steps
constexpr double kStepNs = 0.25;      ///< a pixel and step, before the technique's own factor
constexpr double kLoadStepNs = 0.05;  ///< a pixel and iteration of load.frag
constexpr double kNoise = 0.01;       ///< largest relative deviation of a batch

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

/// Rays of the frame, and hits that come nearer to the exact ones with every step: t = exact * steps / (1 + steps).
std::vector<ScorePixel> made_up_score(const FrameUniforms& frame, const NullTexture& relief, double steps) {
  std::vector<ScorePixel> pixels;
  std::vector<TextureRay> rays;
  for (int y = 0; y < frame.sizes[1]; ++y)
    for (int x = 0; x < frame.sizes[0]; ++x) {
      pixels.push_back(pixel_ray(frame, relief.wrap, x, y));
      rays.push_back(pixels.back().ray);
    }
  if (steps <= 0 || relief.image.width < 2 || relief.image.height < 2) return pixels;

  const Heightfield heights{
      .width = relief.image.width, .height = relief.image.height, .texels = read_channel(relief.image, 0)};
  const std::vector<ReferenceHit> exact = ReferenceTracer(heights, relief.wrap).trace(rays);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i].status == static_cast<float>(PixelStatus::no_ray)) continue;
    pixels[i].t = static_cast<float>(exact[i].t_enter * steps / (1 + steps));
    pixels[i].taps = pixels[i].steps = static_cast<float>(steps);
  }
  return pixels;
}

/// A gradient; the third channel comes nearer to that of the exact picture ("reference") with every step.
std::vector<std::uint8_t> made_up_color(const FrameUniforms& frame, const NullPipeline& pipeline) {
  const double error = pipeline.label == "reference" ? 0 : 1 / (1 + pipeline.steps());
  std::vector<std::uint8_t> color;
  for (int y = 0; y < frame.sizes[1]; ++y)
    for (int x = 0; x < frame.sizes[0]; ++x)
      for (const double value : {1.0 * x / frame.sizes[0], 1.0 * y / frame.sizes[1], 0.5 + 0.5 * error, 1.0})
        color.push_back(static_cast<std::uint8_t>(std::lround(255 * value)));
  return color;
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
    if (device_.index == 1 && desc.label == kFailingLabel)
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
      if (pipeline.target == Target::score)
        score_ =
            made_up_score(draw.frame, static_cast<const NullTexture&>(texture_of(draw, kReliefMap)), pipeline.steps());
      else
        color_ = ColorFrame{.pipeline = pipeline, .frame = draw.frame};
      frame_ns += 1.0 * draw.frame.sizes[0] * draw.frame.sizes[1] * pipeline.pixel_ns();
    }
    const double noise = kNoise * (2 * fraction_of(fmt::format("batch {}", batches_++)) - 1);
    return {.wall_ns = frames * frame_ns * (1 + noise)};
  }

  [[nodiscard]] std::vector<std::uint8_t> read(std::string_view attachment) override {
    if (attachment == Target::color.attachments[0].name && color_)
      return made_up_color(color_->frame, color_->pipeline);
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
  /// One half of every pixel: rays or hits.
  [[nodiscard]] std::vector<std::uint8_t> score_attachment(std::size_t half) const {
    constexpr std::size_t kHalf = sizeof(ScorePixel) / 2;
    std::vector<std::uint8_t> bytes;
    bytes.reserve(score_.size() * kHalf);
    for (const ScorePixel& pixel : score_) {
      const auto* const begin = reinterpret_cast<const std::uint8_t*>(&pixel) + half * kHalf;
      bytes.insert(bytes.end(), begin, begin + kHalf);
    }
    return bytes;
  }

  DeviceInfo device_;
  std::vector<ScorePixel> score_;
  std::optional<ColorFrame> color_;  ///< painted only when it is read: most frames are only timed
  std::uint64_t batches_ = 0;        ///< seed of the noise
};

}  // namespace

std::vector<DeviceInfo> null_devices() {
  std::vector<DeviceInfo> devices;
  for (const char* name : {"null", "null, failing"})
    devices.push_back({.backend = "null",
                       .index = static_cast<int>(devices.size()),
                       .name = name,
                       .vendor = "reliefbench",
                       .type = "other",
                       .driver = "none",
                       .api_version = "none",
                       .software = true,
                       .timers = {Timer::fenced_wall}});
  return devices;
}

std::unique_ptr<Backend> open_null(int device_index, const BackendOptions& /*options*/) {
  std::vector<DeviceInfo> devices = null_devices();
  if (device_index < 0 || static_cast<std::size_t>(device_index) >= devices.size())
    fail_environment("null: no device {}, there are {}", device_index, devices.size());
  return std::make_unique<NullBackend>(std::move(devices[static_cast<std::size_t>(device_index)]));
}

}  // namespace reliefbench
