// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "visualizer/scene/gradient_plan.hpp"

namespace kerf {

namespace {

/// A box of numbers, x fastest.
struct Field {
  explicit Field(VoxelIndex extent) : n(extent), values(VoxelGrid{n.x, n.y, n.z}.voxel_count()) {}
  [[nodiscard]] float* row(std::int32_t y, std::int32_t z) noexcept {
    return values.data() + static_cast<std::ptrdiff_t>(z * n.y + y) * n.x;
  }
  VoxelIndex n;
  std::vector<float> values;
};

/// Of a row along x, from `first` to before `end`, or nothing.
struct RowPart {
  std::int32_t first = std::numeric_limits<std::int32_t>::max(), end = 0;
  void add(const RowPart& other) noexcept {
    first = std::min(first, other.first);
    end = std::max(end, other.end);
  }
};

/// The part of each row of a box that is wanted.
class Wanted {
 public:
  explicit Wanted(const VoxelIndex& extent, const RowPart& each = {})
      : n(extent), rows_(VoxelGrid{1, n.y, n.z}.voxel_count(), each) {}
  static Wanted all(const VoxelIndex& extent) { return Wanted(extent, {0, extent.x}); }

  [[nodiscard]] RowPart& row(std::int32_t y, std::int32_t z) noexcept {
    return rows_[static_cast<std::size_t>(z * n.y + y)];
  }
  [[nodiscard]] const RowPart& row(std::int32_t y, std::int32_t z) const noexcept {
    return rows_[static_cast<std::size_t>(z * n.y + y)];
  }
  /// What taps along y or z read for it, of a box that is larger by their reach at both ends.
  [[nodiscard]] Wanted read_along_y(std::int32_t reach) const { return read(reach, 0); }
  [[nodiscard]] Wanted read_along_z(std::int32_t reach) const { return read(0, reach); }

  const VoxelIndex n;

 private:
  [[nodiscard]] Wanted read(std::int32_t along_y, std::int32_t along_z) const {
    Wanted more({n.x, n.y + 2 * along_y, n.z + 2 * along_z});
    for_each_voxel({{0, 0, 0}, {1, n.y, n.z}}, [&](int, int y, int z) {
      for (std::int32_t j = 0; j <= 2 * along_y; ++j) more.row(y + j, z).add(row(y, z));
      for (std::int32_t k = 1; k <= 2 * along_z; ++k) more.row(y, z + k).add(row(y, z));
    });
    return more;
  }

  std::vector<RowPart> rows_;
};

/// A volume, and how many of its voxels make a cell along each axis.
struct Cells {
  const VoxelGrid& grid;
  std::span<const Density> density;
  VoxelIndex size;

  [[nodiscard]] VoxelBox voxels(const VoxelBox& cells) const {
    return {{cells.lo.x * size.x, cells.lo.y * size.y, cells.lo.z * size.z},
            {cells.hi.x * size.x, cells.hi.y * size.y, cells.hi.z * size.z}};
  }
};

/// The densities of a box, zeros outside the volume.
Field densities(const Cells& cells, const VoxelBox& box) {
  Field field(box.extent());
  const VoxelBox inside = box.clipped(cells.grid.box());
  for (std::int32_t z = inside.lo.z; z < inside.hi.z; ++z) {
    for (std::int32_t y = inside.lo.y; y < inside.hi.y; ++y) {
      const Density* const from = cells.density.data() + cells.grid.index(inside.lo.x, y, z);
      std::copy_n(from, inside.hi.x - inside.lo.x,
                  field.row(y - box.lo.y, z - box.lo.z) + inside.lo.x - box.lo.x);
    }
  }
  return field;
}

/// The mean density of the cells of a box. The sums are whole numbers, so their order is free.
Field means(const Cells& cells, const VoxelBox& box) {
  if (cells.size == VoxelIndex{1, 1, 1}) return densities(cells, box);
  Field field(box.extent());
  const VoxelBox all = cells.voxels(box);
  const VoxelBox inside = all.clipped(cells.grid.box());
  std::vector<std::uint32_t> sums;
  const float share = 1.0F / static_cast<float>(cells.size.x * cells.size.y * cells.size.z);
  for_each_voxel({{0, 0, 0}, {1, field.n.y, field.n.z}}, [&](int, int j, int k) {
    sums.assign(static_cast<std::size_t>(field.n.x), 0);
    const VoxelIndex lo{inside.lo.x, all.lo.y + j * cells.size.y, all.lo.z + k * cells.size.z};
    const VoxelBox rows = VoxelBox{lo, {lo.x + 1, lo.y + cells.size.y, lo.z + cells.size.z}};
    for_each_voxel(rows.clipped(inside), [&](int x, int y, int z) {
      const Density* from = cells.density.data() + cells.grid.index(x, y, z);
      std::int32_t cell = (x - all.lo.x) / cells.size.x;
      std::int32_t rest = cells.size.x - (x - all.lo.x) % cells.size.x;
      for (std::int32_t left = inside.hi.x - x; left > 0; ++cell, rest = cells.size.x) {
        const std::int32_t count = std::min(rest, left);
        std::uint32_t sum = 0;
        for (std::int32_t i = 0; i < count; ++i) sum += from[i];
        sums[static_cast<std::size_t>(cell)] += sum;
        from += count;
        left -= count;
      }
    });
    std::transform(sums.begin(), sums.end(), field.row(j, k),
                   [&](std::uint32_t sum) { return static_cast<float>(sum) * share; });
  });
  return field;
}

using Taps = std::array<float, 2 * AxisTaps::kMiddle + 1>;

/// Taps along one axis, which becomes shorter by their reach at both ends; zeros where nothing is
/// wanted. `kKnown` is this reach, so that a compiler unrolls the sum, or 0.
template <int kAxis, int kKnown>
Field filtered(Field& from, const Taps& all_taps, std::int32_t any_reach, const Wanted& wanted) {
  const Taps own = all_taps;  // which no result overwrites: they stay in registers
  const float* const taps = own.data() + AxisTaps::kMiddle;
  const std::int32_t reach = kKnown > 0 ? kKnown : any_reach;
  const VoxelIndex& n = wanted.n;
  Field to(n);
  const std::ptrdiff_t stride = kAxis == 0 ? 1 : kAxis == 1 ? from.n.x : from.n.x * from.n.y;
  for (std::int32_t z = 0; z < n.z; ++z) {
    for (std::int32_t y = 0; y < n.y; ++y) {
      const float* const in = from.row(y, z) + reach * stride;
      float* const out = to.row(y, z);
      const auto [first, end] = wanted.row(y, z);
      for (std::int32_t x = first; x < end; ++x) {
        float sum = taps[0] * in[x];
        for (std::int32_t i = 1; i <= reach; ++i) {
          sum += taps[i] * in[x + i * stride] + taps[-i] * in[x - i * stride];
        }
        out[x] = sum;
      }
    }
  }
  return to;
}

/// The same; farid5 and the wide filter of cubes are what most volumes have.
template <int kAxis>
Field filtered(Field& from, const Taps& taps, std::int32_t reach, const Wanted& wanted) {
  if (reach == 2) return filtered<kAxis, 2>(from, taps, reach, wanted);
  if (reach == 7) return filtered<kAxis, 7>(from, taps, reach, wanted);
  return filtered<kAxis, 0>(from, taps, reach, wanted);
}

/// One part of the gradient of each voxel, or cell.
struct Parts {
  Field x, y, z;
  glm::vec3 scale;
  [[nodiscard]] glm::vec3 at(std::size_t i) const {
    return scale * glm::vec3(x.values[i], y.values[i], z.values[i]);
  }
};

/// Divides by what a step from air to full density over two edges gives.
float scale_of(const AxisTaps& slope, const AxisTaps& smooth, const AxisTaps& other) {
  constexpr auto kFull = static_cast<float>(kDensityMax);
  return 1.0F / (0.5F * slope.slope_sum * smooth.smooth_sum * other.smooth_sum * kFull);
}

/// Of the voxels that are `wanted` in a box, or cells.
Parts parts_of(const FilterTaps& taps, const Cells& cells, const VoxelBox& box,
               const Wanted& wanted) {
  const auto& [x, y, z] = taps;
  Field all = means(cells, grown(box, {x.reach, y.reach, z.reach}));
  const Wanted along_z = wanted.read_along_z(z.reach);
  const Wanted along_y = along_z.read_along_y(y.reach);
  Field slope_x = filtered<0>(all, x.slope, x.reach, along_y);
  Field smooth_x = filtered<0>(all, x.smooth, x.reach, along_y);
  Field slope_x_smooth_y = filtered<1>(slope_x, y.smooth, y.reach, along_z);
  Field slope_y = filtered<1>(smooth_x, y.slope, y.reach, along_z);
  Field smooth_xy = filtered<1>(smooth_x, y.smooth, y.reach, along_z);
  return {filtered<2>(slope_x_smooth_y, z.smooth, z.reach, wanted),
          filtered<2>(slope_y, z.smooth, z.reach, wanted),
          filtered<2>(smooth_xy, z.slope, z.reach, wanted),
          glm::vec3(scale_of(x, y, z), scale_of(y, z, x), scale_of(z, x, y))};
}

Parts parts_of(const FilterTaps& taps, const Cells& cells, const VoxelBox& box) {
  return parts_of(taps, cells, box, Wanted::all(box.extent()));
}

/// `part` of the direction of `other`, the rest of it that of `own`, and the length of `own`.
glm::vec3 turned(const glm::vec3& own, const glm::vec3& other, float part) {
  const float length = std::sqrt(glm::dot(own, own));
  const float other_length = std::sqrt(glm::dot(other, other));
  const glm::vec3 mixed = glm::mix(own, other * (length / other_length), part);
  return mixed * (length / std::sqrt(glm::dot(mixed, mixed)));
}

/// 1 where the cosine between two vectors is `agree` or more, 0 where it is `differ` or less; 0 for
/// vectors without a direction.
float agreement(const glm::vec3& a, const glm::vec3& b, float agree, float differ) {
  const float a_2 = glm::dot(a, a), b_2 = glm::dot(b, b);
  if (!(a_2 > 0.0F && b_2 > 0.0F)) return 0.0F;
  const float cosine = glm::dot(a, b) / std::sqrt(a_2 * b_2);
  return std::clamp((cosine - differ) / (agree - differ), 0.0F, 1.0F);
}

constexpr float kAdaptedAgree = 0.985F;   // cosine of 10 degrees
constexpr float kAdaptedDiffer = 0.940F;  // of 20

/// The direction of `wide` where it hardly differs from that of `narrow`: steps of voxels turn the
/// narrow one by 9 degrees at 99 of 100 points and the wide one by 2, an edge turns one farther.
/// Length and all else is the narrow one's.
glm::vec3 adapted(const glm::vec3& narrow, const glm::vec3& wide) {
  const float part = agreement(narrow, wide, kAdaptedAgree, kAdaptedDiffer);
  return part == 0.0F ? narrow : turned(narrow, wide, part);
}

/// `adapted` of each cell of a box. The wide filter costs five times as much as the narrow one, and
/// is taken where that finds anything: `adapted` is the narrow one's elsewhere.
void fill_adapted(const GradientPlan& plan, const Cells& cells, const VoxelBox& box,
                  std::vector<glm::vec3>& made) {
  const glm::vec3 per_cell = plan.per_edge * glm::vec3(cells.size.x, cells.size.y, cells.size.z);
  Parts narrow = parts_of(plan.narrow, cells, box);
  narrow.scale /= per_cell;
  made.resize(narrow.x.values.size());
  const VoxelIndex extent = box.extent();
  Wanted sloped(extent);
  bool any = false;
  std::size_t i = 0;
  for_each_voxel({{0, 0, 0}, extent}, [&](int x, int y, int z) {
    made[i] = narrow.at(i);
    if (made[i] != glm::vec3(0.0F)) {
      sloped.row(y, z).add({x, x + 1});
      any = true;
    }
    ++i;
  });
  if (!any) return;
  Parts wide = parts_of(plan.wide, cells, box, sloped);
  wide.scale /= per_cell;
  for (i = 0; i < made.size(); ++i) {
    if (made[i] != glm::vec3(0.0F)) made[i] = adapted(made[i], wide.at(i));
  }
}

/// Where a voxel lies between the centres of two cells along one axis.
struct BetweenCells {
  std::int32_t cell;
  float fraction;

  BetweenCells(std::int32_t voxel, std::int32_t in_cell) {
    const std::int32_t halves = 2 * voxel + 1 - in_cell;  // from the centre of cell 0
    cell = halves >= 0 ? halves / (2 * in_cell) : -1;
    fraction = static_cast<float>(halves - 2 * in_cell * cell) / static_cast<float>(2 * in_cell);
  }
};

/// The gradients of cells, between their centres.
class CellGradients {
 public:
  CellGradients(const GradientPlan& plan, const Cells& cells, const VoxelBox& voxels)
      : size_(cells.size) {
    const VoxelIndex last{voxels.hi.x - 1, voxels.hi.y - 1, voxels.hi.z - 1};
    const auto at = [&](const VoxelIndex& v) {
      return VoxelIndex{BetweenCells(v.x, size_.x).cell, BetweenCells(v.y, size_.y).cell,
                        BetweenCells(v.z, size_.z).cell};
    };
    const VoxelIndex end = at(last);
    box_ = {at(voxels.lo), {end.x + 2, end.y + 2, end.z + 2}};
    fill_adapted(plan, cells, box_, made_);
  }

  [[nodiscard]] glm::vec3 at(int x, int y, int z) const {
    const BetweenCells i(x, size_.x), j(y, size_.y), k(z, size_.z);
    const auto row = [&](std::int32_t up, std::int32_t on) {
      const VoxelIndex extent = box_.extent();
      const glm::vec3* const two = &made_[VoxelGrid{extent.x, extent.y, extent.z}.index(
          i.cell - box_.lo.x, j.cell + up - box_.lo.y, k.cell + on - box_.lo.z)];
      return glm::mix(two[0], two[1], i.fraction);
    };
    return glm::mix(glm::mix(row(0, 0), row(1, 0), j.fraction),
                    glm::mix(row(0, 1), row(1, 1), j.fraction), k.fraction);
  }

 private:
  VoxelIndex size_;
  VoxelBox box_;
  std::vector<glm::vec3> made_;
};

/// The gradient of the cells, but the direction of the voxels, which is counted in their edges,
/// where that turns across the fine axes: a cell does not see what is smaller than itself, as a
/// canal within thick slices. A slope of thick voxels has no direction across the fine axes within
/// a terrace, so a small part of it there says nothing.
glm::vec3 followed(const glm::vec3& voxel, const glm::vec3& cell, const glm::vec3& fine,
                   const glm::vec3& per_edge) {
  const glm::vec3 across = fine * voxel;
  const float share = glm::dot(across, across) / std::max(glm::dot(voxel, voxel), 1e-30F);
  const float says = std::clamp(4.0F * share - 1.0F, 0.0F, 1.0F);  // from half of its length on
  // Cosines of 26 and 46 degrees: farid5 of full and empty voxels is off by 11 at 99 of 100 points.
  const float agree = agreement(across, fine * cell, 0.9F, 0.7F);
  const float part = std::max(agree, 1.0F - says);
  if (part == 1.0F) return cell;
  const glm::vec3 direction = voxel / per_edge;
  const float shrunk = std::sqrt(glm::dot(voxel, voxel) / glm::dot(direction, direction));
  return glm::mix(direction * shrunk, cell, part);
}

/// Of the voxels of a box.
void fill_block(const GradientPlan& plan, const Cells& cells, const VoxelBox& box,
                std::vector<glm::vec3>& made) {
  if (plan.filter == GradientFilter::adaptive && !plan.has_cells()) {
    return fill_adapted(plan, cells, box, made);
  }
  const Parts voxel = parts_of(plan.voxel, {cells.grid, cells.density, {1, 1, 1}}, box);
  made.resize(voxel.x.values.size());
  for (std::size_t i = 0; i < made.size(); ++i) made[i] = voxel.at(i);
  if (!plan.has_cells()) return;
  const CellGradients between(plan, cells, box);
  const glm::vec3 fine(cells.size.x > 1, cells.size.y > 1, cells.size.z > 1);
  std::size_t i = 0;
  for_each_voxel(box, [&](int x, int y, int z) {
    made[i] = followed(made[i], between.at(x, y, z), fine, plan.per_edge);
    ++i;
  });
}

/// Whether all voxels of a box are alike, with air around the volume.
bool is_flat(const Cells& cells, const VoxelBox& box) {
  const VoxelGrid& grid = cells.grid;
  const VoxelBox inside = box.clipped(grid.box());
  const Density first = cells.density[grid.index(inside.lo.x, inside.lo.y, inside.lo.z)];
  if (inside != box && first != 0) return false;
  for (std::int32_t z = inside.lo.z; z < inside.hi.z; ++z) {
    for (std::int32_t y = inside.lo.y; y < inside.hi.y; ++y) {
      const Density* const row = cells.density.data() + grid.index(inside.lo.x, y, z);
      const Density* const end = row + (inside.hi.x - inside.lo.x);
      if (std::any_of(row, end, [&](Density d) { return d != first; })) return false;
    }
  }
  return true;
}

}  // namespace

void fill_gradients(const GradientPlan& plan, const VoxelGrid& grid,
                    std::span<const Density> density, const VoxelBox& box,
                    std::vector<glm::vec3>& gradients) {
  // Block by block: most of a volume is air, or solid, and has none.
  constexpr std::int32_t kEdge = 32;
  const Cells cells{grid, density, plan.cell};
  std::vector<glm::vec3> made;
  const VoxelIndex edge{kEdge * plan.cell.x, kEdge * plan.cell.y, kEdge * plan.cell.z};
  const VoxelIndex n = box.extent();
  const VoxelGrid of_box{n.x, n.y, n.z};
  gradients.assign(of_box.voxel_count(), glm::vec3(0.0F));
  const VoxelBox blocks{
      {0, 0, 0},
      {(n.x + edge.x - 1) / edge.x, (n.y + edge.y - 1) / edge.y, (n.z + edge.z - 1) / edge.z}};
  for_each_voxel(blocks, [&](int i, int j, int k) {
    const VoxelIndex lo{i * edge.x, j * edge.y, k * edge.z};
    const VoxelBox part =
        VoxelBox{lo, {lo.x + edge.x, lo.y + edge.y, lo.z + edge.z}}.clipped(of_box.box());
    const VoxelBox voxels = part.moved(box.lo);
    if (is_flat(cells, plan.around(voxels))) return;
    fill_block(plan, cells, voxels, made);
    const glm::vec3* from = made.data();
    const std::int32_t wide = part.hi.x - lo.x;
    for (std::int32_t z = lo.z; z < part.hi.z; ++z) {
      for (std::int32_t y = lo.y; y < part.hi.y; ++y, from += wide) {
        std::copy_n(from, wide, &gradients[of_box.index(lo.x, y, z)]);
      }
    }
  });
}

}  // namespace kerf
