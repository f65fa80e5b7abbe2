// SPDX-License-Identifier: Apache-2.0
#include "record/summary.hpp"

#include <algorithm>
#include <iomanip>
#include <sstream>

#include "record/manifest.hpp"
#include "record/tick_log.hpp"
#include "shared/segment/energy_columns.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

// The one list of figures: name, value. Text and JSON both come from it.
[[nodiscard]] Json figures(const RecordSummary& s) {
  Json list = {{"rows", s.rows},
               {"first_tick", s.first_tick},
               {"last_tick", s.last_tick},
               {"seconds", s.seconds},
               {"lost_ticks", s.lost_ticks},
               {"missed_before_start", s.missed_before_start},
               {"contact_ticks", s.contact_ticks},
               {"shaft_ticks", s.shaft_ticks},
               {"stale_ticks", s.stale_ticks},
               {"faults", s.faults},
               {"missed_deadlines", s.missed_deadlines},
               {"lost_packets", s.lost_packets},
               {"refused_packets", s.refused_packets},
               {"peak_force_n", s.peak_force_n},
               {"deepest_mm", s.deepest_mm},
               {"removed_mm3", s.removed_mm3},
               {"port_energy_mj", s.port_energy_mj},
               {"port_minimum_mj", s.port_minimum_mj}};
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    list[std::string(kEnergySourceNames[i]) + "_mj"] = s.energy_mj[i];
  }
  list["end_reason"] = s.end_reason;
  return list;
}

}  // namespace

RecordSummary summarise(const std::filesystem::path& folder) {
  const Manifest manifest = read_manifest(folder);
  TickLogReader log(folder / kTickLogName);
  RecordSummary out;
  out.rows = log.rows();
  out.end_reason = manifest.end_reason;
  out.missed_before_start = manifest.missed_before_start;
  std::uint64_t next_seq = 2 * manifest.missed_before_start + 2;  // of index i: 2 i + 2
  std::uint32_t fault = 0;
  log.for_each([&](const TickRecord& record) {
    if (out.last_tick == 0) out.first_tick = record.tick;
    if (record.seq > next_seq) out.lost_ticks += (record.seq - next_seq) / 2;
    next_seq = record.seq + 2;
    out.last_tick = record.tick;
    out.contact_ticks += (record.flags & kFlagContact) != 0 ? 1 : 0;
    out.shaft_ticks += (record.flags & kFlagShaft) != 0 ? 1 : 0;
    out.stale_ticks += (record.flags & kFlagStaleInput) != 0 ? 1 : 0;
    out.faults += record.fault != 0 && record.fault != fault ? 1 : 0;
    fault = record.fault;
    out.missed_deadlines = std::max(out.missed_deadlines, record.missed_deadlines);
    out.lost_packets = std::max(out.lost_packets, record.lost_packets);
    out.refused_packets = std::max(out.refused_packets, record.refused_packets);
    out.peak_force_n = std::max(out.peak_force_n, magnitude(record.commanded_force_n));
    out.deepest_mm = std::max(out.deepest_mm, double{record.penetration_mm});
    if ((record.flags & kFlagReset) != 0) out.removed_mm3 = 0;
    out.removed_mm3 += removed_mm3(record, manifest.voxel_mm3);
    out.port_energy_mj = record.port_energy_j * 1000;
    out.port_minimum_mj = record.port_minimum_j * 1000;
    for (std::size_t i = 0; i < kEnergySources; ++i) {
      out.energy_mj[i] = energy_mj_of_steps(record.*kEnergyColumns[i]);
    }
  });
  if (manifest.complete()) out.lost_ticks = std::max(out.lost_ticks, manifest.lost_ticks);
  if (out.rows != 0) {
    out.seconds = static_cast<double>(out.last_tick - out.first_tick + 1) * manifest.tick_ns * 1e-9;
  }
  return out;
}

std::string to_text(const RecordSummary& summary) {
  std::ostringstream text;
  const Json list = figures(summary);
  for (const auto& [name, value] : list.members()) {
    text << std::left << std::setw(20) << name;
    if (value.is_text()) {
      text << value.get<std::string>();
    } else if (value.is_fraction()) {
      text << std::setprecision(6) << value.get<double>();
    } else {
      text << value.get<std::uint64_t>();
    }
    text << '\n';
  }
  return text.str();
}

std::string to_json(const RecordSummary& summary) {
  return figures(summary).document();
}

}  // namespace kerf
