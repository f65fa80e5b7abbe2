// SPDX-License-Identifier: Apache-2.0

#include "bridge/wire/messages.hpp"

#include <algorithm>
#include <iterator>

namespace kerf::bridge {

BlockPlan::BlockPlan(std::uint32_t scene_bytes, std::span<const VolumeDescriptor> volumes) {
  constexpr auto kText = static_cast<std::uint32_t>(kTextBlockBytes);
  add(BlockKind::text, 0, scene_bytes / kText + (scene_bytes % kText != 0 ? 1 : 0));
  const auto each = [&](BlockKind kind, auto wanted) {
    for (std::uint32_t i = 0; i < volumes.size(); ++i) {
      if (wanted(volumes[i])) add(kind, i, volumes[i].brick_count);
    }
  };
  each(BlockKind::density, [](const VolumeDescriptor&) { return true; });
  each(BlockKind::labels, [](const VolumeDescriptor& volume) { return volume.off_labels != 0; });
}

void BlockPlan::add(BlockKind kind, std::uint32_t volume, std::uint32_t count) {
  if (count == 0) return;
  planes_.push_back({kind, volume, count_, count});
  count_ += count;
}

const BlockPlane& BlockPlan::plane_of(std::uint32_t id) const noexcept {
  const auto after = std::upper_bound(
      planes_.begin(), planes_.end(), id,
      [](std::uint32_t wanted, const BlockPlane& plane) { return wanted < plane.first; });
  return *std::prev(after);
}

}  // namespace kerf::bridge
