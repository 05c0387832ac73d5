#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace reliefbench {

// Names of a run folder's files, in one place.
inline constexpr std::string_view kRunFile = "run.json";
inline constexpr std::string_view kResultsFile = "results.jsonl";
inline constexpr std::string_view kSamplesFile = "samples.jsonl";
inline constexpr std::string_view kBlocksFile = "blocks.jsonl";  ///< where states were told
inline constexpr std::string_view kBenchmarkFile = "benchmark.json";
inline constexpr std::string_view kFrontFile = "front.json";
inline constexpr std::string_view kTableFile = "table.csv";
inline constexpr std::string_view kT4File = "t4.json";
inline constexpr std::string_view kReportFile = "report.html";
inline constexpr std::string_view kMarkFile = "in_hand.txt";  ///< while the run goes on: the case that is being drawn
inline constexpr std::string_view kImagesFolder = "images";

/// The picture of a case (relative to the run folder): images/<hash of key>-<kind>.png
/// key: a case id, or reference_image_key(); kind: "frame" (the shaded frame), "error" (heat map of e_xy) or
/// "taps" (texture instructions of each pixel)
[[nodiscard]] std::filesystem::path image_path(std::string_view key, std::string_view kind);
/// Whether image_path() gives files such names.
[[nodiscard]] bool is_image_name(std::string_view file_name);

/// The key of the shaded exact reference of a scene on a backend, with the exact values of the features of the scene
/// that a case has: others have another reference.
[[nodiscard]] std::string reference_image_key(std::string_view scene, std::string_view backend,
                                              std::string_view case_id = {});

}  // namespace reliefbench
