// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy.hpp"
#include "tests/kernel/contact_support.hpp"
#include "tests/proxy/support.hpp"

namespace kerf::proxy_contact_test {

using namespace kerf::test;

namespace {

constexpr double kRadius = 8;
constexpr Point kUp{0, 1, 0};
const SceneTool kBall = tool_of_units("ball", kRadius, 2 * kRadius);

template <class N>
ProxyPlan<N> plan(double friction = 0, double rotation_step = 0) {
  using Unit = typename N::Unit;
  return {Unit(friction), Unit(rotation_step), typename N::Real(0.25)};
}

/// A block whose top is at height 30, seven voxels from the other ends of its volume.
TestVolume block() {
  return blurred({60, 60, 60}, [](Point p) {
    const double side = std::max(std::abs(p[0] - 30), std::abs(p[2] - 30)) - 23;
    return std::max({side, p[1] - 30, 7 - p[1]});
  });
}

/// Counts the queries.
template <class N>
struct CountedField {
  Contacts<N> query(ContactVec<typename N::Real> q) {
    ++queries;
    return field.query(q);
  }
  [[nodiscard]] bool half_spent() const { return field.half_spent(); }
  [[nodiscard]] bool may_query() const { return field.may_query(); }
  [[nodiscard]] typename N::Real deficit() const { return field.deficit(); }
  [[nodiscard]] bool is_solid(ContactVec<typename N::Real> q) const { return field.is_solid(q); }
  typename N::Real free_distance(ContactVec<typename N::Real> q,
                                 ContactVec<typename N::Real> move) const {
    return field.free_distance(q, move);
  }
  void orient(const Orientation<N>& orientation) { field.orient(orientation); }

  ContactQuery<N>& field;
  int queries = 0;
};

template <class N>
ProxyPose<N> pose_of(Point place) {
  return {place_of<N>(place), {}};
}

}  // namespace

TEST_CASE_TEMPLATE("a contact tells spring, normal and no torque of a ball", N, FixedNumbers,
                   DoubleNumbers) {
  const TestVolume volume = block();
  ContactRig<N> rig(kBall, volume);
  ProxyState<N> state;
  CHECK(follow(plan<N>(), state, rig.field(), pose_of<N>({30, 40, 30})).status ==
        ProxyStatus::placed);
  ProxyContact<N> contact;
  for (double y = 40; y > 35; y -= 0.5) {
    contact = follow(plan<N>(), state, rig.field(), pose_of<N>({30, y, 30}));
  }
  CHECK(point_of<N>(contact.spring)[1] == doctest::Approx(38 - 35.5).epsilon(0.02));
  CHECK(double(contact.normal.y) == doctest::Approx(1));
  CHECK(length(point_of<N>(contact.moment_arm)) < 0.05);
}

TEST_CASE_TEMPLATE("a contact beside the centre turns the tool about its tip", N, FixedNumbers,
                   DoubleNumbers) {
  FlatField<N> field(kUp, {3, -1, 0});
  ProxyState<N> state;
  follow(plan<N>(), state, field, pose_of<N>({0, 2, 0}));
  const auto contact = follow(plan<N>(), state, field, pose_of<N>({0, -1, 0}));
  CHECK(point_of<N>(contact.spring)[1] == doctest::Approx(2).epsilon(0.01));
  // (3, -1, 0) x (0, 1, 0)
  CHECK(length(point_of<N>(contact.moment_arm) - Point{0, 0, 3}) < 1e-3);
}

TEST_CASE_TEMPLATE("friction turns a ball backwards", N, FixedNumbers, DoubleNumbers) {
  FlatField<N> field(kUp, {0, -4, 0});
  ProxyState<N> state;
  follow(plan<N>(0.5), state, field, pose_of<N>({0, 4.5, 0}));
  ProxyContact<N> contact;
  for (int i = 1; i < 100; ++i) {
    contact = follow(plan<N>(0.5), state, field, pose_of<N>({0.1 * i, 2, 0}));
  }
  const Point spring = point_of<N>(contact.spring);
  CHECK(spring[0] / spring[1] == doctest::Approx(-0.5).epsilon(0.03));
  CHECK(double(contact.normal.y) == doctest::Approx(1));
  // arm x force = (0, -4, 0) x (-1, 2, 0) = (0, 0, -4), over a force of sqrt(5)
  CHECK(length(point_of<N>(contact.moment_arm) - Point{0, 0, -4 / std::sqrt(5.0)}) < 0.05);
}

TEST_CASE_TEMPLATE("a tool that lags is pressed by what it slides on, not by its way", N,
                   FixedNumbers, DoubleNumbers) {
  FlatField<N> field(kUp, {0, -4, 0});
  ProxyState<N> state;
  follow(plan<N>(), state, field, pose_of<N>({0, 4.5, 0}));
  for (int i = 1; i < 20; ++i) {
    const auto contact = follow(plan<N>(), state, field, pose_of<N>({40.0 * i, 3.5, 0}));
    CHECK(point_of<N>(contact.spring)[0] < -10);
    CHECK(double(contact.normal.y) == doctest::Approx(1));
  }
}

TEST_CASE_TEMPLATE("a turn that would sink the tool lifts it", N, FixedNumbers, DoubleNumbers) {
  FlatField<N> field(kUp, {6, 0, 0});  // a finger along x, 6 units long
  ProxyState<N> state;
  const auto turning = plan<N>(0, rotation_step_of(6));
  follow(turning, state, field, pose_of<N>({0, 0.5, 0}));
  ProxyPose<N> goal = pose_of<N>({0, 0.5, 0});
  double lifted = 0.5;
  for (int i = 1; i <= 100; ++i) {  // by 0.5 radians, downwards
    const double half = -0.005 * i / 2;
    goal.orientation = {{}, {}, typename N::Unit(std::sin(half)), typename N::Unit(std::cos(half))};
    const auto contact = follow(turning, state, field, goal);
    CHECK(contact.turned);
    const double height = point_of<N>(contact.pose.centre)[1];
    CHECK(height >= 6 * std::sin(0.005 * i) - 0.011);
    CHECK(height > lifted - 0.011);
    lifted = height;
  }
  CHECK(lifted == doctest::Approx(6 * std::sin(0.5)).epsilon(0.01));
}

TEST_CASE_TEMPLATE("a tool with no room to turn keeps its orientation, and follows when it has", N,
                   FixedNumbers, DoubleNumbers) {
  // A bar of 16 in a shaft 12 wide whose walls go on forever upwards.
  const TestVolume volume =
      blurred({70, 70, 70}, [](Point p) { return 6 - std::hypot(p[0] - 35, p[2] - 35); });
  ContactRig<N> rig(tool_of_units("cylinder", 5, 16), volume);
  ProxyState<N> state;
  const auto turning = plan<N>(0, rotation_step_of(9.5));
  ProxyPose<N> goal = pose_of<N>({35, 35, 35});
  REQUIRE(follow(turning, state, rig.field(), goal).status == ProxyStatus::placed);
  const double half = 0.5;  // a radian about z
  goal.orientation = {{}, {}, typename N::Unit(std::sin(half)), typename N::Unit(std::cos(half))};
  ProxyContact<N> contact;
  for (int i = 0; i < 50; ++i) contact = follow(turning, state, rig.field(), goal);
  CHECK_FALSE(contact.turned);
  const double turned = 2 * std::asin(double(contact.pose.orientation.z));
  CHECK(turned > 0.05);
  CHECK(turned < 0.4);
  goal.orientation = {};
  CHECK(follow(turning, state, rig.field(), goal).turned);
}

TEST_CASE_TEMPLATE("a start inside of the solid ends outside, by a force that grows", N,
                   FixedNumbers, DoubleNumbers) {
  const TestVolume volume = block();
  ContactRig<N> rig(kBall, volume);
  CountedField<N> field{rig.field()};
  ProxyState<N> state;
  const auto goal = pose_of<N>({30, 22, 30});  // 16 deep
  double felt = 0;
  int searched = 0;
  ProxyContact<N> contact;
  for (int i = 0; i < 200; ++i) {
    field.queries = 0;
    contact = follow(plan<N>(), state, field, goal);
    CHECK(field.queries <= SweepRules::kMaxQueries);
    const double now = length(point_of<N>(contact.spring));
    CHECK(now <= felt + 0.25 + 1e-3);
    CHECK((contact.status == ProxyStatus::placed || now == 0));
    searched += contact.status == ProxyStatus::placed ? 0 : 1;
    felt = now;
  }
  CHECK(searched >= 28);  // two ticks a unit
  CHECK(searched <= 40);
  CHECK(felt == doctest::Approx(16).epsilon(0.02));
  CHECK(point_of<N>(contact.pose.centre)[1] == doctest::Approx(38).epsilon(0.01));
}

TEST_CASE_TEMPLATE("a start with nothing free near is refused, until the hand is out", N,
                   FixedNumbers, DoubleNumbers) {
  FlatField<N> field(kUp);
  ProxyState<N> state;
  ProxyContact<N> contact;
  for (int i = 0; i < 150; ++i) contact = follow(plan<N>(), state, field, pose_of<N>({0, -200, 0}));
  CHECK(contact.status == ProxyStatus::refused);
  CHECK(length(point_of<N>(contact.spring)) == 0);
  CHECK(follow(plan<N>(), state, field, pose_of<N>({0, 3, 0})).status == ProxyStatus::placed);
  const auto back = follow(plan<N>(), state, field, pose_of<N>({0, -2, 0}));
  CHECK(point_of<N>(back.spring)[1] == doctest::Approx(2).epsilon(0.01));  // and no ramp
}

TEST_CASE_TEMPLATE("a volume that fills up around the tool starts the search again", N,
                   FixedNumbers, DoubleNumbers) {
  const TestVolume full = block();
  TestVolume volume = full;
  ContactRig<N> rig(kBall, volume);  // its map of what is free knows the full block
  std::fill(volume.density.begin(), volume.density.end(), Density{0});
  ProxyState<N> state;
  const auto goal = pose_of<N>({30, 31, 30});
  CHECK(follow(plan<N>(), state, rig.field(), goal).status == ProxyStatus::placed);
  std::copy(full.density.begin(), full.density.end(), volume.density.begin());
  double felt = 0;
  ProxyContact<N> contact;
  for (int i = 0; i < 100; ++i) {
    contact = follow(plan<N>(), state, rig.field(), goal);
    const double now = length(point_of<N>(contact.spring));
    CHECK(now <= felt + 0.25 + 1e-3);
    felt = now;
  }
  CHECK(contact.status == ProxyStatus::placed);
  CHECK(felt == doctest::Approx(7).epsilon(0.03));
}

TEST_CASE("a goal that is no number gives no force and changes nothing") {
  using N = DoubleNumbers;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  FlatField<N> field(kUp);
  ProxyState<N> state;
  follow(plan<N>(), state, field, pose_of<N>({0, 0.5, 0}));
  const auto before = follow(plan<N>(), state, field, pose_of<N>({0, -2, 0}));
  for (const Point bad : {Point{kNan, 0, 0}, Point{0, kInfinity, 0}, Point{0, 0, -kInfinity}}) {
    const auto contact = follow(plan<N>(), state, field, pose_of<N>(bad));
    CHECK(length(point_of<N>(contact.spring)) == 0);
    CHECK(contact.pose == before.pose);
  }
  ProxyPose<N> bad_turn = pose_of<N>({0, -2, 0});
  bad_turn.orientation.w = kNan;
  CHECK(length(point_of<N>(follow(plan<N>(), state, field, bad_turn).spring)) == 0);
  CHECK(follow(plan<N>(), state, field, pose_of<N>({0, -2, 0})).spring == before.spring);
}

TEST_CASE_TEMPLATE("a far goal is bounded work and a finite force", N, FixedNumbers,
                   DoubleNumbers) {
  FlatField<N> field(kUp);
  for (const double far : {1e4, 3e4, 1e6, 1e30}) {
    for (const double side : {-1.0, 1.0}) {
      ProxyState<N> state;
      follow(plan<N>(0.3), state, field, pose_of<N>({0, 0.5, 0}));
      const auto goal = pose_of<N>({side * far, -far, far});
      for (int i = 0; i < 3; ++i) {
        const auto contact = follow(plan<N>(0.3), state, field, goal);
        CHECK(contact.queries <= SweepRules::kMaxQueries);
        CHECK(point_of<N>(contact.pose.centre)[1] > -0.011);
        CHECK(length(point_of<N>(contact.spring)) < 15000);
        CHECK(length(point_of<N>(contact.spring)) > 8000);
      }
    }
  }
}

namespace {

/// A slot from x = 0.2 on that is narrower than the tool: both walls are `depth` deep in it.
template <class N>
struct NarrowSlot : kerf::test::PlainField<N> {
  using typename kerf::test::PlainField<N>::Real;

  Contacts<N> query(ContactVec<Real> at) const {
    if (at.x < Real(0.2)) return {};
    Contacts<N> contacts = kerf::test::one_plane<N>({0, 1, 0}, depth);
    insert(contacts, kerf::test::one_plane<N>({0, -1, 0}, depth).plane[0]);
    return contacts;
  }
  [[nodiscard]] Real deficit() const { return Real(beyond); }

  double depth = 0, beyond = 0;
};

}  // namespace

TEST_CASE_TEMPLATE("a wedged tool moves on while the deepest point of its surface is allowed", N,
                   FixedNumbers, DoubleNumbers) {
  const auto moves = [](double depth, double deficit) {
    NarrowSlot<N> slot;
    slot.depth = depth;
    slot.beyond = deficit;
    ProxyPose<N> pose;
    SweepMemory<N> memory;
    static_cast<void>(
        ProxySweep<N, NarrowSlot<N>>(slot, pose, memory, {}, {}).tick(pose_of<N>({0.5, 0, 0})));
    return double(pose.centre.x) > 0.2;
  };
  for (const double deficit : {0.0, 0.01, 0.03}) {
    CAPTURE(deficit);
    CHECK(moves(SweepRules::kWedged - deficit - 0.001, deficit));
    CHECK_FALSE(moves(SweepRules::kWedged - deficit + 0.001, deficit));
  }
  // Of coarse samples the tolerance of any position is left.
  CHECK(moves(0.009, 1));
}

}  // namespace kerf::proxy_contact_test
