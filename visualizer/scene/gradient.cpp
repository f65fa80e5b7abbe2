// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "visualizer/scene/gradient_plan.hpp"

namespace kerf {

namespace {

/// The fields of one block, in the memory of those before.
class FieldMemory {
 public:
  explicit FieldMemory(std::vector<std::vector<float>>& fields) : fields_(fields) {}

  /// Not set to anything.
  [[nodiscard]] float* take(std::size_t count) {
    if (taken_ == fields_.size()) fields_.emplace_back();
    std::vector<float>& field = fields_[taken_++];
    if (field.size() < count) field.resize(count);
    return field.data();
  }

 private:
  std::vector<std::vector<float>>& fields_;
  std::size_t taken_ = 0;
};

constexpr std::int32_t whole_lanes(std::int32_t count) {
  return (count + kFilterLanes - 1) / kFilterLanes * kFilterLanes;
}

/// A box of numbers, x fastest, in rows as the kernels take them.
struct Field {
  Field(FieldMemory& memory, VoxelIndex extent)
      : n(extent),
        pitch(whole_lanes(n.x)),
        // A row of fewer numbers that begins within the last one may end behind it.
        size(VoxelGrid{static_cast<std::int32_t>(pitch), n.y, n.z}.voxel_count() + kFilterLanes),
        first(memory.take(size)) {}
  [[nodiscard]] float* row(std::int32_t y, std::int32_t z) const noexcept {
    return first + static_cast<std::ptrdiff_t>(z * n.y + y) * pitch;
  }
  VoxelIndex n;
  std::ptrdiff_t pitch;
  std::size_t size;
  float* first;
};

/// Of a row along x, from `first` to before `end`, or nothing.
struct RowPart {
  std::int32_t first = std::numeric_limits<std::int32_t>::max(), end = 0;
  void add(const RowPart& other) noexcept {
    first = std::min(first, other.first);
    end = std::max(end, other.end);
  }
  /// That much and more, in whole steps of the kernels.
  [[nodiscard]] RowPart in_lanes() const noexcept {
    if (first >= end) return {0, 0};
    return {first / kFilterLanes * kFilterLanes, whole_lanes(end)};
  }
  friend bool operator==(const RowPart&, const RowPart&) = default;
};

/// The part of each row of a box that is wanted.
class Wanted {
 public:
  explicit Wanted(const VoxelIndex& extent, const RowPart& each = {})
      : n(extent), rows_(VoxelGrid{1, n.y, n.z}.voxel_count(), each) {}
  static Wanted all(const VoxelIndex& extent) { return Wanted(extent, {0, extent.x}); }

  [[nodiscard]] RowPart& row(std::int32_t y, std::int32_t z) noexcept { return rows_[at(y, z)]; }
  [[nodiscard]] const RowPart& row(std::int32_t y, std::int32_t z) const noexcept {
    return rows_[at(y, z)];
  }
  /// What taps along y or z read for it, of a box that is larger by their reach at both ends.
  [[nodiscard]] Wanted read_along_y(std::int32_t reach) const { return read(reach, 0); }
  [[nodiscard]] Wanted read_along_z(std::int32_t reach) const { return read(0, reach); }

  const VoxelIndex n;

 private:
  [[nodiscard]] std::size_t at(std::int32_t y, std::int32_t z) const noexcept {
    return static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) +
           static_cast<std::size_t>(y);
  }
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
Field densities(const Cells& cells, const VoxelBox& box, FieldMemory& memory) {
  const Field field(memory, box.extent());
  const VoxelBox inside = box.clipped(cells.grid.box());
  if (inside != box) std::fill_n(field.first, field.size, 0.0F);
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
Field means(const Cells& cells, const VoxelBox& box, FieldMemory& memory) {
  if (cells.size == VoxelIndex{1, 1, 1}) return densities(cells, box, memory);
  const Field field(memory, box.extent());
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

/// Where to compute, and how.
struct Filtering {
  const FilterKernels& kernels;
  FieldMemory& memory;

  /// Taps along one axis of a field; what is wanted of a row of the result begins at `from`.
  template <int kAxis>
  [[nodiscard]] Field along(const Field& in, const VoxelIndex& from, const Taps& taps,
                            std::int32_t reach, const Wanted& wanted) const {
    const VoxelIndex& n = wanted.n;
    const Field to(memory, n);
    FilterRows rows;
    rows.taps = taps.data() + AxisTaps::kMiddle;
    rows.reach = reach;
    rows.stride = kAxis == 0 ? 1 : kAxis == 1 ? in.pitch : in.pitch * in.n.y;
    rows.in_pitch = in.pitch;
    rows.out_pitch = to.pitch;
    for (std::int32_t z = 0; z < n.z; ++z) {
      for (std::int32_t y = 0; y < n.y; y += rows.rows) {
        const RowPart part = wanted.row(y, z).in_lanes();
        rows.rows = 1;  // and those after it that are alike
        while (y + rows.rows < n.y && wanted.row(y + rows.rows, z).in_lanes() == part) ++rows.rows;
        rows.in = in.row(y + from.y, z + from.z) + from.x + part.first;
        rows.out = to.row(y, z) + part.first;
        rows.count = part.end - part.first;
        kernels.sum(rows);
      }
    }
    return to;
  }
};

/// One part of the gradient of each voxel, or cell.
struct Parts {
  Field x, y, z;
  glm::vec3 scale;

  [[nodiscard]] glm::vec3 at(int i, int j, int k) const {
    return scale * glm::vec3(x.row(j, k)[i], y.row(j, k)[i], z.row(j, k)[i]);
  }
};

/// Divides by what a step from air to full density over two edges gives.
float scale_of(const AxisTaps& slope, const AxisTaps& smooth, const AxisTaps& other) {
  constexpr auto kFull = static_cast<float>(kDensityMax);
  return 1.0F / (0.5F * slope.slope_sum * smooth.smooth_sum * other.smooth_sum * kFull);
}

/// Of the voxels of a box, or cells, that are `wanted`. `all` are the densities of a box that is
/// larger by `margin` on both sides, no less than the taps reach.
Parts parts_of(const FilterTaps& taps, const Field& all, const VoxelIndex& margin,
               const Wanted& wanted, const Filtering& by) {
  const auto& [x, y, z] = taps;
  const Wanted along_z = wanted.read_along_z(z.reach);
  const Wanted along_y = along_z.read_along_y(y.reach);
  const VoxelIndex in_all{margin.x, margin.y - y.reach, margin.z - z.reach};
  const VoxelIndex in_y{0, y.reach, 0}, in_z{0, 0, z.reach};
  const Field slope_x = by.along<0>(all, in_all, x.slope, x.reach, along_y);
  const Field smooth_x = by.along<0>(all, in_all, x.smooth, x.reach, along_y);
  const Field slope_x_smooth_y = by.along<1>(slope_x, in_y, y.smooth, y.reach, along_z);
  const Field slope_y = by.along<1>(smooth_x, in_y, y.slope, y.reach, along_z);
  const Field smooth_xy = by.along<1>(smooth_x, in_y, y.smooth, y.reach, along_z);
  return {by.along<2>(slope_x_smooth_y, in_z, z.smooth, z.reach, wanted),
          by.along<2>(slope_y, in_z, z.smooth, z.reach, wanted),
          by.along<2>(smooth_xy, in_z, z.slope, z.reach, wanted),
          glm::vec3(scale_of(x, y, z), scale_of(y, z, x), scale_of(z, x, y))};
}

VoxelIndex reach_of(const FilterTaps& taps) {
  return {taps[0].reach, taps[1].reach, taps[2].reach};
}

/// 1 where the cosine between two vectors is `agree` or more, 0 where it is `differ` or less; 0 for
/// vectors without a direction.
float agreement(const glm::vec3& a, const glm::vec3& b, float agree, float differ) {
  const float a_2 = glm::dot(a, a), b_2 = glm::dot(b, b);
  if (!(a_2 > 0.0F && b_2 > 0.0F)) return 0.0F;
  const float cosine = glm::dot(a, b) / std::sqrt(a_2 * b_2);
  return std::clamp((cosine - differ) / (agree - differ), 0.0F, 1.0F);
}

/// Where the gradients of a box go: rows of a larger one.
struct Made {
  glm::vec3* first;
  std::ptrdiff_t row, plane;
  [[nodiscard]] glm::vec3* at(std::int32_t y, std::int32_t z) const {
    return first + z * plane + y * row;
  }
};

/// The part of a row where the gradient is not zero.
RowPart sloped(const Parts& parts, std::int32_t j, std::int32_t k) {
  const float* const x = parts.x.row(j, k);
  const float* const y = parts.y.row(j, k);
  const float* const z = parts.z.row(j, k);
  const auto flat = [&](std::int32_t i) { return x[i] == 0.0F && y[i] == 0.0F && z[i] == 0.0F; };
  RowPart part{0, parts.x.n.x};
  while (part.first < part.end && flat(part.first)) ++part.first;
  while (part.first < part.end && flat(part.end - 1)) --part.end;
  return part.first < part.end ? part : RowPart{};
}

/// The adaptive gradient of each cell of a box. The wide filter costs five times as much as the
/// narrow one, and is taken where that finds anything: the narrow one's is kept elsewhere.
void fill_adapted(const GradientPlan& plan, const Cells& cells, const VoxelBox& box,
                  const Filtering& by, const Made& made) {
  const glm::vec3 per_cell = plan.per_edge * glm::vec3(cells.size.x, cells.size.y, cells.size.z);
  const VoxelIndex margin = reach_of(plan.wide);
  const Field all = means(cells, grown(box, margin), by.memory);
  const VoxelIndex n = box.extent();
  Parts narrow = parts_of(plan.narrow, all, margin, Wanted::all(n), by);
  narrow.scale /= per_cell;
  Wanted some(n);
  bool any = false;
  for_each_voxel({{0, 0, 0}, {1, n.y, n.z}}, [&](int, int y, int z) {
    some.row(y, z) = sloped(narrow, y, z);
    any = any || some.row(y, z).first < some.row(y, z).end;
  });
  if (!any) {
    for_each_voxel({{0, 0, 0}, {1, n.y, n.z}},
                   [&](int, int y, int z) { std::fill_n(made.at(y, z), n.x, glm::vec3(0.0F)); });
    return;
  }
  Parts wide = parts_of(plan.wide, all, margin, some, by);
  wide.scale /= per_cell;
  AdaptedRow row;
  for (int axis = 0; axis < 3; ++axis) {
    row.narrow_scale[axis] = narrow.scale[axis];
    row.wide_scale[axis] = wide.scale[axis];
  }
  for_each_voxel({{0, 0, 0}, {1, n.y, n.z}}, [&](int, int y, int z) {
    const RowPart part = some.row(y, z).in_lanes();
    const Field* const from[3] = {&narrow.x, &narrow.y, &narrow.z};
    const Field* const other[3] = {&wide.x, &wide.y, &wide.z};
    for (int axis = 0; axis < 3; ++axis) {
      row.narrow[axis] = from[axis]->row(y, z) + part.first;
      row.wide[axis] = other[axis]->row(y, z) + part.first;
    }
    row.count = part.end - part.first;
    by.kernels.adapt(row);
    glm::vec3* const to = made.at(y, z);
    const std::int32_t end = std::min(part.end, n.x);
    std::fill_n(to, part.first, glm::vec3(0.0F));
    for (std::int32_t i = part.first; i < end; ++i) {
      const std::int32_t at = i - part.first;
      to[i] = glm::vec3(row.narrow[0][at], row.narrow[1][at], row.narrow[2][at]);
    }
    std::fill_n(to + end, n.x - end, glm::vec3(0.0F));
  });
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
  CellGradients(const GradientPlan& plan, const Cells& cells, const VoxelBox& voxels,
                const Filtering& by)
      : size_(cells.size) {
    const VoxelIndex last{voxels.hi.x - 1, voxels.hi.y - 1, voxels.hi.z - 1};
    const auto at = [&](const VoxelIndex& v) {
      return VoxelIndex{BetweenCells(v.x, size_.x).cell, BetweenCells(v.y, size_.y).cell,
                        BetweenCells(v.z, size_.z).cell};
    };
    const VoxelIndex end = at(last);
    box_ = {at(voxels.lo), {end.x + 2, end.y + 2, end.z + 2}};
    const VoxelIndex n = box_.extent();
    made_.resize(VoxelGrid{n.x, n.y, n.z}.voxel_count());
    fill_adapted(plan, cells, box_, by, {made_.data(), n.x, std::ptrdiff_t{n.x} * n.y});
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
                const Filtering& by, const Made& made) {
  if (plan.filter == GradientFilter::adaptive && !plan.has_cells()) {
    return fill_adapted(plan, cells, box, by, made);
  }
  const VoxelIndex margin = reach_of(plan.voxel), n = box.extent();
  const Field all = densities(cells, grown(box, margin), by.memory);
  const Parts voxel = parts_of(plan.voxel, all, margin, Wanted::all(n), by);
  for_each_voxel({{0, 0, 0}, n},
                 [&](int x, int y, int z) { made.at(y, z)[x] = voxel.at(x, y, z); });
  if (!plan.has_cells()) return;
  const CellGradients between(plan, cells, box, by);
  const glm::vec3 fine(cells.size.x > 1, cells.size.y > 1, cells.size.z > 1);
  for_each_voxel({{0, 0, 0}, n}, [&](int x, int y, int z) {
    glm::vec3& at = made.at(y, z)[x];
    at = followed(at, between.at(box.lo.x + x, box.lo.y + y, box.lo.z + z), fine, plan.per_edge);
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
                    std::vector<glm::vec3>& gradients, GradientWork& work) {
  // Block by block: most of a volume is air, or solid, and has none.
  constexpr std::int32_t kEdge = 32;
  const Cells cells{grid, density, plan.cell};
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
    FieldMemory memory(work.fields);
    fill_block(plan, cells, voxels, {*work.kernels, memory},
               {&gradients[of_box.index(lo.x, lo.y, lo.z)], n.x, std::ptrdiff_t{n.x} * n.y});
  });
}

}  // namespace kerf
