#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/temp_folder.h"
#include "tuner/history/history.h"

namespace reliefbench {

inline constexpr History::Access kRead = History::Access::read;
inline constexpr History::Access kWrite = History::Access::write;

/// A PostgreSQL server of Debian's package, in a folder of its own and on a socket there.
class PostgresServer {
 public:
  /// Whether the package is installed.
  [[nodiscard]] static bool is_installed();
  /// The test process's own server, started when it is first asked for.
  [[nodiscard]] static PostgresServer& shared();

  PostgresServer();
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  /// The URL of a new, empty database.
  [[nodiscard]] std::string make_database();
  /// Stops it without waiting for its clients, as a crash does.
  void stop();
  void start();

 private:
  std::filesystem::path folder_;
  int databases_ = 0;
};

/// A test on both databases, each with a database of its own. GetParam(): "sqlite" or "postgresql"
class OnBothDatabases : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override;
  [[nodiscard]] bool is_server() const { return GetParam() == "postgresql"; }
  /// Another empty database of the kind.
  [[nodiscard]] std::string make_database();

  TempFolder folder_;
  std::string database_;

 private:
  int databases_ = 0;
};

/// For INSTANTIATE_TEST_SUITE_P.
inline const auto kBothDatabases = ::testing::Values("sqlite", "postgresql");
[[nodiscard]] inline std::string database_kind(const ::testing::TestParamInfo<std::string>& info) { return info.param; }

/// A night, made up: `cases` series of one device with three samples each.
struct MadeNight {
  std::string content = "one";  ///< its hash, and of what it is made
  std::int64_t unix_s = 1'795'348'800;
  int cases = 4;
  std::string machine = "farm";
  std::string driver = "driver 1";  ///< in the environment
  double factor = 1;                ///< on all times
};
[[nodiscard]] Night make_night(const MadeNight& made);

/// All that a history holds, as text: equal of two that hold the same. Ids are in it.
[[nodiscard]] std::string content_of(const std::string& database);

}  // namespace reliefbench
