// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <new>
#include <optional>
#include <string_view>

#include <zlib.h>

#include "controller/volume_tool/import_command.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/volume/material.hpp"

namespace kerf {
namespace {

void append_number(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(value >> shift));
}

/// Length, type, data and the checksum of type and data.
void append_chunk(std::string& bytes, std::string_view type, std::string_view data) {
  append_number(bytes, static_cast<std::uint32_t>(data.size()));
  const std::string checked = std::string(type) + std::string(data);
  bytes += checked;
  append_number(bytes,
                static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(checked.data()),
                                                 static_cast<uInt>(checked.size()))));
}

}  // namespace

std::string png_bytes(const RgbPicture& picture) {
  const std::size_t row = std::size_t{3} * static_cast<std::size_t>(picture.width);
  std::string rows;
  for (std::size_t y = 0; y < static_cast<std::size_t>(picture.height); ++y) {
    rows.push_back(0);  // no filter
    rows.append(reinterpret_cast<const char*>(picture.rgb.data()) + y * row, row);
  }
  uLongf size = compressBound(rows.size());
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                reinterpret_cast<const Bytef*>(rows.data()), rows.size(),
                Z_DEFAULT_COMPRESSION) != Z_OK) {
    throw std::bad_alloc();
  }
  packed.resize(size);

  std::string header;
  append_number(header, static_cast<std::uint32_t>(picture.width));
  append_number(header, static_cast<std::uint32_t>(picture.height));
  header += std::string("\x08\x02\x00\x00\x00", 5);  // 8 bits, colour, the only packing and filter
  std::string bytes = "\x89PNG\r\n\x1a\n";
  append_chunk(bytes, "IHDR", header);
  append_chunk(bytes, "IDAT", packed);
  append_chunk(bytes, "IEND", "");
  return bytes;
}

namespace {

using vec3::dot, vec3::unit;
using vec3::operator+, vec3::operator-, vec3::operator*;
using Point = vec3::Vec;
using Colour = std::array<double, 3>;

constexpr std::int32_t kPanel = 384, kGap = 8;
constexpr Colour kAway{0.75, 0.12, 0.10};

/// Linear light to a screen's 8 bits (gamma 2.2).
std::uint8_t screen(double linear) {
  return static_cast<std::uint8_t>(
      std::lround(255 * std::pow(std::clamp(linear, 0.0, 1.0), 1 / 2.2)));
}

/// Between positions in mm, along the axes of the source from its origin, and voxels.
class Placed {
 public:
  explicit Placed(const VolumeFrame& frame) : frame_(frame) {}
  [[nodiscard]] Point voxel(const Point& mm) const {
    Point at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Point along{frame_.direction[axis], frame_.direction[3 + axis],
                        frame_.direction[6 + axis]};
      at[axis] = dot(along, mm) / frame_.spacing_mm[axis];
    }
    return at;
  }
  [[nodiscard]] Point mm(const Point& voxel) const {
    Point at{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        at[i] += frame_.direction[3 * i + axis] * frame_.spacing_mm[axis] * voxel[axis];
      }
    }
    return at;
  }
  /// Half of the box around these voxels, along each of the source's axes.
  [[nodiscard]] Point half_mm(const VoxelIndex& extent) const {
    const std::array<std::int32_t, 3> n{extent.x, extent.y, extent.z};
    Point half{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        half[i] += std::abs(frame_.direction[3 * i + axis]) * frame_.spacing_mm[axis] * n[axis] / 2;
      }
    }
    return half;
  }
  [[nodiscard]] std::optional<std::size_t> nearest(const Point& voxel) const {
    const auto whole = [](double at) {
      return static_cast<std::int32_t>(std::floor(std::clamp(at, -1e6, 1e6) + 0.5));
    };
    const VoxelIndex at{whole(voxel[0]), whole(voxel[1]), whole(voxel[2])};
    if (!frame_.grid.contains(at)) return std::nullopt;
    return frame_.grid.index(at.x, at.y, at.z);
  }

 private:
  const VolumeFrame& frame_;
};

Point middle_of(const VoxelBox& box) {
  return {(box.lo.x + box.hi.x - 1) / 2.0, (box.lo.y + box.hi.y - 1) / 2.0,
          (box.lo.z + box.hi.z - 1) / 2.0};
}

class Sheet {
 public:
  Sheet() {
    picture_.width = picture_.height = 2 * kPanel + 3 * kGap;
    picture_.rgb.assign(std::size_t{3} * static_cast<std::size_t>(picture_.width) *
                            static_cast<std::size_t>(picture_.height),
                        255);
  }
  /// `colour(right, down)`, both -1..1 from the panel's middle.
  template <class ColourAt>
  void fill(std::int32_t column, std::int32_t row, const ColourAt& colour) {
    for (std::int32_t y = 0; y < kPanel; ++y) {
      for (std::int32_t x = 0; x < kPanel; ++x) {
        const Colour c = colour((2 * x + 1.0) / kPanel - 1, (2 * y + 1.0) / kPanel - 1);
        const std::int32_t to_x = kGap + column * (kPanel + kGap) + x;
        const std::int32_t to_y = kGap + row * (kPanel + kGap) + y;
        std::uint8_t* const to =
            &picture_.rgb[3 * static_cast<std::size_t>(to_y * picture_.width + to_x)];
        for (std::size_t i = 0; i < 3; ++i) to[i] = screen(c[i]);
      }
    }
  }
  [[nodiscard]] RgbPicture take() { return std::move(picture_); }

 private:
  RgbPicture picture_;
};

/// Trilinear; 0 outside.
class Field {
 public:
  explicit Field(const VolumeImage& image) : image_(image) {}
  [[nodiscard]] double at(const Point& voxel) const {
    std::array<std::int32_t, 3> cell{};
    Point part{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double low = std::floor(std::clamp(voxel[i], -2.0, 1e6));
      cell[i] = static_cast<std::int32_t>(low);
      part[i] = voxel[i] - low;
    }
    double sum = 0;
    for (std::int32_t k = 0; k < 8; ++k) {
      const VoxelIndex at{cell[0] + (k & 1), cell[1] + (k >> 1 & 1), cell[2] + (k >> 2)};
      if (!image_.grid.contains(at)) continue;
      sum += ((k & 1) != 0 ? part[0] : 1 - part[0]) * ((k & 2) != 0 ? part[1] : 1 - part[1]) *
             ((k & 4) != 0 ? part[2] : 1 - part[2]) *
             image_.density[image_.grid.index(at.x, at.y, at.z)];
    }
    return sum;
  }

 private:
  const VolumeImage& image_;
};

/// The drawn part of a volume and its colours, both of a voxel.
struct Drawn {
  const VolumeImage& image;
  Density iso;     ///< the surface
  VoxelBox solid;  ///< its middle is that of the slices and of the surface
  std::function<Colour(std::size_t)> in_slice, on_surface;
};

/// Rays in parallel, from front, right and above; one light from the eye.
class Surface {
 public:
  explicit Surface(const Drawn& drawn) : drawn_(drawn), field_(drawn.image), placed_(drawn.image) {
    middle_ = placed_.mm(middle_of(drawn.solid));
    reach_mm_ = vec3::length(placed_.half_mm(drawn.solid.extent()));
    step_mm_ = *std::ranges::min_element(drawn.image.spacing_mm);
    step_mm_ = std::max(step_mm_, reach_mm_ / 1024);  // never more than some 2000 steps
  }
  [[nodiscard]] Colour at(double right, double down) const {
    // In voxels a ray is as straight as in mm.
    const Point start = placed_.voxel(middle_ + (right * reach_mm_) * right_ -
                                      (down * reach_mm_) * up_ - reach_mm_ * ahead_);
    const Point way = placed_.voxel(ahead_);
    for (double along = 0; along < 2 * reach_mm_; along += step_mm_) {
      const auto near = placed_.nearest(start + along * way);
      if (!near || drawn_.image.density[*near] < drawn_.iso) continue;
      double outside = along - 2 * step_mm_, inside = along + step_mm_;
      for (int halving = 0; halving < 6; ++halving) {
        const double between = (outside + inside) / 2;
        (field_.at(start + between * way) < drawn_.iso ? outside : inside) = between;
      }
      const double light = light_at(start + inside * way);
      const Colour c = drawn_.on_surface(*near);
      return {c[0] * light, c[1] * light, c[2] * light};
    }
    return {0.05, 0.06, 0.08};
  }

 private:
  [[nodiscard]] double light_at(const Point& voxel) const {
    Point slope{};
    for (std::size_t i = 0; i < 3; ++i) {
      Point mm{};
      mm[i] = 2 * step_mm_;
      const Point way = placed_.voxel(mm);
      slope[i] = field_.at(voxel + way) - field_.at(voxel - way);
    }
    return 0.15 + 0.85 * std::max(0.0, dot(unit(slope), ahead_));
  }

  // The source's frame is LPS: x to the left of a patient, y to the back, z up.
  const Point ahead_ = unit({-0.5, 1, -0.35}), right_ = unit(vec3::cross(ahead_, {0, 0, 1})),
              up_ = vec3::cross(right_, ahead_);
  const Drawn& drawn_;
  Field field_;
  Placed placed_;
  Point middle_{};
  double reach_mm_ = 0, step_mm_ = 0;
};

RgbPicture sheet_of(const Drawn& drawn) {
  const VoxelGrid& grid = drawn.image.grid;
  const Placed placed(drawn.image);
  const Point whole_middle = placed.mm(middle_of(grid.box()));
  const Point solid_middle = placed.mm(middle_of(drawn.solid));
  const Point half = placed.half_mm({grid.nx, grid.ny, grid.nz});
  const double reach_mm = *std::ranges::max_element(half);
  const auto slice = [&](std::size_t across, const Point& right, const Point& down) {
    Point middle = whole_middle;
    middle[across] = solid_middle[across];
    return [&, middle, right, down](double x, double y) -> Colour {
      const Point mm = middle + (x * reach_mm) * right + (y * reach_mm) * down;
      const auto voxel = placed.nearest(placed.voxel(mm));
      return voxel ? drawn.in_slice(*voxel) : Colour{0, 0, 0};
    };
  };
  Sheet sheet;
  sheet.fill(0, 0, slice(2, {1, 0, 0}, {0, 1, 0}));
  sheet.fill(1, 0, slice(1, {1, 0, 0}, {0, 0, -1}));
  sheet.fill(0, 1, slice(0, {0, 1, 0}, {0, 0, -1}));
  const Surface surface(drawn);
  sheet.fill(1, 1, [&](double x, double y) { return surface.at(x, y); });
  return sheet.take();
}

/// Linear light of a value between the darkest and the brightest.
double grey_of(double value, double darkest, double brightest) {
  return std::pow(std::clamp((value - darkest) / (brightest - darkest), 0.0, 1.0), 2.2);
}

}  // namespace

RgbPicture import_preview(const SourceVolume& source, const ProposedVolume& proposed) {
  const VolumeProposal& proposal = proposed.proposal;
  const Density iso = nearest_density(proposal.density_of(proposal.iso) * kDensityMax);
  const double darkest = proposal.surface.hounsfield ? std::max(source.min, kAirHu) : source.min;
  const double brightest = std::min(source.max, proposal.iso + 1.5 * (proposal.iso - darkest));
  const Colour& kept = proposal.materials.back().colour;
  const Colour& felt = proposal.materials.back().name == "denser"
                           ? proposal.materials.front().colour
                           : proposal.materials.back().colour;
  const auto in_slice = [&](std::size_t voxel) -> Colour {
    const double value = static_cast<double>(source.values[voxel]);
    const double grey = grey_of(value, darkest, brightest);
    if (value < proposal.iso) return {grey, grey, grey};
    const Colour& tint = proposed.image.density[voxel] >= iso ? kept : kAway;
    return {tint[0], tint[1] * (0.6 + 0.4 * grey), tint[2] * (0.3 + 0.5 * grey)};
  };
  return sheet_of({.image = proposed.image,
                   .iso = iso,
                   .solid = proposal.solid,
                   .in_slice = in_slice,
                   .on_surface = [&](std::size_t) { return felt; }});
}

RgbPicture label_preview(const VolumeImage& image, Density iso) {
  constexpr Colour kUnlabelled{0.6, 0.6, 0.6};
  const auto in_slice = [&](std::size_t voxel) -> Colour {
    const double grey = grey_of(image.density[voxel], 0, kDensityMax);
    if (image.labels[voxel] == 0) return {grey, grey, grey};
    const Colour c = label_colour(image.labels[voxel]);
    const double light = 0.5 + 0.5 * grey;
    return {c[0] * light, c[1] * light, c[2] * light};
  };
  const auto on_surface = [&](std::size_t voxel) {
    return image.labels[voxel] == 0 ? kUnlabelled : label_colour(image.labels[voxel]);
  };
  return sheet_of({.image = image,
                   .iso = iso,
                   .solid = solid_box(image, iso),
                   .in_slice = in_slice,
                   .on_surface = on_surface});
}

}  // namespace kerf
