#pragma once
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kernels/judge/score.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// A case that was compiled, drawn once and scored. Where record.status is not ok, there is nothing to time.
struct PreparedCase {
  const Case* spec = nullptr;
  Record record{};
  Frame frame{};
  std::vector<Draw> draws{};  ///< of the timed frame, with their pipelines; they read the frame's textures

  /// Frees what it has on the device; it can't be drawn then.
  void release() {
    draws.clear();
    frame = {};
  }
};

/// A case's record before anything is known of it.
[[nodiscard]] Record blank_record(const Case& c, const SceneKey& scene_key, const DeviceInfo& device);

/// What a case looks like, RGBA8.
struct CasePictures {
  std::vector<std::uint8_t> frame{};      ///< as it is timed
  std::vector<std::uint8_t> error{};      ///< heat_map()
  std::vector<std::uint8_t> taps{};       ///< taps_map()
  std::vector<std::uint8_t> reference{};  ///< the exact hits, shaded
};

/// Brings the cases of one session to the point where only their time is missing.
/// Must not outlive session and library.
class Preparer {
 public:
  struct Context {
    Session& session;
    MapLibrary& library;
    const Cache& cache;
    WallSplit& split;
    double timeout_s;
    int flicker_frames;
    /// Whose exact values reference pictures have; none: those that a case has itself.
    std::optional<std::vector<PixelFeature>> seen_features{};
  };
  explicit Preparer(const Context& context) : context_(context) {}

  /// Never throws for a case's own failure: that becomes its record's status and reason.
  [[nodiscard]] PreparedCase prepare(const Case& c, const SceneSpec& scene);

  /// The same without the error: compiled, uploaded, drawn once.
  [[nodiscard]] PreparedCase prepare_to_time(const Case& c, const SceneSpec& scene);

  /// The error of one case by its score frame alone: without metrics of pictures. Cached by content.
  /// throws: Error: what prepare() would make a status of
  [[nodiscard]] FrameScore score(const Case& c, const SceneSpec& scene);

  /// Draws and traces a case once more, to be looked at. throws: Error: what prepare() would make a status of
  [[nodiscard]] CasePictures pictures(const Case& c, const SceneSpec& scene);

  /// Frees what it has on the device, which is uploaded again when it is needed.
  void release();

  [[nodiscard]] int references_traced() const { return references_traced_; }
  [[nodiscard]] int references_from_cache() const { return references_from_cache_; }

 private:
  /// The exact hits of one scene's rays, and their picture with what some features of the scene make of them.
  struct Reference {
    std::vector<TextureRay> rays;
    std::string features;  ///< text_of() their exact ones
    std::string key;
    std::vector<ReferenceHit> hits;
    FeatureValues values;               ///< exact
    std::vector<std::uint8_t> picture;  ///< shaded, RGBA8
    FlipFeatures seen;                  ///< of the picture
  };
  /// A frame of the moving camera.
  struct MovedFrame {
    FrameUniforms frame{};
    std::vector<std::uint8_t> reference{};  ///< shaded, RGBA8
    PixelScores mask{};                     ///< which pixels have a ray
  };
  struct SceneState {
    UploadedScene uploaded{};
    std::map<std::string, std::vector<MovedFrame>> moved;  ///< by features: flicker_frames of them, once needed
    std::list<Reference> references;  ///< one of each set of features, unless a driver's rays differ
  };
  [[nodiscard]] SceneState& state_of(const SceneSpec& scene);
  [[nodiscard]] SceneKey key_of(const SceneSpec& scene) const;
  /// Readies a case to be drawn and runs `rest` on it; failures become the record's status.
  [[nodiscard]] PreparedCase attempt(const Case& c, const SceneSpec& scene,
                                     const std::function<void(PreparedCase&, SceneState&)>& rest);
  void upload_and_draw(PreparedCase& prepared, const SceneSpec& scene, const SceneState& state, Status& on_failure);
  /// Traces, judges and compares the pictures of a case that was drawn.
  void judge_drawn(PreparedCase& prepared, const SceneSpec& scene, SceneState& state);
  /// Traces into pixels_ and values_.
  void trace(std::span<const Draw> score_frame, std::span<const PixelFeature> features);
  /// What a case's score frame was traced by, into pixels_ and values_, and what it is judged by.
  struct Traced {
    std::vector<Draw> score_frame;
    std::vector<PixelFeature> features;
    const Reference& reference;
  };
  [[nodiscard]] Traced trace_case(const Settings& settings, const SceneSpec& scene, SceneState& state,
                                  const Draw& relief);
  [[nodiscard]] JudgedFrame judge_traced(const Traced& traced, const UploadedScene& scene) const;
  /// What reference pictures have in a scene, of the context's seen features or of all where the scene's are complete;
  /// own: of the case, whose objects are in its frame. None: those that it has itself
  [[nodiscard]] std::optional<std::vector<PixelFeature>> seen_features_in(const Scene& scene,
                                                                          std::span<const PixelFeature> own) const;
  [[nodiscard]] std::string score_key(const Case& c, const SceneSpec& scene);
  /// Of the rays that were traced into pixels_.
  /// score_frame: what traced them
  [[nodiscard]] const Reference& reference_of_traced(std::span<const Draw> score_frame, const SceneSpec& scene,
                                                     SceneState& state, std::span<const PixelFeature> features);
  /// The one whose picture a case's is compared with.
  [[nodiscard]] const Reference& seen_reference(const Traced& traced, const SceneSpec& scene, SceneState& state);
  [[nodiscard]] std::vector<ReferenceHit> hits_of_traced(const SceneSpec& scene, const std::string& key,
                                                         const FrameUniforms& frame);
  /// reference_key: of the hits, which are of pixels_
  [[nodiscard]] FeatureValues values_of_traced(const SceneSpec& scene, const std::string& reference_key,
                                               const std::vector<ReferenceHit>& hits,
                                               std::span<const PixelFeature> features, const FrameUniforms& frame);
  [[nodiscard]] std::string reference_key(const std::string& rays_hash, const SceneSpec& scene,
                                          const FrameUniforms& frame);
  /// The picture of exact hits, and of exact values of features.
  struct Exact {
    const std::vector<ReferenceHit>& hits;
    std::span<const PixelFeature> features;
    const FeatureValues& values;
  };
  /// That picture as the scene wants it: of the pixels' own rays, which `exact` is of, or supersampled.
  [[nodiscard]] std::vector<std::uint8_t> reference_picture(const Exact& exact, std::span<const Draw> score_frame,
                                                            const SceneSpec& scene, const SceneState& state);
  [[nodiscard]] std::vector<std::uint8_t> shade_reference(const Exact& exact, const SceneSpec& scene,
                                                          const SceneState& state, const FrameUniforms& frame);
  [[nodiscard]] MovedFrame moved_frame(const PreparedCase& prepared, const SceneSpec& scene, const SceneState& state,
                                       std::span<const PixelFeature> features, int index);
  /// Over the frames of the moving camera.
  [[nodiscard]] MotionJudge judge_motion(const PreparedCase& prepared, const SceneSpec& scene, SceneState& state);

  Context context_;
  std::map<SceneKey, SceneState> scenes_;
  // Of the case in hand. At millions of pixels fresh memory costs as much as what is done with it.
  std::vector<ScorePixel> pixels_;
  FeatureValues values_;
  std::vector<std::uint8_t> picture_;
  std::vector<std::uint8_t> picture_before_;
  int references_traced_ = 0;
  int references_from_cache_ = 0;
};

}  // namespace reliefbench
