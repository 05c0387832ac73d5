#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/judge/score_pixel.h"
#include "kernels/maps/map_texture.h"
#include "kernels/trace/view.h"

namespace reliefbench {

/// SPIR-V dialects of one GLSL source.
enum class Dialect { vulkan, opengl };

/// What can measure a batch of frames. `fenced_wall` is the host clock from first submit to the fence; it is always
/// there. The others are the device's own and are audited before they are believed (timer_audit.h).
enum class Timer {
  fenced_wall,
  gl_time_elapsed,  ///< GL_TIME_ELAPSED round the draws
  gl_timestamp,     ///< GL_TIMESTAMP pairs with a flush on both sides
  vk_timestamp,     ///< vkCmdWriteTimestamp outside the rendering, full barriers on both sides
};
[[nodiscard]] std::string_view timer_id(Timer timer);

struct DeviceInfo {
  std::string backend;  ///< opengl | vulkan | null
  int index = 0;        ///< within the backend, as --device takes it
  std::string name;
  std::string vendor;
  std::string type;    ///< cpu | integrated | discrete | virtual | other
  std::string driver;  ///< name and version
  std::string api_version;
  bool software = false;      ///< a CPU rasteriser
  std::vector<Timer> timers;  ///< that the driver offers; fenced_wall first
  int subtexel_bits = 0;      ///< linear filter's weight precision; 0: not reported by the API
  bool float64 = false;       ///< doubles in shaders
};

struct SpecConstant {
  std::uint32_t id;
  std::int32_t value;
};

enum class Target {
  color,  ///< one RGBA8 attachment
  score,  ///< two RGBA32F attachments, read back as ScorePixel
};

struct PipelineDesc {
  std::string label;                      ///< for debuggers and the null backend: the technique's id
  std::span<const std::uint32_t> vertex;  ///< SPIR-V in the backend's dialect
  std::span<const std::uint32_t> fragment;
  std::vector<SpecConstant> constants;  ///< ids that a module does not declare are ignored
  Target target = Target::color;
};

enum class Filter { nearest, linear };  // within a level; levels are never mixed

struct TextureDesc {
  int width = 0;
  int height = 0;
  TexelLayout layout{};
  int levels = 1;  ///< mip levels, one after the other in texels (level_side)
  std::span<const std::byte> texels;
  Wrap wrap = Wrap::repeat;
  Filter filter = Filter::linear;
};

[[nodiscard]] std::size_t level_bytes(const TextureDesc& desc, int level);
[[nodiscard]] std::size_t texture_bytes(const TextureDesc& desc);  ///< of all levels
/// One of a map's textures.
[[nodiscard]] TextureDesc texture_desc(const TextureImage& image, Wrap wrap);

/// A GPU object; freed on destruction. Must not outlive its backend.
struct Pipeline {
  virtual ~Pipeline() = default;
};
struct Texture {
  virtual ~Texture() = default;
};

/// Binding slots of the shaders, shared with platform.glsl.
inline constexpr int kFrameBinding = 0;      ///< FrameUniforms
inline constexpr int kReliefBinding = 1;     ///< height and cone ratio
inline constexpr int kNormalBinding = 2;     ///< RGBA8
inline constexpr int kReferenceBinding = 3;  ///< R32F, frame-sized reference t
inline constexpr int kExtraBinding = 4;      ///< what a relief map keeps apart: ratios, pyramid or volume

/// One full-screen frame. All textures must be set (any texture where unused).
struct Draw {
  const Pipeline* pipeline = nullptr;
  const Texture* relief = nullptr;
  const Texture* normals = nullptr;
  const Texture* reference = nullptr;
  const Texture* extra = nullptr;
  FrameUniforms frame{};
};

/// Storage buffers of a compute shader; its inputs follow one another from kFirstInputBinding on.
inline constexpr int kOutputBinding = 0;
inline constexpr int kBandBinding = 1;  ///< int: row of workgroups that this dispatch starts at
inline constexpr int kFirstInputBinding = 2;

struct ComputeDesc {
  std::string label;                     ///< for messages and debuggers
  std::span<const std::uint32_t> spirv;  ///< in the backend's dialect
  int inputs = 0;                        ///< storage buffers that it reads
};

/// A compute shader run over a grid of workgroups. It runs as many dispatches, each a band of whole rows of workgroups,
/// short enough for any watchdog; so a workgroup's row is the band's first row + gl_WorkGroupID.y.
struct ComputeJob {
  const Pipeline* pipeline = nullptr;                ///< of compile_compute
  std::vector<std::span<const std::byte>> inputs{};  ///< as many as the pipeline reads, none empty
  std::size_t output_bytes = 0;                      ///< at least 1
  int groups_x = 1;
  int groups_y = 1;
};

/// Times of a whole batch of frames.
struct BatchTime {
  double wall_ns = 0;                 ///< host, first submit to fence
  std::optional<double> device_ns{};  ///< by the asked timer; none for fenced_wall
};

/// One device. Not thread-safe; everything is synchronous: when a call returns, its work is done.
/// throws: Error(environment) with the API's own words on any failed call.
class Backend {
 public:
  virtual ~Backend() = default;
  Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;

  [[nodiscard]] virtual const DeviceInfo& device() const = 0;
  [[nodiscard]] virtual std::unique_ptr<Texture> upload(const TextureDesc& desc) = 0;
  [[nodiscard]] virtual std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) = 0;
  /// Draws `frames` times into the pipeline's target (frame.sizes gives its size) and waits for the end.
  virtual BatchTime render(const Draw& draw, int frames, Timer timer) = 0;
  /// The last frame drawn by a Target::score pipeline; row 0 is gl_FragCoord.y = 0.5 on every backend.
  [[nodiscard]] virtual std::vector<ScorePixel> read_score() = 0;
  /// The last frame drawn by a Target::color pipeline, RGBA8, same row order.
  [[nodiscard]] virtual std::vector<std::uint8_t> read_color() = 0;
  /// throws: Error(environment): a shader that the device does not take, or no compute at all
  [[nodiscard]] virtual std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) = 0;
  /// Runs the job to its end; returns the output buffer.
  /// throws: Error(environment): a buffer over the device's limits
  [[nodiscard]] virtual std::vector<std::byte> compute(const ComputeJob& job) = 0;
  /// Warnings and errors of the API's debug output (Vulkan validation, GL debug) so far; tests want it empty.
  [[nodiscard]] virtual std::vector<std::string> debug_messages() const = 0;
};

struct BackendOptions {
  bool debug = false;  ///< Vulkan validation with synchronization checks, GL debug context
};

/// A backend: one row, one factory.
struct BackendRow {
  std::string_view id;  ///< opengl | vulkan | null
  std::string_view description;
  Dialect dialect;
  bool real;                             ///< false: left out of `--backend all`
  std::vector<DeviceInfo> (*devices)();  ///< empty where the API is missing; never throws for that
  /// throws: Error(environment): no device with this index
  std::unique_ptr<Backend> (*open)(int device_index, const BackendOptions& options);
};
[[nodiscard]] std::span<const BackendRow> backends();
[[nodiscard]] const BackendRow& find_backend(std::string_view id);  ///< throws: Error(bad_input) listing the choices

// Factories behind the rows, one file each.
[[nodiscard]] std::vector<DeviceInfo> opengl_devices();
[[nodiscard]] std::unique_ptr<Backend> open_opengl(int device_index, const BackendOptions& options);
[[nodiscard]] std::vector<DeviceInfo> vulkan_devices();
[[nodiscard]] std::unique_ptr<Backend> open_vulkan(int device_index, const BackendOptions& options);
[[nodiscard]] std::vector<DeviceInfo> null_devices();
[[nodiscard]] std::unique_ptr<Backend> open_null(int device_index, const BackendOptions& options);

}  // namespace reliefbench
