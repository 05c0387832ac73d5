#pragma once
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "tuner/measure/prepare.h"
#include "tuner/measure/sample_book.h"
#include "tuner/plan/config.h"

namespace reliefbench {

/// A case that cannot be drawn, found out when it was to be timed. Where Session::is_lost() says so, the device is
/// to be opened again.
struct CaseFailed {
  Record record;
};

/// Draws batches of cases into a book, in rounds, with the control case before, after and between them.
class DeviceTimes {
 public:
  struct Context {
    Session& session;
    Preparer& preparer;
    SampleBook& book;
    WallSplit& split;
    CaseMark& mark;
    const MeasureSpec& measure;
    double started_ns;  ///< of the run, ns since 1970: Sample::at_ns is 0 there
  };
  explicit DeviceTimes(Context context) : context_(context) {}

  struct Wanted {
    Case spec;
    const SceneSpec* scene = nullptr;
  };
  /// One more sample of each case, in this order; a case may be there more than once. The first time it is compiled,
  /// uploaded and warmed up, before the round. throws: CaseFailed
  void draw(std::span<const Wanted> round);
  /// Frees what it has on the device, which is made again when it is needed.
  void release() { ready_.clear(); }

 private:
  struct Ready {
    Case spec;
    PreparedCase prepared;
    int frames;  ///< of a batch
  };
  [[nodiscard]] Ready& ready(const Wanted& wanted, const std::string& id);

  Context context_;
  std::map<std::string, std::unique_ptr<Ready>> ready_;  // by case id
};

}  // namespace reliefbench
