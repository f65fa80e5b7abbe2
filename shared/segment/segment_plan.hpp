// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "shared/segment/layout.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// Where everything goes: the static header and the descriptors, filled except for the magic, the
/// session, the start time and the content hashes.
struct SegmentPlan {
  SegmentHeader header{};
  std::vector<VolumeDescriptor> volumes;
};

/// Checks `spec` and lays it out. Throws `SegmentError`.
[[nodiscard]] SegmentPlan plan_segment(const SegmentSpec& spec);

}  // namespace kerf
