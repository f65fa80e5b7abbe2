// SPDX-License-Identifier: Apache-2.0
#include "record/manifest.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

#include "record/manifest_seal.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/program.hpp"
#include "shared/segment/layout_table.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

// The only list of figures: text, JSON and the reader all use it.
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
  visit("removed_density_mm3", s.removed_density_mm3);
  visit("port_energy_mj", s.port_energy_mj);
  visit("port_minimum_mj", s.port_minimum_mj);
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    visit(std::string(kEnergySourceNames[i]) + "_mj", s.energy_mj[i]);
  }
  visit("end_reason", s.end_reason);
}

/// The opposite of `figures_of`; nothing if a figure is missing, as in those of earlier versions.
/// Throws JsonError.
[[nodiscard]] std::optional<RecordSummary> summary_of(const Json& list) {
  RecordSummary out;
  bool has_all = true;
  for_each_figure(out, [&]<class Value>(const std::string& name, Value& value) {
    if (list.contains(name)) {
      value = list.at(name).get<Value>();
    } else {
      has_all = false;
    }
  });
  return has_all ? std::optional(out) : std::nullopt;
}

/// The remedy for a manifest that is not there.
std::string way_to_manifest(const std::filesystem::path& folder) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(folder / kTickLogName, fault) ||
      !std::filesystem::is_regular_file(folder / kSceneName, fault)) {
    return way_to_recording(folder);
  }
  return "kerf record check " + folder.string() + " --repair makes it of scene and ticks";
}

}  // namespace

std::vector<std::filesystem::path> recording_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files{folder / kManifestName, folder / kSceneName,
                                           folder / kClockName};
  for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
    const std::filesystem::path log = folder / tick_log_name(arm);
    std::error_code fault;
    files.push_back(log);
    for (std::size_t part = 2; std::filesystem::exists(part_of_log(log, part), fault); ++part) {
      files.push_back(part_of_log(log, part));
    }
  }
  return files;
}

Json figures_of(const RecordSummary& summary) {
  Json list;
  for_each_figure(summary, [&](const std::string& name, const auto& value) { list[name] = value; });
  return list;
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
  if (std::filesystem::exists(folder / kClockName)) manifest["clock"] = kClockName;
  for (const SegmentVolumeInfo& volume : info.volumes) {
    manifest["volumes"].push_back(
        {{"size_vox", std::array{volume.grid.nx, volume.grid.ny, volume.grid.nz}},
         {"spacing_mm", volume.spacing_mm},
         {"initial_hash", hex64(volume.initial_hash)}});
  }
  if (info.arms > 1) manifest["arms"] = info.arms;
  write_with_end(folder, std::move(manifest), losses, rows, end_reason, summaries);
}

void write_with_end(const std::filesystem::path& folder, Json manifest, const RecordLosses& losses,
                    std::uint64_t rows, std::string_view end_reason,
                    const ArmSummaries& summaries) {
  manifest["rows"] = rows;
  manifest["lost_ticks"] = losses.lost;
  manifest["missed_before_start"] = losses.missed_before_start;
  manifest["gaps"] = Json::List{};
  for (const RecordGap& gap : losses.gaps) {
    manifest["gaps"].push_back({{"first_index", gap.first_index}, {"count", gap.count}});
  }
  manifest["end_reason"] = end_reason;
  if (!summaries.empty()) manifest["summary"] = figures_of(summaries[0]);
  if (summaries.size() > 1) manifest["summary_2"] = figures_of(summaries[1]);
  manifest["files"] =
      checksums_of(folder, is_of_whole_log(end_reason) || end_reason == kUnknownEnd);
  write_new_file(folder / kManifestName, sealed(manifest));
}

std::string not_a_manifest(const std::filesystem::path& folder) {
  return (folder / kManifestName).string() +
         ": not a manifest of this version; copy the recording again, or kerf record check "
         "--repair "
         "makes it anew";
}

std::string manifest_text(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kManifestName;
  if (const std::string why = access_error(path); !why.empty()) {
    throw RecordError(path.string() + why);
  }
  std::error_code fault;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, fault)) file.open(path);  // opening a pipe would block
  if (!file.is_open()) {
    throw RecordError(path.string() + ": cannot be read; " + way_to_manifest(folder));
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

Manifest read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kManifestName;
  const std::string text = manifest_text(folder);
  Manifest out;
  try {
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
    out.has_clock = json.contains("clock");
    if (json.contains("arms")) out.arms = json.at("arms").get<std::size_t>();
    for (const char* const key : {"summary", "summary_2"}) {
      if (!json.contains(key)) continue;
      if (auto figures = summary_of(json.at(key))) out.summaries.push_back(std::move(*figures));
    }
    for (const Json& volume : json.at("volumes")) {
      const auto spacing = volume.at("spacing_mm").get<std::array<double, 3>>();
      out.voxel_mm3.push_back(spacing[0] * spacing[1] * spacing[2]);
    }
  } catch (const JsonError&) {
    throw RecordError(not_a_manifest(folder));
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
  std::ifstream file;
  if (!fault && std::filesystem::is_regular_file(path, fault)) file.open(path, std::ios::binary);
  if (!file.is_open()) {
    throw RecordError(path.string() + ": cannot be read; " + way_to_recording(folder));
  }
  if (bytes > kMaxSceneBytes) {
    throw RecordError(path.string() + ": larger than any scene; copy the recording again");
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace kerf
