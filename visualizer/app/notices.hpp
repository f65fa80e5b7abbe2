// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include "visualizer/app/overlay.hpp"

namespace kerf {

/// What came of something that the user asked for.
struct Notice {
  std::string text;
  bool problem = false;
};

/// Tells the user of a window: on the terminal at once, and in the picture for a while, because the
/// terminal may be out of sight.
class Notices {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kShownFor = std::chrono::seconds(4);

  void say(const Notice& notice, Clock::time_point now);
  /// From the picture.
  void clear() noexcept { shown_until_ = {}; }
  /// Takes the banner; hidden panels leave only what is a problem.
  void show(OverlayFigures& figures, Clock::time_point now) const;

 private:
  Notice last_;
  Clock::time_point shown_until_{};
};

}  // namespace kerf
