// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/cost/explain.hpp"

#include <stdexcept>
#include <string>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace kerf;

namespace {

Calibration small_calibration() {
  return {"a machine", {{"aligned/scalar/copy", 0.5}, {"aligned/scalar/contact", 0.04}}};
}

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

TEST_CASE("a calibration reads back as it was written, and predicts by its prices") {
  const Calibration calibration = small_calibration();
  const Calibration again = parse_calibration(calibration_json(calibration));
  CHECK(again.machine == calibration.machine);
  CHECK(again.price_ns == calibration.price_ns);
  CHECK(again.stage_us("aligned/scalar", {"copy", 4000}) == 2.0);
  CHECK_FALSE(again.stage_us("aligned/scalar", {"mill", 1}).has_value());
}

TEST_CASE("what is no sound calibration is refused") {
  const std::string good = calibration_json(small_calibration());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  for (const std::string& bad :
       {std::string(), std::string("[1]"), good.substr(0, good.size() / 2), with("0.5", "-0.5"),
        with("0.5", "0"), with("0.5", "null"), with("0.5", "\"x\""), with("0.5", "1e300"),
        with("ns_per_operation", "prices"), with(KERF_VERSION, "0.0.0-other")}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(static_cast<void>(parse_calibration(bad)), std::runtime_error);
  }
}

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

TEST_CASE("an explanation is told in text and JSON with the same figures") {
  Explanation explanation;
  explanation.scene = "scenes/x.toml";
  explanation.numeric = "fixed";
  explanation.cut = "none";
  explanation.budget_us = 500;
  for (const char* volume : {"tooth", "filling"}) {
    explanation.ticks.push_back(
        {"ball", volume, "aligned/scalar", "round", {{{"copy", 4000}, 5.0, 3000, 2.0, 2.25}}});
  }
  explanation.arrays = {{"density of tooth", 3 << 20, true}, {"carry of tooth", 64, false}};
  const std::string text = explanation_text(explanation);
  CHECK(text.find("ball in tooth: aligned/scalar (round)") != std::string::npos);
  CHECK(text.find("3.0 MiB") != std::string::npos);
  CHECK(text.find("64 B") != std::string::npos);
  CHECK(text.find("at most 500.0 us: half a tick at 1000 Hz") != std::string::npos);
  CHECK(text.find("10.0 us     2.0 %") != std::string::npos);  // both volumes
  const auto json = nlohmann::json::parse(explanation_json(explanation));
  CHECK(json["ticks"][0]["stages"][0]["operations"] == 4000);
  CHECK(json["ticks"][0]["stages"][0]["timed_operations"] == 3000);
  CHECK(json["ticks"][0]["predicted_us"] == 2.0);
  CHECK(json["ticks"][0]["work_us"] == 5.0);
  CHECK(json["tools"].size() == 1);
  CHECK(json["tools"][0]["work_us"] == 10.0);
  CHECK(json["total_bytes"] == (3 << 20) + 64);
  explanation.ticks[0].stages[0].predicted_us.reset();
  CHECK(nlohmann::json::parse(explanation_json(explanation))["ticks"][0]["predicted_us"].is_null());
}
