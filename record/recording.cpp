// SPDX-License-Identifier: Apache-2.0
#include "record/recording.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/segment/layout.hpp"
#include "shared/segment/layout_table.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {

void write_manifest(const std::filesystem::path& folder, const SegmentInfo& info,
                    const Recorder& recorder, std::uint64_t rows, std::string_view end_reason) {
  Json manifest;
  manifest["kerf"] = KERF_VERSION;
  manifest["compiler"] = __VERSION__;
  manifest["build_id"] = info.build_id;
  manifest["abi_hash"] = hex64(kAbiHash);
  manifest["session_id"] = hex64(info.session_id);
  manifest["config_hash"] = hex64(info.config_hash);
  manifest["tick_ns"] = info.tick_ns;
  manifest["start_ns"] = info.start_ns;
  manifest["scene"] = kSceneName;
  for (const SegmentVolumeInfo& volume : info.volumes) {
    manifest["volumes"].push_back(
        {{"size_vox", std::array{volume.grid.nx, volume.grid.ny, volume.grid.nz}},
         {"spacing_mm", volume.spacing_mm},
         {"initial_hash", hex64(volume.initial_hash)}});
  }
  manifest["rows"] = rows;
  manifest["lost_ticks"] = recorder.lost();
  manifest["missed_before_start"] = recorder.missed_before_start();
  manifest["gaps"] = Json::List{};
  for (const RecordGap& gap : recorder.gaps()) {
    manifest["gaps"].push_back({{"first_index", gap.first_index}, {"count", gap.count}});
  }
  manifest["end_reason"] = end_reason;
  write_new_file(folder / kManifestName, manifest.document());
}

Manifest read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kManifestName;
  if (const std::string why = access_error(path); !why.empty()) {
    throw RecordError(path.string() + why);
  }
  std::error_code fault;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, fault)) file.open(path);  // a pipe would be waited for
  if (!file.is_open()) {
    throw RecordError(path.string() + ": cannot be read; " + way_to_recording(folder));
  }
  Manifest out;
  try {
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const Json json = Json::parse(text);
    out.tick_ns = json.at("tick_ns").get<std::uint32_t>();
    out.end_reason = json.at("end_reason").get<std::string>();
    out.lost_ticks = json.at("lost_ticks").get<std::uint64_t>();
    out.missed_before_start = json.at("missed_before_start").get<std::uint64_t>();
    for (const Json& volume : json.at("volumes")) {
      const auto spacing = volume.at("spacing_mm").get<std::array<double, 3>>();
      out.voxel_mm3.push_back(spacing[0] * spacing[1] * spacing[2]);
    }
  } catch (const JsonError&) {
    throw RecordError(path.string() + ": not a manifest of this version; record it again");
  }
  const auto positive = [](double mm3) { return std::isfinite(mm3) && mm3 > 0; };
  if (out.tick_ns == 0 || out.voxel_mm3.empty() ||
      !std::all_of(out.voxel_mm3.begin(), out.voxel_mm3.end(), positive)) {
    throw RecordError(path.string() + ": tick or spacing is not positive; record it again");
  }
  return out;
}

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
  if (log.rows() < log.counted()) {
    out.end_reason = "cut after " + std::to_string(log.rows()) + " of " +
                     std::to_string(log.counted()) + " rows";
  }
  out.missed_before_start = manifest.missed_before_start;
  std::uint64_t next_seq = 2 * manifest.missed_before_start + 2;  // of index i: 2 i + 2
  std::uint32_t fault = 0;
  std::uint64_t stale_in_a_row = 0;
  log.for_each([&](const TickRecord& record) {
    if (out.last_tick == 0) out.first_tick = record.tick;
    if (record.seq > next_seq) out.lost_ticks += (record.seq - next_seq) / 2;
    next_seq = record.seq + 2;
    out.last_tick = record.tick;
    out.contact_ticks += (record.flags & kFlagContact) != 0 ? 1 : 0;
    out.shaft_ticks += (record.flags & kFlagShaft) != 0 ? 1 : 0;
    const bool stale = (record.flags & kFlagStarted) != 0 && (record.flags & kFlagStaleInput) != 0;
    out.stale_ticks += stale ? 1 : 0;
    stale_in_a_row = stale ? stale_in_a_row + 1 : 0;
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
  // The run ended because its device had gone: as in its report, that is no loss on the way.
  if (manifest.end_reason == kFault) out.stale_ticks -= stale_in_a_row;
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

namespace {

template <class Number>
void append(std::string& line, const std::byte* at) {
  Number value{};
  std::memcpy(&value, at, sizeof value);
  char text[32];  // the longest double has 24 characters
  line.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void append_element(std::string& line, std::string_view type, const std::byte* at) {
  if (type == "u64") append<std::uint64_t>(line, at);
  if (type == "i64") append<std::int64_t>(line, at);
  if (type == "u32") append<std::uint32_t>(line, at);
  if (type == "i32") append<std::int32_t>(line, at);
  if (type == "u16") append<std::uint16_t>(line, at);
  if (type == "i16") append<std::int16_t>(line, at);
  if (type == "f64") append<double>(line, at);
  if (type == "f32") append<float>(line, at);
}

/// Calls `visit(field, element)` for each number of a tick record in order.
template <class Visit>
void for_each_number(Visit visit) {
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != "TickRecord") continue;
    for (std::uint32_t i = 0; i < field.count; ++i) visit(field, i);
  }
}

}  // namespace

void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv) {
  check_outputs(recording_files(folder), {{"--csv", csv, ".csv"}});
  AtomicFile file(csv);
  TickLogReader log(folder / kTickLogName);
  std::string line;
  const auto end_line = [&] {
    line.back() = '\n';  // the last comma
    file.write(line.data(), line.size());
    line.clear();
  };
  for_each_number([&](const LayoutField& field, std::uint32_t i) {
    line += field.name;
    if (field.count > 1) line += "_" + std::to_string(i);
    line += ',';
  });
  end_line();
  log.for_each([&](const TickRecord& record) {
    const auto* const bytes = reinterpret_cast<const std::byte*>(&record);
    for_each_number([&](const LayoutField& field, std::uint32_t i) {
      append_element(line, field.type, bytes + field.offset + i * type_bytes(field.type));
      line += ',';
    });
    end_line();
  });
  file.close();
  file.commit();
}

}  // namespace kerf
