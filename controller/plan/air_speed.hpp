// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/plan_contact.hpp"
#include "controller/servo/servo_plan.hpp"
#include "shared/numeric/elementary.hpp"

namespace kerf {

// The hand speed up to which a scene has no drag in air (docs/theory.md 4.2): at any distance from
// a flat wall, if no sample of the tool reads density that contact counts. In a cavity hardly wider
// than the tool more samples are near the solid, and the speed may be lower.

/// Fastest rotation of a tool by a hand: five revolutions per second.
inline constexpr double kFastestTurnRadPerS = 30;

/// The edges of a cube that stands on a corner: orthogonal unit vectors whose sum lies along `up`,
/// rotated about it by `angle_rad`.
[[nodiscard]] inline std::array<std::array<double, 3>, 3> edges_about(
    const std::array<double, 3>& up, double angle_rad) {
  const std::array<double, 3> other =
      std::abs(up[1]) < 0.7 ? std::array{0.0, 1.0, 0.0} : std::array{1.0, 0.0, 0.0};
  const auto cross = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return std::array{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                      a[0] * b[1] - a[1] * b[0]};
  };
  auto first = cross(up, other);
  const double length = hypotenuse(first[0], first[1], first[2]);
  for (double& part : first) part /= length;
  const auto second = cross(up, first);
  std::array<std::array<double, 3>, 3> edges{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double angle = angle_rad + 2 * std::numbers::pi * static_cast<double>(k) / 3;
    for (std::size_t i = 0; i < 3; ++i) {
      edges[k][i] =
          up[i] / std::numbers::sqrt3 + std::numbers::sqrt2 / std::numbers::sqrt3 *
                                            (cosine(angle) * first[i] + sine(angle) * second[i]);
    }
  }
  return edges;
}

/// Samples that a query reads at most beside a flat wall, the wall in the worst direction. It lies
/// across a diagonal of the bricks: there the map knows least. A group is left out once the lowest
/// corner of the brick that holds its middle is farther above the solid than what the group needs,
/// by the diagonal of the cells in which a voxel is read and a step of the map. Tried with the tool
/// at several positions in a brick.
template <class N>
[[nodiscard]] std::int64_t most_read_beside_wall(const PointTable<N>& table) {
  constexpr double kUnknown = std::numbers::sqrt3 + 1.0 / kFreeSteps;
  constexpr int kDirections = 128, kPlaces = 8;
  const double scale = double(table.reach) / (N::kIsFixed ? 65536.0 * 32768.0 : 1.0);
  std::int64_t most = 0;
  for (int k = 0; k < kDirections; ++k) {  // evenly, along a spiral of the golden angle
    const double y = (2 * k + 1.0) / kDirections - 1, turn = k * std::numbers::pi * 2.2360679775;
    const double out = std::sqrt(1 - y * y);
    const std::array<double, 3> up{out * cosine(turn), y, out * sine(turn)};
    const auto edges = edges_about(up, turn);
    const auto along = [&](const std::array<double, 3>& way,
                           const PointNumber<N>* const(&offset)[3], std::int32_t i) {
      double sum = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) sum += way[axis] * double(offset[axis][i]);
      return scale * sum;
    };
    double lowest = 0;
    for (std::int32_t i = 0; i < table.count; ++i) {
      lowest = std::min(lowest, along(up, table.offset, i));
    }
    for (int place = 0; place < kPlaces; ++place) {
      const double from = kFreeBrick * (place + 0.5) / kPlaces;  // along each edge in turn
      std::int64_t read = 0;
      for (std::int32_t group = 0; group < table.groups; ++group) {
        double corner = 0;  // height of the lowest corner, from the tool's centre
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double start = from * static_cast<double>(axis + 1);
          const double at = along(edges[axis], table.middle, group) + start;
          corner += (kFreeBrick * std::floor(at / kFreeBrick) - start) / std::numbers::sqrt3;
        }
        const double needed = double(table.needed[group]) / kFreeSteps + kUnknown;
        read += corner - lowest < needed ? kPointGroup : 0;
      }
      most = std::max(most, read);
    }
  }
  return most;
}

/// How far a tool surely moves in one tick there while it turns by so much, units: a step for each
/// query that turning leaves to the move. Each reads what is near the wall, and three looks tell
/// that no way is free. Groups may have looked in vain before, once with two looks each of one part
/// beyond the bound of all. Of a tool with a shaft each part counts as if it were nearest.
template <class N>
[[nodiscard]] double least_air_move(const SweptTool<N>& tool, std::size_t volumes,
                                    double turn_rad) {
  const QueryWork work = query_work(tool.point_shell, tool.shaft, volumes);
  const auto times = static_cast<std::int64_t>(volumes);
  std::int64_t query = 0, beyond = 0;
  const auto add = [&](const PointTable<N>& table) {
    query += times * (QueryWork::kQueryOverhead + 3 * QueryWork::kFreeStep) +
             most_read_beside_wall(table);
    if (table.round && table.needed_whole <= kFreeFarthest) return;  // as one sphere
    beyond = std::max(beyond, times * 2 * QueryWork::kFreeStep * table.groups);
  };
  add(tool.point_shell.table);
  for (std::size_t i = 0; i < tool.shaft.count; ++i) {
    add(tool.shaft.part[i].point_shell.table);
  }
  const double step_rad = 2 * double(tool.proxy.rotation_step);
  const std::int64_t turns =
      step_rad > 0 ? std::clamp<std::int64_t>(std::int64_t(std::ceil(turn_rad / step_rad)), 1,
                                              SweepRules::kMaxRotationQueries)
                   : 0;
  const std::int64_t left =
      work.budget() - (beyond > 0 ? work.most_wasted() + beyond : 0) -
      std::min((turns + 1) * (query + work.orient), work.budget() / 2 + 2 * (query + work.orient));
  const std::int64_t last = work.query + work.closer;  // no query begins with less
  const std::int64_t queries = left < last ? 0 : (left - last) / query + 1;
  return SweepRules::kStep * double(std::min(SweepRules::kMaxQueries - turns - 1, queries)) -
         SweepRules::kArrived;
}

/// The speed of the hand up to which this tool is free of drag, mm/s.
template <class N>
[[nodiscard]] double air_speed_mm_per_s(const LoadedScene& scene, const SweptTool<N>& tool,
                                        std::size_t volumes) {
  const double units = least_air_move(tool, volumes, kFastestTurnRadPerS / scene.servo.rate_hz);
  return units * contact_unit_mm(scene) * scene.servo.rate_hz / scene.device.workspace_scale;
}

}  // namespace kerf
