#include <fmt/format.h>

#include <algorithm>
#include <list>
#include <tuple>

#include "kernels/base/error.h"
#include "reports/export/engine.h"
#include "reports/export/shader_pieces.h"
#include "reports/export/template.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

/// One engine's files in the making.
class Folder {
 public:
  Folder(const Engine& engine, const EngineSource& source, const ExportChoice& choice, std::string folder)
      : engine_(engine), source_(source), choice_(choice), folder_(std::move(folder)), shader_(source.shader) {}

  EngineFiles make() {
    for (ShippedTexture& texture : shader_.textures) texture = add_texture(texture);
    if (source_.normals != nullptr) add_normals();
    describe();
    if (engine_.language.empty())
      for (const std::string& id : choice_.languages) add_language(find_language(id));
    else
      add_library(find_language(engine_.language));
    for (const EngineFile& file : engine_.files) add_file(file);
    return std::move(files_);
  }

 private:
  /// The kind of file that was asked for, or the engine's first that holds an image without loss.
  [[nodiscard]] const Container& holding_container(const TextureImage& image, std::string_view file) const {
    const std::string texels =
        fmt::format("{} level{} of {}", image.levels, image.levels == 1 ? "" : "s", format_name(image.layout));
    if (!choice_.container.empty()) {
      const Container& chosen = find_container(choice_.container);
      if (!chosen.holds(image))
        fail_input("{} cannot be {} without loss: it has {}, a {} file holds {}", file, chosen.id, texels, chosen.id,
                   chosen.holds_what);
      return chosen;
    }
    for (const std::string_view id : engine_.containers)
      if (const Container& container = find_container(id); container.holds(image)) return container;
    fail_input("{}: {} has no kind of file for {}; --textures ktx2 writes what any loader of KTX2 takes", file,
               engine_.name, texels);
  }

  /// That, if the engine reads it.
  [[nodiscard]] const Container& container_for(const TextureImage& image, std::string_view file) const {
    if (image.layout.type == TexelType::astc && engine_.id != kPlainEngine)
      fail_input("{}: {} has no view of {}", file, engine_.name, format_name(image.layout));
    const Container& container = holding_container(image, file);
    for (const Unreadable& row : engine_.unreadable)
      if (row.container == container.id && row.is_so(image)) fail_input("{}: {} {}", file, engine_.name, row.why);
    return container;
  }

  void widen(ShippedTexture& texture, TextureImage image) {
    texture.image = &images_.emplace_back(std::move(image));
    texture.format = format_name(texture.image->layout);
  }

  /// Returns it as it is stored.
  ShippedTexture add_texture(ShippedTexture texture) {
    if (engine_.widens_unorm16 && texture.image->layout.type == TexelType::unorm16) {
      widen(texture, as_floats(*texture.image));
      values_.flags.insert("widened");
    }
    const Container& container = container_for(*texture.image, texture.file);
    const TexelLayout& layout = texture.image->layout;
    if (container.id == "dds" && layout.channels == 2 &&
        std::ranges::find(engine_.widens_pairs, layout.type) != engine_.widens_pairs.end())
      widen(texture, with_channels(*texture.image, 4));
    const TextureImage& image = *texture.image;
    const std::string name = fmt::format("{}.{}", texture.file, container.id);
    const bool is_turned = engine_.v_runs_up && container.is_top_down;
    files_.files.push_back(
        {.name = fmt::format("{}{}{}", folder_, engine_.asset_folder, name),
         .what = fmt::format("{}: {}, {} x {}", texture.sampler, texture.format, image.width, image.height),
         .bytes = container.encode(is_turned ? turned_over(image) : image, source_.metadata)});
    files_.textures.push_back({.file = files_.files.back().name,
                               .sampler = texture.sampler,
                               .binding = texture.binding,
                               .format = texture.format,
                               .channels = texture.channels,
                               .width = image.width,
                               .height = image.height,
                               .levels = image.levels,
                               .bytes = image.texels.size()});
    describe_texture(texture, name);
    return texture;
  }

  /// What templates may say of a texture.
  void describe_texture(const ShippedTexture& texture, const std::string& name) {
    const TextureImage& image = *texture.image;
    const bool is_relief = texture.sampler == kReliefMap;
    values_.words[is_relief ? "relief_file" : texture.sampler == kExtraMap ? "extra_file" : "normal_file"] = name;
    if (engine_.feature != nullptr && texture.sampler == kReliefMap) {  // another map is of the same type
      values_.words["feature"] = engine_.feature(image.layout.type);
      if (!values_.words["feature"].empty()) values_.flags.insert("feature");
    }
    const bool is_as_is = engine_.takes_dds_as_is && name.ends_with(".dds");
    if (engine_.compression != nullptr && !is_as_is) add_compression(engine_.compression(image.layout), name);
    if (image.levels > 1) {
      values_.flags.insert("levels");
      values_.words["mipped"] += (values_.words["mipped"].empty() ? "" : "`, `") + name;
    }
    names_.push_back(fmt::format("`{}{}`", engine_.asset_folder, name));
    (is_as_is ? as_is_ : asked_).push_back(names_.back());
    lines_ += fmt::format("- `{}`: {}, {} x {}, {} level{}, {}: {}\n", name, texture.sampler, image.width, image.height,
                          image.levels, image.levels == 1 ? "" : "s", texture.format, texture.channels);
  }

  /// How the first texture is stored, and others that differ.
  void add_compression(const std::string& words, const std::string& name) {
    if (compression_.empty()) compression_ = words;
    if (words != compression_)
      other_compressions_ += fmt::format("{}of `{}`: **{}**", other_compressions_.empty() ? "" : ", ", name, words);
  }

  void add_normals() {
    TextureImage normals = *source_.normals;
    const auto is_refused = [&](const Unreadable& row) { return row.is_so(normals); };
    if (std::ranges::any_of(engine_.unreadable, is_refused)) {  // such an engine makes the levels by itself
      normals.levels = 1;
      normals.texels.resize(image_bytes(normals));
      values_.flags.insert("makes_levels");
    }
    if (engine_.green_runs_against_v)
      for (std::size_t i = 1; i < normals.texels.size(); i += 4)
        normals.texels[i] = std::byte{static_cast<unsigned char>(255 - std::to_integer<int>(normals.texels[i]))};
    images_.push_back(std::move(normals));
    (void)add_texture({.sampler = kNormalMap,
                       .binding = 3,
                       .file = "relief.normal",
                       .image = &images_.back(),
                       .format = format_name(images_.back().layout),
                       .channels = fmt::format("normal, times 0.5 + 0.5; green {} v",
                                               engine_.green_runs_against_v ? "against" : "along")});
  }

  /// What all templates may say.
  void describe() {
    const ShippedShader& shader = shader_;
    values_.words["setting"] = setting_id(shader.settings);
    values_.words["heightmap"] = on_one_line(shader.heightmap);
    values_.words["depth"] = fmt::format("{:#}", shader.relief_depth);
    values_.words["mesh"] = mesh_words(shader);
    values_.words["light_radius"] = light_radius_text(shader);
    values_.words["textures"] = lines_;
    values_.words["texture_names"] = fmt::format("{}", fmt::join(names_, " and "));
    values_.words["asked_names"] = fmt::format("{}", fmt::join(asked_, " and "));
    values_.words["as_is_names"] = fmt::format("{}", fmt::join(as_is_, " and "));
    values_.words["compression"] = fmt::format(
        "**{}**{}", compression_, other_compressions_.empty() ? "" : fmt::format(" ({})", other_compressions_));
    values_.words["header"] = shipped_header(shader, engine_.name);
    values_.words["extra_binding"] = shader.textures.size() > 1 ? ", `extra_map` 1" : "";
    const auto set = [&](bool is_set, const char* flag) {
      if (is_set) values_.flags.insert(flag);
    };
    set(!shader.textures.empty(), "map");
    set(shader.textures.size() > 1, "extra");
    set(shader.wrap == Wrap::clamp, "clamp");
    set(!shader.textures.empty() && shader.wrap == Wrap::repeat, "repeat");
    set(!shader.textures.empty() && shader.wrap == Wrap::clamp, "edge");
    set(has_value_of(shader.settings, Query::shadow), "shadow");
    set(takes_curvature(shader.settings), "curvature");
    set(is_animated(shader.settings), "animated");
    set(shader.settings.is("fade", "distance"), "distance");
    set(shader.base == 1, "down");
    set(!shader.textures.empty() && !asked_.empty(), "asked");
    set(!as_is_.empty(), "as_is");
    set(!shader.textures.empty() && !values_.flags.contains("levels"), "nolevels");
  }

  void add_language(const Language& language) {
    const ShippedText text = language.write(shader_);
    std::string files;
    for (const auto& [name, bytes] :
         {std::pair(language.library_file, text.library), std::pair(language.example_file, text.example)}) {
      if (name.empty()) continue;
      files_.files.push_back(
          {.name = fmt::format("{}{}", folder_, name),
           .what = fmt::format("{}{}", language.name, name == language.example_file ? ": a whole fragment shader" : ""),
           .bytes = bytes});
      files += fmt::format("{}`{}`", files.empty() ? "" : ", ", name);
    }
    values_.words["languages"] += fmt::format("- {}: {}\n", language.name, files);
    values_.flags.emplace(language.id);
  }

  void add_library(const Language& language) {
    std::string library = language.write(shader_).library;
    if (engine_.adapt != nullptr) library = engine_.adapt(library);
    if (!engine_.library_file.empty())
      files_.files.push_back({.name = fmt::format("{}{}", folder_, engine_.library_file),
                              .what = fmt::format("relief_trace, {}", language.name),
                              .bytes = std::string(engine_.library_head) + library});
    values_.words["library"] = std::move(library);
    source_text_ = shipped_source(shader_, language.id == "wgsl" ? MapArguments::separate : MapArguments::combined);
    const std::vector<std::string> traced = map_arguments(source_text_, "relief_trace");
    if (std::ranges::find(traced, kReliefSampler) != traced.end()) values_.flags.emplace("sampler");
  }

  void add_file(const EngineFile& file) {
    TemplateValues values = values_;
    if (file.argument != nullptr) {
      for (const auto& [args, params, function] : {std::tuple("args", "node_params", "relief_trace"),
                                                   std::tuple("normal_args", "normal_params", "relief_normal")}) {
        std::string& passed = values.words[args];
        std::string& declared = values.words[params];
        for (const std::string& map : map_arguments(source_text_, function)) {
          passed += file.argument(map) + ", ";
          declared += fmt::format("{}: {}, ", map, map == kReliefSampler ? "sampler" : "texture_2d<f32>");
        }
      }
      values.words["light_arg"] =
          values.flags.contains("shadow") ? fmt::format(", {}, {}", file.light, light_radius_text(shader_)) : "";
      values.words["map_hints"] = map_hints(file);
    }
    files_.files.push_back({.name = fmt::format("{}{}", folder_, file.name),
                            .what = file.name == "README.md" ? "what to do with the files" : std::string(engine_.name),
                            .bytes = filled_template(file.from, values)});
  }

  /// Godot's declarations of its textures.
  [[nodiscard]] std::string map_hints(const EngineFile& file) const {
    std::string text;
    for (const EngineTexture& texture : files_.textures) {
      if (texture.sampler == kNormalMap) continue;
      text += fmt::format("uniform sampler2D {} : filter_{}, {};  // {}\n", file.argument(texture.sampler),
                          texture.levels > 1 ? "linear_mipmap" : "linear",
                          shader_.wrap == Wrap::clamp ? "repeat_disable" : "repeat_enable",
                          texture.file.substr(texture.file.rfind('/') + 1));
    }
    return text;
  }

  const Engine& engine_;
  const EngineSource& source_;
  const ExportChoice& choice_;
  std::string folder_;
  ShippedShader shader_;  ///< with the textures as they are stored
  EngineFiles files_;
  TemplateValues values_;
  std::vector<std::string> names_;  ///< of textures
  std::vector<std::string> asked_;  ///< those that a dialog asks how to store
  std::vector<std::string> as_is_;  ///< the others
  std::string lines_;
  std::string compression_;  ///< of the first texture
  std::string other_compressions_;
  Pieces source_text_;
  std::list<TextureImage> images_{};  // must stay where they are
};

}  // namespace

EngineFiles engine_files(const Engine& engine, const EngineSource& source, const ExportChoice& choice,
                         const std::string& folder) {
  return Folder(engine, source, choice, folder).make();
}

}  // namespace reliefbench
