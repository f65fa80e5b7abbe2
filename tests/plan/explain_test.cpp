// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/plan/work_budget.hpp"
#include "controller/run/scene_check.hpp"
#include "tests/json.hpp"
#include "tests/servo/support.hpp"

using namespace kerf;

namespace {

SegmentPlan segment_of(bool cutting, bool labels) {
  static const std::vector<Density> density(std::size_t{16} * 16 * 16, 1);
  static const std::vector<Label> label(density.size(), 1);
  SegmentSpec spec;
  spec.scene_json = "{}";
  spec.mirror_updates = cutting;
  SegmentVolumeSpec& volume = spec.volumes.emplace_back();
  volume.grid = {16, 16, 16};
  volume.density = density;
  if (labels) volume.labels = label;
  return plan_segment(spec);
}

std::uint64_t bytes_of(const std::vector<ArrayBytes>& arrays, const std::string& name) {
  for (const ArrayBytes& array : arrays) {
    if (array.name == name) return array.bytes;
  }
  return 0;
}

}  // namespace

TEST_CASE("the segment's parts fill it, and only what the scene names is there") {
  LoadedScene scene;
  scene.volumes.emplace_back().name = "tooth";
  for (const bool cutting : {false, true}) {
    const SegmentPlan plan = segment_of(cutting, cutting);
    const auto arrays = segment_arrays(plan, scene);
    std::uint64_t sum = 0;
    for (const ArrayBytes& array : arrays) sum += array.bytes;
    CHECK(sum == plan.header.total_bytes);
    CHECK((bytes_of(arrays, "segment: labels of tooth") != 0) == cutting);
    CHECK((bytes_of(arrays, "segment: ring of changes") != 0) == cutting);
    CHECK(bytes_of(arrays, "segment: bricks of tooth") == 8 * 512 * sizeof(Density));
  }
}

TEST_CASE("one factor, fitted to a scene's ticks, makes their work add up to what was measured") {
  LoadedScene scene = test::half_space_scene(48);
  scene.cut.model = CutModel::preston;
  scene.tools.push_back(test::ball(10));
  const auto servo = compile(scene);
  const CostReport explanation = explain(scene, *servo, segment_of(true, false));
  REQUIRE(explanation.ticks.size() == 2);
  CHECK(explanation.machine_factor > 0);
  double predicted_us = 0, measured_us = 0;
  for (std::size_t i = 0; i < explanation.ticks.size(); ++i) {
    const ExplainedTick& tick = explanation.ticks[i];
    CHECK(work_us(tick.most) == work_us(servo->costs(), i));
    CHECK(work_us(tick.time.stages) <= work_us(tick.most));
    predicted_us += explanation.machine_factor * work_us(tick.time.stages);
    measured_us += tick.time.median_us;
  }
  CHECK(predicted_us == doctest::Approx(measured_us));
}

TEST_CASE("an explanation is told in text and JSON with the same figures") {
  CostReport explanation;
  explanation.scene = "scenes/x.toml";
  explanation.numeric = "fixed";
  explanation.cut = "none";
  explanation.budget_us = 500;
  explanation.machine_factor = 2;
  for (const char* volume : {"tooth", "filling"}) {
    explanation.ticks.push_back({"ball",
                                 volume,
                                 "aligned/scalar",
                                 "round",
                                 {{"copy", 4000, 1.25}},
                                 {2.25, 2.5, {{"copy", 3000, 1.25}}}});
  }
  explanation.arrays = {{"density of tooth", 3 << 20, true}, {"carry of tooth", 64, false}};
  const std::string text = explanation_text(explanation);
  CHECK(text.find("ball in tooth: aligned/scalar (round)") != std::string::npos);
  CHECK(text.find("3.0 MiB") != std::string::npos);
  CHECK(text.find("64 B") != std::string::npos);
  CHECK(text.find("at most 500.0 us: half a tick at 1000 Hz") != std::string::npos);
  CHECK(text.find("10.0 us     2.0 %") != std::string::npos);  // both volumes
  const auto json = kerf::test::read_json(explanation_json(explanation));
  CHECK(json["ticks"][0]["stages"][0]["operations"] == 4000);
  CHECK(json["ticks"][0]["stages"][0]["timed_operations"] == 3000);
  CHECK(json["ticks"][0]["predicted_us"] == 7.5);
  CHECK(json["ticks"][0]["measured_us"] == 2.25);
  CHECK(json["ticks"][0]["measured_p99_us"] == 2.5);
  CHECK(json["ticks"][0]["work_us"] == 5.0);
  CHECK(json["tools"].size() == 1);
  CHECK(json["tools"][0]["work_us"] == 10.0);
  CHECK(json["total_bytes"] == (3 << 20) + 64);
}
