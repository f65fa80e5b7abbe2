// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "shared/segment/connection.hpp"
#include "shared/segment/pulp_heat.hpp"
#include "shared/volume/material.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// How much solid of each material is gone (`solid_gone`), brick by brick: of a voxel, against the
/// most that it has held since this was made. Material that comes back is no longer counted, also
/// if a reset restores what had been removed before. Memory: two bytes for each voxel, three with
/// labels.
class RemovedVolume {
 public:
  RemovedVolume(const SceneView& scene, std::span<const VolumeContent> contents);

  /// Counts the changed bricks of a volume again; `density` is all of it.
  void update(std::size_t volume, std::span<const Density> density, const ChangedBricks& changed);

  /// By index of the scene's materials; 0: of no material.
  [[nodiscard]] std::vector<double> removed_mm3() const;

 private:
  struct Volume {
    BrickGrid bricks;
    Density iso = 0;
    double voxel_mm3 = 0.0;
    std::vector<Density> fullest;       ///< by voxel
    std::vector<Label> labels;          ///< by voxel; may be empty
    std::vector<std::uint32_t> gone;    ///< by brick and material; kDensityMax is a voxel
    std::vector<std::int64_t> removed;  ///< sums by material
  };
  /// Counts a brick again.
  void count(Volume& volume, std::span<const Density> density, std::uint32_t brick) const;

  MaterialRule rule_;
  std::vector<Volume> volumes_;
};

/// One run of a controller as the visualizer sees it: a connection and private copies of the
/// volumes.
///
/// State-based: `poll` brings everything up to the present however long ago the last one was, so
/// late join, a slow picture and a restarted visualizer are one case. Never waits for the
/// controller. One thread.
class Session {
 public:
  /// Throws SegmentError if there is no controller of that name or it speaks another version.
  explicit Session(std::string_view name);

  /// Tries again until a controller of that name lets it in; throws the last reason once `wait` is
  /// over.
  [[nodiscard]] static Session attach(std::string_view name, std::chrono::duration<double> wait);

  /// Copies the bricks that changed and reads the records that came since.
  void poll();

  [[nodiscard]] const SceneView& scene() const noexcept { return scene_; }
  [[nodiscard]] std::vector<VolumeContent> contents() const;
  /// Bricks of a volume that the last `poll` changed.
  [[nodiscard]] const VolumeSnapshot& snapshot(std::size_t volume) const;

  /// The newest record; none before the first tick.
  [[nodiscard]] const std::optional<TickRecord>& latest() const noexcept { return latest_; }
  /// The second arm's record of the same tick; none with one arm.
  [[nodiscard]] const std::optional<TickRecord>& second() const noexcept { return second_; }
  /// Ticks since the device was armed, with two arms the first of both; none before.
  [[nodiscard]] std::optional<std::uint64_t> ticks_since_armed() const noexcept;
  [[nodiscard]] std::optional<double> tick_rate_hz() const;
  /// Removed volume by index of the scene's materials, since this one joined or the volumes were
  /// reset.
  [[nodiscard]] std::vector<double> removed_by_material_mm3() const {
    return removed_volume_.removed_mm3();
  }
  /// How long what may not be cut was pressed upon, by any arm, since then too.
  [[nodiscard]] double forbidden_ms() const noexcept;
  /// The temperature of the pulp since then too, if the scene asks for it.
  [[nodiscard]] const std::optional<PulpHeat>& pulp() const noexcept { return pulp_; }
  /// Something had been cut before it joined, which `removed_by_material_mm3` lacks.
  [[nodiscard]] bool cut_before() const noexcept { return cut_before_; }
  [[nodiscard]] std::optional<double> data_age_ms() const;
  /// When the oldest of the ticks began that removed material whose bricks came with a `poll` since
  /// the last call. None if no such tick; what was removed before the session began does not
  /// count.
  std::optional<std::chrono::steady_clock::time_point> take_oldest_removal();
  [[nodiscard]] std::uint32_t tick_ns() const noexcept;
  /// The servo's own time at the newest record: its ticks times their length. 0 before the first.
  [[nodiscard]] double servo_s() const noexcept;
  /// Since the tick of the newest record began; 0 before the first.
  [[nodiscard]] double record_age_s() const noexcept;
  /// From asking for the controller to the first complete volumes.
  [[nodiscard]] double attach_ms() const noexcept { return attach_ms_; }

  /// True once the controller has said that it ends, or has gone. Nothing changes after that: one
  /// more `poll` has the final state.
  [[nodiscard]] bool ended() const noexcept;
  /// It said so, and it was no fault.
  [[nodiscard]] bool ended_cleanly() const noexcept;
  /// The controller is on hold, or a replay is paused.
  [[nodiscard]] bool is_held() const noexcept;

  // False if the controller refuses, is busy or has gone.
  bool select_tool(std::uint32_t index) { return send(CommandKind::select_tool, index); }
  /// The volumes go back to their first content.
  bool reset() { return send(CommandKind::reset, 0); }
  /// They go back to what they were before the last stroke.
  bool undo() { return send(CommandKind::undo, 0); }
  /// The stroke that was undone last is cut again.
  bool redo() { return send(CommandKind::redo, 0); }
  /// A place in the log; a flight recorder keeps what came before it.
  bool mark() { return send(CommandKind::mark, 0); }

 private:
  bool send(CommandKind kind, std::uint32_t argument);
  [[nodiscard]] RemovedVolume removed_since_now();
  void read_states();
  void read_removals();
  void note_arrivals();
  [[nodiscard]] std::uint64_t began_ns(const DirtyRecord& removal) const;

  Stopwatch began_;
  SegmentConnection connection_;
  SceneView scene_;
  bool cut_before_;  ///< as reported before the first read of the volumes
  std::vector<VolumeSnapshot> snapshots_;
  RemovedVolume removed_volume_;
  std::optional<TickRecord> latest_, second_;
  std::optional<Tick> armed_;
  std::uint64_t next_state_ = 0;  ///< index of the first record not read yet
  std::uint64_t next_removal_ = 0;
  std::vector<DirtyRecord> on_the_way_;  ///< removals whose bricks no snapshot holds yet
  std::optional<std::uint64_t> oldest_removal_ns_;
  std::uint64_t forbidden_ticks_ = 0;
  std::optional<PulpHeat> pulp_;
  double attach_ms_ = 0.0;
};

}  // namespace kerf
