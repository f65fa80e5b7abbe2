// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "shared/segment/server.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// Chance with a seed: the same numbers on every machine.
class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint32_t seed) : random_(seed) {}

  /// 0 to n - 1.
  [[nodiscard]] int below(int n) {
    return static_cast<int>(random_() % static_cast<std::uint32_t>(n));
  }
  /// Once in `n` times.
  [[nodiscard]] bool once_in(int n) { return below(n) == 0; }
  /// From `low` to `high`, in a thousand steps.
  [[nodiscard]] double between(double low, double high) {
    return low + (high - low) * below(1001) * 1e-3;
  }
  template <class T>
  [[nodiscard]] const T& one_of(std::span<const T> all) {
    return all[static_cast<std::size_t>(below(static_cast<int>(all.size())))];
  }

 private:
  std::mt19937 random_;
};

/// A controller in this process without a servo, for a window to follow: one to three small volumes
/// of any extents, nine tools. Its ticks come only on request, so that a run is the same
/// each time.
class MonkeyController {
 public:
  static constexpr std::uint32_t kTools = 9;

  /// Volumes at random. Throws SegmentError.
  MonkeyController(const std::string& name, RandomNumbers& random);

  /// Moves the hand and changes its force; also takes the tool that was asked for.
  void move(RandomNumbers& random);
  /// Removes or adds material in a box anywhere; several boxes in one tick.
  void cut(RandomNumbers& random);
  /// All bricks of a volume at once: more than a tick publishes.
  void refill(RandomNumbers& random);
  /// A tick in which nothing happened.
  void tick();
  /// Says how it ends.
  void end(Lifecycle lifecycle) { writer_->set_lifecycle(lifecycle); }

  [[nodiscard]] std::size_t volume_count() const noexcept { return volumes_.size(); }

 private:
  struct Volume {
    VoxelGrid grid;
    std::vector<Density> density;
    std::vector<Label> labels;
  };

  void fill(Volume& volume, RandomNumbers& random);
  [[nodiscard]] VoxelBox any_box(const VoxelGrid& grid, RandomNumbers& random) const;
  void finish_tick();

  std::vector<Volume> volumes_;
  std::optional<SegmentWriter> writer_;
  std::unique_ptr<SegmentServer> server_;
  TickRecord hand_{};
  Tick now_ = 0;
};

}  // namespace kerf
