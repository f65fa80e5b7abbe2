// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "shared/wire/personality.hpp"

// Device nodes on this machine, and the missing rights to them.

namespace kerf {

/// A device with a driver in kerf, as the kernel lists it.
struct DeviceNode {
  Personality personality = Personality::omni;
  std::string path;    ///< of its node in /dev
  int open_error = 0;  ///< errno of opening it as this user; 0: may read and write
};

/// All such devices, by sysfs: SensAble's vendor on FireWire, the ids of the Falcon on USB and of
/// WoodenHaptics on HID. Opens nothing, so it disturbs no device. `root` stands for `/` in tests.
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
