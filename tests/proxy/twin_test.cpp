// SPDX-License-Identifier: Apache-2.0
// Fixed point goes where double goes. Each tick starts both at the same place and leads both to the
// same goal. Nearly all end within a thousandth of a unit of each other. Where a decision lies on
// its threshold one of them may take a step more: then both are within the stop rule of the same
// place, but for ticks that ran out of queries on the way.
#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "tests/proxy/support.hpp"

namespace kerf::twin_test {

using namespace kerf::test;

namespace {

using Face = std::pair<double, Point>;  ///< height above the face, its normal

struct Tally {
  long ticks = 0, otherwise = 0, out_of_queries = 0;
  double apart = 0;  ///< at most, of the ticks that had queries left
};

template <class Nearest>
Tally led_alike(const Nearest& nearest, double friction, int ticks) {
  using F = FixedNumbers;
  using D = DoubleNumbers;
  RandomNumbers random(31);
  SolidField<F, Nearest> fixed_field(8, nearest);
  SolidField<D, Nearest> double_field(8, nearest);
  Point hand{0, 14, 0};
  ProxyPose<F> fixed{place_of<F>(hand), {}};
  Tally tally;
  for (int i = 0; i < ticks; ++i) {
    hand = hand + std::pow(10.0, random.uniform(-1.5, 1.5)) * random.direction();
    for (double& at : hand) at = std::clamp(at, -25.0, 25.0);
    const auto goal = place_of<F>(hand);
    ProxyPose<D> twin{place_of<D>(point_of<F>(fixed.centre)), {}};
    SweepMemory<F> fixed_memory;
    SweepMemory<D> twin_memory;
    const auto a = ProxySweep<F, SolidField<F, Nearest>>(fixed_field, fixed, fixed_memory,
                                                         F::Unit(friction), {})
                       .tick({goal, {}});
    const auto b =
        ProxySweep<D, SolidField<D, Nearest>>(double_field, twin, twin_memory, friction, {})
            .tick({place_of<D>(point_of<F>(goal)), {}});
    const double apart = length(point_of<F>(fixed.centre) - point_of<D>(twin.centre));
    ++tally.ticks;
    tally.otherwise += apart > 1e-3 ? 1 : 0;
    if (std::max(a.queries, b.queries) == SweepRules::kMaxQueries) {
      ++tally.out_of_queries;
    } else {
      tally.apart = std::max(tally.apart, apart);
    }
  }
  return tally;
}

Face flat(Point p) {
  return {p[1], {0, 1, 0}};
}
/// Its centre is below every goal: beyond a centre two near ways lead to two far places.
Face bump(Point p) {
  const Point offset = p + Point{0, 40, 0};
  return {length(offset) - 40, unit(offset)};
}
Face bowl(Point p) {
  const Point offset = Point{0, 32, 0} - p;
  return {40 - length(offset), length(offset) > 0 ? unit(offset) : Point{0, 1, 0}};
}
Face crease(Point p) {
  const double half = std::sqrt(0.5), side = p[2] < 0 ? 1 : -1;
  return {half * (p[1] + side * p[2]), {0, half, side * half}};
}
/// Three faces of a cube from inside.
Face corner(Point p) {
  const double x = p[0] + 15, z = p[2] + 15;
  if (x < p[1] && x < z) return {x, {1, 0, 0}};
  if (z < p[1]) return {z, {0, 0, 1}};
  return {p[1], {0, 1, 0}};
}

}  // namespace

TEST_CASE("fixed point goes where double goes") {
  constexpr int kTicks = 10'000;  // of each, so 1e5 in all
  for (const double friction : {0.0, 0.2}) {
    struct Row {
      const char* name;
      Face (*nearest)(Point);
    };
    for (const auto& [name, nearest] : {Row{"flat", flat}, Row{"bump", bump}, Row{"bowl", bowl},
                                        Row{"crease", crease}, Row{"corner", corner}}) {
      const Tally tally = led_alike(nearest, friction, kTicks);
      MESSAGE(std::string(name) << ", friction " << friction << ": " << tally.otherwise << " of "
                                << tally.ticks << " ticks more than 0.001 units apart, "
                                << tally.apart << " at most, " << tally.out_of_queries
                                << " out of queries");
      CHECK(tally.otherwise * 400 < tally.ticks);
      CHECK(tally.apart < SweepRules::kArrived + 1e-3);
      CHECK(tally.out_of_queries * 20 < tally.ticks);
    }
  }
}

}  // namespace kerf::twin_test
