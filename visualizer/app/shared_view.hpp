// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "shared/segment/presented_view.hpp"
#include "visualizer/app/options.hpp"
#include "visualizer/panels/overlay.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

/// A camera that is presented to the other viewers of its controller (--present), or that follows
/// their presenter (--follow-view) until its user moves it.
class SharedView {
 public:
  /// Throws SegmentError if another one presents already.
  explicit SharedView(const VisualizerOptions& options);

  /// Once in each frame, before it is drawn: moves the camera, or shows it to the others. `run`
  /// counts the runs that were shown: with another one the camera begins anew, which is no move of
  /// the user. Returns what the user is to be told.
  [[nodiscard]] std::optional<Notice> step(OrbitCamera& camera, std::uint64_t run);
  /// The user wants to follow again.
  void follow_again() noexcept {
    follows_ = true;
    left_.reset();
    shown_ = 0;
  }

 private:
  [[nodiscard]] std::optional<Notice> follow(OrbitCamera& camera);

  std::optional<ViewPresenter> presenter_;
  std::optional<ViewFollower> follower_;
  std::optional<CameraPose> left_{};  ///< the camera as it was at the end of the last step
  std::uint64_t run_ = 0, shown_ = 0;
  bool follows_ = true, asked_ = false, had_presenter_ = false;
};

}  // namespace kerf
