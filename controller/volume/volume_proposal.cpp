// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_proposal.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/scene/scene.hpp"
#include "controller/volume/connected_parts.hpp"
#include "controller/volume/denoise.hpp"
#include "controller/volume/windowing.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

using Counts = std::vector<double>;

constexpr std::size_t kBins = 65536;
/// Pads outside of the scanner's circle lie below air; noise of air reaches so far from -1000.
constexpr double kAirWidthHu = 100;
constexpr double kLeastAirShare = 0.01;
/// A CT image has 16 bits a voxel (DICOM PS3.3 C.8.2.1.1.4).
constexpr double kHighestHu = 65535;
/// Compact bone ends there; metal would pull Otsu's threshold (3 mm spine with a hip joint: 1365 HU
/// without this bound, 220 to 260 HU for any from 1000 to 2000).
constexpr double kBoneEndsHu = 1500;
/// Muscle, organs and blood stay below.
constexpr double kSoftEndsHu = 120;
/// Fewer voxels at the top are outliers, which would pull a threshold.
constexpr double kOutliers = 1e-4;
/// A denser class is another material if its density above air is larger than its neighbour's by
/// this factor: noise of 10 % within one material gives 1.17.
constexpr double kLeastContrast = 1.2;
/// Of the faces of the denser class, those with air near by. Enamel on dentine shows one of its two
/// sides: 0.55 to 0.6 in the two CT teeth; bone in the CT hand 0.05.
constexpr double kBareShare = 0.25;

class ValueScale {
 public:
  explicit ValueScale(Window range) : range_(range) {}
  [[nodiscard]] double value(double density) const {
    return range_.lo + (range_.hi - range_.lo) * density / kDensityMax;
  }
  [[nodiscard]] Density density(double value) const {
    return nearest_density((value - range_.lo) / (range_.hi - range_.lo) * kDensityMax);
  }
  [[nodiscard]] std::size_t bin(double value) const { return density(value); }

 private:
  Window range_;
};

/// Otsu's rule on the bins from `first` on; values above `last` count as `last`.
OtsuSplit split_between(const Counts& counts, std::size_t first, std::size_t last) {
  Counts part(counts.size());
  for (std::size_t bin = first; bin < counts.size(); ++bin) {
    part[std::min(bin, last)] += counts[bin];
  }
  return otsu_split(part);
}

double share_between(const Counts& counts, std::size_t first, std::size_t last) {
  double inside = 0, all = 0;
  for (std::size_t bin = 0; bin < counts.size(); ++bin) {
    all += counts[bin];
    if (bin >= first && bin <= last) inside += counts[bin];
  }
  return all > 0 ? inside / all : 0;
}

std::size_t top_without_outliers(const Counts& counts, std::size_t voxels) {
  double above = 0;
  std::size_t top = counts.size() - 1;
  while (top > 0 && (above += counts[top]) <= kOutliers * static_cast<double>(voxels)) --top;
  return top;
}

/// The fraction of the faces of voxels of at least `hard` from which air, below `skin`, is reached
/// straight ahead within `most` voxels.
double bare_share(const VolumeImage& image, Density skin, Density hard, std::int32_t most) {
  const VoxelGrid& grid = image.grid;
  constexpr std::array<VoxelIndex, 6> kWays{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  std::uint64_t faces = 0, bare = 0;
  const auto look = [&](VoxelIndex at, VoxelIndex way) {
    for (std::int32_t step = 0; step <= most; ++step) {
      at = {at.x + way.x, at.y + way.y, at.z + way.z};
      if (!grid.contains(at)) return;
      const Density d = image.density[grid.index(at.x, at.y, at.z)];
      if (d >= hard) return;
      if (step == 0) ++faces;
      if (d >= skin) continue;
      ++bare;
      return;
    }
  };
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      const Density* const row = &image.density[grid.index(0, y, z)];
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        if (row[x] < hard) continue;
        for (const VoxelIndex& way : kWays) look({x, y, z}, way);
      }
    }
  }
  return faces == 0 ? 1 : static_cast<double>(bare) / static_cast<double>(faces);
}

}  // namespace

SurfaceChoice choose_surface(const VolumeImage& image, Window range) {
  const ValueScale scale(range);
  Counts counts(kBins);
  for (const Density d : image.density) counts[d] += 1;
  const std::size_t top = top_without_outliers(counts, image.density.size());

  SurfaceChoice choice;
  choice.hounsfield = share_between(counts, scale.bin(kAirHu - kAirWidthHu),
                                    scale.bin(kAirHu + kAirWidthHu)) >= kLeastAirShare &&
                      range.lo <= kAirHu + kAirWidthHu && range.hi >= kWaterHu &&
                      range.hi <= kHighestHu;
  const std::size_t air = choice.hounsfield ? scale.bin(kAirHu - kAirWidthHu) : 0;
  const OtsuSplit skin = split_between(counts, air, top);
  const auto skin_bin = static_cast<Density>(skin.bin);
  choice.skin = choice.iso = scale.value(skin.bin);
  if (choice.hounsfield) {
    const OtsuSplit bone =
        split_between(counts, scale.bin(kWaterHu), std::min(top, scale.bin(kBoneEndsHu)));
    if (scale.value(bone.bin) > kSoftEndsHu) choice.hard = scale.value(bone.bin);
    choice.covered = choice.hard.has_value();
  } else {
    const OtsuSplit hard = split_between(counts, skin_bin, top);
    if (hard.high_mean > hard.low_mean &&
        hard.high_mean - skin.low_mean >= kLeastContrast * (hard.low_mean - skin.low_mean)) {
      choice.hard = scale.value(hard.bin);
      // A cover thinner than a fortieth of the volume is the blur of an edge.
      const std::int32_t near =
          std::max({image.grid.nx, image.grid.ny, image.grid.nz, 4 * 40}) / 40;
      choice.covered =
          bare_share(image, skin_bin, static_cast<Density>(hard.bin), near) < kBareShare;
    }
  }
  if (choice.covered) choice.iso = *choice.hard;
  return choice;
}

namespace {

constexpr double kMostSolid = 0.999;
constexpr double kLeastIsoDensity = 0.25;  // as the CT tooth has it: half-way up to dentine
// Linear; tuned by eye: a scale of grey-browns that takes nothing for enamel or pulp.
constexpr std::array<double, 3> kBone{0.80, 0.74, 0.62}, kSoft{0.50, 0.40, 0.34},
    kSofter{0.62, 0.56, 0.46}, kDenser{0.80, 0.76, 0.68};

/// Histogram of densities, and their percentiles.
class Densities {
 public:
  Densities() : counts_(65536) {}
  void add(Density d) {
    ++counts_[d];
    ++total_;
  }
  [[nodiscard]] std::uint64_t total() const { return total_; }
  [[nodiscard]] std::size_t at_share(double share) const {
    const double wanted = share * static_cast<double>(total_);
    std::size_t d = 0;
    for (double passed = 0; d + 1 < counts_.size(); ++d) {
      passed += static_cast<double>(counts_[d]);
      if (passed >= wanted) break;
    }
    return d;
  }

 private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t total_ = 0;
};

/// Which of the solid parts stay; each if `all`.
std::vector<bool> parts_to_keep(const SolidParts& solid, const BodyMask& body, bool all) {
  const auto parts = solid.parts();
  std::vector<std::uint64_t> inside(parts.size());
  for (const SolidRun& run : solid.runs()) {
    for (std::int32_t x = run.x0; x < run.x1; ++x) {
      if (body.contains(x, run.y, run.z)) ++inside[run.part];
    }
  }
  std::vector<bool> keep(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    keep[i] = all || (parts[i].voxels >= kLeastPart && 2 * inside[i] >= parts[i].voxels);
  }
  if (!keep.empty() && std::ranges::find(keep, true) == keep.end()) keep[0] = true;
  return keep;
}

/// Turns the parts that go into air, and with `outside` all that is outside of the body. Sets the
/// fields of `proposal` that describe the rest.
void take_away(const SolidParts& solid, const std::vector<bool>& keep, const BodyMask& body,
               Density iso, bool outside, VolumeImage& image, VolumeProposal& proposal) {
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i]) {
      proposal.solid = proposal.solid.united(solid.parts()[i].box);
      ++proposal.parts;
    } else {
      ++proposal.parts_away;
      proposal.voxels_away += solid.parts()[i].voxels;
    }
  }
  const VoxelGrid& grid = image.grid;
  if (proposal.parts_away > 0) {
    for (const SolidRun& run : solid.runs()) {
      if (keep[run.part]) continue;
      Density* const row = &image.density[grid.index(0, run.y, run.z)];
      std::fill(row + run.x0, row + run.x1, Density{0});
    }
  }
  if (!outside) return;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      Density* const row = &image.density[grid.index(0, y, z)];
      for (std::int32_t x = 0; x < grid.nx; x += body.edge()) {
        if (body.contains(x, y, z)) continue;
        const std::int32_t end = std::min(x + body.edge(), grid.nx);
        std::replace_if(
            row + x, row + end, [iso](Density d) { return d < iso; }, Density{0});
      }
    }
  }
}

/// From the densities around the surface: soft tissue if that covers it, else air.
Window window_around(const VolumeImage& image, Window range, Density skin, Density iso) {
  Densities around, solid;
  const bool covered = skin < iso;
  for (const Density d : image.density) {
    if (d >= iso) {
      solid.add(d);
    } else if (!covered || d >= skin) {
      around.add(d);
    }
  }
  const double lo = around.total() == 0 ? 0 : static_cast<double>(around.at_share(0.5));
  const double widest = lo + (iso - lo) / kLeastIsoDensity;
  const double top = static_cast<double>(solid.at_share(kMostSolid));
  const ValueScale scale(range);
  return {scale.value(lo), scale.value(std::clamp(top, iso + 1.0, std::max(widest, iso + 1.0)))};
}

std::vector<ProposedMaterial> materials_of(const VolumeProposal& proposal) {
  const SurfaceChoice& surface = proposal.surface;
  if (surface.covered && proposal.iso > surface.skin) {
    return {{"soft tissue", surface.skin, kSoft}, {"bone", proposal.iso, kBone}};
  }
  if (surface.hard && *surface.hard > proposal.iso) {
    return {{"softer", proposal.iso, kSofter}, {"denser", *surface.hard, kDenser}};
  }
  return {{"body", proposal.iso, kBone}};
}

void change_window(Window range, Window window, VolumeImage& image) {
  const ValueScale from(range), to(window);
  std::vector<Density> table(65536);
  for (std::size_t d = 0; d < table.size(); ++d) {
    table[d] = to.density(from.value(static_cast<double>(d)));
  }
  for (Density& d : image.density) d = table[d];
}

}  // namespace

double VolumeProposal::density_of(double value) const noexcept {
  return std::clamp((value - window.lo) / (window.hi - window.lo), 0.0, 1.0);
}

ProposedVolume propose_volume(VolumeImage image, Window range, const ProposalWishes& wishes) {
  VolumeProposal proposal;
  proposal.surface = choose_surface(image, range);
  proposal.iso = wishes.iso.value_or(proposal.surface.iso);
  const ValueScale scale(range);
  const Density iso = scale.density(proposal.iso);
  const Density skin = scale.density(std::min(proposal.surface.skin, proposal.iso));
  {
    const SolidParts solid(image.grid, image.density, iso);
    const bool all = proposal.iso <= range.lo;
    if (all || solid.parts().empty() || proposal.iso > range.hi) {
      std::ostringstream text;
      text << "iso: " << (all ? "everything" : "nothing") << " reaches " << proposal.iso
           << "; the values of the file go from " << range.lo << " to " << range.hi
           << ", give --iso between them";
      throw LoadError(text.str());
    }
    const BodyMask body(image, skin);
    take_away(solid, parts_to_keep(solid, body, wishes.keep_all), body, iso,
              !wishes.keep_all && (proposal.surface.hounsfield || proposal.surface.covered), image,
              proposal);
  }
  proposal.window = wishes.window.value_or(window_around(image, range, skin, iso));
  if (!(proposal.window.lo < proposal.window.hi && proposal.window.lo < proposal.iso &&
        proposal.iso <= proposal.window.hi)) {
    std::ostringstream text;
    if (!wishes.window) {
      text << "iso: " << proposal.iso << " parts nothing from what is around it; the values of the "
           << "file go from " << range.lo << " to " << range.hi << ", give --iso between them";
      throw LoadError(text.str());
    }
    text << "window: " << proposal.window.lo << " .. " << proposal.window.hi
         << " does not hold the surface at " << proposal.iso
         << "; give --window lo,hi around it, or another --iso";
    throw LoadError(text.str());
  }
  change_window(range, proposal.window, image);
  proposal.materials = materials_of(proposal);
  return {std::move(image), std::move(proposal)};
}

std::vector<ProposalLine> proposal_lines(const VolumeProposal& p) {
  std::ostringstream surface, window, body;
  surface << p.iso << p.unit() << ", ";
  if (p.iso != p.surface.iso) {
    surface << "as asked for; the histogram says " << p.surface.iso;
  } else if (p.surface.covered) {
    surface << (p.surface.hounsfield ? "bone: Otsu's threshold above water"
                                     : "what is denser below the skin, such as bone");
    surface << "; skin begins at " << p.surface.skin;
  } else {
    surface << (p.surface.hounsfield ? "skin: no bone was found" : "Otsu's threshold above air");
  }
  window << p.window.lo << " .. " << p.window.hi << p.unit()
         << " become density 0 and 1: from what is around the surface";
  body << p.parts << (p.parts == 1 ? " part stays, " : " parts stay, ") << p.parts_away << " with "
       << p.voxels_away << " voxels in all left out (couch, holder, specks)";
  ProposalLine materials{"materials", ""};
  for (const ProposedMaterial& material : p.materials) {
    std::ostringstream text;
    text << (materials.chosen.empty() ? "" : ", ") << material.name << " from " << material.from;
    materials.chosen += text.str();
  }
  materials.chosen += p.unit();
  return {{"surface", surface.str()}, {"window", window.str()}, {"body", body.str()}, materials};
}

bool take_label_map(const SourceVolume& source, VolumeImage& image, const std::string& location) {
  constexpr std::size_t kMostLabels = 256;
  if (source.min != 0 || !(source.max < kMostLabels)) return false;
  std::bitset<kMostLabels> seen;
  for (std::size_t i = 0; i < image.density.size(); ++i) {
    const double value = static_cast<double>(source.values[i]);
    if (value != std::floor(value)) return false;
    seen.set(static_cast<std::size_t>(value));
  }
  if (seen.count() < 3 || !is_label_map(image.grid, image.density)) return false;
  if (source.max >= kMaxMaterials) {
    const std::string last = std::to_string(std::lround(source.max));
    throw LoadError(location + "label " + last + " is above " + std::to_string(kMaxMaterials - 1) +
                    ", the last that a scene has a material for; number the labels anew, or take "
                    "them as a scan with --window 0," +
                    last);
  }
  image.labels.resize(image.density.size());
  for (std::size_t i = 0; i < image.density.size(); ++i) {
    image.labels[i] = static_cast<Label>(source.values[i]);
    image.density[i] = static_cast<Density>(image.labels[i] == 0 ? 0 : kDensityMax);
  }
  return true;
}

bool is_stretched(const VolumeFrame& frame) {
  const auto [least, most] = std::ranges::minmax(frame.spacing_mm);
  return most > kMostStretched * least;
}

std::string odd_spacing(const VolumeFrame& frame, const VoxelBox& solid, bool hounsfield) {
  constexpr double kLongestMm = 2000, kShortestMm = 0.5;
  const auto& s = frame.spacing_mm;
  const VoxelIndex extent = solid.extent();
  const std::array<double, 3> size_mm{s[0] * extent.x, s[1] * extent.y, s[2] * extent.z};
  const double longest_mm = *std::ranges::max_element(size_mm);
  const bool placeholder = !hounsfield && s == std::array<double, 3>{1, 1, 1};
  const bool size_is_usual = longest_mm <= kLongestMm && longest_mm >= kShortestMm;
  if (!placeholder && size_is_usual && !is_stretched(frame)) return {};
  std::ostringstream text;
  text << s[0] << " x " << s[1] << " x " << s[2] << " mm "
       << (placeholder ? "(often written where none is known) " : "") << "makes what is solid "
       << size_mm[0] << " x " << size_mm[1] << " x " << size_mm[2] << " mm; ";
  const std::string own =
      s[0] == s[1] && s[1] == s[2]
          ? number_text(s[0])
          : number_text(s[0]) + ',' + number_text(s[1]) + ',' + number_text(s[2]);
  if (!is_stretched(frame)) text << "confirm it with --spacing " << own << ", or ";
  text << "give the true one with --override-spacing x,y,z (mm)";
  return text.str();
}

}  // namespace kerf
