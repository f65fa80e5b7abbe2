// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

#include "controller/servo/servo.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "tests/golden/golden_script.hpp"

// What a golden run is compared by: a chain over its ticks, and the known ends of it. No heap.

namespace kerf::test {

inline constexpr std::int32_t kPenetrationTicks = 50;  ///< the penetration is hashed once in these

/// FNV-1a over every figure of every tick's output.
class GoldenHash {
 public:
  explicit constexpr GoldenHash(GoldenScene scene) noexcept : scene_(scene) {}

  void add(double number) noexcept { add_word(std::bit_cast<std::uint64_t>(number)); }

  void add(const ServoOutput& out) noexcept {
    add_all(out.gimbal_rad);
    add_all(out.position_mm);
    add_all(out.rotation);
    add_all(out.velocity_mm_per_s);
    add_all(out.commanded_force_n);
    add_all(out.contact_force_n);
    add_all(out.modification_n);
    add_all(out.torque_n_mm);
    add(out.absorbed_mj);
    for (const VoxelBox& box : out.changed) {
      for (const std::int64_t edge : {box.lo.x, box.lo.y, box.lo.z, box.hi.x, box.hi.y, box.hi.z}) {
        add_word(static_cast<std::uint64_t>(edge));
      }
    }
    add_word(static_cast<std::uint64_t>(out.fault));
    add_word(out.output_hash);  // motor counts, removal, phase
    if (scene_ != GoldenScene::sweep) return;
    add_all(out.proxy_offset_mm);
    add_all(out.tip_torque_n_mm);
    for (const double part : {out.press_n, out.spindle_ratio, out.spindle_load}) add(part);
    add_word(static_cast<std::uint64_t>(out.forbidden));
  }

  [[nodiscard]] std::uint64_t value() const noexcept { return hash_; }

 private:
  void add_all(const auto& numbers) noexcept {
    for (const double number : numbers) add(number);
  }
  void add_word(std::uint64_t word) noexcept { hash_ = fnv1a_bytes(hash_, word); }

  GoldenScene scene_;
  std::uint64_t hash_ = kFnv1aBasis;
};

/// The known bits of a run, on every compiler, optimisation level, instruction set and processor
/// (docs/determinism.md).
struct GoldenEnd {
  std::uint64_t hash, volume_hash;  ///< of the outputs; of the volumes at the end
};

/// In fixed point, or in double. `sweep` has no known end in double.
[[nodiscard]] constexpr GoldenEnd golden_end(GoldenScene scene, bool fixed) noexcept {
  switch (scene) {
    case GoldenScene::mill:
      return fixed ? GoldenEnd{0x8d45427d5148a702, 0x74b9e6fd06a55a59}
                   : GoldenEnd{0x8677bb41cce7a324, 0xa83c05782744d479};
    case GoldenScene::feel:  // its volumes stay as they were made
      return fixed ? GoldenEnd{0x6188439df44ff8cb, 0xa62142e8a8487868}
                   : GoldenEnd{0xa04461e2d118c546, 0xa62142e8a8487868};
    case GoldenScene::sweep:
      break;
  }
  return fixed ? GoldenEnd{0x2fdc5a1b388ea9eb, 0x42b4f24ec554b65d} : GoldenEnd{};
}

}  // namespace kerf::test
