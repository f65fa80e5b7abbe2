// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "controller/volume/surface_choice.hpp"
#include "controller/volume/volume_density.hpp"

namespace kerf {

/// What a user wants otherwise; values of the file.
struct ProposalWishes {
  std::optional<double> iso{};
  std::optional<Window> window{};
  bool keep_all = false;  ///< couch, holder and specks stay
};

/// A tissue by its density alone; its colour claims no diagnosis.
struct ProposedMaterial {
  std::string name;
  double from = 0;                 ///< value of the file from which it is seen
  std::array<double, 3> colour{};  ///< linear RGB
};

/// What is felt and seen of a scan of which nobody has said anything; values of the file.
struct VolumeProposal {
  SurfaceChoice surface;  ///< as the histogram has it, whatever the wishes
  double iso = 0;
  Window window;               ///< becomes density 0 and 1
  VoxelBox solid;              ///< of what was kept and is at least iso
  std::size_t parts = 0;       ///< that were kept
  std::size_t parts_away = 0;  ///< that were taken away
  std::uint64_t voxels_away = 0;
  std::vector<ProposedMaterial> materials;  ///< softest first

  /// 0..1.
  [[nodiscard]] double density_of(double value) const noexcept;
  /// " HU", or nothing.
  [[nodiscard]] const char* unit() const noexcept { return surface.hounsfield ? " HU" : ""; }
};

struct ProposedVolume {
  VolumeImage image;  ///< of that window, without what was taken away, not cropped
  VolumeProposal proposal;
};

/// Fewer voxels than 3 x 3 x 3 are noise: no tool rests on them.
inline constexpr std::uint64_t kLeastPart = 27;

/// Looks at a scan and decides, each by its own rule:
///
/// - iso: `choose_surface`.
/// - what is away: parts of fewer than kLeastPart voxels, and parts of which most lies outside of
///   the body (body_mask.hpp). The largest stays. Where bone or skin is felt, all that lies outside
///   of the body becomes air.
/// - window: from the median of what lies around the surface, so that it stands out of nothing, up
///   to the 99.9th percentile of what is solid, but no further than makes the iso a quarter: a
///   surface deep down the scale would lose its steps.
///
/// `image`: `range`, all values of the file, as densities; it is changed in place. Throws
/// SceneError where nothing reaches the iso, or the window is empty. Load time.
[[nodiscard]] ProposedVolume propose_volume(VolumeImage image, Window range,
                                            const ProposalWishes& wishes = {});

/// One line for each choice, without its end: what was chosen, and why.
struct ProposalLine {
  std::string what, chosen;
};
[[nodiscard]] std::vector<ProposalLine> proposal_lines(const VolumeProposal& proposal);

}  // namespace kerf
