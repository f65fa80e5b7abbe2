// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "shared/segment/reader.hpp"

namespace kerf::bridge {

/// OpenIGTLink's device name of each volume: its name in the scene, at most 20 bytes, each another;
/// "volume 1" and so on where the scene's text does not tell.
[[nodiscard]] std::vector<std::string> device_names(const SegmentInfo& segment);

/// Of the labels of volumes of these names: "NAME labels", by the same rules.
[[nodiscard]] std::vector<std::string> label_names(const std::vector<std::string>& volumes);

}  // namespace kerf::bridge
