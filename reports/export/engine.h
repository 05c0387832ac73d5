#pragma once
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "reports/export/container.h"
#include "reports/export/language.h"

namespace reliefbench {

/// A file of an engine that is made from a template.
struct EngineFile {
  std::string_view name;
  std::string_view from;  ///< reports/export/templates/<from>
  std::string (*argument)(std::string_view) =
      nullptr;                          ///< what its calls pass for relief_map, extra_map, relief_sampler
  std::string_view light = "light_ts";  ///< ... and for the light's direction
};

/// Textures that an engine cannot have in some kind of file.
struct Unreadable {
  std::string_view container;
  bool (*is_so)(const TextureImage& image);
  std::string_view why;  ///< after the engine's name
};

/// Whom an export is for: an engine, or whoever has none.
struct Engine {
  std::string_view id;
  std::string_view name;
  std::string_view language;                 ///< of its files; "": those that are asked for
  std::vector<std::string_view> containers;  ///< of textures, the preferred first
  std::vector<EngineFile> files;
  std::string_view asset_folder{};        ///< of its textures and shaders, with `/`
  std::string_view library_file{};        ///< the shader library as a file of its own; "": none, or within another
  std::string_view library_head{};        ///< a line before it
  bool v_runs_up = false;                 ///< pictures are stored from the bottom
  bool green_runs_against_v = false;      ///< of its normal maps
  bool widens_unorm16 = false;            ///< has no 16-bit integer textures
  bool takes_dds_as_is = false;           ///< has nothing to choose of how it is stored
  std::vector<TexelType> widens_pairs{};  ///< it reads four channels from DDS, but not two
  std::vector<Unreadable> unreadable{};
  std::string (*compression)(const TexelLayout& layout) = nullptr;  ///< in its dialogs' words
  std::string_view (*feature)(TexelType type) = nullptr;       ///< of devices, without which they have no such texture
  std::string (*adapt)(const std::string& library) = nullptr;  ///< to what its language lacks
};
[[nodiscard]] std::span<const Engine> engines();
[[nodiscard]] const Engine& find_engine(std::string_view id);  ///< throws: Error(bad_input) listing the choices
inline constexpr std::string_view kPlainEngine = "plain";

/// What is asked of an export beside its setting.
struct ExportChoice {
  std::vector<std::string> engines{};             ///< ids; none: plain
  std::vector<std::string> languages = {"glsl"};  ///< of plain
  std::string container{};                        ///< of textures; "": the engine's own choice
  bool normal_map = false;
  bool leaves_out = false;  ///< engines that cannot have it; else those are an error
};

struct ExportedFile {
  std::string name;  ///< with its folder
  std::string what;  ///< in a few words
  std::string bytes;
};

/// A texture as an engine has it.
struct EngineTexture {
  std::string file;     ///< with its folder
  std::string sampler;  ///< relief_map | extra_map | normal_map
  int binding = 0;      ///< in the examples
  std::string format;
  std::string channels;
  int width = 0;
  int height = 0;
  int levels = 1;
  std::size_t bytes = 0;  ///< of all levels, in memory
};

/// What an engine's folder holds.
struct EngineFiles {
  std::vector<EngineTexture> textures;
  std::vector<ExportedFile> files;
};

/// What all engines are made from.
struct EngineSource {
  const ShippedShader& shader;
  const TextureImage* normals = nullptr;  ///< 8-bit RGBA, y along v; null: not asked for
  std::map<std::string, std::string> metadata{};
};

/// throws: Error(bad_input): an engine whose recipe has no place for something of the setting
void check_recipe(const Engine& engine, const ShippedShader& shader);

/// Where the mesh lies in the relief, after "the mesh's own surface".
[[nodiscard]] std::string mesh_words(const ShippedShader& shader);

/// Every file of an engine, named by paths under `folder` ("" or ending in `/`).
/// throws: Error(bad_input): a texture that the container cannot hold; Error(environment): a language that cannot be
/// had
[[nodiscard]] EngineFiles engine_files(const Engine& engine, const EngineSource& source, const ExportChoice& choice,
                                       const std::string& folder);

/// Every file name that an export can give, with its folder.
[[nodiscard]] std::set<std::string> all_export_names();

}  // namespace reliefbench
