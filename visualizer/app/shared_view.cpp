// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/shared_view.hpp"

#include <string>
#include <utility>

namespace kerf {

SharedView::SharedView(const VisualizerOptions& options) {
  if (options.present) presenter_.emplace(options.name);
  if (options.follow_view) follower_.emplace(options.name);
}

std::optional<Notice> SharedView::step(OrbitCamera& camera, std::uint64_t run) {
  if (presenter_) presenter_->show(presented(camera.pose()));
  if (!follower_) return std::nullopt;
  const bool same_run = std::exchange(run_, run) == run;
  std::optional<Notice> news;
  if (same_run && follows_ && left_ && camera.pose() != *left_) {
    follows_ = false;
    if (follower_->presented())
      news = {"your own view from here on; r follows the presenter again"};
  }
  if (!same_run) shown_ = 0;
  if (const auto more = follow(camera)) news = more;
  left_ = camera.pose();
  return news;
}

std::optional<Notice> SharedView::follow(OrbitCamera& camera) {
  follower_->poll();
  const bool presented = follower_->presented();
  const bool had = std::exchange(had_presenter_, presented);
  if (!follows_) {
    shown_ = 0;  // once it follows again, the view is taken whether it is new or not
  } else if (follower_->count() > 0 && shown_ != follower_->count()) {
    shown_ = follower_->count();
    camera.look(pose_of(follower_->view()));
  }
  if (!std::exchange(asked_, true) && !presented) {
    return Notice{"no viewer presents a view yet (--present, or a page); your own view until then"};
  }
  if (had && !presented) return Notice{"the presenter has gone: this is the last view"};
  if (!had && presented && follows_) {
    return Notice{"follows the view that process " + std::to_string(follower_->presenter()) +
                  " presents, until you move it"};
  }
  return std::nullopt;
}

}  // namespace kerf
