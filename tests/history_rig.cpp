#include "tests/history_rig.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>

#include "kernels/base/sha256.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

const fs::path kPrograms = "/usr/lib/postgresql/15/bin";

/// Runs a line of a shell as a user that PostgreSQL does not refuse, which root is.
void run_as_server(const fs::path& folder, const std::string& line) {
  const std::string log = (folder / "commands.txt").string();
  const std::string who = geteuid() == 0 ? "setpriv --reuid postgres --regid postgres --clear-groups " : "";
  const std::string whole = fmt::format("cd '{}' && {}{} >>'{}' 2>&1", folder.string(), who, line, log);
  const int status = std::system(whole.c_str());  // NOLINT(concurrency-mt-unsafe)
  ASSERT_EQ(status, 0) << line;
}

}  // namespace

bool PostgresServer::is_installed() { return fs::exists(kPrograms / "initdb"); }

PostgresServer& PostgresServer::shared() {
  static PostgresServer server;
  return server;
}

PostgresServer::PostgresServer() {
  // Short, since the path of a socket may have 107 bytes.
  std::string name = (fs::temp_directory_path() / "reliefbench_pg_XXXXXX").string();
  folder_ = mkdtemp(name.data());
  if (geteuid() == 0) {
    const std::string own = fmt::format("chown postgres '{}'", folder_.string());
    if (std::system(own.c_str()) != 0) ADD_FAILURE() << own;  // NOLINT(concurrency-mt-unsafe)
  }
  run_as_server(folder_, fmt::format("'{}/initdb' -D data -U tester -A trust -E UTF8 --locale=C --no-sync -N",
                                     kPrograms.string()));
  start();
}

PostgresServer::~PostgresServer() {
  stop();
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void PostgresServer::start() {
  run_as_server(folder_,
                fmt::format("'{}/pg_ctl' -D data -l log.txt -w -o \"-k '{}' -c listen_addresses='' -c fsync=off "
                            "-c full_page_writes=off -c shared_buffers=32MB\" start",
                            kPrograms.string(), folder_.string()));
}

void PostgresServer::stop() {
  const std::string line = fmt::format("-D data -m immediate -w stop");
  run_as_server(folder_, fmt::format("'{}/pg_ctl' {}", kPrograms.string(), line));
}

std::string PostgresServer::make_database() {
  const std::string name = fmt::format("test{}", ++databases_);
  run_as_server(folder_, fmt::format("'{}/createdb' -h '{}' -U tester {}", kPrograms.string(), folder_.string(), name));
  return fmt::format("postgresql://tester@/{}?host={}", name, folder_.string());
}

void OnBothDatabases::SetUp() {
  if (is_server() && !PostgresServer::is_installed())
    GTEST_SKIP() << "there is no PostgreSQL server in " << kPrograms << " (Debian's package postgresql)";
  database_ = make_database();
}

std::string OnBothDatabases::make_database() {
  if (is_server()) return PostgresServer::shared().make_database();
  return (folder_ / fmt::format("history {}.db", ++databases_)).string();
}

Night make_night(const MadeNight& made) {
  Night night;
  night.run.content = sha256(made.content);
  night.run.kind = "reliefbench";
  night.run.machine = made.machine;
  night.run.unix_s = made.unix_s;
  night.run.build = {.commit = "c-" + made.content, .parent = "p", .is_dirty = false};
  night.run.source = "out/" + made.content;
  night.run.health = {{"devices", {{{"backend", "null"}}}}};
  night.run.calibrations = {{.device = "null device", .control_ns = 1000 * made.factor, .mad = 10, .n = 30}};
  night.environment = {{"driver", made.driver}};
  for (int i = 0; i < made.cases; ++i) {
    Night::Value value;
    value.series.machine = made.machine;
    value.series.setting = fmt::format("cone@{}?steps={}", std::string(64, 'a'), i);
    value.series.case_id = fmt::format("cone@rocks/top?steps={}", i);
    value.series.scene = "rocks/top";
    value.series.scene_key = std::string(64, 'a');
    value.series.technique = "cone";
    value.series.map = "cone";
    value.series.format = "rg8";
    value.series.backend = "null";
    value.series.device = "null device";
    value.series.metric = "frame_time";
    value.series.unit = "ns";
    const double time = made.factor * (1000.0 + i) / 3;
    value.row.samples = {time * 0.99, time, time * 1.02};
    value.row.median = time;
    value.row.mad = time * 0.01;
    value.row.n = 3;
    value.row.value = time / 7;
    value.row.standard_error = 0.01 / 3;
    value.row.status = "ok";
    value.row.code = sha256("code" + std::to_string(i));
    value.score = fmt::format(R"({{"e_xy.p99":{},"psnr":null}})", i);
    night.values.push_back(value);
  }
  return night;
}

std::string content_of(const std::string& database) {
  const HistoryView view = History(database, History::Access::read).load({.with_samples = true});
  std::string text;
  for (const EnvironmentRow& row : view.environments)
    text += fmt::format("environment {} {} {}\n", row.id, row.hash, row.content.dump());
  for (const RunRow& row : view.runs) {
    text +=
        fmt::format("run {} {} {} {} {} {} {} {} {} {}\n", row.id, row.content, row.kind, row.machine, row.environment,
                    row.unix_s, row.build.commit, row.build.parent, row.build.is_dirty, row.health.dump());
    for (const CalibrationRow& c : row.calibrations)
      text += fmt::format("calibration {} {} {} {}\n", c.device, c.control_ns, c.mad, c.n);
  }
  for (std::size_t i = 0; i < view.series.size(); ++i) {
    const SeriesRow& row = view.series[i];
    text += fmt::format("series {} {} {} {} {} {} {} {} {} {} {} {} {} {}\n", row.id, row.machine, row.setting,
                        row.case_id, row.scene, row.scene_key, row.technique, row.map, row.format, row.backend,
                        row.device, row.metric, row.unit, row.lower_is_better);
    for (const RepetitionRow& r : view.nights[i])
      text += fmt::format("  {} {} {} {} {} {} {} {} {} {} [{}]\n", r.run, r.median, r.mad, r.n, r.value,
                          r.standard_error, r.is_valid, r.status, r.code, r.score, fmt::join(r.samples, " "));
  }
  for (const ScoreRow& row : view.scores) text += fmt::format("score {} {}\n", row.id, row.values.dump());
  for (const AnnotationRow& row : view.annotations)
    text += fmt::format("annotation {} {} {} {} {} {}\n", row.id, row.run, row.event, row.unix_s, row.by, row.text);
  for (const EventRow& row : view.events) {
    text += fmt::format("event {} {} {} {} {} {} {} {} {} {} {} {} {}\n", row.id, row.key, row.machine, row.kind,
                        row.what, row.good_run, row.bad_run, row.effect, row.low, row.high, row.q, row.algorithm,
                        fmt::join(row.series, " "));
    for (const EventStateRow& state : row.states)
      text += fmt::format("  {} {} {} {}\n", state.unix_s, event_state_id(state.state), state.by, state.text);
  }
  return text;
}

}  // namespace reliefbench
