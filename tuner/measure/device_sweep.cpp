#include "tuner/measure/device_sweep.h"

#include <algorithm>
#include <exception>
#include <random>
#include <string>
#include <utility>

#include "tuner/measure/draw_block.h"
#include "tuner/measure/pictures.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {
namespace {

constexpr double kPrepareShare = 0.7;  // of a block's time, for the progress bar

const SceneSpec& scene_of(const Config& config, const Case& c) {
  return *std::find_if(config.scenes.begin(), config.scenes.end(),
                       [&](const SceneSpec& s) { return s.id == c.scene_id; });
}

/// Fills in the record's time from its samples. Where the device was held back, those of the block are forgotten, and
/// only a case that an earlier start had drawn all of has them.
void set_frame_time(Record& record, const SampleBook& book, const Calibration& calibration, int samples,
                    const std::string& held_back) {
  if (!held_back.empty() && book.samples(record.case_id).size() < static_cast<std::size_t>(samples)) {
    record.status = Status::throttled;
    record.reason = held_back;
    return;
  }
  record.frame_time = frame_time(book.samples(record.case_id), book.control_samples(), calibration.reference_ns,
                                 timer_id(calibration.timer));
}

}  // namespace

DeviceSweep::DeviceSweep(Session& session, const RunParts& parts, RecordBook& book, std::filesystem::path folder,
                         DeviceBakes device_bakes)
    : config_(parts.config),
      split_(parts.split),
      session_(session),
      store_(parts.store),
      book_(book),
      folder_(std::move(folder)),
      is_compiled_alone_(store_.mark().death() || !store_.earlier().failures.empty()),
      run_(session, parts) {
  if (wants_bakes(device_bakes, session.device()))
    bake_times_.emplace(session, parts.library, split_, store_.earlier().records);
}

void DeviceSweep::run(const std::vector<Block>& blocks, const std::function<void(double)>& on_progress) {
  std::size_t done = 0;
  for (const Block& block : blocks) {
    run_block(block, [&](double fraction) {
      on_progress(static_cast<double>(done) + fraction * static_cast<double>(block.size()));
    });
    done += block.size();
  }
}

void DeviceSweep::draw_pictures(const std::set<const Record*>& pictured, const Plan& plan, Progress& progress) {
  write_pictures({.session = session_,
                  .preparer = run_.preparer,
                  .split = split_,
                  .mark = store_.mark(),
                  .folder = folder_,
                  .progress = progress},
                 pictured, plan.cases, config_.scenes);
}

void DeviceSweep::run_block(const Block& block, const std::function<void(double)>& on_progress) {
  if (session_.device().software) session_.pipelines().drop_old(kMostSoftwarePipelines);
  compile_ahead(block);
  std::vector<PreparedCase> prepared;
  prepared.reserve(block.size());
  for (const Case* c : block) {
    const auto hold = store_.mark().hold(c->id());
    prepared.push_back(run_.preparer.prepare(*c, scene_of(config_, *c)));
    if (session_.is_lost(prepared.back().record.status)) reopen(prepared);
    on_progress(kPrepareShare * static_cast<double>(prepared.size()) / static_cast<double>(block.size()));
  }
  const std::string held_back = draw_block(run_.timing, [&] {
    sample(prepared, [&](double fraction) { on_progress(kPrepareShare + (1 - kPrepareShare) * fraction); });
  });
  for (PreparedCase& one : prepared)
    if (one.record.status == Status::ok)
      set_frame_time(one.record, run_.samples, session_.calibration(), config_.measure.samples, held_back);
  std::exception_ptr gone;
  try {
    bake_on_device(prepared);
  } catch (const Error&) {  // the device is: all ends here, but what was measured of the block is kept
    gone = std::current_exception();
  }
  for (const PreparedCase& one : prepared) book_.append(one.record);
  if (gone) std::rethrow_exception(gone);
}

void DeviceSweep::bake_on_device(std::vector<PreparedCase>& block) {
  if (!bake_times_) return;
  const auto release = [&] {
    for (PreparedCase& one : block) one.release();
    run_.preparer.release();
  };
  const std::optional<CaseMark::Death>& death = store_.mark().death();
  for (PreparedCase& one : block) {
    if (one.record.status != Status::ok || !has_device_bake(one.spec->settings)) continue;
    const bool is_suspect = death && death->case_id == one.record.case_id;
    const auto hold = store_.mark().hold(one.record.case_id);
    one.record.device_bake_ns =
        bake_times_->time_of(one.record, one.spec->settings, scene_of(config_, *one.spec), !is_suspect, release);
  }
}

void DeviceSweep::compile_ahead(const Block& block) {
  if (session_.device().software || is_compiled_alone_) return;
  std::vector<PipelineSource> wanted;
  for (const Case* c : block) {
    const Scene& scene = scene_of(config_, *c).scene;
    for (const Target& target : {shade_target(c->settings, scene), Target::score})
      wanted.push_back(session_.source_of(c->settings, target, scene));
  }
  const auto hold = store_.mark().hold(block.front()->id());
  session_.pipelines().compile_ahead(wanted);
  if (!session_.backend().is_gone()) return;
  is_compiled_alone_ = true;
  run_.preparer.release();
  session_.reopen();
}

void DeviceSweep::sample(std::vector<PreparedCase>& block, const std::function<void(double)>& on_progress) {
  for (int lost_by_control = 0;;) {
    make_drawable(block);
    try {
      time_block(block, on_progress);
      return;
    } catch (const CaseFailed& failed) {
      const auto owner = std::ranges::find_if(
          block, [&](const PreparedCase& one) { return one.record.case_id == failed.record.case_id; });
      owner->record = failed.record;
      owner->release();
      if (session_.is_lost(failed.record.status)) reopen(block);
    } catch (const Error& error) {
      if (!session_.helps_reopening(error.fault()) || ++lost_by_control > kMostLostByControl) throw;  // no case's fault
      reopen(block);
    }
  }
}

void DeviceSweep::time_block(const std::vector<PreparedCase>& block, const std::function<void(double)>& on_progress) {
  const auto wants_more = [&](const Record& record) {
    return static_cast<int>(run_.samples.samples(record.case_id).size()) < config_.measure.samples;
  };
  std::vector<TimedCase> cases;
  for (const PreparedCase& one : block)
    if (one.record.status == Status::ok && wants_more(one.record))
      cases.push_back(warm_up(run_.timing, one.record, one.draws));
  std::mt19937_64 random(config_.seed ^ std::hash<std::string>{}(block.front().record.case_id));
  for (int round = 1; !cases.empty(); ++round) {
    std::vector<TimedCase> order = cases;
    std::shuffle(order.begin(), order.end(), random);
    time(run_.timing, order);
    std::erase_if(cases, [&](const TimedCase& one) { return !wants_more(*one.record); });
    on_progress(static_cast<double>(round) / config_.measure.samples);
  }
}

void DeviceSweep::reopen(std::vector<PreparedCase>& block) {
  for (PreparedCase& one : block) one.release();
  run_.preparer.release();
  try {
    session_.reopen();
  } catch (const Error&) {  // all ends here; the next start draws last what brought this one to its end
    for (const PreparedCase& one : block)
      if (one.record.status != Status::ok) book_.append(one.record);
    throw;
  }
}

void DeviceSweep::make_drawable(std::vector<PreparedCase>& block) {
  for (std::size_t i = 0; i < block.size();) {
    PreparedCase& one = block[i++];
    if (one.record.status != Status::ok || !one.draws.empty()) continue;
    PreparedCase again = run_.preparer.prepare_to_time(*one.spec, scene_of(config_, *one.spec));
    one.frame = std::move(again.frame);
    one.draws = std::move(again.draws);
    one.record.status = again.record.status;
    one.record.reason = again.record.reason;
    if (again.record.status == Status::ok || !session_.is_lost(again.record.status)) continue;
    reopen(block);
    i = 0;
  }
}

}  // namespace reliefbench
