// SPDX-License-Identifier: Apache-2.0
#include "controller/run/run_report.hpp"

#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

Json percentiles(const Histogram& histogram) {
  return {{"p50", histogram.percentile_us(0.5)},
          {"p99", histogram.percentile_us(0.99)},
          {"p999", histogram.percentile_us(0.999)},
          {"max", histogram.max_us()}};
}

Json by_source(const ArmRecord& record) {
  Json list = Json::Members{};
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    list[std::string(kEnergySourceNames[i])] = record.energy_mj[i] / 1000.0;
  }
  return list;
}

/// The sources that did any work, in mJ.
std::string energy_line(const ArmRecord& record) {
  std::string text = format("  energy     lowest %.3f mJ", record.port_minimum_mj);
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    if (record.energy_mj[i] == 0) continue;
    text += format(", %s %.3f", std::string(kEnergySourceNames[i]).c_str(), record.energy_mj[i]);
  }
  return text + "\n";
}

Json removed_of(const MaterialScores& materials) {
  Json list = Json::Members{};
  for (const MaterialScore& one : materials) list[one.name] = one.removed_mm3;
  return list;
}

Json forbidden_of(const MaterialScores& materials) {
  Json list = Json::Members{};
  for (const MaterialScore& one : materials) {
    if (one.forbidden_ms) list[one.name] = *one.forbidden_ms;
  }
  return list;
}

/// Removed volume by material, and the time in contact with forbidden material.
std::string score_lines(const MaterialScores& materials) {
  constexpr double kSeenMm3 = 0.0005;  // else the line would say 0.000
  std::string removed, touched;
  for (const MaterialScore& one : materials) {
    if (one.removed_mm3 >= kSeenMm3) {
      removed +=
          format("%s%s %.3f", removed.empty() ? "" : ", ", one.name.c_str(), one.removed_mm3);
    }
    if (one.forbidden_ms.value_or(0) > 0) {
      touched +=
          format("%s%s %.0f ms", touched.empty() ? "" : ", ", one.name.c_str(), *one.forbidden_ms);
    }
  }
  std::string text;
  if (!removed.empty()) text += "  of these   " + removed + " mm3\n";
  if (!touched.empty()) text += "  forbidden  touched: " + touched + "\n";
  return text;
}

/// The wear of the burs in the hands.
std::string bur_line(const RunReport& report) {
  const RunRecord& r = report.record;
  const bool second = report.second && r.second.sharpness < 1;
  if (r.sharpness == 1 && !second) return {};
  std::string text = format("  bur        cuts at %.0f %% of its first rate", 100 * r.sharpness);
  if (report.second) text += format(", the second arm's at %.0f %%", 100 * r.second.sharpness);
  return text + "\n";
}

Json pulp_of(const RunRecord& record) {
  if (!record.pulp) return nullptr;
  return {{"end", record.pulp->rise_c()},
          {"highest", record.pulp->highest_c()},
          {"harm_s", record.pulp->harm_s()}};
}

std::string pulp_line(const RunRecord& record) {
  if (!record.pulp) return {};
  const PulpHeat& pulp = *record.pulp;
  return format("  pulp       %+.1f C, highest %+.1f C, harmed (%+.1f C) for %.1f s\n",
                pulp.rise_c(), pulp.highest_c(), PulpHeat::kHarmC, pulp.harm_s());
}

/// A scan is larger than the workspace: its tool, and what it removes, are so, too.
std::string scale_line(const RunReport& report) {
  if (report.workspace_scale <= 1) return {};
  return format("  scale      1 mm of the hand is %.3g mm here, where tool %s is %.3g mm wide\n",
                report.workspace_scale, report.tool.c_str(), report.tool_mm);
}

std::string line(const char* name, const Histogram& histogram) {
  return format("  %-10s %9.1f %9.1f %9.1f %9.1f\n", name, histogram.percentile_us(0.5),
                histogram.percentile_us(0.99), histogram.percentile_us(0.999), histogram.max_us());
}

Json list(const EventList& events) {
  Json list = Json::List{};
  for (const EventList::Event& event : events.kept()) {
    list.push_back({{"tick", event.tick}, {"name", event.name}});
  }
  return list;
}

std::string lines(const char* kind, const EventList& events) {
  std::string text;
  for (const EventList::Event& event : events.kept()) {
    text += format("  %-10s %s at tick %llu\n", kind, event.name,
                   static_cast<unsigned long long>(event.tick));
  }
  return text;
}

}  // namespace

namespace {

Json json_of(const std::vector<LinkCounter>& link) {
  Json json = Json::Members{};
  for (const LinkCounter& counter : link) json[counter.name] = counter.value;
  return json;
}

Json second_json(const ArmReport& arm, const ArmRecord& r) {
  return {{"device", arm.device},
          {"tool", arm.tool},
          {"in_use", r.in_use},
          {"stale_ticks", r.stale_ticks},
          {"contact_ticks", r.contact_ticks},
          {"shaft_ticks", r.shaft_ticks},
          {"peak_force_n", r.peak_force_n},
          {"sharpness", r.sharpness},
          {"energy_j", r.absorbed_mj / 1000.0},
          {"port_minimum_j", r.port_minimum_mj / 1000.0},
          {"energy_by_source_j", by_source(r)},
          {"faults", list(r.faults)},
          {"fault_count", r.faults.count},
          {"lost_packets", arm.lost_packets},
          {"refused_packets", arm.refused_packets},
          {"link", json_of(arm.link)},
          {"output_hash", hex64(r.output_hash)}};
}

std::string contact_line(const ArmRecord& r) {
  return format("  contact    %llu ticks, peak force %.3f N, work of the hand %.3f mJ\n",
                static_cast<unsigned long long>(r.contact_ticks), r.peak_force_n, r.absorbed_mj);
}

std::string second_lines(const ArmReport& arm, const ArmRecord& r) {
  return format("\n  second arm %s with tool %s%s\n", arm.device.c_str(), arm.tool.c_str(),
                r.in_use ? "" : ", never in use") +
         contact_line(r) + energy_line(r) +
         format("  losses     %llu stale ticks, %llu packets lost\n",
                static_cast<unsigned long long>(r.stale_ticks),
                static_cast<unsigned long long>(arm.lost_packets)) +
         format("  hash       output %s\n", hex64(r.output_hash).c_str()) +
         lines("fault", r.faults) + "\n";
}

Json missing_rights_json(const std::vector<MissingRight>& rights) {
  Json list = Json::List{};
  for (const MissingRight& right : rights) {
    list.push_back({{"what", right.what}, {"effect", right.effect}});
  }
  return list;
}

}  // namespace

std::string report_json(const RunReport& report) {
  const RunRecord& r = report.record;
  Json json{
      {"program", "kerf-controller"},
      {"version", KERF_VERSION},
      {"scene", report.scene},
      {"config_hash", hex64(report.config_hash)},
      {"device", report.device},
      {"numeric", report.numeric},
      {"rate_hz", report.rate_hz},
      {"velocity_estimator", report.velocity_estimator},
      {"virtual", report.virtual_time},
      {"end", report.end},
      {"waiting", report.waiting},
      {"ticks", r.ticks},
      {"armed_at_tick", r.armed_at_tick},
      {"overruns", r.overruns},
      {"stale_ticks", r.stale_ticks},
      {"wake_us", percentiles(r.wake)},
      {"compute_us", percentiles(r.compute)},
      {"publish_us", percentiles(r.publish)},
      {"allocations", r.allocations},
      {"allocations_counted", report.allocations_counted},
      {"minor_faults", r.faults_of_pages.minor},
      {"major_faults", r.faults_of_pages.major},
      {"guarded", report.guarded},
      {"unexpected_call", report.unexpected_call},
      {"contact_ticks", r.contact_ticks},
      {"shaft_ticks", r.shaft_ticks},
      {"peak_force_n", r.peak_force_n},
      {"removed_mm3", report.removed_mm3},
      {"removed_mm3_by_material", removed_of(report.materials)},
      {"removed_density_mm3", report.removed_density_mm3},
      {"forbidden_ms", forbidden_of(report.materials)},
      {"sharpness", r.sharpness},
      {"pulp_rise_c", pulp_of(r)},
      {"resets", r.resets},
      {"undos", r.undos},
      {"redos", r.redos},
      {"energy_j", r.absorbed_mj / 1000.0},
      {"port_minimum_j", r.port_minimum_mj / 1000.0},
      {"energy_by_source_j", by_source(r)},
      {"faults", list(r.faults)},
      {"fault_count", r.faults.count},
      {"events", list(r.events)},
      {"event_count", r.events.count},
      {"watchdog_trips", report.watchdog_trips},
      {"lost_packets", report.lost_packets},
      {"refused_packets", report.refused_packets},
      {"link", json_of(report.link)},
      {"missing_rights", missing_rights_json(report.missing_rights)},
      {"load_s", report.load_s},
      {"start_to_force_ms", report.start_to_force_ms},
      {"volume_hash", hex64(report.volume_hash)},
      {"output_hash", hex64(r.output_hash)},
  };
  if (report.second) json["second"] = second_json(*report.second, r.second);
  return json.document();
}

std::string summary(const RunReport& report) {
  const RunRecord& r = report.record;
  std::string text;
  text += format("kerf: %s, %llu ticks at %d Hz (%s, %s numbers)\n\n", report.end.c_str(),
                 static_cast<unsigned long long>(r.ticks), report.rate_hz,
                 report.virtual_time ? "virtual time" : "real time", report.numeric.c_str());
  if (r.ticks == 0 && !report.waiting.empty()) {
    text += format("  never in use; %s\n\n", escaped(report.waiting).c_str());
  }
  text += "  us              p50       p99     p99.9       max\n";
  if (!report.virtual_time) text += line("wake-up", r.wake);
  text += line("compute", r.compute);
  text += line("publish", r.publish);
  if (report.second && !r.in_use) text += "\n  first arm  never in use";
  text += "\n" + contact_line(r) + energy_line(r);
  if (r.shaft_ticks > 0) {
    text += format("  shaft      %llu ticks\n", static_cast<unsigned long long>(r.shaft_ticks));
  }
  text += format("  removed    %.3f mm3", report.removed_mm3);
  if (r.resets > 0) {
    text += format(" since the last of %llu resets", static_cast<unsigned long long>(r.resets));
  }
  text +=
      "\n" + score_lines(report.materials) + bur_line(report) + pulp_line(r) + scale_line(report);
  text += format("  losses     %llu stale ticks, %llu overruns, %llu packets lost\n",
                 static_cast<unsigned long long>(r.stale_ticks),
                 static_cast<unsigned long long>(r.overruns),
                 static_cast<unsigned long long>(report.lost_packets));
  text += format("  loop       %llu allocations%s, %lld minor and %lld major page faults\n",
                 static_cast<unsigned long long>(r.allocations),
                 report.allocations_counted ? "" : " (not counted under sanitizers)",
                 static_cast<long long>(r.faults_of_pages.minor),
                 static_cast<long long>(r.faults_of_pages.major));
  text += format("  hashes     volume %s, output %s\n", hex64(report.volume_hash).c_str(),
                 hex64(r.output_hash).c_str());
  text += lines("fault", r.faults);
  if (report.second) text += second_lines(*report.second, r.second);
  return text + lines("event", r.events);
}

}  // namespace kerf
