// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "hil/device/hand_script.hpp"
#include "hil/script/fault_script.hpp"
#include "lab/safety/emulated_program.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::faults {

/// One emulated device, its driver and the servo step in virtual time, with faults between them.
struct FaultCase {
  const LoadedScene& scene;  ///< its device is the one that is emulated
  const HandScript& hand;
  bool by_service = false;  ///< an Inverse3 behind its emulated service: see ServiceLink
  /// So long after the first push a signal asks the controller to end, as in its MotorGuard: the
  /// motors go off for good, the tick under way is the last one.
  std::optional<double> stop_s{};
  /// Of the program, if the scene's force is external; it goes wrong with the first push.
  ProgramWay program = ProgramWay::steady;
};

/// Whether this program was built with the Inverse3's service.
#ifdef KERF_LAB_HAS_SERVICE
inline constexpr bool kHasService = true;
#else
inline constexpr bool kHasService = false;
#endif

/// The findings of a run on the safety contract (docs/safety.md), by the wire, the emulated device
/// and its clock.
struct FaultOutcome {
  std::vector<std::string> violations;  ///< the first few, with their times
  std::uint64_t violation_count = 0;
  std::string inconclusive;  ///< the reason if the run shows nothing, else empty
  std::uint64_t faults_begun = 0;
  double peak_n = 0;             ///< commanded
  double device_peak_n = 0;      ///< of the motors at the true tip
  double steepest_n_per_ms = 0;  ///< change of the command, but for letting go
  double rms_n = 0;              ///< of the command, over 10 s
  double longest_alone_ms = 0;   ///< motors on without a newer packet
  double slowest_off_ms = 0;     ///< from the packet that switched the motors off to no torque
  std::string demanded;          ///< of the words of FaultScript::latches; empty: none
  std::string latched = "none";  ///< the first fault that the reports amounted to
  double latch_ms = 0;           ///< from the newest fault of the script before that to it
  bool pushed = false;           ///< there was a force to go wrong
  bool pushed_again = false;     ///< and again after the last fault
};

/// Returns true if a device has the part that this kind of fault breaks. `by_service`: as in
/// FaultCase; such messages have no numbers.
[[nodiscard]] bool concerns(FaultKind kind, Personality personality,
                            bool by_service = false) noexcept;

/// Plays `script` on `subject`, each seed at another moment of the hand's motion. The same
/// arguments give the same outcome.
[[nodiscard]] FaultOutcome run_faults(const FaultCase& subject, const FaultScript& script);

}  // namespace kerf::faults
