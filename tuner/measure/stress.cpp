#include "tuner/measure/stress.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "kernels/base/cache.h"
#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/image/heightmap.h"
#include "kernels/judge/heat_map.h"
#include "tuner/measure/frame.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/session.h"
#include "tuner/measure/stress_check.h"
#include "tuner/plan/plan.h"

namespace reliefbench {
namespace {

constexpr double kFrameTimeout_s = 300;  ///< a software rasteriser takes seconds

class StressRun {
 public:
  StressRun(const Extremes& extremes, const StressOptions& options)
      : extremes_(extremes), options_(options), progress_(options.quiet) {
    for (const std::string& id : options.backends) {
      devices_.push_back(std::make_unique<Device>(find_backend(id), options.device, options.open));
      if (options.simulated) devices_.back()->session.simulate_filter(*options.simulated);
    }
  }

  StressReport all() {
    plan();
    options_.before_drawing();
    const auto total = static_cast<double>(planned_.size());
    for (std::size_t i = 0; i < planned_.size(); ++i) {
      if (options_.is_interrupted()) {
        report_.undone = static_cast<std::int64_t>(planned_.size() - i);
        break;
      }
      const Planned& planned = planned_[i];
      progress_.update(static_cast<double>(i) / total,
                       fmt::format("{} at {}", planned.settings.technique().id, planned.extreme->id));
      run_one(planned);
    }
    progress_.finish();
    for (const auto& device : devices_) {
      const DeviceInfo& info = device->session.device();
      std::string text = fmt::format("{}: {}, {}", info.backend, info.name, info.driver);
      if (options_.simulated) text += fmt::format("; simulated filter: {}", filter_text(*options_.simulated));
      report_.devices.push_back(std::move(text));
    }
    for (auto& [technique, picture] : pictures_) report_.pictures.push_back(std::move(picture));
    report_.wall_s = clock_.total_seconds();
    return std::move(report_);
  }

 private:
  struct Planned {
    const Extreme* extreme;
    Settings settings;
  };
  struct Device {
    Device(const BackendRow& row, int index, const OpenDevice& open)
        : session(row, index, split, {.audits = Audits::none, .open = open, .timeout_s = kFrameTimeout_s}) {}
    WallSplit split;
    Session session;
    const Extreme* extreme = nullptr;  // that `scene` is of
    UploadedScene scene{};
  };

  void plan() {
    std::vector<SettingChange> changes = extremes_.changes;
    if (options_.simulated) changes.emplace_back("filter", "hardware");
    std::set<std::string_view> asked;
    for (const Extreme& extreme : extremes_.list) {
      std::vector<std::pair<std::string, Planned>> here;  // by bake
      for (const Technique& technique : techniques())
        // Others see the upper surface of a solid alone, as if it were a relief: extremes of that are above.
        if (technique.is_of_solids() == is_solid(extreme.scene.heightmap))
          for (Settings& settings : stress_settings(technique, changes, extreme))
            if (options_.filter.empty() || glob_matches(options_.filter, name_of(extreme, settings))) {
              std::string bake = bake_text(settings, extreme.scene);
              here.emplace_back(std::move(bake), Planned{&extreme, std::move(settings)});
            }
      std::ranges::stable_sort(here, {}, &std::pair<std::string, Planned>::first);
      if (!here.empty()) report_.extremes.push_back(extreme);
      for (auto& [bake, planned] : here) {
        asked.insert(planned.settings.technique().id);
        planned_.push_back(std::move(planned));
      }
    }
    if (planned_.empty()) fail_input("stress: the filter '{}' matches nothing", options_.filter);
    for (const Technique& technique : techniques())
      if (asked.contains(technique.id)) report_.techniques.emplace_back(technique.id);
  }

  static std::string_view format_of(const Settings& settings) {
    return settings.technique().reads_map() ? storage_of(settings).format.id : "";
  }

  static std::string name_of(const Extreme& extreme, const Settings& settings) {
    return fmt::format("{}/{}/{}/{}", settings.technique().id, map_of(settings).id, format_of(settings), extreme.id);
  }

  static StressResult blank_of(const Planned& planned) {
    return {.extreme = planned.extreme->id,
            .technique = std::string(planned.settings.technique().id),
            .map = std::string(map_of(planned.settings).id),
            .format = std::string(format_of(planned.settings)),
            .settings = planned.settings.text(),
            .backend = {},
            .guarantee = guarantee_of(planned.settings)};
  }

  std::string reason_to_skip(const Planned& planned) const {
    if (!planned.extreme->is_large) return "";
    if (!options_.is_large) return "large maps are run with --large";
    return map_of(planned.settings).sees_pairs ? "its baker looks at every pair of texels: days at this size" : "";
  }

  void run_one(const Planned& planned) {
    StressResult blank = blank_of(planned);
    blank.skipped = reason_to_skip(planned);
    if (!blank.skipped.empty()) return add(std::move(blank));
    try {
      bake_for(planned);
    } catch (const Error& error) {
      leave_out(error, blank);
      return add(std::move(blank));
    }
    // Drivers compile for longer than they draw, on one thread each.
    std::vector<Drawn> drawn(devices_.size(), Drawn{.result = blank});
    const auto count = static_cast<int>(devices_.size());
    parallel_for(count, options_.draws_at_once ? count : 1, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      draw(planned, *devices_[at], drawn[at]);
    });
    const Scene& scene = planned.extreme->scene.scene;
    const StressFrame* first = nullptr;
    for (auto& [result, frame] : drawn) {
      if (frame) {
        const JudgedFrame judged = check_frame(*frame, planned.settings, *stored_, scene.wrap, result);
        if (first == nullptr) {
          first = &*frame;
        } else {
          compare_frames(*first, *frame, scene.wrap, result);
        }
        keep_worst(result, judged, scene);
      }
      add(std::move(result));
    }
  }

  /// Of the error that is being handled. throws: it again, where it is not of this setting alone
  static void leave_out(const Error& error, StressResult& result) {
    result.is_lost = needs_reopening(error.fault()) || error.fault() == Fault::out_of_memory;
    if (error.code() != Exit::bad_input && !result.is_lost) throw;
    result.skipped = error.what();
  }

  void add(StressResult result) {
    if (!result.holds()) progress_.note(options_.words(result));
    report_.results.push_back(std::move(result));
  }

  /// Reads the heights of an extreme; bakes and stores a setting's map.
  void bake_for(const Planned& planned) {
    const Extreme& extreme = *planned.extreme;
    const Scene& scene = extreme.scene.scene;
    if (extreme_ != &extreme) {
      extreme_ = nullptr;
      heights_ = load_heightmap(extreme.scene.heightmap);
      extreme_ = &extreme;
    }
    stored_ = &recent_.get(fmt::format("{}|{}", extreme.id, bake_text(planned.settings, extreme.scene)), [&] {
      return StoredMap(reliefbench::bake(bake_spec(planned.settings, scene.wrap), heights_), scene.wrap);
    });
    textures_ = pack(planned.settings, stored_->map, scene);
  }

  /// What a device made of a setting: a frame, or in the result why there is none.
  struct Drawn {
    StressResult result;
    std::optional<StressFrame> frame{};
  };

  void draw(const Planned& planned, Device& device, Drawn& drawn) const {
    const Scene& scene = planned.extreme->scene.scene;
    Session& session = device.session;
    StressResult& result = drawn.result;
    result.backend = session.device().backend;
    if (textures_) result.skipped = session.device().refusal(textures_->relief.layout.type);
    if (!result.skipped.empty()) return;
    try {
      if (session.device().software) session.pipelines().drop_old(kMostSoftwarePipelines);
      Backend& backend = session.backend();
      if (device.extreme != planned.extreme) {
        device.extreme = nullptr;
        device.scene = upload(backend, scene, heights_);
        device.extreme = planned.extreme;
      }
      const Frame frame = upload(backend, textures_, device.scene);
      const std::vector<Draw> draws = scored_draws(session, planned.settings, scene, frame.draw);
      drawn.frame.emplace(backend, draws, planned.settings, device.scene.mesh.get());
      const StressFrame again(backend, draws, planned.settings, device.scene.mesh.get());
      if (!drawn.frame->is_same(again)) result.fault(StressCheck::repeatable) = 1;
    } catch (const Error& error) {
      drawn.frame.reset();
      leave_out(error, result);
      if (!result.is_lost) return;
      device.extreme = nullptr;
      device.scene = {};
      if (session.is_lost(error.fault())) session.reopen();
    }
  }

  void keep_worst(const StressResult& result, const JudgedFrame& judged, const Scene& scene) {
    const auto found = pictures_.find(result.technique);
    if (found != pictures_.end() && found->second.result.e_xy_p99 >= result.e_xy_p99) return;
    pictures_[result.technique] = {.technique = result.technique,
                                   .result = result,
                                   .rgba8 = heat_map(judged.pixels, scene.width_px, scene.height_px),
                                   .width = scene.width_px,
                                   .height = scene.height_px};
  }

  const Extremes& extremes_;
  const StressOptions& options_;
  WallSplit clock_;
  Progress progress_;
  std::vector<std::unique_ptr<Device>> devices_;
  std::vector<Planned> planned_;
  const Extreme* extreme_ = nullptr;  // that heights_ are of
  Heightfield heights_;
  Recent<StoredMap> recent_{1};        // large maps: not two at once
  const StoredMap* stored_ = nullptr;  // of the setting that is drawn
  std::optional<MapTextures> textures_;
  std::map<std::string, StressPicture> pictures_;
  StressReport report_;
};

}  // namespace

bool StressResult::holds() const {
  return !is_lost && std::ranges::all_of(faults, [](std::int64_t pixels_at_fault) { return pixels_at_fault == 0; });
}

bool StressReport::holds() const { return undone == 0 && std::ranges::all_of(results, &StressResult::holds); }

StressReport run_stress(const Extremes& extremes, const StressOptions& options) {
  return StressRun(extremes, options).all();
}

}  // namespace reliefbench
