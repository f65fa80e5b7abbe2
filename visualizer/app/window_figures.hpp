// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <optional>
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

/// The panel's figures that differ in every frame though nothing happens: rates, the data's age,
/// frames filmed. Each stays for `kHold`, so that it can be read, and so that a still hand leaves
/// frames in which nothing is to be drawn.
class ShownRates {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kHold = std::chrono::milliseconds(250);

  /// Call once per frame, which begins `now`: adds the frame rate, and puts what was shown before
  /// in the place of what is newer, until its time is over.
  void show(OverlayFigures& figures, Clock::time_point now);

 private:
  /// Frames begun in the last second; none before the second one.
  [[nodiscard]] std::optional<double> frame_rate_hz() const;

  std::deque<Clock::time_point> frames_;
  std::optional<Clock::time_point> shown_since_;
  std::optional<double> tick_rate_hz_, frame_rate_hz_, data_age_ms_;
  std::optional<std::uint64_t> filmed_frames_;
};

}  // namespace kerf
