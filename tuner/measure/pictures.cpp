#include "tuner/measure/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/image/image.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/recommend.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

// Pictures are encoded together, on all threads, as soon as so many bytes wait.
constexpr std::size_t kMostWaitingBytes = std::size_t{256} << 20U;

/// Where the pictures of a case lie, relative to the run's folder.
struct PictureFiles {
  PictureFiles(const std::string& case_id, std::string_view scene, std::string_view backend)
      : frame(image_path(case_id, "frame")),
        error(image_path(case_id, "error")),
        taps(image_path(case_id, "taps")),
        reference(image_path(reference_image_key(scene, backend, case_id), "frame")) {}

  [[nodiscard]] std::array<fs::path, 4> all() const { return {frame, error, taps, reference}; }

  fs::path frame;
  fs::path error;
  fs::path taps;
  fs::path reference;  ///< of all cases of the scene
};

/// Pictures that are to be written, and which there are.
class PictureFolder {
 public:
  explicit PictureFolder(const PictureWork& work) : work_(work) {}

  [[nodiscard]] bool has(const fs::path& file) const {
    std::error_code unreadable;
    return std::ranges::find(waiting_, file, &Picture::file) != waiting_.end() ||
           fs::exists(work_.folder / file, unreadable);
  }
  void add(const fs::path& file, const SceneSpec& scene, std::vector<std::uint8_t> rgba8) {
    if (has(file)) return;
    bytes_ += rgba8.size();
    waiting_.push_back(
        {.file = file, .width = scene.scene.width_px, .height = scene.scene.height_px, .rgba8 = std::move(rgba8)});
    if (bytes_ >= kMostWaitingBytes) write();
  }
  void write() {
    work_.split.book(Part::pictures, [&] {
      parallel_for(static_cast<int>(waiting_.size()), 0, [&](int i) {
        const Picture& one = waiting_[static_cast<std::size_t>(i)];
        write_png(work_.folder / one.file, one.width, one.height, one.rgba8);
      });
    });
    waiting_.clear();
    bytes_ = 0;
  }

 private:
  struct Picture {
    fs::path file;
    int width;
    int height;
    std::vector<std::uint8_t> rgba8;
  };
  const PictureWork& work_;
  std::vector<Picture> waiting_;
  std::size_t bytes_ = 0;
};

}  // namespace

SceneSpec pictured_scene(const SceneSpec& scene) {
  constexpr int kMostTimes = 4;
  SceneSpec pictured = scene;
  const int least = std::min(scene.scene.width_px, scene.scene.height_px);
  const int times = std::clamp((kPictureSide_px + least - 1) / least, 1, kMostTimes);
  pictured.scene.width_px *= times;
  pictured.scene.height_px *= times;
  return pictured;
}

std::set<const Record*> pictured_records(std::span<const Record> records, const Config& config, Pictured which) {
  std::set<const Record*> pictured;
  if (which == Pictured::none) return pictured;
  if (which == Pictured::all) {
    for (const Record& record : records)
      if (record.status == Status::ok) pictured.insert(&record);
    return pictured;
  }
  for (const Front& front : fronts(records, config.front_error, config.front_constraints))
    for (const FrontPoint& point : front.points) pictured.insert(point.record);
  for (const Answer& answer : recommend(records, {.budgets = config.budgets, .error_metric = config.front_error}))
    for (const Record* record :
         {answer.pick, answer.tie, answer.runner_up, answer.simplest, answer.flat, answer.nearest, answer.just_fails})
      if (record != nullptr) pictured.insert(record);
  return pictured;
}

void remove_other_pictures(const fs::path& folder, const std::set<const Record*>& pictured) {
  std::set<fs::path> kept;
  for (const Record* record : pictured)
    for (fs::path& file : PictureFiles(record->case_id, record->scene, record->backend).all())
      kept.insert(std::move(file));
  remove_other_pictures(folder, kept);
}

void write_pictures(const PictureWork& work, const std::set<const Record*>& pictured, std::span<const Case> cases,
                    std::span<const SceneSpec> scenes) {
  std::set<std::string_view> ids;
  for (const Record* record : pictured) ids.insert(record->case_id);
  PictureFolder folder(work);
  std::vector<const Case*> lacking;
  for (const Case& c : cases) {
    if (c.backend != work.session.device().backend || !ids.contains(c.id())) continue;
    const PictureFiles files(c.id(), c.scene_id, c.backend);
    if (!std::ranges::all_of(files.all(), [&](const fs::path& file) { return folder.has(file); }))
      lacking.push_back(&c);
  }
  for (std::size_t i = 0; i < lacking.size(); ++i) {
    const Case& c = *lacking[i];
    const std::string id = c.id();
    work.progress.update(static_cast<double>(i) / static_cast<double>(lacking.size()),
                         fmt::format("pictures of {} cases on {}", lacking.size(), work.session.device().name));
    const std::string mark = "pictures of " + id;  // not the case's own, which is measured
    if (const auto& death = work.mark.death(); death && death->case_id == mark && death->is_its_fault()) {
      work.progress.note(fmt::format("no {}: the process ended {} times in them", mark, death->times));
      continue;
    }
    const PictureFiles files(id, c.scene_id, c.backend);
    const SceneSpec scene = pictured_scene(*std::ranges::find(scenes, c.scene_id, &SceneSpec::id));
    Record drawn;
    CasePictures pictures;
    try {
      const auto hold = work.mark.hold(mark);
      pictures = work.preparer.pictures(c, scene);
    } catch (...) {
      enter_failure(drawn, Status::unsupported);
      work.progress.note(fmt::format("no pictures of {}: {}", id, drawn.reason));
      if (work.session.is_lost(drawn.status)) {
        work.preparer.release();
        work.session.reopen();
      }
      continue;
    }
    folder.add(files.frame, scene, std::move(pictures.frame));
    folder.add(files.error, scene, std::move(pictures.error));
    folder.add(files.taps, scene, std::move(pictures.taps));
    folder.add(files.reference, scene, std::move(pictures.reference));
  }
  folder.write();
}

}  // namespace reliefbench
