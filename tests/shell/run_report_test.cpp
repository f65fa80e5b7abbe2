// SPDX-License-Identifier: Apache-2.0
#include "controller/run/run_report.hpp"

#include <string>

#include <doctest/doctest.h>

#include "tests/json.hpp"

TEST_CASE("the report has every promised key, hashes as 16 hex digits") {
  kerf::RunReport report;
  report.record.ticks = 3;
  report.record.output_hash = 0xab;
  report.record.add_fault(2, "stale_input");
  report.link = {{"bus_resets", 2}};
  report.start_to_force_ms = 812.5;
  const auto json = kerf::test::read_json(kerf::report_json(report));
  for (const char* key :
       {"ticks", "overruns", "stale_ticks", "wake_us", "compute_us", "publish_us", "allocations",
        "minor_faults", "major_faults", "contact_ticks", "peak_force_n", "removed_mm3", "energy_j",
        "port_minimum_j", "energy_by_source_j", "faults", "events", "volume_hash", "output_hash"}) {
    CAPTURE(key);
    CHECK(json.contains(key));
  }
  for (const char* key : {"wake_us", "compute_us", "publish_us"}) {
    for (const char* part : {"p50", "p99", "p999", "max"}) CHECK(json[key].contains(part));
  }
  CHECK(json["output_hash"] == "00000000000000ab");
  CHECK(json["faults"][0]["tick"] == 2);
  CHECK(json["faults"][0]["name"] == "stale_input");
  CHECK(json["link"]["bus_resets"] == 2);
  CHECK(json["start_to_force_ms"] == 812.5);
}

TEST_CASE(
    "report and summary tell what was removed of each material, and touches of forbidden ones") {
  kerf::RunReport report;
  report.materials = {{"enamel", 2.1, {}}, {"dentin", 0.0001, {}}, {"pulp", 0.0, 121.0}};
  const auto json = kerf::test::read_json(kerf::report_json(report));
  CHECK(json["removed_mm3_by_material"]["enamel"] == 2.1);
  CHECK(json["removed_mm3_by_material"]["dentin"] == 0.0001);
  CHECK(json["forbidden_ms"] == kerf::test::ReadJson(kerf::Json{{"pulp", 121.0}}));
  const std::string text = kerf::summary(report);
  CHECK(text.find("  of these   enamel 2.100 mm3\n") != std::string::npos);
  CHECK(text.find("  forbidden  touched: pulp 121 ms\n") != std::string::npos);
}

TEST_CASE("an event is no fault, and more of them than fit hide none") {
  kerf::RunReport report;
  for (std::uint64_t i = 0; i < 100; ++i) report.record.add_event(i, "watchdog");
  report.record.add_fault(101, "stale_input");
  const auto json = kerf::test::read_json(kerf::report_json(report));
  CHECK(json["events"].size() == kerf::EventList::kMax);
  CHECK(json["events"][0]["name"] == "watchdog");
  CHECK(json["event_count"] == 100);
  CHECK(json["faults"].size() == 1);
  CHECK(json["faults"][0]["name"] == "stale_input");
  CHECK(json["fault_count"] == 1);
  const std::string text = kerf::summary(report);
  CHECK(text.find("fault      stale_input at tick 101\n") != std::string::npos);
  CHECK(text.find("event      watchdog at tick 0\n") != std::string::npos);
  CHECK(text.find("fault      watchdog") == std::string::npos);
}

TEST_CASE("what was removed below the surface is told apart, with the scale of a scan") {
  kerf::RunReport report;
  report.removed_mm3 = 55252.953;
  report.materials = {{"soft tissue", 44295.239, {}, false}, {"bone", 10957.714}};
  CHECK(kerf::summary(report).find("  scale ") == std::string::npos);
  report.workspace_scale = 4.4625;
  report.tool = "ball 16";
  report.tool_mm = 48;
  CHECK(kerf::summary(report).find(
            "  removed    55252.953 mm3\n  of these   bone 10957.714 mm3\n"
            "  not felt   soft tissue 44295.239 mm3, below the surface\n"
            "  scale      1 mm of the hand is 4.46 mm here, where tool ball 16 is 48 mm wide\n") !=
        std::string::npos);
}
