// SPDX-License-Identifier: Apache-2.0
// Of two arms: what a comparison counts of each, and which one a difference is told of.
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "replay/compared_runs.hpp"
#include "replay/replayed_ticks.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf::two_arms_test {
namespace {

/// A tick in which an arm pushes with a force and removes so many whole voxels.
TickRecord record(float force_n, std::uint32_t voxels, std::uint32_t flags = 0) {
  TickRecord row{};
  row.tick = 1;
  row.commanded_force_n[1] = force_n;
  row.removed = voxels * 65535U;  // kDensityMax
  row.dirty_volumes = voxels > 0 ? 1 : 0;
  row.flags = flags;
  return row;
}

/// The text of rows of a recording, of its replay in double the voxel, each a first and a second
/// arm.
std::string text_of(std::size_t arms, const std::vector<std::array<ArmRecords, 2>>& rows) {
  Manifest manifest;
  manifest.arms = arms;
  manifest.tick_ns = 1'000'000;
  manifest.voxel_mm3 = {0.5};
  ComparedRuns runs(rows.size(), manifest, {1.0});
  for (const auto& [recorded, replayed] : rows) runs.add(recorded, replayed);
  return runs.text();
}

}  // namespace

TEST_CASE("what either arm removes counts, in recording and replay, and only if there is one") {
  const ArmRecords both{record(0.5F, 2), record(0.75F, 6)}, idle{record(0.5F, 0), {}};
  CHECK(text_of(2, {{both, idle}}) ==
        "                 recorded    replayed\n"
        "peak force         0.5000      0.5000 N\n"
        "removed density    4.0000      0.0000 mm3\n"
        "at most apart      0.0000 N, 0.0000 mm between the places of the tool\n");
  const std::string removed_4_8 = "removed density    4.0000      8.0000 mm3\n";
  const ArmRecords crossed{both[1], both[0]};
  CHECK(text_of(2, {{both, both}}).find(removed_4_8) != std::string::npos);
  CHECK(text_of(2, {{crossed, crossed}}).find(removed_4_8) != std::string::npos);
  for (const std::size_t cuts : {std::size_t{0}, std::size_t{1}}) {
    ArmRecords one{};
    one[cuts] = record(0, 8);
    CHECK(text_of(2, {{one, one}}).find(removed_4_8) != std::string::npos);
  }
  CHECK(text_of(1, {{both, both}}).find("removed density    1.0000      2.0000 mm3\n") !=
        std::string::npos);
}

TEST_CASE("a reset takes back what both arms removed, whichever cuts afterwards") {
  const ArmRecords cut{record(0, 2), record(0, 4)};
  const ArmRecords reset{record(0, 0, kFlagReset), record(0, 0, kFlagReset)};
  for (const std::size_t cuts : {std::size_t{0}, std::size_t{1}}) {
    ArmRecords again{};
    again[cuts] = record(0, 6);
    CHECK(text_of(2, {{cut, cut}, {reset, reset}, {again, again}})
              .find("removed density    3.0000      6.0000 mm3\n") != std::string::npos);
  }
}

TEST_CASE("a difference is told of the arm that has it, of the first one if both have") {
  const ArmRecords recorded{record(0.5F, 0), record(0.5F, 0)};
  for (const std::size_t arm : {std::size_t{0}, std::size_t{1}}) {
    CAPTURE(arm);
    ArmRecords replayed = recorded;
    replayed[arm].commanded_force_n[1] = 0.25F;
    const auto found = first_difference(recorded, replayed, 2);
    REQUIRE(found);
    CHECK(found->arm == arm);
    CHECK((text_of(*found, 1'000'000).find("arm 2, ") != std::string::npos) == (arm == 1));
    CHECK(first_difference(recorded, replayed, 1).has_value() == (arm == 0));
    replayed[1 - arm].commanded_force_n[1] = 0.25F;
    CHECK(first_difference(recorded, replayed, 2)->arm == 0);
  }
}

}  // namespace kerf::two_arms_test
