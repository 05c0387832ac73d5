#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace reliefbench {

/// The case that is being drawn, in a small file of the run's folder. A driver that dies takes the process with it: the
/// next start finds here which case it died of. At most one is alive in a process.
class CaseMark {
 public:
  /// How the earlier start ended, where it did so in the middle of a case.
  struct Death {
    std::string case_id;
    int signal = 0;  ///< that the process itself raised (SIGSEGV, ...); 0: killed from outside, power, memory
    int times = 1;   ///< ends without a signal, one after the other, while this case was drawn
  };

  /// Reads what the earlier start left and holds the file from now on. throws: FileError
  explicit CaseMark(std::filesystem::path path);
  /// Removes the file: whoever comes to an orderly end was not killed by a case.
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
  std::optional<Death> death_;
};

}  // namespace reliefbench
