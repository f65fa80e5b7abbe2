// SPDX-License-Identifier: Apache-2.0
// One scripted cut, hashed: the same bits from every compiler, optimisation level and machine.

#include <cstdint>
#include <string>

#include <doctest/doctest.h>

#include "controller/kernel/sampling.hpp"
#include "tests/kernel/hash.hpp"
#include "tests/kernel/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// A ball in a cloud of noise, from integers only.
TestVolume blob() {
  std::uint32_t noise = 1;
  return made_of({48, 26, 22}, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    noise = noise * 1664525u + 1013904223u;
    const std::int32_t square = (x - 24) * (x - 24) + (y - 13) * (y - 13) + (z - 11) * (z - 11);
    return static_cast<Density>(square < 81 ? 60000 + (noise >> 20) : noise >> 24);
  });
}

/// A turned 8 voxel ball through the blob in 80 ticks; every result of every stage is hashed.
template <class N>
std::string scripted_cut(GradientKernel kernel, bool exact_exponential) {
  TestVolume volume = blob();
  auto field = gradients<N>(kernel, volume);
  const auto tool = paper_ball(8);
  const auto rate = removal_rate<N>(0.125, exact_exponential);
  Cutter<N> cutter(24);
  GradientScratch scratch;
  Hash hash;
  for (int tick = 0; tick < 80; ++tick) {
    // Rational quaternions and positions: no libm decides about a bit.
    const auto pose = turned_pose<N>({tick * 0.625 - 2, 13 + tick * 0.03125, 20 - tick * 0.1875},
                                     {1, 2, tick * 0.125, 3}, 0.875);
    hash.add(contact_sum<N>(volume.grid, field, tool, pose));
    overlap<N>(volume.grid, tool, pose, step_from<N>(0.669921875), cutter.overlap);
    hash.add(modification_sum<N>(volume.grid, field, volume.density, cutter.overlap));
    using Unit = typename N::Unit;
    hash.add(static_cast<double>(penetration_extent<N>(volume.grid, volume.density, tool, pose,
                                                       32768, {Unit(0.6), Unit(0.0), Unit(0.8)})));
    const Removed removed =
        remove<N>(volume.grid, volume.density, cutter.overlap, rate, cutter.carry);
    hash.add(removed.density_steps);
    refresh_gradients<N>(kernel, volume.grid, volume.density, removed.changed, field, scratch);
  }
  for (const Density rho : volume.density) hash.add(std::uint64_t{rho});
  for (const auto& g : field) {
    for (const auto part : {g.x, g.y, g.z}) hash.add(static_cast<double>(part));
  }
  for (const auto owed : cutter.carry) hash.add(static_cast<double>(owed));
  return hash.hex();
}

}  // namespace

TEST_CASE("a scripted cut ends in the known hash: fixed") {
  CHECK(scripted_cut<FixedNumbers>(GradientKernel::farid, false) == "691a8bb5e4ce8e6e");
  CHECK(scripted_cut<FixedNumbers>(GradientKernel::sobel5, true) == "5bea33a96e22c8ce");
  CHECK(scripted_cut<FixedNumbers>(GradientKernel::central, false) == "bb3cdf22bf9dabe5");
}

TEST_CASE("a scripted cut ends in the known hash: double") {
  CHECK(scripted_cut<DoubleNumbers>(GradientKernel::farid, true) == "572e4679cfb43462");
}
