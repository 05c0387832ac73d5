#pragma once
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace reliefbench {

/// What rays are, said in text: ray.glsl's macros, and conditions on them, written out.
class RayText {
 public:
  /// defines: of BENT_RAYS and BENT_EXACTLY, those that hold; none: straight rays
  explicit RayText(std::set<std::string> defines);

  /// Lines of a shader file as such rays have them: without what stands under other names, and without macros.
  [[nodiscard]] std::vector<std::string> written_out(std::vector<std::string> lines) const;

 private:
  struct Macro {
    std::string name;
    std::vector<std::string> params;
    std::string body;
    [[nodiscard]] std::string called_with(const std::string& arguments) const;
  };
  [[nodiscard]] std::vector<std::string> chosen(std::vector<std::string> lines) const;
  [[nodiscard]] std::string without_macros(std::string line) const;

  std::set<std::string> defines_;
  std::vector<Macro> macros_;  ///< as ray.glsl has them
};

}  // namespace reliefbench
