// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/run/controller_options.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/sense.hpp"
#include "controller/servo/servo.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/wire/personality.hpp"

// `--probe`: shows a device with its motors off.

namespace kerf {

/// Summary of the reports of a device so far: the servo's own processing of encoders, pots and
/// pose, in double, without a servo. Steps and gaps are measured from one `take` to the next.
class ProbeView {
 public:
  /// `rate_hz`: rate of the calls of `take`.
  ProbeView(const DeviceSettings& device, int rate_hz);

  /// Call once per tick; `now_ns` is the clock of the host.
  void take(const DeviceReport& report, std::int64_t now_ns) noexcept;

  struct Seen {
    std::uint64_t ticks = 0;                          ///< since the first report
    std::uint64_t reports = 0;                        ///< ticks with a fresh one
    double longest_gap_ms = 0;                        ///< between fresh ones
    std::array<std::int32_t, 3> lowest{}, highest{};  ///< counts since the first report
    std::array<bool, 2> pressed{};                    ///< buttons, ever
    bool parked = false, homed = false;               ///< ever
    bool calibrated = false;                          ///< parked at rest, homed: the pose is valid
  };
  [[nodiscard]] const Seen& seen() const noexcept { return seen_; }
  [[nodiscard]] const DeviceReport& last() const noexcept { return last_; }
  /// In the frame of the device; invalid until `calibrated`.
  [[nodiscard]] std::array<double, 3> tip_mm() const noexcept;

  /// The last report on one line of at most 100 characters.
  [[nodiscard]] std::string line() const;

 private:
  DevicePlan<DoubleNumbers> plan_;
  SafetyTiming timing_;
  EncoderState encoders_;
  std::array<std::int32_t, 3> travelled_{};  ///< counts since the first report, beyond the wrap
  DeviceReport last_;
  std::int64_t last_ns_ = 0;
  Seen seen_;
};

/// `kerf-controller --probe`: shows the reports of a device, with its motors always off.
///
/// With a port: opens it, prints the reports of the device once a second (on a terminal: one line,
/// ten times a second), until `seconds` or a signal; then lists what is missing and writes the
/// report. Without one: lists the connected devices, and what this user and machine lack.
///
/// Exit code: 0 success; 1 if a port was opened and no report came, or, without one, if the device
/// of --device is not connected. Throws std::exception with one line if the port cannot be opened.
[[nodiscard]] int run_probe(const ControllerOptions& options);

// Device nodes on this machine, and the missing rights to them.

/// A device with a driver in kerf, as the kernel lists it.
struct DeviceNode {
  Personality personality{};
  std::string path;    ///< of its node in /dev; of the Inverse3 its service's address
  int open_error = 0;  ///< errno of opening it as this user; 0: may read and write
};

/// All such devices, by sysfs: SensAble's vendor on FireWire, the ids of the Falcon on USB and of
/// WoodenHaptics on HID; an Inverse3 on USB whose service listens. Opens nothing, so it disturbs no
/// device. `root` stands for `/` in tests.
[[nodiscard]] std::vector<DeviceNode> list_device_nodes(const std::filesystem::path& root = "/");

/// One thing that a device or the servo lacks on this machine, and the command that provides it.
struct SetupProblem {
  std::string what;
  std::string cure;
};

/// What this user lacks for a device: a node, or the right to open it. `which`: only this kind,
/// which must be connected; if empty, all connected devices. `root` as above.
[[nodiscard]] std::vector<SetupProblem> lacks_of_nodes(std::optional<Personality> which,
                                                       std::span<const DeviceNode> nodes,
                                                       const std::filesystem::path& root = "/");

/// What the servo thread lacks: real-time priority, locked memory. Tries both on threads and limits
/// of this process, and restores them.
[[nodiscard]] std::vector<SetupProblem> lacks_of_rights();

}  // namespace kerf
