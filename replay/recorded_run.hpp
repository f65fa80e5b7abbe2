// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/plan/compile.hpp"
#include "record/input_rows.hpp"
#include "record/manifest.hpp"
#include "replay/replay_step.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/writer.hpp"

// A recording as a run that can be repeated: its scene, loaded again.

namespace kerf {

/// What a replay changes; if all are empty, the run is repeated as it was.
struct ReplayChanges {
  std::vector<std::string> settings{};           ///< `table.key=VALUE`
  std::optional<std::filesystem::path> scene{};  ///< in place of the recorded one
  std::optional<NumericKind> numeric{};

  [[nodiscard]] bool none() const { return settings.empty() && !scene && !numeric; }
};

/// The scene of a recording, planned; it may be stepped from the run's first tick on.
struct RecordedRun {
  Manifest manifest;  ///< with length of a tick and voxels of the scene that was recorded
  /// Ticks of the run before the first one of the log.
  [[nodiscard]] Tick earlier_ticks() const noexcept { return manifest.losses.missed_before_start; }

  LoadedScene scene;       ///< without its densities, which the servo has
  std::string canonical;   ///< `canonical_json` of it
  std::string scene_json;  ///< `canonical` and the scene's source
  std::unique_ptr<CompiledScene> servo;
  std::uint64_t volume_chain = kFnv1aBasis;  ///< of the ticks before those of the log
  std::optional<SegmentWriter> segment;      ///< with the volumes at the start; if requested
  /// Counts steps of the servo, for a thread that watches them (StepGuard).
  std::unique_ptr<std::atomic<std::uint64_t>> steps =
      std::make_unique<std::atomic<std::uint64_t>>(0);
};

/// Of each volume.
[[nodiscard]] std::vector<double> voxel_mm3_of(const LoadedScene& scene);

/// The error line for a scene.json that has no source.
[[nodiscard]] std::string scene_without_source(const std::filesystem::path& folder);

/// Loads the scene of the recording in `folder`, with `changes`. Volumes and meshes come from the
/// recording if it has them, else from their files.
///
/// Without changes the loaded scene must be equal to the recorded one to the bit; otherwise throws
/// `RecordError`, one line that names the first key or volume that differs. With changes, only the
/// rate and the devices must be the recorded ones. Throws `RecordError` too if the recording
/// neither begins at the run's first tick nor has the inputs before its own, LoadError if the scene
/// cannot be loaded.
[[nodiscard]] RecordedRun load_run(const std::filesystem::path& folder,
                                   const ReplayChanges& changes, const KernelSet& kernels,
                                   bool with_segment = false);

/// Steps the ticks before those of the log. A flight recording has only their inputs; other
/// recordings have no such ticks. Their results are in the hash chains of the log's first tick.
class EarlierTicks {
 public:
  /// `run` outlives it.
  EarlierTicks(RecordedRun& run, const std::filesystem::path& folder);
  /// Steps the next one; returns false if there is none. Throws `RecordError` if the inputs are
  /// damaged.
  bool step();
  /// Number of ticks stepped so far.
  [[nodiscard]] Tick done() const noexcept { return done_; }

 private:
  RecordedRun& run_;
  InputReader inputs_;
  ReplayStep step_;
  Tick done_ = 0;
};

/// Steps all of them. Throws as `EarlierTicks::step`; a stop signal ends it as `end_if_asked` does.
void step_earlier_ticks(RecordedRun& run, const std::filesystem::path& folder);

/// The kernels of that name, as `kernel_sets` has them; the fastest if `name` is empty. Throws
/// UsageError: with all sets if there is none of that name, with those of this machine if it lacks
/// that one.
[[nodiscard]] const KernelSet& kernels_named(const std::string& name);

}  // namespace kerf
