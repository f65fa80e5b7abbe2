// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/proxy/contact_math.hpp"
#include "controller/kernel/proxy/plane.hpp"
#include "controller/kernel/proxy/probe_work.hpp"
#include "controller/kernel/proxy/shell_cap.hpp"
#include "controller/kernel/proxy/shell_patch.hpp"
#include "controller/kernel/proxy/shell_peak.hpp"
#include "controller/kernel/proxy/shell_spiral.hpp"
#include "controller/kernel/proxy/shell_sums.hpp"
#include "controller/kernel/proxy/shell_table.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"

namespace kerf {

/// A tool as contact sees it: samples on its surface.
template <class N>
struct Shell {
  ShellTable<N> table;
  typename N::Real reach{};    ///< units from the centre to the farthest sample
  std::int32_t step_bits = 0;  ///< fraction bits of ShellStep's rows: reach 2^step_bits < 2^16
};

/// One solid volume with room for the tool's places in it; `places` belongs to the servo's memory.
template <class N>
struct ShellVolume {
  ShellField field;
  ContactFrame<N> frame;
  ShellPlaces<N> places;
};

/// What a tool feels among the solid volumes of a scene: the ContactField of the sweep.
///
/// `turn` first, then any number of probes with this orientation; a tool that does not turn needs
/// it once. A probe costs up to as many reads as the shell has samples, times the volumes: those in
/// free space are left out. In fixed all kernels give the same bits. Servo thread; no heap.
///
/// What a tick may cost is counted in samples: where tissue or noise is felt on all sides, a probe
/// is twice as dear as at a face. Once the count of `begin_tick` is spent, probes answer `buried`
/// unseen, and a sweep stays at the last place that it found; but the first probe after a turn is
/// always answered.
template <class N>
class ShellProbe {
 public:
  using Real = typename N::Real;

  /// `kernels` serve fixed point alone.
  ShellProbe(const KernelSet& kernels, const Shell<N>& shell,
             std::span<const ShellVolume<N>> volumes) noexcept
      : kernels_(kernels),
        shell_(shell),
        volumes_(volumes),
        work_(probe_work(shell.table, volumes.size())) {}

  /// From the tool's axes to those of the world.
  void turn(const ToolTurn<N>& turn) noexcept {
    rows_ = rows_of(turn);
    turned_ = true;
    left_ -= work_.turn;
    for (const ShellVolume<N>& volume : volumes_) {
      place(shell_, rows_, volume.frame, volume.places);
    }
  }

  /// The probes from now on are those of one tick; before the first, nothing is counted.
  void begin_tick() noexcept { left_ = work_.budget(); }
  [[nodiscard]] const ProbeWork& work() const noexcept { return work_; }
  /// Since then, counted as `work` is.
  [[nodiscard]] std::int64_t spent() const noexcept { return work_.budget() - left_; }

  /// The tool's centre at `q`: at most one plane a volume, the deepest three.
  [[nodiscard]] Probe<N> probe(ContactVec<Real> q) const noexcept {
    Probe<N> felt;
    felt.buried = left_ <= 0 && !turned_;
    if (felt.buried) return felt;
    turned_ = false;
    for (const ShellVolume<N>& volume : volumes_) feel(volume, q, felt);
    if (felt.count > 0) felt.depth = std::max(felt.depth, felt.plane[0].depth);
    return felt;
  }

  /// The tool's centre may move so far from `q` in any direction and feel nothing: a lower bound.
  [[nodiscard]] Real free_distance(ContactVec<Real> q) const noexcept {
    // A sample reads one voxel further, and half a unit is for roundings.
    const Real own = shell_.reach + Real(1.5);
    Real free(kContactLimit);
    for (const ShellVolume<N>& volume : volumes_) {
      const VoxelVec<Real> at = place_of(volume, q);
      const std::int32_t x = whole(at.x), y = whole(at.y), z = whole(at.z);
      const VoxelGrid& grid = volume.field.grid;
      const auto beyond = [](std::int32_t i, std::int32_t n) { return std::max(-i, i - n + 1); };
      const std::int32_t outside =
          std::max({beyond(x, grid.nx), beyond(y, grid.ny), beyond(z, grid.nz)});
      const std::int32_t bricks = volume.field.free.at(x, y, z);
      // No edge of a voxel is shorter than a unit.
      free = std::min(free, Real(std::max(outside, (bricks - 1) * kFreeBrick)) - own);
    }
    return std::max(free, Real(0));
  }

 private:
  [[nodiscard]] static std::int32_t whole(Real x) noexcept {
    if constexpr (N::kIsFixed) {
      return x.raw() >> Real::kFractionBits;
    } else {
      return static_cast<std::int32_t>(x < Real(0) ? x - Real(1) : x);
    }
  }
  [[nodiscard]] static VoxelVec<Real> place_of(const ShellVolume<N>& volume,
                                               ContactVec<Real> q) noexcept {
    return volume.frame.voxel_from_contact * q + volume.frame.origin_vox;
  }

  /// A shell whose axes `rows` takes to those of the world.
  void place(const Shell<N>& shell, const TurnRows<N>& rows, const ContactFrame<N>& frame,
             const ShellPlaces<N>& places) const noexcept {
    ShellStep<N> step;
    step.shift = 15 + shell.step_bits - 16;  // from levers times rows to Q15.16
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& m = frame.voxel_from_contact.row[i];
      for (std::size_t j = 0; j < 3; ++j) {
        if constexpr (N::kIsFixed) {
          std::int64_t turned = 0;  // Q24 Q30 = Q54, three terms of 2^54
          for (std::size_t k = 0; k < 3; ++k) {
            turned += std::int64_t{m[k].raw()} * rows[k][j].raw();
          }
          // Q30 times a reach in Q16: 2^30 2^22.
          const std::int64_t reached = round_shift(turned, 24) * shell.reach.raw();
          step.row[i][j] = static_cast<std::int32_t>(round_shift(reached, 46 - shell.step_bits));
        } else {
          step.row[i][j] =
              shell.reach * (m[0] * rows[0][j] + m[1] * rows[1][j] + m[2] * rows[2][j]);
        }
      }
    }
    if constexpr (N::kIsFixed) {
      kernels_.place_shell(shell.table, step, places);
    } else {
      place_shell(shell.table, step, places);
    }
  }

  /// Adds this volume's plane in the order of depths.
  void feel(const ShellVolume<N>& volume, ContactVec<Real> q, Probe<N>& felt) const noexcept {
    const VoxelVec<Real> at = place_of(volume, q);
    const Real margin = shell_.reach + Real(1);
    const auto near = [&](Real x, std::int32_t n) { return x > -margin && x < Real(n) + margin; };
    const VoxelGrid& grid = volume.field.grid;
    if (!near(at.x, grid.nx) || !near(at.y, grid.ny) || !near(at.z, grid.nz)) return;

    const ShellSums<N> sums = sums_at(volume.field, shell_.table, volume.places, at);
    if (sums.weight <= typename N::Sum(0)) return;
    const bool round = shell_.table.round;
    const auto means = shell_means<N>(sums, volume.field.scale, volume.frame, rows_, round);
    Plane<N> plane = plane_of<N>(means, shell_.reach, round);
    if (round && plane.depth < Real(kCapBelow) && -plane.depth < Real(kCapAbove)) {
      plane.depth = depth_around(volume, at, sums, means, plane);
    } else if (!round && std::max(plane.depth, -plane.depth) < Real(kPatchDepth)) {
      plane.normal = normal_around(volume, at, sums, plane);
    }
    // Almost the whole surface is in the solid, or it feels the same all round.
    const ContactVec<typename N::Unit> none{};
    if (sums.solid >= shell_.table.count - shell_.table.count / 16 || plane.normal == none) {
      felt.buried = true;
      felt.depth = std::max(felt.depth, plane.depth);
      return;
    }
    auto slot = static_cast<std::size_t>(felt.count);
    if (slot < kMaxPlanes) {
      ++felt.count;
    } else if (felt.plane[--slot].depth >= plane.depth) {
      return;
    }
    for (; slot > 0 && felt.plane[slot - 1].depth < plane.depth; --slot) {
      felt.plane[slot] = felt.plane[slot - 1];
    }
    felt.plane[slot] = plane;
  }

  /// The normal with the gradients of a patch around the middle of the contact, too.
  [[nodiscard]] ContactVec<typename N::Unit> normal_around(const ShellVolume<N>& volume,
                                                           VoxelVec<Real> at, ShellSums<N> sums,
                                                           const Plane<N>& plane) const noexcept {
    constexpr Shell<N> kPatch{kPatchArrays<N>.table(), Real(kPatchRadius), 15};
    SpiralPlaces<N, kPatchSamples> memory;
    const ShellPlaces<N> places = memory.places();
    place(kPatch, flattened<N>(plane.normal), volume.frame, places);
    const VoxelVec<Real> middle = at + volume.frame.voxel_from_contact * plane.arm;
    const ShellSums<N> patch = sums_at(volume.field, kPatch.table, places, middle);
    if (patch.weight <= typename N::Sum(0)) return plane.normal;
    sums.weight += patch.weight;
    for (std::size_t axis = 0; axis < 3; ++axis) sums.rise[axis] += patch.rise[axis];
    return direction<N>(-mean_rise<N>(sums, volume.field.scale, volume.frame));
  }

  /// A ball's depth with the height of a cap around the middle of the contact, where it is sharp.
  [[nodiscard]] Real depth_around(const ShellVolume<N>& volume, VoxelVec<Real> at,
                                  const ShellSums<N>& sums, const ShellMeans<N>& means,
                                  const Plane<N>& plane) const noexcept {
    using Ratio = typename N::Ratio;
    const Ratio height = peak_height(means, true), slope = slope_along(means, plane.normal, true);
    const auto sharp = sharpness(sums, shell_.table.count, height, slope, shell_.reach);
    const auto out = direction<N>(means.lever);
    if (sharp <= typename N::Unit(0) || out == decltype(out){}) return plane.depth;
    const Real half = multiply<Real>(shell_.reach, typename N::Unit(0.5));
    const Shell<N> cap{kCapArrays<N>.table(), std::min(Real(kCapRadius), half), 14};
    SpiralPlaces<N, kCapSamples> memory;
    const ShellPlaces<N> places = memory.places();
    place(cap, cap_rows<N>(out, cap.reach, shell_.reach), volume.frame, places);
    const VoxelVec<Real> top = at + volume.frame.voxel_from_contact * times<N>(out, shell_.reach);
    const ShellSums<N> near = sums_at(volume.field, cap.table, places, top);
    if (near.weight <= typename N::Sum(0)) return plane.depth;
    const Ratio summit =
        peak_height(shell_means<N>(near, volume.field.scale, volume.frame, rows_, false), false);
    return depth_of<N>(height + multiply<Ratio>(sharp, summit - height), slope);
  }

  [[nodiscard]] ShellSums<N> sums_at(const ShellField& field, const ShellTable<N>& table,
                                     const ShellPlaces<N>& places,
                                     VoxelVec<Real> at) const noexcept {
    if constexpr (N::kIsFixed) {
      const std::int32_t centre[3] = {at.x.raw(), at.y.raw(), at.z.raw()};
      ShellSums<N> sums;
      kernels_.sum_shell(table, places, centre, field, sums);
      left_ -= ProbeWork::kLookSamples + sums.read;
      return sums;
    } else {
      const Real centre[3] = {at.x, at.y, at.z};
      const ShellSums<N> sums = shell_sums<N>(table, places, centre, field);
      left_ -= ProbeWork::kLookSamples + sums.read;
      return sums;
    }
  }

  const KernelSet& kernels_;
  const Shell<N>& shell_;
  std::span<const ShellVolume<N>> volumes_;
  ProbeWork work_;
  TurnRows<N> rows_{};
  mutable std::int64_t left_ = std::numeric_limits<std::int64_t>::max();  ///< of the tick's samples
  mutable bool turned_ = false;                                           ///< and not probed since
};

}  // namespace kerf
