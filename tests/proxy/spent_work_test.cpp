// SPDX-License-Identifier: Apache-2.0
// A tick whose work is spent hands its search on to the next one.
#include <algorithm>
#include <cstdint>
#include <utility>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/proxy.hpp"
#include "tests/proxy/support.hpp"

namespace kerf::spent_work_test {

using namespace kerf::test;

namespace {

constexpr double kBowl = 5;

using Face = std::pair<double, Point> (*)(Point);

/// A point in a bowl about the origin, solid beyond kBowl, whose queries of a tick are counted
/// down; beyond them they answer `no_normal`. A turned tool is in the solid while `holds_turns`.
template <class N>
class CountedBowl : public SolidField<N, Face> {
 public:
  explicit CountedBowl(int queries)
      : SolidField<N, Face>(0,
                            [](Point at) { return std::pair(kBowl - length(at), -1 * unit(at)); }),
        queries_(queries) {}

  void begin_tick() { left_ = queries_; }
  Contacts<N> query(ContactVec<typename N::Real> at) {
    Contacts<N> contacts;
    contacts.no_normal =
        (left_ <= 0 && !unseen_) || (holds_turns && !(orientation_ == Orientation<N>{}));
    unseen_ = false;
    --left_;
    return contacts.no_normal ? contacts : SolidField<N, Face>::query(at);
  }
  [[nodiscard]] bool half_spent() const { return left_ <= queries_ / 2; }
  [[nodiscard]] bool may_query() const { return left_ > 0; }
  void orient(const Orientation<N>& orientation) {
    orientation_ = orientation;
    unseen_ = true;
  }

  bool holds_turns = false;

 private:
  int queries_, left_ = 0;
  bool unseen_ = false;
  Orientation<N> orientation_{};
};

/// Leads the point from the bowl's bottom to under `goal` outside of it, and says where it is.
template <class N>
struct Led {
  explicit Led(int queries, double rotation_step = 0) : field(queries) {
    plan.rotation_step = typename N::Unit(rotation_step);
    plan.ramp_per_tick = typename N::Real(1);
    state.pose.centre = place_of<N>({0, -kBowl, 0});
    state.valid = true;
  }
  ProxyContact<N> tick(Point goal, const Orientation<N>& orientation = {}) {
    field.begin_tick();
    return follow(plan, state, field, {place_of<N>(goal), orientation});
  }
  [[nodiscard]] Point at() const { return point_of<N>(state.pose.centre); }

  CountedBowl<N> field;
  ProxyPlan<N> plan;
  ProxyState<N> state;
};

/// Air at the origin alone, in solid that pushes back and lets nothing out; counts how often a free
/// way is asked for.
template <class N>
struct Cage : PlainField<N> {
  using typename PlainField<N>::Place;

  [[nodiscard]] Contacts<N> query(Place at) const {
    return at == Place{} ? Contacts<N>{} : one_plane<N>({0, 1, 0}, 1.5);
  }
  [[nodiscard]] typename N::Real free_distance(Place, Place) {
    ++asked;
    return {};
  }

  int asked = 0;
};

const Point kSide = unit(Point{0.8, -0.5, 0.3});

}  // namespace

TEST_CASE_TEMPLATE("a tick of two queries still finds along a bowl", N, FixedNumbers,
                   DoubleNumbers) {
  // A step of 0.875 ends 0.076 units in the bowl, and no query is left to push the tool out.
  for (const int queries : {2, 3, 4, 6, 32}) {
    CAPTURE(queries);
    Led<N> led(queries);
    for (int tick = 0; tick < 800; ++tick) led.tick(12 * kSide);
    CHECK(length(led.at() - kBowl * kSide) < 0.06);  // as deep as a wedged tool may be
  }
}

TEST_CASE_TEMPLATE("a turn that the solid refuses does not stop the move", N, FixedNumbers,
                   DoubleNumbers) {
  const Orientation<N> askew{typename N::Unit(0), typename N::Unit(0), typename N::Unit(0.6),
                             typename N::Unit(0.8)};
  for (const int queries : {3, 4, 5, 8}) {
    CAPTURE(queries);
    Led<N> led(queries, rotation_step_of(3));
    led.field.holds_turns = true;
    for (int tick = 0; tick < 800; ++tick) CHECK_FALSE(led.tick(12 * kSide, askew).turned);
    CHECK(length(led.at() - kBowl * kSide) < 0.06);
    // Nor does the move stop the turn: the tool turns as soon as it may, at rest and on its way.
    led.field.holds_turns = false;
    for (int tick = 0; tick < 400; ++tick) led.tick({-12, 0, 0}, askew);
    CHECK(led.tick({-12, 0, 0}, askew).turned);
  }
}

TEST_CASE_TEMPLATE("a tool that is held begins its search anew", N, FixedNumbers, DoubleNumbers) {
  Led<N> led(1);  // one query tells where it is, and none is left to move
  std::int32_t most = 0;
  for (int tick = 0; tick < 50; ++tick) {
    const std::int32_t before = led.state.memory.stuck_ticks;
    led.tick(12 * kSide);
    CHECK((led.state.memory.stuck_ticks == before + 1 || led.state.memory.stuck_ticks == 0));
    most = std::max(most, led.state.memory.stuck_ticks);
  }
  CHECK(most == 4);  // with steps of 1, 0.4, 0.16, 0.064 and 0.0256
  while (led.state.memory.stuck_ticks == 0) led.tick(12 * kSide);
  led.tick(led.at());  // the hand comes to where it is
  CHECK(led.state.memory.stuck_ticks == 0);
}

TEST_CASE_TEMPLATE("a shorter step asks for no free way", N, FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  Cage<N> cage;
  ProxyState<N> state;
  state.valid = true;
  const auto tick = [&] { return follow({}, state, cage, {place_of<N>({0, -9, 0}), {}}); };
  CHECK(tick().queries > 3);  // one step after the other fails
  CHECK(cage.asked == 1);
  state.memory.stuck_ticks = 1;
  CHECK(tick().queries > 3);
  CHECK(cage.asked == 1);
  CHECK(state.pose.centre == ContactVec<Real>{});
}

}  // namespace kerf::spent_work_test
