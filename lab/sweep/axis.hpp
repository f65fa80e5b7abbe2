// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kerf::sweep {

/// What one key of a sweep takes, in order.
struct Axis {
  std::string key;  ///< of a scene, `table.key`; or `emulator.OPTION`
  std::vector<std::string> values;

  [[nodiscard]] bool of_emulator() const { return key.starts_with("emulator."); }
};

inline constexpr std::size_t kMostRuns = 1'000'000;

/// `KEY=LO:HI:N` (N values from LO to HI, both included), `KEY=A,B,C` or `KEY=A`. Commas in
/// brackets belong to a value. Throws `HilError` for another form, an empty range or list, or a key
/// that no scene has; what the values may be is the scene's to say.
[[nodiscard]] Axis parse_axis(std::string_view text);

/// All together; throws `HilError` where a key stands twice or there are more than `kMostRuns`.
[[nodiscard]] std::vector<Axis> parse_axes(std::span<const std::string> texts);

[[nodiscard]] std::size_t runs_of(std::span<const Axis> axes);
/// The value of each axis in run `run`; the last axis changes fastest.
[[nodiscard]] std::vector<std::string> values_of(std::span<const Axis> axes, std::size_t run);

}  // namespace kerf::sweep
