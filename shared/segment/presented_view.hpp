// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "shared/segment/connection.hpp"

// The view that one viewer of a run presents to the others: a file NAME.view beside the socket of
// controller NAME, which its presenter holds locked. The controller has no part in it.

namespace kerf {

/// Where a picture is seen from, in world mm: the eye, what is in the middle of the picture, and a
/// direction that is upright in it. Plain data of the file and of the bridge's messages.
struct PresentedView {
  double eye_mm[3] = {0, 0, 1};
  double target_mm[3] = {0, 0, 0};
  double up[3] = {0, 1, 0};
  friend bool operator==(const PresentedView&, const PresentedView&) noexcept = default;
};
static_assert(sizeof(PresentedView) == 72);

/// Farther off, a float of the shaders steps by more than 1/128 mm.
inline constexpr double kFarthestViewMm = 1e5;

/// What makes a view none.
enum class ViewProblem {
  none,
  eye_far,     ///< beyond `kFarthestViewMm`, or not finite
  target_far,  ///< as well
  up_far,      ///< as well
  eye_at_target,
  up_zero,
  up_along_view
};
/// The first of them. What --camera takes has none (visualizer/scene/camera_pose.hpp).
[[nodiscard]] ViewProblem problem_in(const PresentedView& view) noexcept;
/// True if there is none. Others' views are checked by this before they are used or passed on.
[[nodiscard]] inline bool is_valid(const PresentedView& view) noexcept {
  return problem_in(view) == ViewProblem::none;
}

/// The one presenter of a controller's views, until it is destroyed or its process ends. One
/// thread.
class ViewPresenter {
 public:
  /// Throws `SegmentError` if another process presents them, or for a name that cannot be.
  explicit ViewPresenter(std::string_view name);
  ~ViewPresenter();
  ViewPresenter(const ViewPresenter&) = delete;
  ViewPresenter& operator=(const ViewPresenter&) = delete;

  /// Writes a valid view, if it is another one than before; never waits.
  void show(const PresentedView& view) noexcept;

 private:
  std::string path_;
  OwnedFd file_;
  PresentedView shown_;
  std::uint64_t count_ = 0;
};

/// Follows the presenter of a controller's views, who may come and go. One thread.
class ViewFollower {
 public:
  /// Throws `SegmentError` for a name that cannot be.
  explicit ViewFollower(std::string_view name);

  /// Looks again; never waits.
  void poll() noexcept;
  /// Somebody presents, and has shown a valid view.
  [[nodiscard]] bool presented() const noexcept { return presented_; }
  /// Counts the views that were seen: 0, there was none yet.
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  /// The newest one; it stays when the presenter goes.
  [[nodiscard]] const PresentedView& view() const noexcept { return view_; }
  /// Of the presenter's process; 0: none presents.
  [[nodiscard]] std::uint64_t presenter() const noexcept { return presented_ ? pid_ : 0; }

 private:
  std::string path_;
  OwnedFd file_;
  PresentedView view_;
  std::uint64_t pid_ = 0, hash_ = 0, count_ = 0;
  bool presented_ = false;
};

}  // namespace kerf
