#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace reliefbench {

/// The case that is being drawn, in a small file of the run's folder: where the process ends in the middle of it (a
/// driver may take the whole machine with it), the next start finds here which one it was. Whoever stops the process
/// (kStopSignals) says nothing of the case: where nobody else heeds these signals, they clear the mark first.
class CaseMark {
 public:
  /// Where the earlier start ended in the middle of a case.
  struct Death {
    std::string case_id;
    int times = 1;  ///< such ends, one after the other, in this case: 1 or 2

    /// One end says nothing (kill -9, power), a second one that the case is at fault. What comes after that is counted
    /// anew: whoever asks again is obeyed again.
    [[nodiscard]] bool is_its_fault() const { return times == 2; }
  };

  /// Reads what the earlier start left and holds the file from now on. throws: FileError
  explicit CaseMark(std::filesystem::path path);
  /// Removes the file: whoever comes to an orderly end was not ended by a case.
  ~CaseMark();
  CaseMark(const CaseMark&) = delete;
  CaseMark& operator=(const CaseMark&) = delete;

  [[nodiscard]] const std::optional<Death>& death() const { return death_; }

  /// Marks a case for as long as the object lives.
  class Hold {
   public:
    Hold(CaseMark& mark, std::string_view case_id) : mark_(mark) { mark_.set(case_id); }
    ~Hold() { mark_.clear(); }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    CaseMark& mark_;
  };
  /// throws: FileError
  [[nodiscard]] Hold hold(std::string_view case_id) { return {*this, case_id}; }

 private:
  void set(std::string_view case_id);
  void clear() noexcept;

  std::filesystem::path path_;
  int fd_ = -1;
  int outer_fd_ = -1;  ///< of the mark that signals cleared before
  std::optional<Death> death_;
};

}  // namespace reliefbench
