// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/phantom.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>
#include <version>

#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/windowing.hpp"
#ifdef __cpp_lib_jthread
#include <thread>

#include "shared/posix/threads.hpp"
#endif

namespace kerf {
namespace {

/// A box, cut across its longest side.
struct Halves {
  explicit Halves(const VoxelBox& box) noexcept : low(box), high(box) {
    const VoxelIndex n = box.extent();
    const std::int32_t longest = std::max({n.x, n.y, n.z});
    if (n.x == longest) {
      low.hi.x = high.lo.x = box.lo.x + n.x / 2;
    } else if (n.y == longest) {
      low.hi.y = high.lo.y = box.lo.y + n.y / 2;
    } else {
      low.hi.z = high.lo.z = box.lo.z + n.z / 2;
    }
  }
  VoxelBox low, high;
};

/// Fraction of a voxel of edge `h_mm` inside of a boundary at this distance.
double share_inside(double distance_mm, double h_mm) noexcept {
  return std::clamp(0.5 - distance_mm / (2.0 * h_mm), 0.0, 1.0);
}

/// Side of a boundary on which a whole block lies: its voxels need no test of their own.
enum class Side : std::uint8_t { unknown, outside, inside };

struct Sides {
  Side outer = Side::unknown, dentin = Side::unknown, pulp = Side::unknown;
};

/// Samples the shape block by block. A boundary that is far from the middle of a block is far from
/// all of it, and is not tested there again; a block of one material is filled. Others are halved
/// down to `kLeaf` voxels.
class Sampler {
 public:
  explicit Sampler(VolumeImage& image)
      : image_(image), h_mm_(image.spacing_mm[0]), far_mm_(phantom::kSteepest * h_mm_) {
    for (std::int32_t z = 0; z < image.grid.nz; ++z) {
      at_voxels_.emplace_back(position(0, 0, z).z);
      at_middles_.push_back(at_voxels_.back().here);
      at_middles_.emplace_back(position(0, 0, z + 0.5).z);
    }
  }

  /// On 2^cuts threads: blocks share no voxel, so the image is the same bit by bit.
  void sample_on_threads(const VoxelBox& box, int cuts) {
    if (cuts == 0) return sample(box, {});
    const Halves half(box);
#ifdef __cpp_lib_jthread
    const std::jthread other = start_worker([&] { sample_on_threads(half.low, cuts - 1); });
#else  // libc++ 16, of WebAssembly, which has one thread
    sample_on_threads(half.low, cuts - 1);
#endif
    sample_on_threads(half.high, cuts - 1);
  }

 private:
  static constexpr std::int32_t kLeaf = 2;

  void sample(const VoxelBox& box, Sides sides) {
    if (box.empty()) return;
    look(box, sides);
    if (fill_if_uniform(box, sides)) return;
    const VoxelIndex n = box.extent();
    if (std::max({n.x, n.y, n.z}) <= kLeaf) return sample_voxels(box, sides);
    const Halves half(box);
    sample(half.low, sides);
    sample(half.high, sides);
  }

  /// Tests, at the middle of the block, the boundaries that its parent did not decide.
  void look(const VoxelBox& box, Sides& sides) const noexcept {
    const VoxelIndex n = box.extent();
    const VoxelIndex last{n.x - 1, n.y - 1, n.z - 1};
    const phantom::Point middle =
        position(box.lo.x + 0.5 * last.x, box.lo.y + 0.5 * last.y, box.lo.z + 0.5 * last.z);
    const phantom::Level& level =
        at_middles_[2 * static_cast<std::size_t>(box.lo.z) + static_cast<std::size_t>(last.z)];
    const double radius_mm =
        0.5 * h_mm_ *
        std::sqrt(double(last.x) * last.x + double(last.y) * last.y + double(last.z) * last.z);
    const double clear = phantom::kSteepest * radius_mm + far_mm_;
    const auto decide = [clear](Side& side, double value) {
      if (side != Side::unknown) return;
      if (value > clear) side = Side::outside;
      if (value < -clear) side = Side::inside;
    };
    if (sides.outer == Side::unknown || sides.dentin == Side::unknown) {
      const double outer = phantom::outer_field(middle, level);
      decide(sides.outer, outer);
      decide(sides.dentin, outer + phantom::enamel_mm(middle));
    }
    if (sides.dentin == Side::outside) return;  // it encloses the pulp
    if (sides.pulp == Side::unknown) decide(sides.pulp, phantom::pulp_field(middle, level));
  }

  bool fill_if_uniform(const VoxelBox& box, const Sides& sides) {
    if (sides.outer == Side::outside) return true;  // air, as the image starts
    if (sides.outer == Side::unknown || sides.dentin == Side::unknown) return false;
    if (sides.dentin == Side::outside) return fill(box, kPhantomEnamel, kLabelEnamel);
    if (sides.pulp == Side::unknown) return false;
    return sides.pulp == Side::outside ? fill(box, kPhantomDentin, kLabelDentin)
                                       : fill(box, kPhantomPulp, kLabelPulp);
  }

  /// Fraction of the voxel inside the boundary, from 0 to 1 over two voxels. `value` is `field(p)`.
  [[nodiscard]] double cover(phantom::Field field, phantom::Point p, const phantom::Levels& levels,
                             double value) const noexcept {
    if (value >= far_mm_) return 0.0;
    if (value <= -far_mm_) return 1.0;
    return share_inside(phantom::distance(field, p, levels, value), h_mm_);
  }

  [[nodiscard]] phantom::Point position(double x, double y, double z) const noexcept {
    const auto& origin = image_.origin_mm;
    return {origin[0] + x * h_mm_, origin[1] + y * h_mm_, origin[2] + z * h_mm_};
  }

  bool fill(const VoxelBox& box, Density density, Label label) {
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        const std::size_t first = image_.grid.index(box.lo.x, y, z);
        const auto count = static_cast<std::size_t>(box.hi.x - box.lo.x);
        std::fill_n(image_.density.begin() + static_cast<std::ptrdiff_t>(first), count, density);
        std::fill_n(image_.labels.begin() + static_cast<std::ptrdiff_t>(first), count, label);
      }
    }
    return true;
  }

  void sample_voxels(const VoxelBox& box, const Sides& sides) {
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      const phantom::Levels& levels = at_voxels_[static_cast<std::size_t>(z)];
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
          sample_voxel(image_.grid.index(x, y, z), position(x, y, z), levels, sides);
        }
      }
    }
  }

  void sample_voxel(std::size_t at, phantom::Point p, const phantom::Levels& levels,
                    const Sides& sides) {
    // On a known side the fraction is 0 or 1, as `cover` would find.
    const bool looks = sides.outer == Side::unknown || sides.dentin == Side::unknown;
    const double outer = looks ? phantom::outer_field(p, levels.here) : 0.0;
    double tooth = 1.0;
    if (sides.outer == Side::unknown) tooth = cover(phantom::outer_field, p, levels, outer);
    if (tooth <= 0.0) return;
    double dentin = sides.dentin == Side::outside ? 0.0 : tooth;
    if (sides.dentin == Side::unknown && !phantom::is_bare(p)) {
      dentin =
          std::min(tooth, cover(phantom::dentin_field, p, levels, outer + phantom::enamel_mm(p)));
    }
    double pulp = sides.pulp == Side::inside ? dentin : 0.0;
    if (sides.pulp == Side::unknown && dentin > 0.0) {  // which encloses it
      pulp = std::min(dentin,
                      cover(phantom::pulp_field, p, levels, phantom::pulp_field(p, levels.here)));
    }
    const double density =
        kPhantomEnamel * (tooth - dentin) + kPhantomDentin * (dentin - pulp) + kPhantomPulp * pulp;
    image_.density[at] = nearest_density(density);
    if (image_.density[at] == 0) return;
    // The label of the largest solid part of the voxel.
    if (2.0 * pulp > tooth) {
      image_.labels[at] = kLabelPulp;
    } else {
      image_.labels[at] = 2.0 * dentin > tooth ? kLabelDentin : kLabelEnamel;
    }
  }

  VolumeImage& image_;
  double h_mm_;
  std::vector<phantom::Levels> at_voxels_;
  std::vector<phantom::Level> at_middles_;  ///< of z = 0, 0.5, 1, ...
  double far_mm_;  ///< a field value beyond this is more than one voxel from its boundary
};

/// Calls `visit` with the index and the position of each voxel.
void for_each_voxel(const VolumeImage& image, const auto& visit) {
  std::size_t at = 0;
  const auto& origin = image.origin_mm;
  const double h_mm = image.spacing_mm[0];
  for (std::int32_t z = 0; z < image.grid.nz; ++z) {
    for (std::int32_t y = 0; y < image.grid.ny; ++y) {
      for (std::int32_t x = 0; x < image.grid.nx; ++x, ++at) {
        visit(at, phantom::Point{origin[0] + x * h_mm, origin[1] + y * h_mm, origin[2] + z * h_mm});
      }
    }
  }
}

void add_caries(VolumeImage& image) {
  for_each_voxel(image, [&](std::size_t at, phantom::Point p) {
    Density& density = image.density[at];
    Label& label = image.labels[at];
    if (density <= kPhantomCaries || label == kLabelPulp) return;
    const double share = share_inside(phantom::lesion_distance(p), image.spacing_mm[0]);
    density = nearest_density(density + share * (double{kPhantomCaries} - density));
    if (share > 0.5) label = kLabelCaries;
  });
}

void sample_solid(std::string_view shape, VolumeImage& image) {
  for_each_voxel(image, [&](std::size_t at, phantom::Point p) {
    const double distance_mm = phantom::solid_distance(shape, p);
    image.density[at] =
        nearest_density(kDensityMax * share_inside(distance_mm, image.spacing_mm[0]));
  });
}

}  // namespace

VolumeImage make_phantom(const PhantomSpec& spec) {
  check_grid("phantom size", spec.grid.nx, spec.grid.ny, spec.grid.nz, "ask for fewer voxels");
  double spacing = spec.spacing_mm;
  if (spacing == 0.0) {
    spacing = std::max({32.0 / spec.grid.nx, 32.0 / spec.grid.ny, 20.0 / spec.grid.nz});
  }
  check_spacing("phantom spacing", {spacing, spacing, spacing});
  VolumeImage image;
  image.grid = spec.grid;
  image.spacing_mm = {spacing, spacing, spacing};
  image.origin_mm = {-0.5 * spacing * (spec.grid.nx - 1), -0.5 * spacing * (spec.grid.ny - 1),
                     -0.5 * spacing * (spec.grid.nz - 1)};
  image.density.assign(spec.grid.voxel_count(), 0);
  if (spec.shape != kMolar && spec.shape != kCariousMolar) {
    sample_solid(spec.shape, image);
    return image;
  }
  image.labels.assign(spec.grid.voxel_count(), 0);
  constexpr int kCuts = 2;  // the first is in the middle of the tooth: halves of equal work
  Sampler(image).sample_on_threads(spec.grid.box(), kCuts);
  if (spec.shape == kCariousMolar) add_caries(image);
  return image;
}

double phantom_signed_distance(double x_mm, double y_mm, double z_mm) noexcept {
  const phantom::Point p{x_mm, y_mm, z_mm};
  const phantom::Levels levels(z_mm);
  return phantom::distance(phantom::outer_field, p, levels, phantom::outer_field(p, levels.here));
}

}  // namespace kerf
