// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_proposal.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/body_mask.hpp"
#include "controller/volume/solid_parts.hpp"

namespace kerf {
namespace {

constexpr double kMostSolid = 0.999;
constexpr double kLeastIsoDensity = 0.25;  // as the CT tooth has it: half-way up to dentine
// Linear; tuned by eye: a scale of grey-browns that takes nothing for enamel or pulp.
constexpr std::array<double, 3> kBone{0.80, 0.74, 0.62}, kSoft{0.50, 0.40, 0.34},
    kSofter{0.62, 0.56, 0.46}, kDenser{0.80, 0.76, 0.68};

/// How often each density occurs, and which one stands at a share of them.
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

double value_of(Window range, double density) {
  return range.lo + (range.hi - range.lo) * density / kDensityMax;
}

Density density_in(Window range, double value) {
  return nearest_density((value - range.lo) / (range.hi - range.lo) * kDensityMax);
}

/// Which parts of what is solid stay; of `all`, each does.
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

/// Makes air of the parts that go, and of all that is outside of the body where it has a skin.
/// Tells what is left.
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

/// Of what is around the surface: soft tissue where that covers it, else air.
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
  return {value_of(range, lo),
          value_of(range, std::clamp(top, iso + 1.0, std::max(widest, iso + 1.0)))};
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
  std::vector<Density> table(65536);
  for (std::size_t d = 0; d < table.size(); ++d) {
    table[d] = density_in(window, value_of(range, static_cast<double>(d)));
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
  const Density iso = density_in(range, proposal.iso);
  const Density skin = density_in(range, std::min(proposal.surface.skin, proposal.iso));
  {
    const SolidParts solid(image.grid, image.density, iso);
    const bool all = proposal.iso <= range.lo;
    if (all || solid.parts().empty() || proposal.iso > range.hi) {
      std::ostringstream text;
      text << "iso: " << (all ? "everything" : "nothing") << " reaches " << proposal.iso
           << "; the values of the file go from " << range.lo << " to " << range.hi
           << ", give --iso between them";
      throw SceneError(text.str());
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
      throw SceneError(text.str());
    }
    text << "window: " << proposal.window.lo << " .. " << proposal.window.hi
         << " does not hold the surface at " << proposal.iso
         << "; give --window lo,hi around it, or another --iso";
    throw SceneError(text.str());
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
       << p.voxels_away << " voxels in all taken away (couch, holder, specks)";
  ProposalLine materials{"materials", ""};
  for (const ProposedMaterial& material : p.materials) {
    std::ostringstream text;
    text << (materials.chosen.empty() ? "" : ", ") << material.name << " from " << material.from;
    materials.chosen += text.str();
  }
  materials.chosen += p.unit();
  return {{"surface", surface.str()}, {"window", window.str()}, {"body", body.str()}, materials};
}

}  // namespace kerf
