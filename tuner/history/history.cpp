#include "tuner/history/history.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <set>
#include <unordered_map>

#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/history/connection.h"
#include "tuner/history/migrations.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

constexpr std::size_t kLongestName = 255;  // bytes, of what is looked up by its text

/// JSON with sorted keys; bytes that are no UTF-8 are replaced, NUL is escaped.
std::string stored_json(const nlohmann::json& content) { return json_text(content, -1); }

void check_name(std::string_view what, const std::string& name) {
  if (name.size() > kLongestName)
    fail_input("{} '{}...': {} bytes, expected at most {}", what, name.substr(0, 40), name.size(), kLongestName);
}

void check_night(const Night& night) {
  const RunRow& run = night.run;
  if (run.machine.empty()) fail_input("{}: the machine has no name", run.source);
  check_name("machine", run.machine);
  check_name("commit", run.build.commit);
  check_name("parent", run.build.parent);
  for (const Night::Value& value : night.values) {
    const RepetitionRow& row = value.row;
    for (const double number : {row.median, row.mad, row.value, row.standard_error})
      if (!std::isfinite(number)) fail_input("{}: case '{}': a number is {}", run.source, value.series.case_id, number);
    for (const double sample : row.samples)
      if (!std::isfinite(sample)) fail_input("{}: case '{}': a sample is {}", run.source, value.series.case_id, sample);
  }
}

/// What a series is, whatever people call its case.
std::string series_key(const SeriesRow& series) {
  std::string text;
  for (const std::string* part : {&series.machine, &series.setting, &series.device, &series.metric, &series.unit})
    text += fmt::format("{}:{}\n", part->size(), *part);
  return sha256(text);
}

/// A table whose rows are stored once: hash -> id.
class Interned {
 public:
  /// hashes: all that will be asked for
  Interned(soci::session& sql, const std::string& table, std::span<const std::string> hashes)
      : next_(next_id(sql, table)) {
    for (std::size_t begin = 0; begin < hashes.size(); begin += kRowsAtOnce) {
      const auto some = hashes.subspan(begin, std::min(kRowsAtOnce, hashes.size() - begin));
      std::string places;
      for (std::size_t i = 0; i < some.size(); ++i) places += fmt::format("{}:h{}", i == 0 ? "" : ", ", i);
      each_row<std::string, std::int64_t>(
          sql, fmt::format("SELECT hash, id FROM {} WHERE hash IN ({})", table, places),
          [&](const std::string& hash, std::int64_t id) { ids_.emplace(hash, id); }, some);
    }
  }

  /// add: called with the id of what is new
  template <typename Add>
  std::int64_t id(const std::string& hash, const Add& add) {
    const auto [place, is_new] = ids_.try_emplace(hash, next_);
    if (is_new) add(next_++);
    return place->second;
  }

 private:
  std::int64_t next_;
  std::unordered_map<std::string, std::int64_t> ids_{};
};

std::int64_t environment_id(soci::session& sql, const nlohmann::json& environment) {
  const std::string content = stored_json(environment);
  const std::string hash = sha256(content);
  return Interned(sql, "environment", {&hash, 1}).id(hash, [&](std::int64_t id) {
    insert_row(sql, "environment (id, hash, content)", id, hash, content);
  });
}

std::int64_t build_id(soci::session& sql, const BuildRow& build) {
  const std::string sha = storable(build.commit);
  const std::string parent = storable(build.parent);
  const int is_dirty = build.is_dirty ? 1 : 0;
  std::int64_t id =
      number_of(sql, "SELECT id FROM build WHERE sha = :sha AND parent = :parent AND is_dirty = :is_dirty", sha, parent,
                is_dirty);
  if (id == 0) {
    id = next_id(sql, "build");
    insert_row(sql, "build (id, sha, parent, is_dirty)", id, sha, parent, is_dirty);
  }
  return id;
}

std::int64_t write_run(soci::session& sql, const Night& night, std::int64_t machine) {
  const RunRow& run = night.run;
  const std::int64_t id = next_id(sql, "run");
  insert_row(sql, "run (id, content, origin, kind, machine, environment, build, unix_s, source, health)", id,
             run.content, night.origin.empty() ? run.content : night.origin, run.kind, machine,
             environment_id(sql, night.environment), build_id(sql, run.build), run.unix_s, storable(run.source),
             stored_json(run.health));
  Insert<std::int64_t, int, std::string, double, double, int> calibration(
      sql, "calibration (run, place, device, control_ns, mad, n)");
  int place = 0;
  for (const CalibrationRow& row : run.calibrations)
    calibration(id, place++, storable(row.device), row.control_ns, row.mad, row.n);
  calibration.write();
  return id;
}

/// The series of a machine, of which a night adds those that are new.
class SeriesTable {
 public:
  SeriesTable(soci::session& sql, std::int64_t machine)
      : machine_(machine),
        next_(next_id(sql, "series")),
        insert_(sql,
                "series (id, key, machine, setting, case_id, scene, scene_key, technique, map, format, backend, "
                "device, metric, unit, lower_is_better)") {
    each_row<std::string, std::int64_t>(
        sql, "SELECT key, id FROM series WHERE machine = :machine",
        [&](const std::string& key, std::int64_t id) { ids_.emplace(key, id); }, machine);
  }

  std::int64_t id(const SeriesRow& row) {
    const auto [place, is_new] = ids_.try_emplace(series_key(row), next_);
    if (is_new)
      insert_(next_++, place->first, machine_, storable(row.setting), storable(row.case_id), storable(row.scene),
              storable(row.scene_key), storable(row.technique), storable(row.map), storable(row.format),
              storable(row.backend), storable(row.device), storable(row.metric), storable(row.unit),
              row.lower_is_better ? 1 : 0);
    return place->second;
  }
  void write() { insert_.write(); }

 private:
  using Text = std::string;
  std::int64_t machine_;
  std::int64_t next_;
  std::unordered_map<std::string, std::int64_t> ids_;
  Insert<std::int64_t, Text, std::int64_t, Text, Text, Text, Text, Text, Text, Text, Text, Text, Text, Text, int>
      insert_;
};

/// What the values' rows refer to in tables where each thing stands once; "" is nothing.
struct Hashes {
  std::vector<std::string> code{};   ///< parallel to the values
  std::vector<std::string> score{};  ///< ditto
};
Hashes hashes_of(const Night& night) {
  Hashes hashes;
  for (const Night::Value& value : night.values) {
    hashes.code.push_back(storable(value.row.code));
    hashes.score.push_back(value.score ? sha256(*value.score) : "");
  }
  return hashes;
}

void write_values(soci::session& sql, const Night& night, std::int64_t run, std::int64_t machine) {
  const Hashes hashes = hashes_of(night);
  SeriesTable series(sql, machine);
  Interned shaders(sql, "shader", hashes.code);
  Interned scores(sql, "score", hashes.score);
  Insert<std::int64_t, std::string> shader(sql, "shader (id, hash)");
  Insert<std::int64_t, std::string, std::string> score(sql, "score (id, hash, content)");
  Insert<std::int64_t, std::int64_t, double, double, int, double, double, int, std::string, OptionalId, OptionalId>
      repetition(sql,
                 "repetition (run, series, median, mad, n, value, standard_error, is_valid, status, shader, score)");
  Insert<std::int64_t, std::int64_t, std::string> samples(sql, "sample (run, series, raw)");
  for (std::size_t i = 0; i < night.values.size(); ++i) {
    const Night::Value& value = night.values[i];
    const RepetitionRow& row = value.row;
    OptionalId code;
    if (const std::string& hash = hashes.code[i]; !hash.empty())
      code.id = shaders.id(hash, [&](std::int64_t id) { shader(id, hash); });
    OptionalId result;
    if (const std::string& hash = hashes.score[i]; !hash.empty())
      result.id = scores.id(hash, [&](std::int64_t id) { score(id, hash, storable(*value.score)); });
    const std::int64_t id = series.id(value.series);
    repetition(run, id, row.median, row.mad, row.n, row.value, row.standard_error, row.is_valid ? 1 : 0,
               storable(row.status), code, result);
    if (!row.samples.empty()) samples(run, id, stored_samples(row.samples));
  }
  series.write();
  shader.write();
  score.write();
  repetition.write();  // refers to those
  samples.write();
}

/// throws: Error(bad_input): the run was imported before it was gone on with
void check_origin(soci::session& sql, const Night& night, const std::string& database) {
  if (night.origin.empty()) return;
  const std::int64_t earlier = number_of(sql, "SELECT id FROM run WHERE origin = :origin", night.origin);
  if (earlier != 0)
    fail_input("{}: an earlier state of it is run {} of {}, whose rows are never altered; import it into a new history",
               night.run.source, earlier, database);
}

/// throws: Error(bad_input): what was measured is there, alone or in a merged run: a night would count twice
void check_parts(soci::session& sql, const Night& night, const std::string& database) {
  for (const std::string& part : night.parts)
    if (const std::int64_t run = number_of(sql, "SELECT run FROM run_part WHERE part = :part", part); run != 0)
      fail_input("{}: run {} of {} was measured with it, in part or whole; import a merged run or its parts, not both",
                 night.run.source, run, database);
}

void write_parts(soci::session& sql, const Night& night, std::int64_t run) {
  Insert<std::string, std::int64_t> insert(sql, "run_part (part, run)");
  for (const std::string& part : std::set(night.parts.begin(), night.parts.end())) insert(part, run);
  insert.write();
}

}  // namespace

std::int64_t next_id(soci::session& sql, const std::string& table) {
  return number_of(sql, "SELECT COALESCE(MAX(id), 0) + 1 FROM " + table);
}

std::int64_t machine_id(soci::session& sql, const std::string& name) {
  const std::string stored = storable(name);
  std::int64_t id = number_of(sql, "SELECT id FROM machine WHERE name = :name", stored);
  if (id == 0) {
    id = next_id(sql, "machine");
    insert_row(sql, "machine (id, name)", id, stored);
  }
  return id;
}

History::History(const std::string& database, Access access)
    : connection_(std::make_unique<Connection>(database, access == Access::write)) {
  Database& opened = connection_->database;
  opened.guarded([&] { access == Access::write ? migrate(opened) : check_schema(opened); });
}

History History::existing(const std::string& database) {
  {
    Database looked(database, /*may_write=*/false);
    looked.guarded([&] { check_is_history(looked); });
  }
  return History(database, Access::write);
}

History::~History() = default;

const std::string& History::name() const { return connection_->database.shown(); }

std::optional<std::int64_t> History::add(const Night& night) {
  check_night(night);
  Database& database = connection_->database;
  return database.guarded([&]() -> std::optional<std::int64_t> {
    soci::session& sql = database.sql();
    Transaction transaction(database, Transaction::Kind::write);
    if (number_of(sql, "SELECT COUNT(*) FROM run WHERE content = :content", night.run.content) > 0) return std::nullopt;
    check_origin(sql, night, database.shown());
    check_parts(sql, night, database.shown());
    const std::int64_t machine = machine_id(sql, night.run.machine);
    const std::int64_t run = write_run(sql, night, machine);
    write_parts(sql, night, run);
    write_values(sql, night, run, machine);
    transaction.commit();
    return run;
  });
}

HistoryView History::load(const Query& query) const {
  Database& database = connection_->database;
  return database.guarded([&] {
    const Transaction transaction(database, Transaction::Kind::read);
    return read_history(database.sql(), query);
  });
}

void History::annotate(const AnnotationRow& annotation) {
  Database& database = connection_->database;
  database.guarded([&] {
    soci::session& sql = database.sql();
    Transaction transaction(database, Transaction::Kind::write);
    const bool is_of_run = annotation.run != 0;
    const std::int64_t what = is_of_run ? annotation.run : annotation.event;
    if (number_of(sql,
                  is_of_run ? "SELECT COUNT(*) FROM run WHERE id = :id" : "SELECT COUNT(*) FROM event WHERE id = :id",
                  what) == 0)
      fail_input("{}: has no {} {}", database.shown(), is_of_run ? "run" : "event", what);
    insert_row(sql, "annotation (id, run, event, unix_s, author, said)", next_id(sql, "annotation"),
               OptionalId{annotation.run}, OptionalId{annotation.event}, annotation.unix_s, storable(annotation.by),
               storable(annotation.text));
    transaction.commit();
  });
}

std::vector<std::int64_t> History::add_events(std::span<const EventRow> events) {
  if (events.empty()) return {};
  Database& database = connection_->database;
  return database.guarded([&] {
    Transaction transaction(database, Transaction::Kind::write);
    std::vector<std::int64_t> ids = write_events(database.sql(), events);
    transaction.commit();
    return ids;
  });
}

}  // namespace reliefbench
