#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "backends/device_state.h"
#include "backends/spirv.h"
#include "kernels/judge/score_pixel.h"
#include "kernels/maps/map_texture.h"
#include "kernels/trace/shader_contract.h"
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
  bool software = false;              ///< a CPU rasteriser
  std::vector<Timer> timers;          ///< that the driver offers; fenced_wall first
  int subtexel_bits = 0;              ///< linear filter's weight precision; 0: not reported by the API
  bool float64 = false;               ///< doubles in shaders
  std::vector<TexelType> blocks{};    ///< that its textures may be of
  bool compiles_in_parallel = false;  ///< Backend::compile may be called on several threads at once
  std::string pci{};                  ///< its address, "0000:65:00.0"; "" where it has none, or nobody tells
  [[nodiscard]] bool takes(TexelType type) const { return refusal(type).empty(); }
  [[nodiscard]] std::string refusal(TexelType type) const;  ///< why it takes no textures of it; "" if it does
};

/// An image that frames are drawn into, named as the fragment shader's output; that output's location is its place in
/// the target's list.
struct Attachment {
  std::string_view name;
  TexelLayout layout;
  bool operator==(const Attachment&) const = default;
};

/// What a frame is drawn into. With depth, nearer fragments win (z from 0 to 1), and every frame starts from depth 1
/// and colors of 0; without, frames start from anything: their draws cover every pixel.
struct Target {
  std::vector<Attachment> attachments;
  bool has_depth = false;   ///< a float32 attachment of the name "depth"
  bool by_compute = false;  ///< a compute shader puts its pixels into images of the attachments' names; no depth then
  bool operator==(const Target&) const = default;

  static const Target color;  ///< the timed frame, RGBA8
  static const Target score;  ///< the score frame, read back as ScorePixel
};
inline const Target Target::color{.attachments = {{"out_color", {.type = TexelType::unorm8, .channels = 4}}}};
inline const Target Target::score{.attachments = {{"out_ray", {.type = TexelType::float32, .channels = 4}},
                                                  {"out_hit", {.type = TexelType::float32, .channels = 4}}}};
/// Target::color, with depth where the scene needs it or a feature has objects beside the relief.
[[nodiscard]] Target color_target(std::span<const PixelFeature> features, bool has_depth);
/// Target::score, with an attachment of one float for each feature of the scene that the frame has.
[[nodiscard]] Target score_target(std::span<const PixelFeature> features, bool has_depth = false);
/// Whether it is Target::score, with or without features.
[[nodiscard]] bool is_score(const Target& target);
inline constexpr Attachment kDepth{.name = "depth", .layout = {.type = TexelType::float32, .channels = 1}};

struct PipelineDesc {
  std::string label;                        ///< for debuggers and the null backend: the technique's id
  std::span<const std::uint32_t> vertex;    ///< SPIR-V in the backend's dialect; of no use to a target by_compute
  std::span<const std::uint32_t> fragment;  ///< of a target by_compute the compute shader
  std::vector<SpecConstant> constants;      ///< ids that a module does not declare are ignored
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
  bool is_from_cache = false;  ///< the driver was given what it had made of it before (PipelineCache)
  double keeping_ns = 0;       ///< of Backend::compile()'s time: what keeping it there took
};
struct Texture {
  virtual ~Texture() = default;
};

/// Textures by the names that the shaders give their samplers (shader_contract.h has ours).
using Textures = std::map<std::string, const Texture*, std::less<>>;

/// One draw of a frame. Every sampler that its shaders read must be among the textures; others do no harm, so that one
/// list serves several pipelines.
struct Draw {
  const Pipeline* pipeline = nullptr;
  Textures textures{};
  FrameUniforms frame{};  ///< the uniform block `Frame`; the first draw's says how large the frame is
  int vertices = 3;       ///< there are no vertex buffers; three make the full-screen triangle; compute has none
};

/// Where a compute shader finds {int first_group_row, int argument}, and from where on the buffers of its pass.
inline constexpr int kDispatchBinding = 0;
inline constexpr int kFirstBufferBinding = 1;

struct ComputeDesc {
  std::string label;                     ///< for messages and debuggers
  std::span<const std::uint32_t> spirv;  ///< in the backend's dialect
  int buffers = 0;                       ///< storage buffers, beside the dispatch's own
};

/// A storage buffer of a compute job.
struct ComputeBuffer {
  std::size_t bytes = 0;                  ///< at least 1
  std::span<const std::byte> contents{};  ///< what it starts with, all of it; empty: nothing that counts
};

/// A compute shader run over a grid of workgroups, after all passes before it. A workgroup's row is
/// first_group_row + gl_WorkGroupID.y.
struct ComputePass {
  std::string_view part;               ///< whose time it is: passes that follow one another may share one
  const Pipeline* pipeline = nullptr;  ///< of compile_compute
  std::vector<int> buffers{};          ///< places in ComputeJob::buffers, as many as the pipeline has
  int groups_x = 1;
  int groups_y = 1;
  int groups_z = 1;
  int argument = 0;
  bool may_be_long = false;  ///< cut into bands of rows where a first small one shows that a watchdog could bark
};

struct ComputeJob {
  std::vector<ComputeBuffer> buffers{};
  std::vector<ComputePass> passes{};
  int result = 0;                       ///< place in `buffers` of what is read back
  std::function<void()> on_progress{};  ///< called after each band of a pass that may be long; null: nobody asks
};

/// Time of a part of a job on the device's own clock.
struct ComputeTime {
  std::string part;
  double ns = 0;
};

struct ComputeResult {
  std::vector<std::byte> bytes;
  std::vector<ComputeTime> times{};  ///< "upload", the passes' parts, "read_back"; none where the device has no clock
  double transport_ns = 0;           ///< of what the call took, the way to another process and back
};

/// Times of a whole batch of frames.
struct BatchTime {
  double wall_ns = 0;                 ///< host, first submit to fence
  std::optional<double> device_ns{};  ///< by the asked timer; none for fenced_wall
};

/// One device. Not thread-safe; everything is synchronous: when a call returns, its work is done.
/// throws: Error(environment) with the API's own words on any failed call, and its Fault where the API has a code for
/// it
class Backend {
 public:
  virtual ~Backend() = default;
  Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;

  /// How long a batch, or a band of a compute job, may take on a device in a process of its own (worker/): then that is
  /// killed, and render() and compute() throw an Error of Fault::timeout. In this process nothing can end what a driver
  /// does.
  void set_render_limit(double seconds) { render_limit_s_ = seconds; }
  /// Whether the device is gone, with all that was made on it: its process has ended.
  [[nodiscard]] bool is_gone() const { return is_gone_; }

  [[nodiscard]] virtual const DeviceInfo& device() const = 0;
  /// Of the device now, as driver and system tell this process: not the one, maybe, that has the device.
  [[nodiscard]] DeviceState state();
  [[nodiscard]] virtual std::unique_ptr<Texture> upload(const TextureDesc& desc) = 0;
  /// throws: Error(environment): also where the shader's outputs are not the target's attachments
  [[nodiscard]] virtual std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) = 0;
  /// Draws a frame `frames` times and waits for the end. frame: its draws in their order, all into the same target
  virtual BatchTime render(std::span<const Draw> frame, int frames, Timer timer) = 0;
  /// The attachment of that name as the last frame that has it left it, rows tightly packed; row 0 is
  /// gl_FragCoord.y = 0.5 on every backend. The bytes are the backend's own, until its next call.
  [[nodiscard]] virtual std::span<const std::uint8_t> read(std::string_view attachment) = 0;
  /// throws: Error(environment): a shader that the device does not take, or no compute at all
  [[nodiscard]] virtual std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) = 0;
  /// Runs the job to its end.
  /// throws: Error(environment): a buffer over the device's limits
  [[nodiscard]] virtual ComputeResult compute(const ComputeJob& job) = 0;
  /// Warnings and errors of the API's debug output (Vulkan validation, GL debug) so far; tests want it empty.
  [[nodiscard]] virtual std::vector<std::string> debug_messages() const = 0;

  /// A frame of one draw.
  BatchTime render(const Draw& draw, int frames, Timer timer) { return render(std::span(&draw, 1), frames, timer); }
  /// The last frame drawn into Target::color, RGBA8. into: what is in it goes, its memory is used again
  void read_color(std::vector<std::uint8_t>& into);
  [[nodiscard]] std::vector<std::uint8_t> read_color();
  /// The last frame drawn into Target::score, likewise.
  void read_score(std::vector<ScorePixel>& into);
  [[nodiscard]] std::vector<ScorePixel> read_score();
  /// What each of the features of the scene made of the pixels of that frame.
  [[nodiscard]] FeatureValues read_values(std::span<const PixelFeature> features);

 protected:
  [[nodiscard]] double render_limit_s() const { return render_limit_s_; }
  void set_gone() { is_gone_ = true; }
  /// Whom state() asks in the system's place.
  void set_state_source(std::function<DeviceState()> source) { state_source_ = std::move(source); }

 private:
  std::atomic<bool> is_gone_ = false;  ///< compile() is called on several threads
  double render_limit_s_ = std::numeric_limits<double>::infinity();
  std::function<DeviceState()> state_source_;  ///< null: nobody has asked yet
};

/// Groups of a compute shader that cover a frame: columns, rows.
[[nodiscard]] std::array<std::uint32_t, 2> groups_of(const ShaderInterface& shader, const FrameUniforms& frame);

// What both APIs ask of a draw, and say in the same words.
/// throws: Error(environment): the draw has no texture for the sampler
[[nodiscard]] const Texture& texture_of(const Draw& draw, std::string_view sampler);
/// Of all its shaders. throws: Error(environment): their outputs are not the target's attachments, in their order
[[nodiscard]] ShaderInterface interface_of(const PipelineDesc& desc);
[[noreturn]] void fail_not_drawn(std::string_view backend, std::string_view attachment);

struct BackendOptions {
  bool debug = false;            ///< Vulkan validation with synchronization checks, GL debug context
  bool keeps_pipelines = false;  ///< in the user's cache; else the driver compiles all of them anew
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
