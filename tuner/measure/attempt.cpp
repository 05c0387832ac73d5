#include "tuner/measure/attempt.h"

#include <fmt/format.h>

#include <optional>

#include "tuner/measure/timing.h"

namespace reliefbench {
namespace {

/// The record of a failure; none where there was none.
std::optional<Record> failure_of(const std::function<void()>& work) {
  Record failed;
  try {
    work();
    return std::nullopt;
  } catch (const CaseFailed& failure) {
    return failure.record;
  } catch (const Error& error) {
    if (error.code() == Exit::bad_input) throw;
    enter_failure(failed, Status::unsupported);
  } catch (...) {
    enter_failure(failed, Status::unsupported);
  }
  return failed;
}

}  // namespace

std::string attempt(Session& session, const std::function<void()>& work, const std::function<void()>& release) {
  for (bool is_again = false;; is_again = true) {
    const std::optional<Record> failed = failure_of(work);
    if (!failed) return "";
    const bool is_lost = session.is_lost(failed->status);
    if (is_lost) {
      release();
      session.reopen();
    }
    if (!is_lost || is_again) return fmt::format("{}: {}", status_id(failed->status), failed->reason);
  }
}

}  // namespace reliefbench
