// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/json.hpp"
#include "tests/rig/contact_motions.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/exact_contact.hpp"
#include "tests/studies/contact/hands.hpp"
#include "tests/studies/contact/rows.hpp"
#include "tests/studies/studies_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::extremes_test {

using namespace kerf::extremes;
using kerf::test::studies, kerf::test::LabAnswer;

TEST_CASE("a row passes up to its limit; one without a limit is only told") {
  CHECK(Row{"g", "n", 2, "1", 2, 1}.pass());
  CHECK_FALSE(Row{"g", "n", 2.001, "1", 2, 1}.pass());
  CHECK(Row{"g", "n", 1e9, "1", {}, {}}.pass());
}

TEST_CASE("a row that was skipped is not judged") {
  const Row skipped{"g", "n", 3, "1", 2, 1, "no --data"};
  CHECK_FALSE(skipped.judged());
  CHECK(skipped.pass());
}

TEST_CASE("the report has each row with its limit and whether it is kept, and the code says so") {
  const kerf::test::TemporaryFolder folder;
  const auto file = folder / "report.json";
  const LabAnswer answer = studies("extremes --quick --only slides --report " + file.string());
  const auto rows = kerf::test::read_json_file(file)["rows"];
  CHECK(rows.size() == 12);
  bool all = true;
  for (const kerf::test::ReadJson row : rows) {
    CHECK(row["group"] == "slides");
    CHECK(row["pass"] == (row["value"] <= row["limit"]));
    all = all && row["pass"].get<bool>();
    CHECK(answer.out.find(row["name"].get<std::string>()) != std::string::npos);
  }
  CHECK(answer.code == (all ? 0 : 1));
}

TEST_CASE(
    "a quick run measures the iso-surfaces against the limit of a full one, from any folder") {
  const auto here = std::filesystem::current_path();
  const kerf::test::TemporaryFolder folder;
  std::filesystem::current_path(folder.path());
  const LabAnswer isos = studies("extremes --quick --only isos");
  const LabAnswer shapes = studies("extremes --quick --only shapes");  // reads a bur of scenes/burs
  std::filesystem::current_path(here);
  CAPTURE(isos.out);
  CHECK(isos.code == 0);
  CHECK(shapes.code != 2);
}

TEST_CASE("a head that is wedged against its own shaft between two walls goes on cutting") {
  // The sent force stands across the face that the head is pressed on.
  const LabAnswer answer = studies("extremes --only traps --presses 23 --seed 5");
  CAPTURE(answer.out);
  CHECK(answer.code == 0);
}

TEST_CASE("the tick that sank the bur deepest into a wall ends within the depth of a wedged tool") {
  // Tick 51 at the 380th wall of the rows `walls`: with its work spent the sweep kept a position
  // whose samples were 0.0395 deep, and a corner of the mesh between them 0.0551.
  using N = kerf::FixedNumbers;
  const auto raw = [](auto number, std::int32_t value) {
    return decltype(number)::from_raw(value);
  };
  const auto orientation = [&](std::int32_t w, std::int32_t x, std::int32_t y, std::int32_t z) {
    const N::Unit unit{};
    return kerf::Orientation<N>{raw(unit, x), raw(unit, y), raw(unit, z), raw(unit, w)};
  };
  const Point up{0.54171018016247141, 0.61352605527651227, -0.5745745036156622};
  const Point place{32.195366719343276, 32.253210462003516, 32.789943098137485};
  const Body wall = blurred({66, 66, 66}, [&](Point p) { return dot(p - place, up); });
  const kerf::SceneTool bur = shipped_bur();
  const SampledTool tool(bur);
  CHECK(tool.deficit > 0.02);
  ContactRig<N> rig(tool, wall);
  const N::Real unit{};
  kerf::ProxyPose<N> pose{{raw(unit, 2121136), raw(unit, 2628807), raw(unit, 1551254)},
                          orientation(779782352, -132531184, -590145065, 423113787)};
  kerf::SweepMemory<N> memory;
  rig.field().begin_tick();
  const auto swept =
      kerf::ProxySweep<N, kerf::ContactQuery<N>>(rig.field(), pose, memory, {}, rig.rotation_step())
          .tick({{raw(unit, 1289941), raw(unit, 1631051), raw(unit, 2457233)},
                 orientation(739924823, 757505406, -81374689, 158102751)});
  const ShakenTool shape{.round = false, .mesh = &bur};
  const double below = shape.reach_below<N>(pose.orientation, up);
  const double sunk = below - dot(point_of<N>(pose.centre) - place, up);
  CAPTURE(double(swept.depth));
  CHECK(sunk < kerf::SweepRules::kWedged);
  CHECK(sunk > -2);  // it came to the wall
}

TEST_CASE("the paper's force ends inside of a wall and can be passed; the proxy's does not") {
  const Comparison comparison = compare(Effort::quick(), [](const Row&) {});
  for (const Wall& wall : comparison.walls) {
    CHECK(std::abs(wall.presses.back().paper_n) < 1e-6);
    CHECK(wall.presses.back().proxy_n ==
          doctest::Approx(0.4 * wall.presses.back().depth_mm).epsilon(0.01));
    double before = 0;
    for (const Loss& loss : wall.losses) {
      CHECK_FALSE(loss.proxy_mm_per_s);
      REQUIRE(loss.paper_mm_per_s);
      CHECK(*loss.paper_mm_per_s > before);  // a higher rate helps
      before = *loss.paper_mm_per_s;
    }
  }
  // The zone of force on a thick wall is the ball's diameter and the width of its edge.
  CHECK(*comparison.walls[0].losses.back().paper_mm_per_s ==
        doctest::Approx(1000 * (1.6 + 0.4)).epsilon(0.15));
}

TEST_CASE("the costliest tick is told with its place; a body out of reach keeps the one before") {
  const WorstCase flat{"flat", {}, {20, 20, 20}, kIso};
  const Body solid = blurred({40, 40, 40}, [](Point p) { return p[2] - 20; });
  const kerf::SceneTool ball = tool_of_units("ball", 8, 16);
  WorstTick worst;
  find_worst_tick(ball, flat, solid, 200, worst);
  CHECK(worst.us > 0);
  CHECK(worst.at == "flat");
  CHECK(worst.queries <= kerf::SweepRules::kMaxQueries);
  worst.us = 1e9;
  find_worst_tick(ball, {"air", {}, {1000, 20, 20}, kIso}, solid, 200, worst);
  CHECK(worst.at == "flat");
}

TEST_CASE("exact contact on a smooth ball is where and how the ball is") {
  const SampledTool cone(tool_of_units("cone", 5, 16));
  RandomNumbers random(2);
  for (int pose = 0; pose < 10; ++pose) {
    const Point up = random.direction(), top{30, 30, 30};
    const Axes axes = standing_on(random.direction(), random);
    const Body bump =
        blurred({60, 60, 60}, [&](Point p) { return length(p - top + 40 * up) - 40; });
    const Reach reach(tool_of_units("cone", 5, 16));
    const Point centre = top - axes.to_world(reach.farthest(axes.to_tool(-1 * up)));
    const ExactTouch touch(cone, axes, bump);
    CHECK(std::abs(touch.height(centre, up)) < 0.03);
    CHECK(degrees_between(touch.normal(centre, up), up) < 1);
  }
}

}  // namespace kerf::extremes_test
