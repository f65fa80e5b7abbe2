// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// The axes of a grid: their syntax, and the values of each cell.
namespace kerf::grid {

/// LO:HI:N as written. The command that reads it decides which ranges are allowed, and how the
/// values between the ends are spaced and rounded.
struct Range {
  double lo, hi, count;
};
inline constexpr std::size_t kMostCells = 1'000'000;

/// Parts between the separators that stand in no brackets, braces or quotes; at least one.
[[nodiscard]] std::vector<std::string> split(std::string_view text, char separator);

/// Empty if the text is not three numbers.
[[nodiscard]] std::optional<Range> range_in(std::string_view text);

/// The values of one key of a sweep, in order.
struct Axis {
  std::string key;  ///< of a scene, `table.key`; or `emulator.OPTION`
  std::vector<std::string> values;

  [[nodiscard]] bool of_emulator() const { return key.starts_with("emulator."); }
};

/// `KEY=LO:HI:N` (N values from LO to HI, both included), `KEY=A,B,C` or `KEY=A`. Commas in
/// brackets belong to a value. Throws `HilError` for another form, an empty range or list, or a key
/// that no scene has; the scene checks the values.
[[nodiscard]] Axis parse_axis(std::string_view text);

/// All axes; throws `HilError` if a key stands twice or there are more than `kMostCells` cells.
[[nodiscard]] std::vector<Axis> parse_axes(std::span<const std::string> texts);

[[nodiscard]] std::size_t cells_of(std::span<const Axis> axes);
/// The value of each axis in this cell; the last axis changes fastest.
[[nodiscard]] std::vector<std::string> values_of(std::span<const Axis> axes, std::size_t cell);

}  // namespace kerf::grid
