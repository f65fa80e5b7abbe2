// SPDX-License-Identifier: Apache-2.0
#include "record/recording.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include "record/scene_facts.hpp"
#include "record/tick_log.hpp"
#include "record/tick_text.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/segment/layout.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {

void make_recording_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw RecordError(folder.string() + ": " + error.message() + "; choose another --out");
  }
}

int run_on_recordings(const char* program, const std::function<int()>& work) {
  return run_program(program, [&] {
    try {
      return work();
    } catch (const DamagedRecording& damaged) {
      std::cerr << program << ": " << damaged.what() << '\n';
      return 1;
    }
  });
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
  if ((record.flags & kFlagReset) != 0) out_.removed_density_mm3 = 0;
  out_.removed_density_mm3 += removed_density_mm3(record, voxel_mm3_);
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
  std::vector<TickLogReader> logs = open_logs(folder, manifest.arms);
  TickLogReader& log = logs.front();
  TickLogReader* const second = logs.size() > 1 ? &logs.back() : nullptr;
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
          throw DamagedRecording((folder / tick_log_name(1)).string() + ": row " +
                                 std::to_string(row) +
                                 " is not of the tick of ticks.npy; copy the recording again");
        }
        visit(first, other);
        ++row;
      },
      range);
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
  const Json list = figures_of(summary);
  for (const auto& [name, value] : list.members()) {
    text << std::left << std::setw(20) << name;
    if (value.is_text()) {
      text << one_line(value.get<std::string>());  // of a file, perhaps a foreign one
    } else if (value.is_fraction()) {
      text << std::setprecision(6) << value.get<double>();
    } else {
      text << value.get<std::uint64_t>();
    }
    text << '\n';
  }
  return text.str();
}

std::string to_json(const RecordSummary& summary, std::string_view date) {
  Json figures = figures_of(summary);
  figures["date"] = nullptr;
  if (!date.empty()) figures["date"] = date;
  return figures.document();
}

void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv,
                TickRange range, std::size_t arm) {
  check_outputs(recording_files(folder), {{"--csv", csv, ".csv"}});
  const Manifest manifest = read_facts(folder);
  require_arm(folder, manifest, arm);
  AtomicFile file(csv);
  TickLogReader log = std::move(open_logs(folder, manifest.arms)[arm]);
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
