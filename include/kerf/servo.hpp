// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "kerf/scene.hpp"
#include "kerf/tick.hpp"

namespace kerf {

/// A volume as it is now; x fastest. Its densities lie in the Servo or Segment that returned it,
/// and change with the next step or `restore`, or with the next `Segment::volume`.
struct VoxelView {
  std::array<int, 3> size{};
  std::array<double, 3> spacing_mm{};
  std::array<double, 3> origin_mm{};  ///< world position of the middle of voxel (0, 0, 0)
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< quaternion x, y, z, w: voxel axes to world
  std::span<const std::uint16_t> density{};       ///< 0 is air, 65535 is full
};

/// The servo of a scene without a device, a clock or a thread: reports and commands in, ticks out.
/// A pure function of the scene and of what it is given. In fixed point it has the same bits on
/// every machine; in double, on machines with the same instruction set.
///
///     kerf::Servo servo(scene);
///     kerf::Hand hand(scene, "press.toml");
///     for (int i = 0; i < 4000; ++i) servo.step(hand.next(servo.last()));
///     std::printf("%g N\n", servo.last().commanded_force_n[1]);
///
/// A step takes some microseconds (`Scene::explain`), allocates nothing, throws nothing, locks
/// nothing and has a bound from load. One thread.
class Servo {
 public:
  /// Plans the scene, and copies its volumes. Throws Error for a scene that the loop cannot hold.
  explicit Servo(const Scene& scene);
  ~Servo();
  Servo(Servo&&) noexcept;
  Servo& operator=(Servo&&) noexcept;

  /// 1 or 2.
  [[nodiscard]] std::size_t arms() const noexcept;

  /// One tick of a scene with one arm. Of a scene with two the second one has no report then. The
  /// records of `step` and `last` lie in this object: the next step overwrites them.
  const TickRecord& step(const DeviceReport& report) noexcept;
  /// One tick of all arms; a report that is missing counts as not fresh, those beyond the arms are
  /// ignored.
  std::span<const TickRecord> step(std::span<const DeviceReport> reports) noexcept;
  /// The last tick of an arm; all zero, so in the phase `off`, before the first one and for an arm
  /// that the scene does not have. Numbers above 1 count as 1.
  [[nodiscard]] const TickRecord& last(std::size_t arm = 0) const noexcept;

  /// Call it before a step: first at most one command of a person, then at most one `missed`, then
  /// at most one `fade_in`, since a log has room for so much a tick. Returns false, and changes
  /// nothing, for a second one, for one out of order, and for what the servo refuses: a tool that
  /// the scene lacks, an undo of nothing.
  bool apply(const ServoCommand& command) noexcept;

  /// The force of a program from the next step on, for a scene with `force.model = "external"`.
  /// Returns false, and changes nothing, for another scene or arm, and for a force that is none
  /// (`ProgramForce`).
  ///
  ///     servo.give_force({.force_n = {0, 0.5F, 0}});
  bool give_force(const ProgramForce& force, std::size_t arm = 0) noexcept;

  /// Volume number `volume` of the scene.
  [[nodiscard]] VoxelView voxels(std::size_t volume) const noexcept;
  /// Hash of the contents of all volumes now: `volume_hash` of reports and replays. That of a
  /// `TickRecord` is another one, a chain over the changes.
  [[nodiscard]] std::uint64_t volume_hash() const noexcept;

  /// All that the servo carries from tick to tick, with commands that wait and the last ticks. A
  /// copy of it shares it; any thread.
  class State;
  /// The state between two ticks, and back to it: of this servo, or another one of the same scene.
  /// A Hand and a LogWriter do not go back with it. `restore` throws Error if the scene differs.
  /// Both allocate.
  [[nodiscard]] State keep() const;
  void restore(const State& state);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

class Servo::State {
  struct Kept;
  friend class Servo;
  explicit State(std::shared_ptr<const Kept> kept) noexcept : kept_(std::move(kept)) {}
  std::shared_ptr<const Kept> kept_;
};

}  // namespace kerf
