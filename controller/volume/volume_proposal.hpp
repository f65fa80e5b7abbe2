// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/windowing.hpp"

// A proposal for a scan of which nothing else is known: surface, window, materials, labels,
// doubtful spacing.

namespace kerf {

/// Hounsfield's scale (DICOM PS3.3 C.11.1.1.2): -1000 is air and 0 is water, by definition.
inline constexpr double kAirHu = -1000, kWaterHu = 0;

/// The threshold between the solid and its surroundings, in values of the file.
struct SurfaceChoice {
  bool hounsfield = false;  ///< air of -1000 occurs, and the values fit in 16 bits
  double skin = 0;          ///< Otsu's threshold of all values: below is air
  std::optional<double>
      hard;  ///< that of the values above: a second, denser class; empty if there is one class
  bool covered = false;  ///< the denser class lies below a skin of the other
  double iso = 0;        ///< `hard` if that is covered, else `skin`
};

/// Chooses from the histogram and the positions of the classes:
///
/// - Two thresholds by Otsu's rule, the second for the values above the first.
/// - In HU the second splits the values between water and 1500 HU, and counts if it is above all
/// soft
///   tissue and blood; then it is bone.
/// - Without a scale: bone is hidden below skin, enamel lies bare. So the denser class is taken if
/// air is
///   rarely near its surface.
///
/// `image`: the whole range of the file, `range`, as densities. Load time.
[[nodiscard]] SurfaceChoice choose_surface(const VolumeImage& image, Window range);

/// Choices of the user in place of the proposal; values of the file.
struct ProposalWishes {
  std::optional<double> iso{};
  std::optional<Window> window{};
  bool keep_all = false;  ///< couch, holder and specks stay
};

/// A tissue by its density alone; its colour claims no diagnosis.
struct ProposedMaterial {
  std::string name;
  double from = 0;                 ///< value of the file from which it is drawn
  std::array<double, 3> colour{};  ///< linear RGB
};

/// Proposed settings for a scan of which nothing is known; values of the file.
struct VolumeProposal {
  SurfaceChoice surface;  ///< by the histogram, without the user's settings
  double iso = 0;
  Window window;               ///< becomes density 0 and 1
  VoxelBox solid;              ///< of the kept voxels of at least iso
  std::size_t parts = 0;       ///< kept
  std::size_t parts_away = 0;  ///< removed
  std::uint64_t voxels_away = 0;
  std::vector<ProposedMaterial> materials;  ///< softest first

  /// 0..1.
  [[nodiscard]] double density_of(double value) const noexcept;
  /// " HU", or nothing.
  [[nodiscard]] const char* unit() const noexcept { return surface.hounsfield ? " HU" : ""; }
};

struct ProposedVolume {
  VolumeImage image;  ///< of that window, without the removed parts, not cropped
  VolumeProposal proposal;
};

/// Fewer voxels than 3 x 3 x 3 are noise: no tool rests on them.
inline constexpr std::uint64_t kLeastPart = 27;

/// Proposes, each by its own rule:
///
/// - iso: `choose_surface`.
/// - removed parts: those of fewer than kLeastPart voxels, and those that lie mostly outside of the
/// body
///   (`BodyMask`). The largest stays. If the surface is bone or skin, all voxels outside of the
///   body become air.
/// - window: from the median of the densities around the surface, which becomes 0, up to the 99.9th
///   percentile of the solid densities, but no further than makes the iso a quarter: a surface far
///   down the scale would lose its steps.
///
/// `image`: `range`, all values of the file, as densities; it is changed in place. Throws
/// LoadError if no voxel reaches the iso, or the window is empty. Load time.
[[nodiscard]] ProposedVolume propose_volume(VolumeImage image, Window range,
                                            const ProposalWishes& wishes = {});

/// One line for each choice, without its end: the choice, and why.
struct ProposalLine {
  std::string what, chosen;
};
[[nodiscard]] std::vector<ProposalLine> proposal_lines(const VolumeProposal& proposal);

/// If a file holds only labels, turns `image`, its densities, into a solid of them, each label at
/// full density, and returns true. Labels are whole numbers up to 255 of which 0 and at least two
/// others occur, in blocks with nothing between them, as no scan has them. Throws LoadError, which
/// begins with `location`, if a label is higher than the number of materials of a scene. Load time.
[[nodiscard]] bool take_label_map(const SourceVolume& source, VolumeImage& image,
                                  const std::string& location);

/// The longest side of a voxel over its shortest: thick slices have 50; in longer voxels a tool
/// has more samples than the loop can count.
inline constexpr double kMostStretched = 60;
[[nodiscard]] bool is_stretched(const VolumeFrame& frame);

/// Reason why the voxel size of a file may be wrong, and how to confirm or replace it, for a
/// message that begins with "spacing"; empty if it may be right:
///
/// - 1 x 1 x 1 mm without HU: libraries write that for an unknown size.
/// - The solid box is longer than 2 m, the reach of a scanner, or shorter than 0.5 mm: then the
/// numbers are
///   micrometres or metres.
/// - A voxel is stretched.
[[nodiscard]] std::string odd_spacing(const VolumeFrame& frame, const VoxelBox& solid,
                                      bool hounsfield);

}  // namespace kerf
