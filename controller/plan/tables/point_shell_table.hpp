// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/tool/surface_samples.hpp"

// Owner of a tool's point shell: surface samples in groups, dense samples in cells, and room for
// them in a volume's frame.

namespace kerf {

/// An offset over the tool's reach, as PointTable holds it; fixed: Q0.15.
template <class N>
[[nodiscard]] PointNumber<N> sample_offset(double share) {
  if constexpr (N::kIsFixed) {
    return static_cast<PointNumber<N>>(std::lround(share * 32768));
  } else {
    return static_cast<PointNumber<N>>(share);
  }
}

/// Owner of a tool's close samples, sorted by cells. Load time; moving it keeps the table valid. In
/// FixedNumbers and DoubleNumbers.
template <class N>
class DenseSamples {
 public:
  /// `samples_units`: from the tool's centre, none farther than `reach`; contact units. Of a cell
  /// with more than kMostInCell samples that many are kept, evenly chosen. Without samples there is
  /// no table.
  DenseSamples(std::span<const SurfaceSample> samples_units, double reach);

  [[nodiscard]] CloseTable<N> table() const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  std::array<std::vector<PointNumber<N>>, 3> offset_, normal_;
  std::vector<std::int32_t> first_;
  std::array<std::int32_t, 3> cells_{};
  std::array<PointNumber<N>, 3> low_{};
  PointNumber<N> edge_{};
};

/// Owner of one tool's point shell for the swept contact. Load time; moving it keeps the shell
/// valid. In FixedNumbers and DoubleNumbers.
template <class N>
class PointShellTable {
 public:
  /// `samples_units`: from the tool's centre, in contact units; they are sorted into compact
  /// groups. `round`: they are those of a ball. `close_units`: the close samples of another shape;
  /// without them its contacts are not refined. `deficit_units`: support_deficit_mm of these.
  PointShellTable(std::span<const std::array<double, 3>> samples_units, bool round,
                  std::span<const SurfaceSample> close_units = {}, double deficit_units = 0);

  [[nodiscard]] PointShell<N> point_shell() const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  /// Largest error of a sample's position: it is rounded to 2^-15 of the reach at load, and twice
  /// more when it is rotated.
  [[nodiscard]] double rounding() const noexcept { return 4 * reach_ / 32768 + 0.001; }

  std::array<std::vector<PointNumber<N>>, 3> offset_, middle_;
  std::vector<std::uint8_t> needed_;
  std::size_t count_;
  double reach_, deficit_;
  bool round_;
  DenseSamples<N> close_;
};

/// Memory for the transformed shell of the widest of several tools in one volume.
template <class N>
class TransformedShell {
 public:
  void hold(const PointShell<N>& point_shell);

  [[nodiscard]] PointPositions<N> places() noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  std::array<std::vector<PointNumber<N>>, 3> offset_vox_, middle_;
};

}  // namespace kerf
