// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <pybind11/pybind11.h>

#include "include/kerf/tick.hpp"

namespace kerf::python {

/// The name under which a scene has the law of its Python program.
inline constexpr const char* kPythonLaw = "python";

/// What the function gets: `kerf.LawInput`, doubles whatever the numbers of the servo.
struct LawValues {
  std::array<double, 3> tip_mm, scene_tip_mm, velocity_mm_per_s, spring_mm, normal;
  double stiffness_n_per_mm, damping_ns_per_mm;  ///< settings of the law, as a map varies them
};

/// A function of Python as the force law `python` of the scenes that this thread steps.
///
/// The servo finds it through the thread, since a law in a plan is plain bytes: a `LawInUse` puts
/// it there. The first call that raises, or returns something else than three finite numbers, is
/// the last one: from that tick on the law fails, and the servo latches its fault, motors off.
/// Ctrl-C in the function calls it a second time, so that a run can go on after it; the second one
/// in a row ends the function as any other exception does.
class __attribute__((visibility("hidden"))) LawFunction {
 public:
  explicit LawFunction(pybind11::function function) : function_(std::move(function)) {}

  /// The force in N, none if it failed. With the interpreter's lock.
  [[nodiscard]] std::optional<std::array<double, 3>> force(const LawValues& values) noexcept;

  [[nodiscard]] bool failed() const noexcept { return !problem_.empty(); }
  /// Ctrl-C came in a call that was repeated; true once.
  [[nodiscard]] bool take_interrupt() noexcept { return std::exchange(interrupted_, false); }
  /// Throws `Error` with the problem and the tick, its cause what the function raised.
  [[noreturn]] void raise(Tick tick) const;
  [[nodiscard]] const pybind11::function& function() const noexcept { return function_; }

 private:
  [[nodiscard]] std::array<double, 3> call(const LawValues& values);

  pybind11::function function_;
  std::string problem_;
  std::optional<pybind11::error_already_set> cause_;
  bool interrupted_ = false;
};

/// While it lives, `function` is the law of the scenes that this thread steps; none: null.
class LawInUse {
 public:
  explicit LawInUse(LawFunction* function) noexcept;
  ~LawInUse();
  LawInUse(const LawInUse&) = delete;
  LawInUse& operator=(const LawInUse&) = delete;

 private:
  LawFunction* before_;
};

}  // namespace kerf::python
