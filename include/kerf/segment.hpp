// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/scene.hpp"
#include "kerf/servo.hpp"
#include "kerf/tick.hpp"

namespace kerf {

/// A running controller, read in its shared memory. The servo never waits for a reader, nor a
/// reader for the servo; nothing here can change a run but `send`.
///
///     auto running = kerf::Segment::open("kerf");
///     while (running.alive()) {
///       if (const auto tick = running.latest()) std::printf("%g N\n", tick->commanded_force_n[1]);
///       std::this_thread::sleep_for(std::chrono::milliseconds(100));
///     }
///
/// One thread each; any number of them may read one controller. Every call has a bound, whatever
/// the controller does.
class Segment {
 public:
  /// Controller NAME: its `--name`, "kerf" without one. Throws Error if none of that name runs (the
  /// message names those that do), or it was built with another layout.
  [[nodiscard]] static Segment open(std::string_view name = "kerf");
  ~Segment();
  Segment(Segment&&) noexcept;
  Segment& operator=(Segment&&) noexcept;

  /// False once the controller has gone; what it published stays readable.
  [[nodiscard]] bool alive() const noexcept;
  [[nodiscard]] std::size_t arms() const noexcept;
  [[nodiscard]] double period_s() const noexcept;
  /// The scene's `Scene::json`, and its source.
  [[nodiscard]] const std::string& scene_json() const noexcept;

  /// The newest tick of an arm; empty before the first one.
  [[nodiscard]] std::optional<TickRecord> latest(std::size_t arm = 0) const noexcept;
  /// Ticks that were published so far. The last 4096 can be read.
  [[nodiscard]] std::uint64_t count() const noexcept;
  /// Appends the records from number `from`, counted from 0, up to `count()` to `out`, oldest
  /// first. Returns how many of them were overwritten before they were read. The next `from` is
  /// this one plus the number of records appended plus the number returned.
  std::uint64_t since(std::uint64_t from, std::vector<TickRecord>& out, std::size_t arm = 0) const;

  /// Copies what has changed in a volume since the last call, into memory of this object. Returns
  /// it, and in `changed_bricks` how many bricks of 8^3 voxels were copied.
  VoxelView volume(std::size_t number, std::size_t* changed_bricks = nullptr);

  /// Asks the controller for a command, as a key in the window does; waits up to 2 s for its
  /// answer. Returns the command's number: the servo gets it before the step of the tick in which
  /// `last_command` reaches that number, and may still refuse it, as an undo of nothing. Returns 0
  /// if the queue of 64 commands is full (try again), or the command is refused: its argument is
  /// out of range, or its kind is not a reader's (`missed`, `fade_in`). Throws Error if there is no
  /// answer.
  std::uint32_t send(const ServoCommand& command);

 private:
  struct Parts;
  explicit Segment(std::unique_ptr<Parts> parts) noexcept;
  std::unique_ptr<Parts> parts_;
};

}  // namespace kerf
