// SPDX-License-Identifier: Apache-2.0
// Phantoms whose tissue is known: what is proposed must find it.
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/connected_parts.hpp"
#include "controller/volume/volume_proposal.hpp"
#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::proposal_test {

using namespace kerf::test;

namespace {

/// Value at a voxel of a cube of `kEdge`, from its middle.
using Tissue = std::function<double(double x, double y, double z)>;
constexpr std::int32_t kEdge = 64;

double distance(double x, double y, double z) {
  return std::sqrt(x * x + y * y + z * z);
}

/// Each voxel is the mean of 8 points within it, as a scanner blurs; then noise.
std::vector<float> scanned(const Tissue& tissue, double noise) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  std::vector<float> values;
  for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {kEdge, kEdge, kEdge}})) {
    double sum = 0;
    for (int k = 0; k < 8; ++k) {
      sum += tissue(x - 31.75 + 0.5 * (k & 1), y - 31.75 + 0.5 * (k >> 1 & 1),
                    z - 31.75 + 0.5 * (k >> 2));
    }
    values.push_back(static_cast<float>(sum / 8 + noise * normal(random)));
  }
  return values;
}

ProposedVolume propose(std::vector<float> values, const ProposalWishes& wishes = {}) {
  SourceVolume source;
  source.grid = {kEdge, kEdge, kEdge};
  source.values = VoxelValues(values);
  const auto [least, most] = std::ranges::minmax(values);
  source.min = static_cast<double>(least);
  source.max = static_cast<double>(most);
  return propose_volume(apply_window(source, range_window(source)), range_window(source), wishes);
}

/// A head in HU: skin and brain to 26, a skull from 18 to 22; a couch of 4 layers touches it.
double head(double x, double y, double z) {
  const double r = distance(x, y, z);
  if (y > 26 && y < 28) return 600;  // of metal, at the border
  if (r > 26) return -1000;
  return r > 18 && r < 22 ? 900 : 40;
}

}  // namespace

TEST_CASE("in a head, bone is taken before skin, and the couch goes") {
  const ProposedVolume made = propose(scanned(head, 15));
  const VolumeProposal& p = made.proposal;
  CHECK(p.surface.hounsfield);
  CHECK(p.surface.skin > -700);
  CHECK(p.surface.skin < -200);
  CHECK(p.iso > 200);  // half-way is 470
  CHECK(p.iso < 700);
  CHECK(p.window.lo == doctest::Approx(40).epsilon(0.3));
  CHECK(p.parts == 1);
  CHECK(p.parts_away >= 1);
  // The skull's box, to a voxel.
  CHECK(std::abs(p.solid.extent().x - 44) <= 2);
  CHECK(std::abs(p.solid.extent().y - 44) <= 2);
  CHECK(std::abs(p.solid.extent().z - 44) <= 2);
  REQUIRE(p.materials.size() == 2);
  CHECK(p.materials[0].name == "soft tissue");
  CHECK(p.materials[1].name == "bone");
  CHECK(p.density_of(p.iso) >= 0.25 - 1e-9);
  CHECK(made.image.density[made.image.grid.index(3, 59, 3)] == 0);  // where the couch was
}

TEST_CASE("without bone the skin is felt, and the couch that touches it goes") {
  const auto soft = [](double x, double y, double z) {
    if (y > 26 && y < 28) return 0.0;
    return distance(x, y, z) > 27 ? -1000.0 : 40.0;
  };
  const VolumeProposal p = propose(scanned(soft, 10)).proposal;
  CHECK(p.surface.hounsfield);
  CHECK_FALSE(p.surface.hard);
  CHECK(p.iso > -700);
  CHECK(p.iso < -200);
}

TEST_CASE("without a scale, what lies below a skin is taken, what lies bare is not") {
  const auto hand = [](double x, double y, double z) {
    const double r = distance(x, y, z);
    return r < 12 ? 200.0 : r < 26 ? 90.0 : 10.0;
  };
  const VolumeProposal covered = propose(scanned(hand, 3)).proposal;
  CHECK(covered.surface.covered);
  CHECK(covered.iso > 110);
  CHECK(covered.iso < 180);
  // The upper half has a coat, as a tooth has.
  const auto tooth = [](double x, double y, double z) {
    const double r = distance(x, y, z);
    return r > 24 ? 10.0 : z > 0 && r > 18 ? 200.0 : 110.0;
  };
  const VolumeProposal bare = propose(scanned(tooth, 3)).proposal;
  CHECK_FALSE(bare.surface.covered);
  REQUIRE(bare.surface.hard);
  CHECK(bare.iso > 30);
  CHECK(bare.iso < 90);
  CHECK(bare.materials.back().name == "denser");
}

TEST_CASE("one material has one surface, whatever its noise") {
  const auto ball = [](double x, double y, double z) {
    return distance(x, y, z) < 20 ? 1000.0 : 0.0;
  };
  for (const double noise : {0.0, 10.0, 60.0}) {
    CAPTURE(noise);
    const VolumeProposal p = propose(scanned(ball, noise)).proposal;
    CHECK_FALSE(p.surface.hounsfield);
    CHECK_FALSE(p.surface.covered);
    CHECK(p.iso > 250);
    CHECK(p.iso < 750);
    CHECK(p.parts == 1);
    CHECK(std::abs(p.solid.extent().x - 40) <= 1);
  }
}

TEST_CASE("a wish goes before what is proposed, and one that cannot be is refused") {
  const std::vector<float> values = scanned(head, 15);
  CHECK(propose(values, {.iso = -300}).proposal.iso == -300);
  const VolumeProposal windowed = propose(values, {.window = Window{0, 1000}}).proposal;
  CHECK(windowed.window.hi == 1000);
  const VolumeProposal whole = propose(values, {.keep_all = true}).proposal;
  CHECK(whole.parts_away == 0);
  CHECK(whole.solid.extent().x == kEdge);
  const auto refused = [&](const ProposalWishes& wishes) {
    try {
      static_cast<void>(propose(values, wishes));
    } catch (const LoadError& error) {
      CHECK(is_one_line(error.what()));
      return true;
    }
    return false;
  };
  CHECK(refused({.iso = 5000}));
  CHECK(refused({.iso = 500, .window = Window{600, 1000}}));
  CHECK(refused({.iso = -5000}));
  std::vector<float> blob(kEdge * kEdge * kEdge, 10.0F);
  blob[1000] = 100;
  CHECK_THROWS_WITH_AS(static_cast<void>(propose(blob, {.iso = -5})),
                       doctest::Contains("iso: everything reaches -5; the values of the file go "
                                         "from 10 to 100, "),
                       LoadError);
}

TEST_CASE("values that no CT has are not taken for its scale") {
  for (const double most : {3000.0, 800000.0}) {
    CAPTURE(most);
    const auto ball = scanned(
        [&](double x, double y, double z) { return distance(x, y, z) < 20 ? most : -1000; }, 0);
    const ProposedVolume proposed = propose(ball);
    CHECK(proposed.proposal.surface.hounsfield == (most < 65536));
    CHECK(std::string(proposed.proposal.unit()) == (most < 65536 ? " HU" : ""));
  }
}

TEST_CASE("a label map, a single voxel and a full box are no trouble") {
  std::vector<float> two(kEdge * kEdge * kEdge, 0.0F);
  for (std::size_t i = 0; i < two.size() / 2; ++i) two[i] = 1;
  CHECK(propose(two).proposal.iso == doctest::Approx(0.5).epsilon(0.01));
  std::vector<float> one(kEdge * kEdge * kEdge, 0.0F);
  one[1000] = 100;
  CHECK(propose(one).proposal.parts == 1);
  std::vector<float> full(kEdge * kEdge * kEdge, 7.0F);
  full[0] = 0;
  CHECK(propose(full).proposal.solid.extent().y == kEdge);
}

TEST_CASE("a voxel size that makes no sense is told") {
  VolumeFrame frame;
  const VoxelBox tooth{{0, 0, 0}, {88, 78, 155}};
  CHECK(odd_spacing(frame, tooth, false) ==
        "1 x 1 x 1 mm (often written where none is known) makes what is solid 88 x 78 x 155 mm; "
        "confirm it with --spacing 1, or give the true one with --override-spacing x,y,z (mm)");
  CHECK(odd_spacing(frame, tooth, true).empty());  // a head of 1 mm is usual
  frame.spacing_mm = {0.125, 0.125, 0.125};
  CHECK(odd_spacing(frame, tooth, false).empty());
  frame.spacing_mm = {125, 125, 125};  // micrometres
  CHECK_FALSE(odd_spacing(frame, tooth, true).empty());
  frame.spacing_mm = {1.25e-4, 1.25e-4, 1.25e-4};  // metres
  CHECK_FALSE(odd_spacing(frame, tooth, false).empty());
  frame.spacing_mm = {0.2, 0.2, 10};  // thick slices
  CHECK(odd_spacing(frame, {{0, 0, 0}, {88, 78, 16}}, true).empty());
  frame.spacing_mm = {0.1, 0.1, 50};
  CHECK_FALSE(odd_spacing(frame, {{0, 0, 0}, {88, 78, 16}}, true).empty());
}

namespace {

/// Sizes of the parts by walking from voxel to voxel: the obvious way.
std::vector<std::uint64_t> walked(const VoxelGrid& grid, std::vector<Density> density) {
  std::vector<std::uint64_t> sizes;
  for (const auto& [x, y, z] : voxels(grid)) {
    std::vector<VoxelIndex> open{{x, y, z}};
    std::uint64_t size = 0;
    while (!open.empty()) {
      const VoxelIndex v = open.back();
      open.pop_back();
      if (!grid.contains(v) || density[grid.index(v.x, v.y, v.z)] == 0) continue;
      density[grid.index(v.x, v.y, v.z)] = 0;
      ++size;
      for (const VoxelIndex& d :
           {VoxelIndex{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
        open.push_back({v.x + d.x, v.y + d.y, v.z + d.z});
      }
    }
    if (size > 0) sizes.push_back(size);
  }
  std::ranges::sort(sizes, std::greater<>());
  return sizes;
}

}  // namespace

TEST_CASE("parts by runs are those of a walk from voxel to voxel") {
  std::mt19937 random(7);
  for (const int percent : {1, 20, 31, 50, 90, 100}) {
    const VoxelGrid grid{17, 9, 11};
    std::vector<Density> density(grid.voxel_count());
    for (Density& d : density) d = random() % 100 < static_cast<unsigned>(percent) ? 1 : 0;
    const SolidParts parts(grid, density, 1);
    std::vector<std::uint64_t> sizes;
    for (const SolidPart& part : parts.parts()) sizes.push_back(part.voxels);
    CAPTURE(percent);
    CHECK(sizes == walked(grid, density));
    std::uint64_t in_runs = 0;
    for (const SolidRun& run : parts.runs()) {
      in_runs += static_cast<std::uint64_t>(run.x1 - run.x0);
      const VoxelBox& box = parts.parts()[run.part].box;
      CHECK(box.contains({run.x0, run.y, run.z}));
      CHECK(box.contains({run.x1 - 1, run.y, run.z}));
    }
    CHECK(in_runs == static_cast<std::uint64_t>(std::ranges::count(density, 1)));
  }
  CHECK(SolidParts({4, 4, 4}, std::vector<Density>(64), 1).parts().empty());
}

TEST_CASE("a body's mask holds the body and not the couch that touches it") {
  VolumeImage image = air({96, 96, 96});
  const auto fill = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    image.density[image.grid.index(x, y, z)] = 1000;
  };
  for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {96, 96, 96}})) {
    const bool body = (x - 48) * (x - 48) + (y - 40) * (y - 40) <= 30 * 30;
    const bool couch = y >= 70 && y < 72;
    if (body || couch) fill(x, y, z);
  }
  const BodyMask mask(image, 500);
  CHECK(mask.contains(48, 40, 48));
  CHECK(mask.contains(48, 10, 0));  // its skin
  CHECK(mask.contains(18, 40, 95));
  CHECK_FALSE(mask.contains(5, 70, 48));
  CHECK_FALSE(mask.contains(90, 71, 48));
}

}  // namespace kerf::proposal_test
