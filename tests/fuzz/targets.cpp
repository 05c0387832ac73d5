// What reads files and texts from outside, each with whatever libFuzzer makes up (./dev fuzz). A target is a row: what
// is wrong with its input must be said by an Error of ours; everything else that is thrown, read or computed is a find.
//   reliefbench_fuzz --target=NAME CORPUS... [-max_total_time=SECONDS ...]
//   reliefbench_fuzz --list        names, and where their first inputs are
#include <fmt/format.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "backends/spirv.h"
#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "kernels/image/ktx2.h"
#include "kernels/mesh/obj.h"
#include "reports/export/shader_pieces.h"
#include "tests/written_tables.h"
#include "tuner/history/google_benchmark.h"
#include "tuner/plan/config.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/preset_file.h"
#include "tuner/plan/scene_file.h"
#include "tuner/plan/setting_space.h"
#include "tuner/plan/shard.h"
#include "tuner/results/case_table.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"
#include "tuner/results/t4.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

void hold(bool is_so, const char* what) {
  if (is_so) return;
  fmt::print(stderr, "{} does not hold\n", what);
  std::abort();
}

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// A folder in memory of this process's own.
const fs::path& work_folder() {
  static const fs::path folder = [] {
    std::string name = "/dev/shm/reliefbench_fuzz_XXXXXX";
    hold(::mkdtemp(name.data()) != nullptr, "a folder in /dev/shm");
    static fs::path made;
    made = name;
    std::atexit([] { fs::remove_all(made); });
    return made;
  }();
  return folder;
}

void write_to(const fs::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

/// A run's folder that is good but for one file; what can be read is written again in all forms.
void read_run_with(std::string_view file, std::string_view text) {
  const fs::path& folder = work_folder();
  static const bool is_made = [&] {
    for (const std::string_view name : {kRunFile, kResultsFile, kSamplesFile})
      fs::copy_file(fs::path(RELIEFBENCH_SOURCE_DIR) / "tests/fuzz/seeds" / name, folder / name);
    return true;
  }();
  static_cast<void>(is_made);
  write_to(folder / file, text);
  const Run run = load_run(folder);
  for (const Record& record : run.records) static_cast<void>(nlohmann::json(record).dump());
  const std::vector<TableRow> table = case_table(run);
  hold(parse_case_table(case_table_csv(table), "again.csv").size() == table.size(), "a table is read as it is written");
  std::ostringstream t4;
  write_t4(run, table, {}, t4);
  hold(nlohmann::json::accept(t4.str()), "T4 is JSON");
}

/// By its first bytes, or where they say nothing by its name.
void read_image(std::string_view text) {
  const fs::path file = work_folder() / "image.tga";
  write_to(file, text);
  const Image image = load_image(file);
  hold(image.pixels.size() ==
           static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * image.channels.size(),
       "an image is whole");
}

void read_budget(std::string_view text) {
  const Budget budget = parse_budget(text);
  hold(parse_budget(budget.text()).limit == budget.limit, "a budget is read as it is written");
}

void read_case(std::string_view text) {
  const Case read = parse_case(text);
  hold(parse_case(read.id()).id() == read.id(), "a case is read as it is written");
}

/// The pattern, a newline, the text.
void match_glob(std::string_view text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view pattern = text.substr(0, end);
  static_cast<void>(glob_matches(pattern, text.substr(end)));
  hold(glob_matches(pattern, pattern), "a pattern matches itself");
}

void reflect_words(std::string_view text) {
  std::vector<std::uint32_t> words(text.size() / sizeof(std::uint32_t));
  if (!words.empty()) std::memcpy(words.data(), text.data(), words.size() * sizeof(std::uint32_t));
  static_cast<void>(reflect(words));
  static_cast<void>(with_plain_names(words));
  static_cast<void>(remainder_widths(words));
}

/// A shader file, cut down to what its function `first_hit` needs.
void cut_shader(std::string_view text) {
  hold(words_of(text_of(pieces_of(text))) == words_of(text), "pieces are the whole text");
  const std::string file = "shader.glsl";
  static_cast<void>(text_of(cut_glsl(
      {.files = {file}, .roots = {"first_hit"}, .constants = {{0, 1}}, .generated = {{file, std::string(text)}}})));
}

struct Target {
  std::string_view name;
  std::string_view seeds;  ///< globs below the sources
  void (*read)(std::string_view);
};

const Target kTargets[] = {
    {"config", "configs/*.json", [](std::string_view text) { (void)parse_config(std::string(text), "c.json"); }},
    {"scene", "configs/scenes/*.json",
     [](std::string_view text) { (void)parse_scene_file(std::string(text), "s.json"); }},
    {"png", "tests/data/images/*.png", read_image},
    {"tiff", "tests/data/images/*.tif", read_image},
    {"exr", "tests/data/images/*.exr", read_image},
    {"tga", "tests/data/images/*.tga", read_image},
    {"webp", "tests/fuzz/seeds/*.webp", read_image},
    {"netpbm", "tests/fuzz/seeds/*.p?m", read_image},
    {"obj", "tests/fuzz/seeds/*.obj",
     [](std::string_view text) {
       std::istringstream in{std::string(text)};
       (void)read_obj(in, "x.obj");
     }},
    {"ktx2", "tests/fuzz/seeds/*.ktx2",
     [](std::string_view text) { (void)decode_ktx2(std::as_bytes(bytes_of(text)), "x.ktx2"); }},
    {"run", "tests/fuzz/seeds/run*.json", [](std::string_view text) { read_run_with(kRunFile, text); }},
    {"results", "tests/fuzz/seeds/results.jsonl", [](std::string_view text) { read_run_with(kResultsFile, text); }},
    {"samples", "tests/fuzz/seeds/samples.jsonl", [](std::string_view text) { read_run_with(kSamplesFile, text); }},
    {"blocks", "tests/fuzz/seeds/blocks.jsonl", [](std::string_view text) { read_run_with(kBlocksFile, text); }},
    {"table", "tests/fuzz/seeds/table.csv",
     [](std::string_view text) {
       const std::vector<TableRow> table = parse_case_table(text, "t.csv");
       static_cast<void>(case_table_csv(table));
     }},
    {"benchmark", "tests/data/google_benchmark*.json",
     [](std::string_view text) {
       write_to(work_folder() / "benchmark.json", text);
       (void)read_google_benchmark(work_folder() / "benchmark.json", 0);
     }},
    {"presets", "tests/fuzz/seeds/presets.json", [](std::string_view text) { (void)parse_presets(text, "p.json"); }},
    {"case", "tests/fuzz/seeds/case*.txt", read_case},
    {"glob", "tests/fuzz/seeds/glob*.txt", match_glob},
    {"budget", "tests/fuzz/seeds/budget*.txt", read_budget},
    {"shard", "tests/fuzz/seeds/shard*.txt", [](std::string_view text) { (void)parse_shard(text); }},
    {"glsl", "tests/fuzz/seeds/*.glsl", cut_shader},
    {"spirv", "tests/fuzz/seeds/*.spv", reflect_words},
};

const Target* chosen = nullptr;

}  // namespace
}  // namespace reliefbench

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer calls it so
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace reliefbench;
  constexpr std::string_view kTarget = "--target=";
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    for (const Target& target : kTargets) {
      if (argument == "--list") fmt::print("{} {}\n", target.name, target.seeds);
      if (argument.starts_with(kTarget) && argument.substr(kTarget.size()) == target.name) chosen = &target;
    }
    if (argument == "--list") std::exit(0);
  }
  hold(chosen != nullptr, "--target=NAME");
  return 0;
}

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer calls it so
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    reliefbench::chosen->read({reinterpret_cast<const char*>(data), size});
  } catch (const reliefbench::Error&) {
  }
  return 0;
}
