// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "shared/segment/layout.hpp"
#include "shared/volume/brick_grid.hpp"

// For a segment's writer: errors, the content at tick 0, the layout plan, the memory.

namespace kerf {

/// A segment cannot be made, reached or trusted. One line: "place: value; remedy".
class SegmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// No controller of that name answers. The caller may try again, unlike after any other
/// SegmentError.
class SegmentAbsent : public SegmentError {
 public:
  using SegmentError::SegmentError;
};

/// Text of an `errno`; thread-safe, unlike strerror.
[[nodiscard]] inline std::string system_message(int error) {
  return std::generic_category().message(error);
}

/// One volume at tick 0.
struct SegmentVolumeSpec {
  VoxelGrid grid;  ///< each edge 1..65535
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};  ///< world position of the centre of voxel (0, 0, 0)
  std::array<float, 4> orientation{0, 0, 0, 1};
  std::uint32_t material = 0;
  std::uint32_t iso = 32768;
  std::span<const Density> density;  ///< copied by `create`
  std::span<const Label> labels;     ///< one per voxel, or none; copied by `create`
};

/// The content of a segment at tick 0.
struct SegmentSpec {
  std::vector<SegmentVolumeSpec> volumes;  ///< 1..8
  std::string scene_json;
  std::uint64_t config_hash = 0;
  std::uint32_t tick_ns = 1'000'000;
  std::string build_id;        ///< truncated to 63 characters
  std::size_t arms = 1;        ///< 1..kMaxArms; each has a ring of tick records
  bool mirror_updates = true;  ///< false: nothing is cut, so no brick updates; 1 dirty slot
};

/// The static header and the volume descriptors with all offsets. Magic, session, start time and
/// content hashes are still missing.
struct SegmentPlan {
  SegmentHeader header{};
  std::vector<VolumeDescriptor> volumes;
};

/// Checks `spec` and plans its layout. Throws `SegmentError`.
[[nodiscard]] SegmentPlan plan_segment(const SegmentSpec& spec);

/// Sets `build_id` in the header, truncated to 63 characters.
void set_build_id(SegmentHeader& header, std::string_view build_id);

/// Sets the constant fields and all offsets. Input: the sizes of the volumes, `off_labels` of each
/// (not 0 if it has labels), `scene_bytes`, `off_state_2` (not 0 if there are two arms) and
/// `dirty_slots`.
void lay_out(SegmentPlan& plan);

/// Checks a plan after `lay_out` by the rules of `parse_segment`. Throws `SegmentError`.
void check_plan(const SegmentPlan& plan);

/// A memfd, mapped and populated; locked in memory if the limits allow it.
class SegmentMemory {
 public:
  /// Throws `SegmentError` if there is no memory for `bytes`.
  [[nodiscard]] static SegmentMemory create(std::uint64_t bytes);
  SegmentMemory(SegmentMemory&& other) noexcept;
  SegmentMemory& operator=(SegmentMemory&& other) noexcept;
  ~SegmentMemory();

  /// From now on no process can resize it, map it writable or write to it; this mapping stays
  /// writable. Throws `SegmentError`.
  void seal();

  [[nodiscard]] int fd() const noexcept { return fd_; }
  [[nodiscard]] bool locked() const noexcept { return locked_; }
  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }

 private:
  SegmentMemory() = default;
  int fd_ = -1;
  bool locked_ = false;
  std::span<std::byte> bytes_;
};

/// Random, never 0.
[[nodiscard]] std::uint64_t random_session_id();

}  // namespace kerf
