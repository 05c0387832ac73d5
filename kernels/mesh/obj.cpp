#include "kernels/mesh/obj.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include "kernels/base/file_error.h"

namespace reliefbench {
namespace {

/// What a relief has no use for.
constexpr std::array<std::string_view, 6> kPassedOver{"g", "mtllib", "o", "s", "usemtl", "l"};

/// The words of a line, one after the other.
class ObjWords {
 public:
  explicit ObjWords(std::string_view line) : rest_(line.substr(0, line.find('#'))) {}
  [[nodiscard]] std::string_view next() {
    constexpr std::string_view kSpaces = " \t\r";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kSpaces), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kSpaces));
    rest_.remove_prefix(word.size());
    return word;
  }

 private:
  std::string_view rest_;
};

template <typename Number>
std::optional<Number> number_in(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return number;
}

class ObjReader {
 public:
  ObjReader(std::istream& in, std::string name) : in_(in), name_(std::move(name)) {}

  [[nodiscard]] RawMesh read() {
    for (std::string line; std::getline(in_, line);) {
      ++line_;
      if (line.ends_with('\\') || line.ends_with("\\\r")) fail("a line that ends in itself", "one that goes on (\\)");
      take(ObjWords(line));
    }
    if (mesh_.triangles.empty()) fail_input("{}: no face: expected f lines", name_);
    const bool some = std::ranges::any_of(has_normal_, [](bool has) { return has; });
    const bool all = std::ranges::all_of(has_normal_, [](bool has) { return has; });
    if (some && !all) fail_input("{}: some faces have vn and some have not: expected all or none", name_);
    if (!some) mesh_.normals.clear();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
    fail_input("{}:{}: expected {}, found {}", name_, line_, expected,
               found.empty() ? "the line's end" : fmt::format("'{}'", found.substr(0, 40)));
  }

  /// Numbers that must be there, and up to `more` that may.
  template <int kCount>
  [[nodiscard]] Eigen::Matrix<double, kCount, 1> numbers(ObjWords& words, int more, std::string_view expected) {
    Eigen::Matrix<double, kCount, 1> list;
    // As floats they go to the device.
    constexpr double kMost = 1e18;
    for (int i = 0; i < kCount + more; ++i) {
      const std::string_view word = words.next();
      if (word.empty() && i >= kCount) return list;
      const auto number = number_in<double>(word);
      if (!number || !(std::abs(*number) <= kMost)) fail(expected, word);
      if (i < kCount) list(i) = *number;
    }
    if (const std::string_view word = words.next(); !word.empty()) fail("the line's end", word);
    return list;
  }

  [[nodiscard]] std::uint32_t index(std::string_view text, std::size_t size, std::string_view of) const {
    const auto number = number_in<std::int64_t>(text);
    const auto count = static_cast<std::int64_t>(size);
    if (!number || *number == 0 || *number > count || *number < -count)
      fail(fmt::format("the number of one of {} {}", count, of), text);
    return static_cast<std::uint32_t>(*number > 0 ? *number - 1 : count + *number);
  }

  [[nodiscard]] RawMesh::Corner corner(std::string_view word, bool& has_normal) const {
    const std::size_t first = word.find('/');
    const std::string_view position = word.substr(0, first);
    const std::string_view rest = first == std::string_view::npos ? "" : word.substr(first + 1);
    const std::size_t second = rest.find('/');
    if (rest.empty() || second == 0) fail("a corner v/vt or v/vt/vn, for a relief lies on a mesh by its vt", word);
    has_normal = second != std::string_view::npos;
    return {.position = index(position, mesh_.positions.size(), "v"),
            .uv = index(rest.substr(0, second), mesh_.uvs.size(), "vt"),
            .normal = has_normal ? index(rest.substr(second + 1), mesh_.normals.size(), "vn") : 0};
  }

  void take_face(ObjWords& words) {
    std::vector<RawMesh::Corner> corners;
    bool has_normal = false;
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
      bool here = false;
      corners.push_back(corner(word, here));
      if (corners.size() > 1 && here != has_normal) fail("vn at all corners of a face or at none", word);
      has_normal = here;
    }
    if (corners.size() < 3) fail("three corners at least", "");
    if (mesh_.triangles.size() + corners.size() - 2 > kMostTriangles)
      fail(fmt::format("{} triangles at most", kMostTriangles), "more");
    for (std::size_t i = 2; i < corners.size(); ++i) {
      mesh_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
      has_normal_.push_back(has_normal);
    }
  }

  /// An OBJ's v goes up from the image's bottom row, ours down from its top one.
  void take_uv(const Eigen::Vector2d& uv) { mesh_.uvs.emplace_back(uv.x(), 1 - uv.y()); }

  void take(ObjWords words) {
    const std::string_view kind = words.next();
    if (kind.empty() || std::ranges::find(kPassedOver, kind) != kPassedOver.end()) return;
    // A fourth number of v is a weight, more are a colour.
    if (kind == "v")
      mesh_.positions.emplace_back(numbers<3>(words, 4, "v and three numbers"));
    else if (kind == "vt")
      take_uv(numbers<2>(words, 1, "vt and two numbers"));
    else if (kind == "vn")
      mesh_.normals.emplace_back(numbers<3>(words, 0, "vn and three numbers"));
    else if (kind == "f")
      take_face(words);
    else
      fail("v, vt, vn or f", kind);
  }

  std::istream& in_;
  std::string name_;
  int line_ = 0;
  RawMesh mesh_;
  std::vector<bool> has_normal_;  ///< a triangle
};

}  // namespace

RawMesh read_obj(std::istream& in, const std::string& name) { return ObjReader(in, name).read(); }

RawMesh load_obj(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) fail_file(path, "cannot read the mesh", error.value());
  if (bytes > kMostObjBytes)
    fail_input("{}: {} bytes: a mesh may have {} at most", path.string(), bytes, kMostObjBytes);
  std::ifstream in(path);
  if (!in) fail_file(path, "cannot read the mesh", errno);
  return read_obj(in, path.string());
}

}  // namespace reliefbench
