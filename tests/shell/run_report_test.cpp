// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/run_report.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

TEST_CASE("the report has every promised key, hashes as 16 hex digits") {
  kerf::RunReport report;
  report.record.ticks = 3;
  report.record.output_hash = 0xab;
  report.record.add_event(2, "stale_input");
  report.link = {{"bus_resets", 2}};
  report.start_to_force_ms = 812.5;
  const auto json = nlohmann::json::parse(kerf::report_json(report));
  for (const char* key :
       {"ticks", "overruns", "stale_ticks", "wake_us", "compute_us", "publish_us", "allocations",
        "minor_faults", "major_faults", "contact_ticks", "peak_force_n", "removed_mm3", "energy_j",
        "faults", "volume_hash", "output_hash"}) {
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

TEST_CASE("more events than fit are counted, and the first ones kept") {
  kerf::RunReport report;
  for (std::uint64_t i = 0; i < 100; ++i) report.record.add_event(i, "watchdog");
  const auto json = nlohmann::json::parse(kerf::report_json(report));
  CHECK(json["faults"].size() == kerf::RunRecord::kMaxEvents);
  CHECK(json["event_count"] == 100);
  CHECK(json["fault_count"] == 0);
}
