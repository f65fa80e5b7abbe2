// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/shell/probe/probe_nodes.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// One thing that a device or the servo lacks on this machine, and the command that cures it.
struct Lack {
  std::string what;
  std::string cure;
};

/// What stands between this user and a device: no node, no right to it. `which`: only this kind,
/// and its absence is a lack; none: rights to those that are there. `root` as in probe_nodes.hpp.
[[nodiscard]] std::vector<Lack> lacks_of_nodes(std::optional<Personality> which,
                                               std::span<const DeviceNode> nodes,
                                               const std::filesystem::path& root = "/");

/// What the servo thread lacks: real-time priority, locked memory. Tries both on threads and
/// limits of this process, and leaves them as they were.
[[nodiscard]] std::vector<Lack> lacks_of_rights();

}  // namespace kerf
