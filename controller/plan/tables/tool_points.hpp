// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/plan/tables/close_cells.hpp"

namespace kerf {

/// Owner of one tool's point shell for the swept contact. Load time; moving it keeps the shell
/// valid. In FixedNumbers, FloatNumbers and DoubleNumbers.
template <class N>
class ToolPoints {
 public:
  /// `samples_units`: from the tool's centre, in contact units; they are sorted into groups that
  /// lie together. `round`: they are those of a ball. `close_units`: the close samples of another
  /// shape; without them there is no closer look at its contacts.
  ToolPoints(std::span<const std::array<double, 3>> samples_units, bool round,
             std::span<const SurfaceSample> close_units = {});

  [[nodiscard]] PointShell<N> point_shell() const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  /// How far a sample may be from its place: it is rounded to 2^-15 of the reach at load, and twice
  /// more when it is turned.
  [[nodiscard]] double rounding() const noexcept { return 4 * reach_ / 32768 + 0.001; }

  std::array<std::vector<PointNumber<N>>, 3> offset_, middle_;
  std::vector<std::uint8_t> needed_;
  std::size_t count_;
  double reach_;
  bool round_;
  CloseCells<N> close_;
};

/// Memory for the places of the widest of several tools in one volume.
template <class N>
class PlaceMemory {
 public:
  void hold(const PointShell<N>& point_shell);

  [[nodiscard]] PointPlaces<N> places() noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  std::array<std::vector<PointNumber<N>>, 3> offset_vox_, middle_;
};

}  // namespace kerf
