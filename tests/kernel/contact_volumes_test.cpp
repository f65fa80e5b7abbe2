// SPDX-License-Identifier: Apache-2.0
// A tool among several volumes, turned and stretched ones, far from them and deep in them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "tests/case_count.hpp"
#include "tests/kernel/contact_support.hpp"

namespace kerf::contact_volumes_test {

using namespace kerf::test;

namespace {

/// A volume turned by `rotation` (rows: its axes in contact space) with voxels of `edge` units.
template <class N>
ContactFrame<N> frame_of(const std::array<Point, 3>& rotation, const Point& edge,
                         const Point& origin_vox) {
  ContactFrame<N> frame;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      frame.voxel_from_contact.row[i][j] = typename N::Ratio(rotation[i][j] / edge[i]);
    }
  }
  using Real = typename N::Real;
  frame.origin_vox = {Real(origin_vox[0]), Real(origin_vox[1]), Real(origin_vox[2])};
  return frame;
}

static_assert(ContactField<ContactQuery<FixedNumbers>, FixedNumbers>);
static_assert(ContactField<ContactQuery<DoubleNumbers>, DoubleNumbers>);

const SceneTool kBall = tool_of_units("ball", 8, 16);

}  // namespace

TEST_CASE_TEMPLATE("turned volumes of long voxels feel like upright ones", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers random(2);
  for (int i = 0; i < 20; ++i) {
    const Point n = random.direction();
    const std::array<Point, 3> axes = turned_to(random.direction(), random);
    const Point edge{1, random.uniform(1, 1.5), random.uniform(1, 2)};
    const SceneTool tool = i % 2 == 0 ? kBall : tool_of_units("cylinder", 5, 16);
    const Point tool_axis = i % 4 == 1 ? n : random.across(n);
    const double support = tool.round || tool_axis == n ? 8 : 5;
    // Contact space begins in the middle of the volume; the plane is `support` below.
    // The edge of the density is two voxels wide where they are longest.
    const auto height = [&](const Point& voxel) {
      double height = support;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        height += edge[axis] * (voxel[axis] - 14.5) * dot(axes[axis], n);
      }
      return height;
    };
    const TestVolume volume = blurred({30, 30, 30}, height, 4);
    QueryRig<N> rig(tool);
    rig.add(volume, frame_of<N>(axes, edge, {14.5, 14.5, 14.5}));
    rig.orient(turned_to(tool_axis, random));
    const double offset = rig.rest({0, 0, 0}, n);
    CHECK(std::abs(offset) < 0.09);
    const Contacts<N> felt = rig.at(offset * n);
    REQUIRE(felt.count == 1);
    CHECK(degrees_between(normal_of(felt.plane[0]), n) < 1.5);
    CHECK(std::abs(double(felt.depth)) < 0.01);
    // Depths are in units, whatever the voxels.
    CHECK(double(rig.at((offset - 0.3) * n).depth) == doctest::Approx(0.3).epsilon(0.2));
  }
}

TEST_CASE_TEMPLATE("each volume gives a plane, the deepest three are kept in order", N,
                   FixedNumbers, DoubleNumbers) {
  // Walls below, behind, beside and above the ball.
  const Point towards[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}};
  const double deep[] = {0.1, 0.4, 0.2, 0.3};
  std::array<TestVolume, 4> volumes;
  QueryRig<N> rig(kBall);
  for (std::size_t i = 0; i < 4; ++i) {
    volumes[i] = blurred({28, 28, 28}, [&](const Point& x) {
      return dot(towards[i], x - Point{13.5, 13.5, 13.5}) + 8 - deep[i];
    });
    rig.add(volumes[i], plain_frame<N>());
    const Contacts<N> felt = rig.at({13.5, 13.5, 13.5});
    CHECK(felt.count == static_cast<int>(std::min<std::size_t>(i + 1, 3)));
    CHECK(felt.depth == felt.plane[0].depth);
    CHECK_FALSE(felt.no_normal);
  }
  const Contacts<N> felt = rig.at({13.5, 13.5, 13.5});
  const std::size_t order[] = {1, 3, 2};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(double(felt.plane[i].depth) == doctest::Approx(deep[order[i]]).epsilon(0.2));
    CHECK(degrees_between(normal_of(felt.plane[i]), towards[order[i]]) < 0.5);
  }
}

TEST_CASE_TEMPLATE("volumes that share a face give one plane, whichever comes first", N,
                   FixedNumbers, DoubleNumbers) {
  const auto floor = [](double deep) {
    return blurred({28, 28, 28}, [=](const Point& x) { return x[1] - 13.5 + 8 - deep; });
  };
  const TestVolume low = floor(0.1), high = floor(0.2);
  const TestVolume wall =
      blurred({28, 28, 28}, [](const Point& x) { return x[0] - 13.5 + 8 - 0.15; });
  std::array<const TestVolume*, 3> order{&low, &high, &wall};
  do {
    QueryRig<N> rig(kBall);
    for (const TestVolume* volume : order) rig.add(*volume, plain_frame<N>());
    const Contacts<N> felt = rig.at({13.5, 13.5, 13.5});
    REQUIRE(felt.count == 2);
    CHECK(double(felt.plane[0].depth) == doctest::Approx(0.2).epsilon(0.1));
    CHECK(degrees_between(normal_of(felt.plane[0]), {0, 1, 0}) < 0.5);
    CHECK(double(felt.plane[1].depth) == doctest::Approx(0.15).epsilon(0.1));
    CHECK(degrees_between(normal_of(felt.plane[1]), {1, 0, 0}) < 0.5);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST_CASE_TEMPLATE("a tool deep in the solid is buried and has no plane", N, FixedNumbers,
                   DoubleNumbers) {
  const TestVolume volume = blurred({40, 40, 60}, [](const Point& x) { return x[2] - 50; });
  for (const SceneTool& tool : {kBall, tool_of_units("cone", 6, 18)}) {
    QueryRig<N> rig(tool, volume);
    const Contacts<N> felt = rig.at({20, 20, 20});
    CHECK(felt.no_normal);
    CHECK(felt.count == 0);
    CHECK(felt.depth > typename N::Real(0.5));
    CHECK_FALSE(rig.at({20, 20, 50}).no_normal);
  }
}

TEST_CASE_TEMPLATE("far from every volume nothing is felt", N, FixedNumbers, DoubleNumbers) {
  const TestVolume volume = filled({12, 12, 12}, 65535);
  QueryRig<N> rig(kBall, volume);
  for (const double far : {-8192.0, -30.0, 30.0, 8192.0}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Point q{6, 6, 6};
      q[axis] = far;
      const Contacts<N> felt = rig.at(q);
      CHECK(felt.count == 0);
      CHECK(felt.depth == typename N::Real(-1));
      // The volume is 12 wide, the ball 16; the map knows matter to a brick.
      const double gap = std::abs(far - 5.5) - 5.5 - 8;
      const double there = rig.free_distance(q, Point{6, 6, 6} - q);
      CHECK(there > gap - 6);
      CHECK(there < gap + 1);
      CHECK(rig.free_distance(q, 0.2 * (q - Point{6, 6, 6})) ==
            doctest::Approx(0.2 * length(q - Point{6, 6, 6})).epsilon(1e-4));
    }
  }
  CHECK(rig.free_distance({6, 6, 6}, {0, 0, 60}) == 0);
}

TEST_CASE_TEMPLATE("within the free distance a tool feels nothing", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers random(8);
  const Point middle{20, 25, 20};
  const TestVolume volume =
      blurred({60, 50, 60}, [&](const Point& x) { return length(x - middle) - 6; });
  for (const SceneTool& tool : {tool_of_units("ball", 3, 6), tool_of_units("cylinder", 3, 12)}) {
    QueryRig<N> rig(tool, volume);
    int free = 0, stopped = 0;
    for (int i = 0; i < cases(1000); ++i) {
      const Point axis = random.direction();
      rig.orient(turned_to(axis, random));
      const Point q{random.uniform(-20, 80), random.uniform(-20, 70), random.uniform(-20, 80)};
      // Anywhere, and close by the middle.
      const Point move = i % 2 == 0 ? random.uniform(0.1, 60) * random.direction()
                                    : middle + 12.0 * random.direction() - q;
      static_cast<void>(rig.at(q));
      const double distance = rig.free_distance(q, move);
      CHECK(distance <= length(move) + 1e-4);
      if (distance == 0) continue;
      ++free;
      for (int part = 0; part <= 20; ++part) {
        const Point at = q + part / 20.0 * distance * unit(move);
        if (rig.at(at).count != 0) REQUIRE(rig.at(at).count == 0);
      }
      if (distance > length(move) - 0.01) continue;
      ++stopped;
      // What it stopped for is not far: the ramp of the density, 1; a voxel is read from a corner,
      // a brick and a group are known by a box and a sphere.
      const Point there = q + distance * unit(move);
      const double along = std::clamp(dot(middle - there, axis), -6.0, 6.0);
      const double from_axis = length(middle - there - along * axis);
      CHECK(from_axis - 6 - 3 < 1 + 1.8 + 3.5 + 0.3 + (tool.round ? 0 : 3));
    }
    CHECK(free > cases(1000) / 2);
    CHECK(stopped > cases(1000) / 20);
  }
}

TEST_CASE_TEMPLATE("a lone high sample lifts the peak of many low ones", N, FixedNumbers,
                   DoubleNumbers) {
  using Ratio = typename N::Ratio;
  PointMeans<N> means;
  means.density = Ratio(0.2);
  means.square = Ratio(0.04);
  means.top = Ratio(0.3);
  CHECK(double(peak_height(means, true)) == doctest::Approx(0.2));  // alike all round
  CHECK(double(peak_height(means, false)) == doctest::Approx(0.2));
  PointMeans<N> point = means;  // where e is 1
  point.square = Ratio(0.04 * 36 / 35);
  CHECK(double(peak_height(point, true)) == doctest::Approx(0.2418).epsilon(1e-4));
  means.top = Ratio(0.7);
  CHECK(double(peak_height(means, true)) == doctest::Approx(0.5));
  CHECK(double(peak_height(means, false)) == doctest::Approx(0.5));
}

TEST_CASE_TEMPLATE("the height of a peak does not depend on its dimension", N, FixedNumbers,
                   DoubleNumbers) {
  using Ratio = typename N::Ratio;
  for (const double e : {0.0, 0.5, 1.0, 1.5, 2.0}) {
    // Means of h and h^2 with weights h^6 where heights are as frequent as (H - h)^(e - 1).
    const double height = 0.5, mean = height * 7 / (7 + e);
    PointMeans<N> means;
    means.density = Ratio(mean);
    means.square = Ratio(mean * height * 8 / (8 + e));
    means.top = Ratio(height);
    CHECK(double(peak_height(means, false)) == doctest::Approx(height).epsilon(1e-4));
  }
}

TEST_CASE_TEMPLATE(
    "what the queries of a tick look at is bounded; the first after a turn is answered", N,
    FixedNumbers, DoubleNumbers) {
  // Felt on all sides, hardly solid anywhere, and a voxel of the iso near each place, so that no
  // map tells that it bears nothing: the costliest that there is.
  TestVolume tissue = blurred({40, 40, 40}, [](Point p) { return 0.2 + 0.01 * (p[1] - 20); });
  for (int z = 0; z < 40; z += 5) {
    for (int y = 0; y < 40; y += 5) {
      for (int x = 0; x < 40; x += 5) tissue.density[tissue.grid.index(x, y, z)] = kIso;
    }
  }
  for (const SceneTool& tool : {kBall, tool_of_units("cylinder", 5, 16)}) {
    QueryRig<N> rig(tool);
    rig.add(tissue, plain_frame<N>());
    const Point middle{20, 20, 20};
    const auto answered = [&] {
      int queries = 0;
      while (queries < 100 && !rig.at(middle).no_normal) ++queries;
      return queries;
    };
    CHECK(answered() == 100);  // nothing is counted before the first tick
    for (int tick = 0; tick < 3; ++tick) {
      rig.field().begin_tick();
      const int queries = answered();
      // A cylinder's have closer looks, which cost as much as two queries.
      CHECK(queries >= (tool.round ? QueryWork::kLeastQueries : 8));
      CHECK(queries <= 25);
    }
    rig.field().orient({});
    CHECK(answered() == 1);
  }
}

TEST_CASE_TEMPLATE("all volumes of a query are looked at alike, while the tick has some left", N,
                   FixedNumbers, DoubleNumbers) {
  const SampledTool cylinder(tool_of_units("cylinder", 5, 16));
  RandomNumbers random(4);
  for (int pose = 0; pose < 20; ++pose) {
    const Point n = random.direction(), top{20, 20, 20};
    const TestVolume flat = blurred({40, 40, 40}, [&](Point p) { return dot(p - top, n); });
    ContactRig<N> rig(cylinder);
    for (int copy = 0; copy < 3; ++copy) rig.add(flat, plain_frame<N>());
    rig.field().orient(random.rotation<N>(random.uniform(0, 3)));
    const auto place = place_of<N>(top + random.uniform(4, 8) * n);
    rig.field().begin_tick();
    rig.field().orient(random.rotation<N>(0));
    for (Contacts<N> felt = rig.field().query(place); !felt.no_normal;
         felt = rig.field().query(place)) {
      for (std::int32_t k = 1; k < felt.count; ++k) {
        CHECK(felt.plane[static_cast<std::size_t>(k)].depth == felt.plane[0].depth);
        CHECK(felt.plane[static_cast<std::size_t>(k)].normal == felt.plane[0].normal);
      }
    }
  }
}

TEST_CASE_TEMPLATE("no tick of a sweep spends more than a scene is planned with", N, FixedNumbers,
                   DoubleNumbers) {
  const TestVolume tissue = blurred({60, 60, 60}, [](Point p) { return 0.1 + 0.01 * (p[1] - 30); });
  const Point middle{30, 30, 30};
  for (const SceneTool& tool :
       {kBall, tool_of_units("cylinder", 5, 16), tool_of_units("cylinder", 10, 30)}) {
    ContactRig<N> rig(tool);
    rig.add(tissue, plain_frame<N>());
    const QueryWork work = rig.field().work();
    RandomNumbers random(7);
    std::int64_t most = 0;
    for (int tick = 0; tick < 300; ++tick) {
      ProxyPose<N> pose{place_of<N>(middle), {}};
      const ProxyPose<N> goal{place_of<N>(middle + random.uniform(1, 30) * random.direction()),
                              random.rotation<N>(random.uniform(0, 3))};
      rig.field().begin_tick();
      SweepMemory<N> memory;
      ProxySweep<N, ContactQuery<N>>(rig.field(), pose, memory, {}, rig.rotation_step()).tick(goal);
      most = std::max(most, rig.field().spent());
    }
    CHECK(most <= work.most());
    CHECK(double(most) > 0.8 * double(work.most()));
  }
}

}  // namespace kerf::contact_volumes_test
