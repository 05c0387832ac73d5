#pragma once
#include <functional>
#include <string>

#include "tuner/measure/timing.h"

namespace reliefbench {

/// A block during which the device was held back is drawn again so often, after a pause in which it may cool.
inline constexpr int kMostAgain = 2;
inline constexpr double kCoolingPause_s = 5;
/// Where the control case takes so many times what it took when it was calibrated, the device is not itself.
inline constexpr double kThrottledRatio = 4;

/// What says that a device was held back while a block was drawn; "" where nothing does. That is
/// - a thermal or hardware slowdown that the driver tells afterwards, and did not when the control case was calibrated,
/// - a count of the processor's slowdowns that has risen,
/// - a clock that afterwards is below nine tenths of the calibration's, borne out by a power cap or a control case that
///   ran slower by as much: a driver lowers the clock of a device that has nothing to do, too,
/// - the control case at less than 1 / most_slowdown of its calibrated speed.
/// A power cap alone is none: many devices draw at theirs, and the control case takes out what that costs.
/// control_slowdown: the control case's time in the block, over the calibrated one
[[nodiscard]] std::string held_back_by(const DeviceState& calibrated, const DeviceState& before,
                                       const DeviceState& after, double control_slowdown,
                                       double most_slowdown = kThrottledRatio);

/// That the driver told of a thermal or hardware slowdown when the control case was calibrated, which is no change
/// then: the run's times are those of such a device. "" where it told of none.
[[nodiscard]] std::string held_back_note(const Session& session);

/// Draws a block of samples, with the device's state read before and after, neither inside a batch. Where it was held
/// back, the book forgets the block, and it is drawn again.
/// draw: time()s what the book lacks. most_slowdown: infinite for blocks so short that another process may slow all of
/// their few batches
/// returns: what says that the device was still held back when it was drawn last; "" where it was not
[[nodiscard]] std::string draw_block(const Timing& timing, const std::function<void()>& draw,
                                     double most_slowdown = kThrottledRatio);

}  // namespace reliefbench
