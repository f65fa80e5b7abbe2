// SPDX-License-Identifier: Apache-2.0
#include "record/recording.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include "record/tick_log.hpp"
#include "record/tick_text.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/program.hpp"
#include "shared/segment/layout.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {

namespace {

// The one list of figures: text, JSON and what is read back all come from it.
template <class Summary, class Visit>
void for_each_figure(Summary& s, Visit visit) {
  visit("rows", s.rows);
  visit("first_tick", s.first_tick);
  visit("last_tick", s.last_tick);
  visit("seconds", s.seconds);
  visit("lost_ticks", s.lost_ticks);
  visit("missed_before_start", s.missed_before_start);
  visit("contact_ticks", s.contact_ticks);
  visit("shaft_ticks", s.shaft_ticks);
  visit("stale_ticks", s.stale_ticks);
  visit("faults", s.faults);
  visit("missed_deadlines", s.missed_deadlines);
  visit("lost_packets", s.lost_packets);
  visit("refused_packets", s.refused_packets);
  visit("peak_force_n", s.peak_force_n);
  visit("deepest_mm", s.deepest_mm);
  visit("removed_mm3", s.removed_mm3);
  visit("port_energy_mj", s.port_energy_mj);
  visit("port_minimum_mj", s.port_minimum_mj);
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    visit(std::string(kEnergySourceNames[i]) + "_mj", s.energy_mj[i]);
  }
  visit("end_reason", s.end_reason);
}

[[nodiscard]] Json figures(const RecordSummary& summary) {
  Json list;
  for_each_figure(summary, [&](const std::string& name, const auto& value) { list[name] = value; });
  return list;
}

/// The opposite. Throws JsonError.
[[nodiscard]] RecordSummary summary_of(const Json& list) {
  RecordSummary out;
  for_each_figure(out, [&]<class Value>(const std::string& name, Value& value) {
    value = list.at(name).get<Value>();
  });
  return out;
}

}  // namespace

void make_recording_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw RecordError(folder.string() + ": " + error.message() + "; choose another --out");
  }
}

void write_manifest(const std::filesystem::path& folder, const SegmentInfo& info,
                    const RecordLosses& losses, std::uint64_t rows, std::string_view end_reason,
                    const ArmSummaries& summaries) {
  Json manifest;
  manifest["kerf"] = KERF_VERSION;
  manifest["compiler"] = __VERSION__;
  manifest["flags"] = KERF_FLAGS;
  manifest["cpu"] = processor_name();
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
  if (info.arms > 1) manifest["arms"] = info.arms;
  manifest["rows"] = rows;
  manifest["lost_ticks"] = losses.lost;
  manifest["missed_before_start"] = losses.missed_before_start;
  manifest["gaps"] = Json::List{};
  for (const RecordGap& gap : losses.gaps) {
    manifest["gaps"].push_back({{"first_index", gap.first_index}, {"count", gap.count}});
  }
  manifest["end_reason"] = end_reason;
  if (!summaries.empty()) manifest["summary"] = figures(summaries[0]);
  if (summaries.size() > 1) manifest["summary_2"] = figures(summaries[1]);
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
    out.session_id = json.at("session_id").get<std::string>();
    out.losses.lost = json.at("lost_ticks").get<std::uint64_t>();
    out.losses.missed_before_start = json.at("missed_before_start").get<std::uint64_t>();
    for (const Json& gap : json.at("gaps")) {
      out.losses.gaps.push_back(
          {gap.at("first_index").get<std::uint64_t>(), gap.at("count").get<std::uint64_t>()});
    }
    if (json.contains("arms")) out.arms = json.at("arms").get<std::size_t>();
    for (const char* const key : {"summary", "summary_2"}) {
      if (json.contains(key)) out.summaries.push_back(summary_of(json.at(key)));
    }
    for (const Json& volume : json.at("volumes")) {
      const auto spacing = volume.at("spacing_mm").get<std::array<double, 3>>();
      out.voxel_mm3.push_back(spacing[0] * spacing[1] * spacing[2]);
    }
  } catch (const JsonError&) {
    throw RecordError(path.string() + ": not a manifest of this version; record it again");
  }
  if (out.arms == 0 || out.arms > kMaxArms) {
    throw RecordError(path.string() + ": arms = " + std::to_string(out.arms) +
                      "; this version knows 1 and 2; use the kerf that recorded it");
  }
  const auto positive = [](double mm3) { return std::isfinite(mm3) && mm3 > 0; };
  if (out.tick_ns == 0 || out.voxel_mm3.empty() ||
      !std::all_of(out.voxel_mm3.begin(), out.voxel_mm3.end(), positive)) {
    throw RecordError(path.string() + ": tick or spacing is not positive; record it again");
  }
  return out;
}

std::string recorded_scene(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kSceneName;
  std::error_code fault;
  const std::uintmax_t bytes = std::filesystem::file_size(path, fault);
  if (fault || !std::filesystem::is_regular_file(path, fault)) {
    throw RecordError(path.string() + ": cannot be read; " + way_to_recording(folder));
  }
  if (bytes > kMaxSceneBytes) {
    throw RecordError(path.string() + ": larger than any scene; copy the recording again");
  }
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

SummaryBuilder::SummaryBuilder(std::uint32_t tick_ns, std::vector<double> voxel_mm3)
    : tick_ns_(tick_ns), voxel_mm3_(std::move(voxel_mm3)) {}

SummaryBuilder::SummaryBuilder(const SegmentInfo& info) : tick_ns_(info.tick_ns) {
  for (const SegmentVolumeInfo& volume : info.volumes) {
    const auto& mm = volume.spacing_mm;
    voxel_mm3_.push_back(mm[0] * mm[1] * mm[2]);
  }
}

void SummaryBuilder::add(const TickRecord& record) {
  const std::uint64_t index = index_of(record);
  if (out_.rows++ == 0) {
    out_.first_tick = record.tick;
    first_index_ = next_index_ = index;
  }
  if (index > next_index_) out_.lost_ticks += index - next_index_;
  next_index_ = index + 1;
  out_.last_tick = record.tick;
  out_.contact_ticks += (record.flags & kFlagContact) != 0 ? 1 : 0;
  out_.shaft_ticks += (record.flags & kFlagShaft) != 0 ? 1 : 0;
  const bool stale = (record.flags & kFlagStarted) != 0 && (record.flags & kFlagStaleInput) != 0;
  out_.stale_ticks += stale ? 1 : 0;
  stale_in_a_row_ = stale ? stale_in_a_row_ + 1 : 0;
  out_.faults += record.fault != 0 && record.fault != fault_ ? 1 : 0;
  fault_ = record.fault;
  out_.missed_deadlines = std::max(out_.missed_deadlines, record.missed_deadlines);
  out_.lost_packets = std::max(out_.lost_packets, record.lost_packets);
  out_.refused_packets = std::max(out_.refused_packets, record.refused_packets);
  out_.peak_force_n = std::max(out_.peak_force_n, magnitude(record.commanded_force_n));
  out_.deepest_mm = std::max(out_.deepest_mm, double{record.penetration_mm});
  if ((record.flags & kFlagReset) != 0) out_.removed_mm3 = 0;
  out_.removed_mm3 += removed_mm3(record, voxel_mm3_);
  out_.port_energy_mj = record.port_energy_j * 1000;
  out_.port_minimum_mj = record.port_minimum_j * 1000;
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    out_.energy_mj[i] = energy_mj_of_steps(record.*kEnergyColumns[i]);
  }
}

RecordSummary SummaryBuilder::result(const RecordLosses& losses,
                                     std::string_view end_reason) const {
  RecordSummary out = out_;
  out.end_reason = end_reason;
  out.missed_before_start = losses.missed_before_start;
  if (out.rows != 0 && first_index_ > losses.missed_before_start) {
    out.lost_ticks += first_index_ - losses.missed_before_start;
  }
  // The run ended because its device had gone: as in its report, that is no loss on the way.
  if (end_reason == kFault) out.stale_ticks -= stale_in_a_row_;
  // The manifest of a killed recorder is that of its start.
  if (end_reason != kStillRunning) out.lost_ticks = std::max(out.lost_ticks, losses.lost);
  out.seconds =
      out.rows == 0 ? 0 : static_cast<double>(out.last_tick - out.first_tick + 1) * tick_ns_ * 1e-9;
  return out;
}

void require_arm(const std::filesystem::path& folder, const Manifest& manifest, std::size_t arm) {
  if (arm < manifest.arms) return;
  throw RecordError(folder.string() + ": has no arm " + std::to_string(arm + 1) +
                    ", the run had one device; leave --arm out");
}

void for_each_tick(const std::filesystem::path& folder, const Manifest& manifest, TickRange range,
                   const std::function<void(const TickRecord&, const TickRecord*)>& visit) {
  TickLogReader log(folder / tick_log_name(0));
  std::optional<TickLogReader> second;
  if (manifest.arms > 1) second.emplace(folder / tick_log_name(1));
  std::vector<TickRecord> chunk(second ? TickLogReader::kChunkRows : 0);
  std::uint64_t row = second && range.from != 0 ? log.row_of(range.from) : 0;
  std::uint64_t begin = row;  // of `chunk`, in rows
  std::uint64_t end = row;
  log.for_each(
      [&](const TickRecord& first) {
        if (second && row == end && row < second->rows()) {
          begin = row;
          end = row + second->read(row, chunk);
        }
        const TickRecord* const other = row < end ? &chunk[row - begin] : nullptr;
        if (other != nullptr && other->seq != first.seq) {
          throw RecordError((folder / tick_log_name(1)).string() + ": row " + std::to_string(row) +
                            " is not of the tick of ticks.npy; copy the recording again");
        }
        visit(first, other);
        ++row;
      },
      range);
}

RecordSummary summarise(const std::filesystem::path& folder, TickRange range, std::size_t arm) {
  const Manifest manifest = read_manifest(folder);
  require_arm(folder, manifest, arm);
  TickLogReader log(folder / tick_log_name(arm));
  SummaryBuilder builder(manifest.tick_ns, manifest.voxel_mm3);
  RecordLosses losses = manifest.losses;
  std::uint64_t before_range = 0;
  log.for_each(
      [&](const TickRecord& record) {
        if (builder.rows() == 0) before_range = index_of(record);
        builder.add(record);
      },
      range);
  if (!range.is_whole()) losses = {.missed_before_start = before_range};
  RecordSummary out = builder.result(losses, manifest.end_reason);
  if (log.rows() < log.counted()) {
    out.end_reason = "cut after " + std::to_string(log.rows()) + " of " +
                     std::to_string(log.counted()) + " rows";
  }
  return out;
}

std::optional<RecordSummary> kept_summary(const std::filesystem::path& folder, std::size_t arm) {
  const Manifest manifest = read_manifest(folder);
  require_arm(folder, manifest, arm);
  const TickLogReader log(folder / tick_log_name(arm));
  if (arm >= manifest.summaries.size() || log.rows() != log.counted() ||
      log.rows() != manifest.summaries[arm].rows) {
    return std::nullopt;
  }
  return manifest.summaries[arm];
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

void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv,
                TickRange range, std::size_t arm) {
  check_outputs(recording_files(folder), {{"--csv", csv, ".csv"}});
  if (arm != 0) require_arm(folder, read_manifest(folder), arm);
  AtomicFile file(csv);
  TickLogReader log(folder / tick_log_name(arm));
  std::string line;
  const auto end_line = [&] {
    line.back() = '\n';  // the last comma
    file.write(line.data(), line.size());
    line.clear();
  };
  for_each_column([&](const LayoutField& field) {
    for (std::uint32_t i = 0; i < field.count; ++i) {
      line += field.name;
      if (field.count > 1) line += "_" + std::to_string(i);
      line += ',';
    }
  });
  end_line();
  const auto write_row = [&](const TickRecord& record) {
    for_each_column([&](const LayoutField& field) {
      for (std::uint32_t i = 0; i < field.count; ++i) {
        append_number(record, field, i, line);
        line += ',';
      }
    });
    end_line();
  };
  log.for_each(write_row, range);
  file.close();
  file.commit();
}

}  // namespace kerf
