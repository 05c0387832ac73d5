#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/append_file.h"
#include "tuner/results/block_state.h"
#include "tuner/results/case_mark.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// A run's folder as read back. A torn last line of a .jsonl is ignored; any other broken line is an error with its
/// file and line, as is one of over 1 MiB. Of two records of a case (measured again after a failure) the later one
/// counts.
struct Run {  // NOLINT(bugprone-exception-escape): moving a json does not throw
  std::filesystem::path folder;
  nlohmann::json info;                ///< run.json
  std::vector<MeasuredScene> scenes;  ///< run.json's "scenes": those of all records
  std::vector<Record> records;
  std::vector<Sample> samples;            ///< without those of blocks that were held back
  std::map<std::string, int> failures{};  ///< by case id: how many of its lines have a status that may_pass()
  std::vector<BlockState> blocks{};       ///< none of runs before these were kept, and where nothing was told
};
/// throws: Error(bad_input): not a run, other schema, one scene with two keys
[[nodiscard]] Run load_run(const std::filesystem::path& folder);

/// An append-only run folder: a line is with the kernel when append() returns, so it survives this process. One
/// process at a time holds a folder: by the lock of results.jsonl, without which nothing there is looked at.
class RunStore {
 public:
  /// Opens or makes the folder. `identity` is what must not change between start and resume (schema, config hash,
  /// devices with drivers); it is kept as run.json's "identity".
  /// throws: Error(bad_input): unwritable; a run of something else lies there (names the first differing key)
  RunStore(std::filesystem::path folder, const nlohmann::json& identity);

  /// What an earlier, interrupted start left: finished records and all samples.
  [[nodiscard]] const Run& earlier() const { return earlier_; }
  void append(const Record& record);
  void append(const Sample& sample);
  void append(const BlockState& block);
  /// Where the case that is about to be drawn is marked, and in which one an earlier start ended.
  [[nodiscard]] CaseMark& mark() { return *mark_; }
  /// Replaces run.json's content (identity is added).
  void write_info(const nlohmann::json& info);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  void open();

  std::filesystem::path folder_;
  nlohmann::json identity_;
  Run earlier_;
  std::optional<AppendFile> results_;
  std::optional<AppendFile> samples_;
  std::optional<AppendFile> blocks_;  ///< from the first line on
  std::optional<CaseMark> mark_;
};

}  // namespace reliefbench
