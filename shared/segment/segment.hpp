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

// What a segment's writer starts from: errors, the content at tick 0, the layout plan, the memory.

namespace kerf {

/// A segment that cannot be made, reached or trusted. One line: "place: value; remedy".
class SegmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// No controller of that name answers (yet): the caller may try again, unlike after any other
/// SegmentError.
class SegmentAbsent : public SegmentError {
 public:
  using SegmentError::SegmentError;
};

/// Text of an `errno`; thread-safe, unlike strerror.
[[nodiscard]] inline std::string system_message(int error) {
  return std::generic_category().message(error);
}

/// One volume, as readers see it at tick 0.
struct SegmentVolumeSpec {
  VoxelGrid grid;  ///< each edge 1..65535
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};  ///< world position of the centre of voxel (0, 0, 0)
  std::array<float, 4> orientation{0, 0, 0, 1};
  std::uint32_t material = 0;
  std::uint32_t iso = 32768;
  std::span<const Density> density;  ///< copied by `create`
  std::span<const Label> labels;     ///< empty, or one per voxel; copied by `create`
};

/// The content of a segment at tick 0.
struct SegmentSpec {
  std::vector<SegmentVolumeSpec> volumes;  ///< 1..8
  std::string scene_json;
  std::uint64_t config_hash = 0;
  std::uint32_t tick_ns = 1'000'000;
  std::string build_id;        ///< truncated to 63 characters
  std::size_t arms = 1;        ///< 1..kMaxArms; each has a ring of tick records
  bool mirror_updates = true;  ///< false if nothing is cut: no dirty ring and no brick updates
};

/// Offsets of all parts: the static header and the descriptors, complete except for the magic, the
/// session, the start time and the content hashes.
struct SegmentPlan {
  SegmentHeader header{};
  std::vector<VolumeDescriptor> volumes;
};

/// Checks `spec` and lays it out. Throws `SegmentError`.
[[nodiscard]] SegmentPlan plan_segment(const SegmentSpec& spec);

/// Sets `build_id` in the header, truncated to the room there.
void set_build_id(SegmentHeader& header, std::string_view build_id);

/// Fills the constant fields and all offsets, from the sizes of the volumes (`off_labels` not 0:
/// has labels), the size of the scene, the arms (`off_state_2` not 0: two) and the slots of the
/// dirty ring.
void lay_out(SegmentPlan& plan);

/// Checks a plan that is laid out, by the rules of `parse_segment`. Throws `SegmentError`.
void check_plan(const SegmentPlan& plan);

/// A memfd, mapped writable only by this process, populated, and locked if the limits allow it.
class SegmentMemory {
 public:
  /// Throws `SegmentError` if there is no memory for `bytes`.
  [[nodiscard]] static SegmentMemory create(std::uint64_t bytes);
  SegmentMemory(SegmentMemory&& other) noexcept;
  SegmentMemory& operator=(SegmentMemory&& other) noexcept;
  ~SegmentMemory();

  /// From now on no process can resize it, and no other process can map it writable or write it.
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
