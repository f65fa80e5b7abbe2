// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "shared/wire/personality.hpp"

namespace kerf {

/// A device that kerf has a driver for, as the kernel shows it.
struct DeviceNode {
  Personality personality = Personality::omni;
  std::string path;    ///< of its node in /dev
  int open_error = 0;  ///< errno that this user would meet on opening it; 0: may read and write
};

/// All of them, by sysfs: SensAble's vendor on FireWire, the ids of the Falcon on USB and of
/// WoodenHaptics on HID. Opens nothing, so it disturbs no device. `root` stands for `/` in tests.
[[nodiscard]] std::vector<DeviceNode> list_device_nodes(const std::filesystem::path& root = "/");

}  // namespace kerf
