// What `./dev bundle` packs, unpacked where nothing but glibc and a driver is.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/command.h"
#include "tests/temp_folder.h"
#include "tests/thorough.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const fs::path kLibraries = "/usr/lib/x86_64-linux-gnu";
const std::set<std::string> kGlibc = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1"};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Name and path of each library in the output of ldd.
std::map<std::string, fs::path> parse_ldd(const std::string& text) {
  std::map<std::string, fs::path> libraries;
  for (const std::string& line : lines_of(text)) {
    std::istringstream words(line);
    std::string name, arrow, path;
    if (words >> name >> arrow >> path && arrow == "=>") libraries[name] = path;
  }
  return libraries;
}

/// The libraries that a library needs, and those that they need.
std::map<std::string, fs::path> needs_of(const fs::path& library) {
  return parse_ldd(output_of("ldd '" + library.string() + "'"));
}

bool is_bundled(const fs::path& library) { return library.string().starts_with("/bundle/"); }

/// Packs the built binary into a folder; the archive.
fs::path pack(const fs::path& folder) {
  const std::string out = output_of(
      fmt::format("'{}/configs/bundle.sh' '{}' '{}'", RELIEFBENCH_SOURCE_DIR, RELIEFBENCH_BINARY, folder.string()));
  return out.substr(0, out.find('\n'));
}

void unpack(const fs::path& archive, const fs::path& folder) {
  fs::create_directories(folder);
  const std::string command =
      fmt::format("tar -C '{}' --strip-components=1 -xf '{}'", folder.string(), archive.string());
  ASSERT_EQ(std::system(command.c_str()), 0) << command;  // NOLINT(concurrency-mt-unsafe)
}

class BundleTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kIsSanitized) GTEST_SKIP() << "a sanitizer's own libraries are no part of a bundle";
  }

  TempFolder folder_;
};

/// A root folder that commands are run in.
class BareRoot {
 public:
  /// Holds glibc and a mount point for /proc.
  explicit BareRoot(fs::path path) : path_(std::move(path)) {
    for (const char* folder : {"usr/lib64", "proc", "tmp"}) fs::create_directories(path_ / folder);
    fs::create_directory_symlink("usr/lib", path_ / "lib");
    fs::create_directory_symlink("usr/lib64", path_ / "lib64");
    add("/usr/lib64/ld-linux-x86-64.so.2");
    for (const std::string& library : kGlibc) add(kLibraries / library);
  }

  void add(const fs::path& file) const {
    const fs::path to = path_ / file.relative_path();
    fs::create_directories(to.parent_path());
    fs::copy_file(file, to, fs::copy_options::skip_existing);
  }
  /// A library with all that it needs, each in the system's own folder.
  void add_library(const fs::path& library) const {
    add(library);
    for (const auto& [name, path] : needs_of(library)) add(kLibraries / name);
  }

  /// The first words of a command that sees this root alone; none where the system lets nobody in. Mounts, since
  /// $ORIGIN and what lies beside the binary are found by /proc.
  static std::string entrance() {
    for (const std::string unshare : {"unshare --mount", "unshare --map-root-user --mount"})
      if (output_of(unshare + " sh -c 'mount --rbind /proc /proc && echo in' 2>/dev/null") == "in\n")
        return unshare + R"( sh -c 'mount --rbind /proc "$0/proc" && exec env -i "$@"')";
    return "";
  }

  /// Runs a command that sees this root alone, and has nothing in its environment but a home.
  [[nodiscard]] CommandResult run(const std::string& command) const {
    const std::string line =
        fmt::format("{0} '{1}' HOME=/tmp /usr/sbin/chroot '{1}' {2} >'{1}/out.txt' 2>'{1}/err.txt'", entrance(),
                    path_.string(), command);
    const int status = std::system(line.c_str());  // NOLINT(concurrency-mt-unsafe)
    return {.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1,
            .out = file_text(path_ / "out.txt"),
            .err = file_text(path_ / "err.txt")};
  }
  [[nodiscard]] CommandResult reliefbench(const std::string& arguments) const {
    return run("/bundle/bin/reliefbench " + arguments);
  }
  /// Where the binary's libraries are found.
  [[nodiscard]] std::map<std::string, fs::path> libraries() const {
    return parse_ldd(run("/lib64/ld-linux-x86-64.so.2 --list /bundle/bin/reliefbench").out);
  }

 private:
  fs::path path_;
};

TEST_F(BundleTest, runs_in_a_bare_root) {
  if (BareRoot::entrance().empty()) GTEST_SKIP() << "neither root nor a user may mount in a namespace here (unshare)";
  const fs::path root = folder_ / "root";
  unpack(pack(folder_ / "packed"), root / "bundle");
  const BareRoot bare(root);

  // Without a driver: all but glibc is the bundle's own.
  const std::map<std::string, fs::path> own = bare.libraries();
  EXPECT_GT(own.size(), kGlibc.size());
  for (const auto& [name, path] : own) EXPECT_EQ(is_bundled(path), !kGlibc.contains(name)) << path;
  const CommandResult none = bare.reliefbench("devices");
  EXPECT_EQ(none.exit_code, 3) << none.err;
  EXPECT_EQ(
      bare.reliefbench("sweep /bundle/configs/quickstart.json -o /null --backend null --filter 'flat@*'").exit_code, 0);

  // A driver of Vulkan alone, then with an EGL that has no OpenGL.
  bare.add_library(kLibraries / "libvulkan.so.1");
  bare.add_library(kLibraries / "libvulkan_lvp.so");
  bare.add("/usr/share/vulkan/icd.d/lvp_icd.x86_64.json");
  const CommandResult vulkan = bare.reliefbench("devices");
  EXPECT_EQ(vulkan.exit_code, 0) << vulkan.err;
  EXPECT_THAT(vulkan.out, HasSubstr("vulkan "));
  for (const char* library : {"libEGL.so.1", "libEGL_mesa.so.0", "dri/swrast_dri.so"})
    bare.add_library(kLibraries / library);
  bare.add("/usr/share/glvnd/egl_vendor.d/50_mesa.json");
  EXPECT_EQ(bare.reliefbench("devices").out, vulkan.out);

  // The driver's versions of what both need, and nothing else of the driver's.
  bare.add_library(kLibraries / "libGL.so.1");
  for (const auto& [name, path] : bare.libraries()) {
    const bool is_fallback = fs::exists(root / "bundle/lib/fallback" / name);
    const bool is_of_system = fs::exists(root / kLibraries.relative_path() / name);
    EXPECT_EQ(is_bundled(path), !is_of_system) << path;
    EXPECT_TRUE(is_fallback || kGlibc.contains(name) || !is_of_system) << name << " is the driver's, too: lib/fallback";
  }

  const CommandResult sweep = bare.reliefbench(
      "sweep /bundle/configs/quickstart.json -o /out --backend all --quiet --filter '*/oblique?*_steps=16*'");
  ASSERT_EQ(sweep.exit_code, 0) << sweep.out << sweep.err;
  std::map<std::string, int> measured;
  for (const std::string& line : lines_of(file_text(root / "out/results.jsonl"))) {
    const nlohmann::json record = nlohmann::json::parse(line);
    EXPECT_EQ(record.at("status"), "ok") << line;
    ++measured[record.at("backend")];
  }
  EXPECT_GT(measured["opengl"], 5);
  EXPECT_EQ(measured["opengl"], measured["vulkan"]);
  const CommandResult report = bare.reliefbench("report /out -o /out/report.html");
  EXPECT_EQ(report.exit_code, 0) << report.err;
  EXPECT_GT(fs::file_size(root / "out/report.html"), 100'000U);
}

TEST_F(BundleTest, is_small_and_lies_anywhere_and_is_the_same_twice) {
  const fs::path archive = pack(folder_ / "packed");
  EXPECT_THAT(archive.filename().string(), StartsWith("reliefbench-"));
  ASSERT_TRUE(fs::exists(archive));
  EXPECT_LT(fs::file_size(archive), 40U << 20U);
  EXPECT_EQ(file_text(archive), file_text(pack(folder_ / "again")));

  const fs::path bundle = folder_ / "bundle";
  unpack(archive, bundle);
  for (const char* file : {"README", "configs/quickstart.json", "heightmaps/rocks_NM_height.tga", "licences/libtbb12"})
    EXPECT_TRUE(fs::exists(bundle / file)) << file;
  std::vector<fs::path> objects = {bundle / "bin/reliefbench"};
  for (const auto& entry : fs::recursive_directory_iterator(bundle / "lib"))
    if (entry.is_regular_file()) objects.push_back(entry.path());
  EXPECT_GT(objects.size(), 10U);
  for (const fs::path& object : objects) {
    // Beside itself, or the system's own folder of libraries: no place of the machine that it was built on.
    std::string search = output_of("patchelf --print-rpath '" + object.string() + "'");
    std::replace(search.begin(), search.end(), ':', '\n');
    for (const std::string& place : lines_of(search))
      EXPECT_TRUE(place.empty() || place.starts_with("$ORIGIN") || place == "/usr/$LIB") << object << ": " << place;
    const std::string versions = output_of("objdump -T '" + object.string() + "' | grep -o 'GLIBC_2[.][0-9]*'");
    for (const std::string& version : lines_of(versions))
      EXPECT_LE(std::stoi(version.substr(version.find('.') + 1)), 36) << object;
  }
}

TEST_F(BundleTest, refuses_what_it_can_not_pack) {
  const auto error_of = [&](const std::string& arguments) {
    return output_of(
        fmt::format("'{}/configs/bundle.sh' {} 2>&1 >/dev/null || true", RELIEFBENCH_SOURCE_DIR, arguments));
  };
  EXPECT_THAT(error_of(""), HasSubstr("usage: "));
  EXPECT_THAT(error_of("/no/binary '" + folder_.path().string() + "'"), HasSubstr("/no/binary"));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace
}  // namespace reliefbench
