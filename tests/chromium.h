#pragma once
#include <sys/types.h>

#include <chrono>
#include <deque>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace reliefbench {

/// How a page is opened.
struct Opening {
  std::string fragment{};  ///< of the URL, without '#'
  int width_px = 1280;
  int height_px = 900;
  bool is_dark = false;
  bool in_real_time = false;  ///< for figures of time; nothing is waited for then
  bool with_webgpu = false;   ///< on SwiftShader, which is the browser's own; in real time, too: see kHold
};

/// A headless Chromium, driven through its debugging pipe (Chrome DevTools Protocol).
class Chromium {
 public:
  [[nodiscard]] static bool is_installed();
  /// The one that all tests of this process share: to start it takes longer than most pages do.
  [[nodiscard]] static Chromium& shared(bool with_webgpu);

  explicit Chromium(const std::vector<std::string>& flags);
  ~Chromium();
  Chromium(const Chromium&) = delete;
  Chromium& operator=(const Chromium&) = delete;

  struct Page {
    std::string dom;                        ///< once its scripts have run
    std::vector<std::string> complaints{};  ///< what was written to the console, and what was thrown
    std::string png{};                      ///< where a picture was asked for
  };
  /// Opens a file as a reader does who never was here before. picture: of the window, as PNG
  [[nodiscard]] Page open(const std::filesystem::path& file, const Opening& opening, bool picture = false);

 private:
  using Json = nlohmann::json;

  /// The answer. throws: std::runtime_error on the browser's error, or where nothing comes within kPatience
  Json call(const std::string& method, Json parameters = Json::object(), const std::string& session = "");
  /// Waits for an event of a session, which is taken.
  void wait_for(const std::string& event, const std::string& session);
  [[nodiscard]] Json next_message();

  static constexpr std::chrono::seconds kPatience{120};

  std::filesystem::path profile_;
  pid_t process_ = -1;
  int to_ = -1;
  int from_ = -1;
  int calls_ = 0;
  std::string read_;           ///< behind the last whole message
  std::deque<Json> events_{};  ///< that nobody waited for yet
};

}  // namespace reliefbench
