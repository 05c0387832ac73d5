#pragma once
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "tuner/measure/prepare.h"
#include "tuner/measure/sample_book.h"
#include "tuner/plan/config.h"

namespace reliefbench {

/// A case that cannot be drawn, found out when it was to be timed. Where its status is device_lost, the device is to be
/// opened again.
struct CaseFailed {
  Record record;
};

/// Draws batches of cases into a book, one at a time, with the control case between them.
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

  /// One more sample of a case; the first time it is compiled, uploaded and warmed up. throws: CaseFailed
  void draw(const Case& c, const SceneSpec& scene);
  /// Frees what it has on the device, which is made again when it is needed.
  void release() { ready_.clear(); }

 private:
  struct Ready {
    Case spec;
    PreparedCase prepared;
    int frames;  ///< of a batch
  };
  [[nodiscard]] Ready& ready(const Case& c, const SceneSpec& scene, const std::string& id);
  void draw_batch(const std::string& case_id, int frames, const std::function<double()>& run_ns);

  Context context_;
  std::map<std::string, std::unique_ptr<Ready>> ready_;  // by case id
  int until_control_ = 0;
};

}  // namespace reliefbench
