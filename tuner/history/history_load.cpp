#include <algorithm>
#include <limits>
#include <unordered_map>

#include "tuner/history/connection.h"

namespace reliefbench {
namespace {

using Id = std::int64_t;
using Text = std::string;

/// What of a table `run r` a query asks for; with its parameters: since, machine, machine, run, run.
const Text kAsked =
    " JOIN machine m ON m.id = r.machine WHERE r.unix_s >= :since AND (:any = '' OR m.name = :machine)"
    " AND (:all = 0 OR r.id = :run)";

/// Reads the parts of a view.
class ViewReader {
 public:
  ViewReader(soci::session& sql, const History::Query& query)
      : sql_(sql), query_(query), since_(query.since_unix_s.value_or(std::numeric_limits<Id>::min())) {}

  HistoryView read() {
    read_runs();
    read_calibrations();
    read_environments();
    read_series();
    read_nights();
    if (query_.with_samples) read_samples();
    for (std::vector<RepetitionRow>& nights : view_.nights)
      std::ranges::sort(nights, {}, [&](const RepetitionRow& row) { return place_of_run_.at(row.run); });
    drop_series_without_nights();
    read_scores();
    view_.events = read_events(sql_, query_.machine);
    read_annotations();
    return std::move(view_);
  }

 private:
  /// each_row() of a query of `run r`, `kAsked` at its end.
  template <typename... Columns, typename Row>
  void each_asked(const Text& query, const Row& row) {
    each_row<Columns...>(sql_, query, row, since_, query_.machine, query_.machine, query_.run, query_.run);
  }

  void read_runs() {
    view_.is_whole = number_of(sql_,
                               "SELECT COUNT(*) FROM run r JOIN machine m ON m.id = r.machine WHERE r.unix_s < :since"
                               " AND (:any = '' OR m.name = :machine)",
                               since_, query_.machine, query_.machine) == 0;
    each_asked<Id, Text, Text, Text, Id, Id, Text, Text, int, Text, Text>(
        "SELECT r.id, r.content, r.kind, m.name, r.environment, r.unix_s, b.sha, b.parent, b.is_dirty, r.source, "
        "r.health FROM run r JOIN build b ON b.id = r.build" +
            kAsked + " ORDER BY r.unix_s, r.id",
        [&](Id id, const Text& content, const Text& kind, const Text& machine, Id environment, Id unix_s,
            const Text& commit, const Text& parent, int is_dirty, const Text& source, const Text& health) {
          place_of_run_.emplace(id, view_.runs.size());
          view_.runs.push_back({.id = id,
                                .content = content,
                                .kind = kind,
                                .machine = machine,
                                .environment = environment,
                                .unix_s = unix_s,
                                .build = {.commit = commit, .parent = parent, .is_dirty = is_dirty != 0},
                                .source = source,
                                .health = nlohmann::json::parse(health),
                                .calibrations = {}});
        });
  }

  void read_calibrations() {
    each_asked<Id, Text, double, double, int>(
        "SELECT c.run, c.device, c.control_ns, c.mad, c.n FROM calibration c JOIN run r ON r.id = c.run" + kAsked +
            " ORDER BY c.run, c.place",
        [&](Id run, const Text& device, double control_ns, double mad, int n) {
          view_.runs[place_of_run_.at(run)].calibrations.push_back(
              {.device = device, .control_ns = control_ns, .mad = mad, .n = n});
        });
  }

  void read_environments() {
    each_asked<Id, Text, Text>(
        "SELECT e.id, e.hash, e.content FROM environment e WHERE e.id IN (SELECT r.environment FROM run r" + kAsked +
            ") ORDER BY e.id",
        [&](Id id, const Text& hash, const Text& content) {
          view_.environments.push_back({.id = id, .hash = hash, .content = nlohmann::json::parse(content)});
        });
  }

  void read_series() {
    each_row<Id, Text, Text, Text, Text, Text, Text, Text, Text, Text, Text, Text, Text, int>(
        sql_,
        "SELECT s.id, m.name, s.setting, s.case_id, s.scene, s.scene_key, s.technique, s.map, s.format, s.backend, "
        "s.device, s.metric, s.unit, s.lower_is_better FROM series s JOIN machine m ON m.id = s.machine"
        " WHERE :any = '' OR m.name = :machine ORDER BY s.id",
        [&](Id id, const Text& machine, const Text& setting, const Text& case_id, const Text& scene,
            const Text& scene_key, const Text& technique, const Text& map, const Text& format, const Text& backend,
            const Text& device, const Text& metric, const Text& unit, int lower_is_better) {
          place_of_series_.emplace(id, view_.series.size());
          view_.series.push_back({.id = id,
                                  .machine = machine,
                                  .setting = setting,
                                  .case_id = case_id,
                                  .scene = scene,
                                  .scene_key = scene_key,
                                  .technique = technique,
                                  .map = map,
                                  .format = format,
                                  .backend = backend,
                                  .device = device,
                                  .metric = metric,
                                  .unit = unit,
                                  .lower_is_better = lower_is_better != 0});
        },
        query_.machine, query_.machine);
    view_.nights.resize(view_.series.size());
  }

  void read_nights() {
    std::unordered_map<Id, Text> shaders;
    each_row<Id, Text>(sql_, "SELECT id, hash FROM shader",
                       [&](Id id, const Text& hash) { shaders.emplace(id, hash); });
    shaders.emplace(0, "");
    each_asked<Id, Id, double, double, int, double, double, int, Text, Id, Id>(
        "SELECT p.run, p.series, p.median, p.mad, p.n, p.value, p.standard_error, p.is_valid, p.status, "
        "COALESCE(p.shader, 0), COALESCE(p.score, 0) FROM run r JOIN repetition p ON p.run = r.id" +
            kAsked,
        [&](Id run, Id series, double median, double mad, int n, double value, double standard_error, int is_valid,
            const Text& status, Id shader, Id score) {
          view_.nights[place_of_series_.at(series)].push_back({.run = run,
                                                               .median = median,
                                                               .mad = mad,
                                                               .n = n,
                                                               .value = value,
                                                               .standard_error = standard_error,
                                                               .is_valid = is_valid != 0,
                                                               .status = status,
                                                               .code = shaders.at(shader),
                                                               .score = score,
                                                               .samples = {}});
        });
  }

  void read_samples() {
    std::vector<std::unordered_map<Id, std::vector<double>*>> places(view_.series.size());
    for (std::size_t i = 0; i < places.size(); ++i)
      for (RepetitionRow& row : view_.nights[i]) places[i].emplace(row.run, &row.samples);
    each_asked<Id, Id, Text>(
        "SELECT p.run, p.series, p.raw FROM run r JOIN sample p ON p.run = r.id" + kAsked,
        [&](Id run, Id series, const Text& raw) { *places[place_of_series_.at(series)].at(run) = parse_samples(raw); });
  }

  void drop_series_without_nights() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < view_.series.size(); ++i) {
      if (view_.nights[i].empty()) continue;
      if (kept != i) {
        view_.series[kept] = std::move(view_.series[i]);
        view_.nights[kept] = std::move(view_.nights[i]);
      }
      ++kept;
    }
    view_.series.resize(kept);
    view_.nights.resize(kept);
  }

  void read_scores() {
    each_asked<Id, Text>(
        "SELECT s.id, s.content FROM score s WHERE s.id IN (SELECT p.score FROM run r JOIN repetition p ON p.run = "
        "r.id" +
            kAsked + ") ORDER BY s.id",
        [&](Id id, const Text& content) {
          view_.scores.push_back({.id = id, .values = nlohmann::json::parse(content)});
        });
  }

  void read_annotations() {
    each_row<Id, Id, Id, Id, Text, Text>(
        sql_, "SELECT id, COALESCE(run, 0), COALESCE(event, 0), unix_s, author, said FROM annotation ORDER BY id",
        [&](Id id, Id run, Id event, Id unix_s, const Text& by, const Text& text) {
          if (place_of_run_.contains(run) ||
              std::ranges::find(view_.events, event, &EventRow::id) != view_.events.end())
            view_.annotations.push_back(
                {.id = id, .run = run, .event = event, .unix_s = unix_s, .by = by, .text = text});
        });
  }

  soci::session& sql_;
  const History::Query& query_;
  Id since_;
  HistoryView view_;
  std::unordered_map<Id, std::size_t> place_of_run_;
  std::unordered_map<Id, std::size_t> place_of_series_;
};

}  // namespace

HistoryView read_history(soci::session& sql, const History::Query& query) { return ViewReader(sql, query).read(); }

std::int64_t History::runs_after(const std::string& machine, std::int64_t unix_s) const {
  Database& database = connection_->database;
  return database.guarded([&] {
    const Transaction transaction(database, Transaction::Kind::read);
    return number_of(database.sql(),
                     "SELECT COUNT(*) FROM run r JOIN machine m ON m.id = r.machine WHERE m.name = :machine"
                     " AND r.unix_s > :since",
                     storable(machine), unix_s);
  });
}

}  // namespace reliefbench
