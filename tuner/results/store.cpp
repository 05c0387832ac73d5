#include "tuner/results/store.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "kernels/base/atomic_file.h"
#include "kernels/base/file_error.h"
#include "kernels/base/json_file.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/json_text.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"
#include "tuner/results/run_shape.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// One line of JSON. Bytes that are no UTF-8 (a driver's strings) are replaced, not refused.
std::string line_of(const json& j) { return json_text(j, -1); }

json parse(std::string_view text, const fs::path& path, int line) {
  try {
    return json::parse(text);
  } catch (const json::exception&) {
    fail_input("{}:{}: not JSON: {}", path.string(), line, text.substr(0, 60));
  }
}

/// The lines of a .jsonl file; what follows the last newline is a torn line and left out. A missing file has none.
/// take: is given each line
template <typename Line>
void read_json_lines(const fs::path& path, const std::function<void(Line)>& take) {
  if (!fs::exists(path)) return;
  int number = 0;
  read_lines(path, kMostLineBytes, [&](std::string_view text) {
    ++number;
    if (text.size() > kMostLineBytes)
      fail_input("{}:{}: a line of over {} bytes, expected one record", path.string(), number, kMostLineBytes);
    const json j = parse(text, path, number);
    try {
      take(j.get<Line>());
    } catch (const Error& error) {
      fail_input("{}:{}: {}", path.string(), number, error.what());
    }
  });
}

template <typename Line>
std::vector<Line> lines_of(const fs::path& path) {
  std::vector<Line> lines;
  read_json_lines<Line>(path, [&](Line line) { lines.push_back(std::move(line)); });
  return lines;
}

/// Those of a case share its id.
std::vector<Sample> samples_of(const fs::path& path) {
  std::vector<Sample> samples;
  std::unordered_map<std::string_view, SharedName> ids;
  read_json_lines<Sample>(path, [&](Sample sample) {
    sample.case_id = ids.try_emplace(sample.case_id.text(), sample.case_id).first->second;
    samples.push_back(std::move(sample));
  });
  return samples;
}

/// A case that was measured again after a failure has two lines; the later one counts, in the place of the first.
std::vector<Record> latest_of_each_case(std::vector<Record> records) {
  std::vector<Record> latest;
  std::unordered_map<std::string, std::size_t> place;
  for (Record& record : records) {
    const auto [found, is_new] = place.try_emplace(record.case_id, latest.size());
    if (is_new)
      latest.push_back(std::move(record));
    else
      latest[found->second] = std::move(record);
  }
  return latest;
}

json read_info(const fs::path& path) {
  json info = read_json(path);
  if (!info.is_object() || !info.contains("identity") || !info["identity"].is_object())
    fail_input("{}: key 'identity' is missing: not a run of reliefbench", path.string());
  check_run_shape(info, path);
  return info;
}

void check_schema(const json& identity, const fs::path& path) {
  const auto schema = identity.find("schema");
  if (schema == identity.end() || *schema != kSchemaVersion)
    fail_input("{}: key 'identity.schema': is {}, this reliefbench reads {}; measure it anew, in another folder",
               path.string(), schema == identity.end() ? "missing" : line_of(*schema), kSchemaVersion);
}

/// In a run, a scene's name says what it is.
void check_keys(const Run& run) {
  std::unordered_map<std::string, const SceneKey*> keys;
  for (const MeasuredScene& scene : run.scenes) keys.try_emplace(scene.spec.id, &scene.key);
  for (const Record& record : run.records) {
    const SceneKey& known = *keys.try_emplace(record.scene, &record.scene_key).first->second;
    if (known != record.scene_key)
      fail_input("{}: two scenes are called '{}': {}, and that of case '{}', {}", run.folder.string(), record.scene,
                 known.short_text(), record.case_id, record.scene_key.short_text());
  }
}

struct Difference {
  std::string key;  ///< "devices[0].driver"
  std::string before;
  std::string now;
};

json member_or_null(const json& object, const std::string& key) {
  const auto found = object.find(key);
  return found == object.end() ? json(nullptr) : *found;
}

/// The first key, in alphabetical order, whose values differ.
std::optional<Difference> first_difference(const json& before, const json& now, const std::string& key = "") {
  if (before == now) return std::nullopt;
  if (before.is_object() && now.is_object()) {
    json keys = before;
    keys.update(now);
    for (const auto& item : keys.items()) {
      const std::string path = key.empty() ? item.key() : key + "." + item.key();
      auto difference = first_difference(member_or_null(before, item.key()), member_or_null(now, item.key()), path);
      if (difference) return difference;
    }
  }
  if (before.is_array() && now.is_array() && before.size() == now.size())
    for (std::size_t i = 0; i < before.size(); ++i)
      if (auto difference = first_difference(before[i], now[i], fmt::format("{}[{}]", key, i))) return difference;
  return Difference{.key = key, .before = line_of(before), .now = line_of(now)};
}

void check_same_identity(const json& before, const json& now, const fs::path& folder) {
  if (const auto difference = first_difference(before, now))
    fail_input("{}: holds another run: its '{}' is {}, now it is {}; choose another folder to start anew",
               folder.string(), difference->key, difference->before, difference->now);
}

/// Makes the folder and those on the way to it.
/// returns: what this call made, innermost first. throws: FileError
std::vector<fs::path> make_folders(const fs::path& folder) {
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path path = fs::absolute(folder).lexically_normal(); !fs::exists(path, error) && path.has_relative_path();
       path = path.parent_path())
    if (path.has_filename()) missing.push_back(path);  // "a/b/" has an empty last part
  std::vector<fs::path> made;
  while (!missing.empty()) {
    if (fs::create_directory(missing.back(), error)) made.insert(made.begin(), missing.back());
    if (error) fail_file(folder, "cannot be made", error.value());
    missing.pop_back();
  }
  return made;
}

std::map<std::string, int> count_failures(const std::vector<Record>& records) {
  std::map<std::string, int> failures;
  for (const Record& record : records)
    if (may_pass(record.status)) ++failures[record.case_id];
  return failures;
}

}  // namespace

Run load_run(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / kRunFile, error))
    fail_input("{}: is not a run folder: it has no {}", folder.string(), kRunFile);
  Run run{.folder = folder, .info = read_info(folder / kRunFile), .scenes = {}, .records = {}, .samples = {}};
  check_schema(run.info["identity"], folder / kRunFile);
  try {
    run.scenes = parse_scenes(member_or_null(run.info, "scenes"));
  } catch (const Error& bad) {
    fail_input("{}: key 'scenes': {}", (folder / kRunFile).string(), bad.what());
  }
  run.records = lines_of<Record>(folder / kResultsFile);
  run.failures = count_failures(run.records);
  run.records = latest_of_each_case(std::move(run.records));
  run.samples = samples_of(folder / kSamplesFile);
  run.blocks = lines_of<BlockState>(folder / kBlocksFile);
  keep_counting(run.samples, run.blocks);
  check_keys(run);
  return run;
}

RunStore::RunStore(fs::path folder, const json& identity) : folder_(std::move(folder)), identity_(identity) {
  const std::vector<fs::path> made = make_folders(folder_);
  try {
    open();
  } catch (const Error&) {  // what this process made goes; without the lock it made no more than folders
    mark_.reset();
    if (samples_) samples_->remove_if_made();
    if (results_) results_->remove_if_made();
    std::error_code not_empty;
    for (const fs::path& one : made) fs::remove(one, not_empty);
    throw;
  }
}

void RunStore::open() {
  earlier_.folder = folder_;
  results_.emplace(folder_ / kResultsFile);
  const FolderState state = folder_state(folder_);
  if (state == FolderState::run) {
    const json before = read_info(folder_ / kRunFile)["identity"];
    check_schema(before, folder_ / kRunFile);
    check_same_identity(before, identity_, folder_);
  }
  samples_.emplace(folder_ / kSamplesFile);
  mark_.emplace(folder_ / kMarkFile);
  remove_stale_run_files(folder_);
  if (state == FolderState::fresh) return write_info(json::object());
  results_->cut_torn_line();
  samples_->cut_torn_line();
  if (std::error_code none; fs::exists(folder_ / kBlocksFile, none))
    blocks_.emplace(folder_ / kBlocksFile).cut_torn_line();
  earlier_ = load_run(folder_);
}

void RunStore::append(const Record& record) { results_->append(line_of(record)); }

void RunStore::append(const Sample& sample) { samples_->append(line_of(sample)); }

void RunStore::append(const BlockState& block) {
  if (!blocks_) blocks_.emplace(folder_ / kBlocksFile);
  blocks_->append(line_of(block));
}

void RunStore::write_info(const json& info) {
  json whole = info;
  whole["identity"] = identity_;
  write_atomically(folder_ / kRunFile, json_text(whole, 1) + "\n");
}

}  // namespace reliefbench
