#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "backends/cross_compiler.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

/// One process translates; its arguments are naga's folder and the folder with the module.
constexpr const char* kScript = R"(
const {readFileSync, writeFileSync} = await import('node:fs');
const {pathToFileURL} = await import('node:url');
const [, naga, work] = process.argv;
try {
  const {translate} = await import(pathToFileURL(naga + '/dist/node.js').href);
  writeFileSync(work + '/shader.wgsl',
                translate({from: 'spirv', to: 'wgsl', source: readFileSync(work + '/shader.spv')}));
} catch (error) {
  console.error(error.message ?? error);
  process.exit(1);
}
)";

/// A folder of our own for as long as it takes.
class WorkFolder {
 public:
  WorkFolder() {
    std::string name = (fs::temp_directory_path() / "reliefbench.XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) fail_environment("{}: cannot be made", name);
    path_ = name;
  }
  ~WorkFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string text_of_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

fs::path naga_folder() {
  for (const fs::path& folder : naga_folders())
    if (std::error_code error; fs::is_regular_file(folder / "dist/node.js", error)) return fs::absolute(folder);
  fail_environment("WGSL is written by naga, which is not there: run ./dev setup");
}

/// Starts `node` with its output in a file, and waits for its end.
void run_node(const fs::path& naga, const fs::path& work) {
  std::array<std::string, 7> words = {"node", "--input-type=module", "-e", kScript, "--", naga.string(), work.string()};
  std::array<char*, 8> argv{};
  for (std::size_t i = 0; i < words.size(); ++i) argv[i] = words[i].data();
  const std::string log = (work / "log.txt").string();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, fd, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  pid_t child = 0;
  const int error = posix_spawnp(&child, "node", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT)
    fail_environment("WGSL is written by naga, which runs in Node.js: no `node` on PATH (apt-get install nodejs)");
  if (error != 0) fail_environment("node cannot be started: {}", std::strerror(error));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  const std::string words_of_node = text_of_file(log);
  fail_environment("naga: {}", words_of_node.substr(0, words_of_node.find('\n')));
}

}  // namespace

std::vector<fs::path> naga_folders() {
  if (const char* chosen = std::getenv("RELIEFBENCH_NAGA"); chosen != nullptr && *chosen != '\0') return {chosen};
  std::vector<fs::path> folders{"build/naga"};
  std::error_code error;
  const fs::path executable = fs::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(executable.parent_path().parent_path() / "naga");
  return folders;
}

std::string naga_wgsl(const Spirv& spirv) {
  const fs::path naga = naga_folder();
  const WorkFolder work;
  std::ofstream(work.path() / "shader.spv", std::ios::binary)
      .write(reinterpret_cast<const char*>(spirv.data()),
             static_cast<std::streamsize>(spirv.size() * sizeof(std::uint32_t)));
  run_node(naga, work.path());
  return text_of_file(work.path() / "shader.wgsl");
}

}  // namespace reliefbench
