// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
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

/// Cut to what the header holds.
void set_build_id(SegmentHeader& header, std::string_view build_id);

/// Fills what every segment has and all places, from the volumes' sizes (`off_labels` not 0: has
/// labels), the scene's size and the slots of the dirty ring.
void lay_out(SegmentPlan& plan);

/// Checks a plan that is laid out, by the rules of `parse_segment`. Throws `SegmentError`.
void check_plan(const SegmentPlan& plan);

}  // namespace kerf
