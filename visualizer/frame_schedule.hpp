// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace kerf {

/// Which headless pictures are to be taken: picture i = 1, 2, ... once `i * every` ticks have
/// passed since arming. A late one is taken at the next chance, so none is left out.
class FrameSchedule {
 public:
  FrameSchedule(std::uint32_t frames, std::uint64_t every_ticks) noexcept
      : frames_(frames), every_ticks_(every_ticks) {}

  [[nodiscard]] bool complete() const noexcept { return taken_ == frames_; }
  [[nodiscard]] bool due(std::optional<std::uint64_t> ticks) const noexcept {
    return !complete() && ticks && *ticks / every_ticks_ > taken_;
  }
  /// The end of the run has a picture too, unless the last one shows that tick already.
  [[nodiscard]] bool final_due(std::optional<std::uint64_t> ticks) const noexcept {
    return !complete() && (due(ticks) || taken_ == 0 || ticks.value_or(kUnarmed) != last_ticks_);
  }
  /// Returns the number of the picture, from 1.
  std::uint32_t take(std::optional<std::uint64_t> ticks) noexcept {
    last_ticks_ = ticks.value_or(kUnarmed);
    return ++taken_;
  }
  [[nodiscard]] std::uint32_t taken() const noexcept { return taken_; }

 private:
  static constexpr std::uint64_t kUnarmed = ~std::uint64_t{0};

  std::uint32_t frames_;
  std::uint64_t every_ticks_;
  std::uint32_t taken_ = 0;
  std::uint64_t last_ticks_ = kUnarmed;
};

}  // namespace kerf
