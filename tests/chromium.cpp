#include "tests/chromium.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <memory>
#include <stdexcept>

namespace reliefbench {
namespace {

// Where the browser reads and writes, by --remote-debugging-pipe.
constexpr int kItReads = 3;
constexpr int kItWrites = 4;

std::string from_base64(const std::string& text) {
  std::string bytes(text.size() / 4 * 3, '\0');
  const int size = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                                   reinterpret_cast<const unsigned char*>(text.data()), static_cast<int>(text.size()));
  if (size < 0) throw std::runtime_error("not base64");
  // The padding's bytes are among them.
  bytes.resize(static_cast<std::size_t>(size - std::ranges::count(text, '=')));
  return bytes;
}

}  // namespace

bool Chromium::is_installed() { return std::system("command -v chromium >/dev/null 2>&1") == 0; }

Chromium& Chromium::shared(bool with_webgpu) {
  static std::array<std::unique_ptr<Chromium>, 2> browsers;
  std::unique_ptr<Chromium>& browser = browsers[with_webgpu ? 1 : 0];
  if (!browser)
    browser = std::make_unique<Chromium>(
        with_webgpu ? std::vector<std::string>{"--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"}
                    : std::vector<std::string>{"--disable-gpu"});
  return *browser;
}

Chromium::Chromium(const std::vector<std::string>& flags) {
  std::string folder = (std::filesystem::temp_directory_path() / "reliefbench_chromium_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error(folder);
  profile_ = folder;
  std::vector<std::string> words = {"chromium",
                                    "--headless",
                                    "--no-sandbox",
                                    "--remote-debugging-pipe",
                                    "--disable-quic",
                                    "--disable-dev-shm-usage",
                                    "--no-first-run",
                                    "--disable-background-networking",
                                    "--disable-component-update",
                                    "--disable-sync",
                                    "--hide-scrollbars",
                                    "--user-data-dir=" + profile_.string()};
  words.insert(words.end(), flags.begin(), flags.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  std::array<int, 2> there{};
  std::array<int, 2> back{};
  if (pipe2(there.data(), O_CLOEXEC) != 0 || pipe2(back.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe");
  process_ = fork();
  if (process_ == 0) {
    setpgid(0, 0);
    // Out of the way first: the pipes' ends may lie on 3 and 4.
    const int reads = fcntl(there[0], F_DUPFD, kItWrites + 1);
    const int writes = fcntl(back[1], F_DUPFD, kItWrites + 1);
    dup2(reads, kItReads);
    dup2(writes, kItWrites);
    close(reads);
    close(writes);
    const int log = ::open((profile_ / "log.txt").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(log, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  close(there[0]);
  close(back[1]);
  to_ = there[1];
  from_ = back[0];
}

Chromium::~Chromium() {
  close(to_);  // it ends
  close(from_);
  kill(-process_, SIGKILL);
  waitpid(process_, nullptr, 0);
  std::error_code ignored;
  std::filesystem::remove_all(profile_, ignored);
}

Chromium::Page Chromium::open(const std::filesystem::path& file, const Opening& opening, bool picture) {
  const std::string context = call("Target.createBrowserContext").at("browserContextId");
  const std::string target =
      call("Target.createTarget", {{"url", "about:blank"}, {"browserContextId", context}}).at("targetId");
  const std::string session = call("Target.attachToTarget", {{"targetId", target}, {"flatten", true}}).at("sessionId");
  for (const char* domain : {"Page.enable", "Runtime.enable", "Log.enable"}) call(domain, Json::object(), session);
  call("Emulation.setDeviceMetricsOverride",
       {{"width", opening.width_px}, {"height", opening.height_px}, {"deviceScaleFactor", 1}, {"mobile", false}},
       session);
  const Json scheme = {{"name", "prefers-color-scheme"}, {"value", opening.is_dark ? "dark" : "light"}};
  call("Emulation.setEmulatedMedia", {{"features", Json::array({scheme})}}, session);
  call("Page.navigate", {{"url", fmt::format("file://{}#{}", file.string(), opening.fragment)}}, session);
  wait_for("Page.loadEventFired", session);
  if (!opening.in_real_time && !opening.with_webgpu && !picture) {
    call("Emulation.setVirtualTimePolicy", {{"policy", "pauseIfNetworkFetchesPending"}, {"budget", 10000}}, session);
    wait_for("Emulation.virtualTimeBudgetExpired", session);
  }

  Page page;
  const auto evaluate = [&](const char* script) {
    return call("Runtime.evaluate", {{"expression", script}, {"awaitPromise", true}, {"returnByValue", true}}, session)
        .at("result")
        .value("value", Json());
  };
  if (picture) {
    // A chart is drawn in the frame after the one that laid it out.
    (void)evaluate(
        "new Promise((done) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)), 300))");
    page.png = from_base64(call("Page.captureScreenshot", {{"format", "png"}}, session).at("data"));
  }
  page.dom = evaluate("document.documentElement.outerHTML").get<std::string>();
  for (const Json& event : events_) {
    if (event.value("sessionId", "") != session) continue;
    const std::string method = event.at("method");
    if (method == "Runtime.consoleAPICalled" || method == "Runtime.exceptionThrown" || method == "Log.entryAdded")
      page.complaints.push_back(event.at("params").dump());
  }
  call("Target.disposeBrowserContext", {{"browserContextId", context}});
  events_.clear();
  return page;
}

nlohmann::json Chromium::call(const std::string& method, Json parameters, const std::string& session) {
  const int id = ++calls_;
  Json message = {{"id", id}, {"method", method}, {"params", std::move(parameters)}};
  if (!session.empty()) message["sessionId"] = session;
  const std::string text = message.dump();
  // The message's end is a zero byte, which c_str() has.
  for (std::size_t sent = 0; sent <= text.size();) {
    const ssize_t now = write(to_, text.c_str() + sent, text.size() + 1 - sent);
    if (now < 0 && errno != EINTR) throw std::runtime_error("chromium has ended");
    sent += static_cast<std::size_t>(std::max<ssize_t>(now, 0));
  }
  while (true) {
    Json answer = next_message();
    if (answer.value("id", 0) != id) {
      events_.push_back(std::move(answer));
      continue;
    }
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer.at("error").dump());
    return answer.at("result");
  }
}

void Chromium::wait_for(const std::string& event, const std::string& session) {
  const auto is_it = [&](const Json& message) {
    return message.value("method", "") == event && message.value("sessionId", "") == session;
  };
  while (true) {
    if (const auto found = std::ranges::find_if(events_, is_it); found != events_.end()) {
      events_.erase(found);
      return;
    }
    events_.push_back(next_message());
  }
}

nlohmann::json Chromium::next_message() {
  std::size_t end = 0;
  std::size_t seen = 0;
  while ((end = read_.find('\0', seen)) == std::string::npos) {
    seen = read_.size();
    pollfd readable{.fd = from_, .events = POLLIN, .revents = 0};
    const auto patience = std::chrono::milliseconds(kPatience).count();
    if (poll(&readable, 1, static_cast<int>(patience)) == 0) throw std::runtime_error("chromium says nothing");
    std::array<char, 1 << 16> bytes{};
    const ssize_t size = read(from_, bytes.data(), bytes.size());
    if (size == 0 || (size < 0 && errno != EINTR)) throw std::runtime_error("chromium has ended");
    read_.append(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  }
  Json message = Json::parse(std::string_view(read_).substr(0, end));
  read_.erase(0, end + 1);
  return message;
}

}  // namespace reliefbench
