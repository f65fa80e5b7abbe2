// SPDX-License-Identifier: Apache-2.0
// The view that one viewer presents to those who follow it, here and behind the bridge.

#include <utility>

#include "bridge/serve/server_impl.hpp"

namespace kerf::bridge {

void Server::Impl::take_view(const std::shared_ptr<Viewer>& viewer, const ViewMessage& message) {
  if (viewer->right != Right::command || viewer->closing) return;
  const bool is_presenter = presenter_ && presenting_.lock() == viewer;
  if (message.presenter == static_cast<std::uint32_t>(Presenter::nobody)) {
    if (is_presenter) presenter_.reset();
    return;
  }
  if (!is_valid(view_in(message))) {
    say_at_most_once_a_second(
        "a viewer presents a view that is none (not finite, beyond 1e5 mm, EYE at TARGET, or UP "
        "along the view); it is left out");
    return;
  }
  if (!is_presenter) {
    viewer->view_sent = 0;  // the next message says who presents, also if it is another one
    if (presenter_) return;
    try {
      presenter_.emplace(setup_.name);
    } catch (const SegmentError& problem) {
      say_at_most_once_a_second(problem.what());
      return;
    }
    presenting_ = viewer;
  }
  presenter_->show(view_in(message));
}

void Server::Impl::watch_views() {
  const std::shared_ptr<Viewer> viewer = presenting_.lock();
  if (presenter_ && (!viewer || viewer->gone || viewer->closing)) presenter_.reset();
  views_.poll();
  const bool changed = std::exchange(presented_, views_.presented()) != views_.presented();
  if (std::exchange(view_count_, views_.count()) != views_.count() || changed) ++view_changes_;
}

ViewMessage Server::Impl::view_for(const Viewer& viewer) const {
  const bool its_own = presenter_ && presenting_.lock().get() == &viewer;
  const Presenter who = its_own      ? Presenter::receiver
                        : presented_ ? Presenter::another
                                     : Presenter::nobody;
  return view_message(who, views_.view());
}

}  // namespace kerf::bridge
