// SPDX-License-Identifier: Apache-2.0
#include "record/manifest.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

#include "record/input_rows.hpp"
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

constexpr std::string_view kWayToNewManifest =
    "; copy the recording again, or kerf record check --repair rebuilds it";

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

/// The checksum of the first row of each arm's log, which tells the logs apart. None of a row that
/// cannot be read or is unsound: a recorder goes on whatever was done to its files.
[[nodiscard]] Json first_rows(const std::filesystem::path& folder, std::size_t arms) {
  Json list = Json::List{};
  for (std::size_t arm = 0; arm < arms; ++arm) {
    std::ifstream file(folder / tick_log_name(arm), std::ios::binary);
    TickRecord row;
    file.seekg(kTickLogHeaderBytes);
    if (!file.read(reinterpret_cast<char*>(&row), sizeof row) || !why_unsound(row).empty()) break;
    list.push_back(row.crc32c);
  }
  return list;
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

std::vector<TickLogReader> open_logs(const std::filesystem::path& folder, std::size_t arms) {
  std::vector<TickLogReader> logs;
  for (std::size_t arm = 0; arm < arms; ++arm) logs.emplace_back(folder / tick_log_name(arm));
  for (TickLogReader& log : logs) {
    logs.front().end_at(std::max(log.rows(), logs.front().counted()));
  }
  for (TickLogReader& log : logs) log.end_at(logs.front().rows());
  return logs;
}

std::vector<std::filesystem::path> recording_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files{folder / kManifestName, folder / kSceneName,
                                           folder / kClockName};
  for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
    const std::filesystem::path log = folder / tick_log_name(arm);
    files.push_back(log);
    const std::size_t parts = files_of_log(log);
    for (std::size_t part = 2; part <= parts; ++part) {
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
                    const ArmSummaries& summaries, const Json* files) {
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
  write_with_end(folder, std::move(manifest), losses, rows, end_reason, summaries, files);
}

void write_with_end(const std::filesystem::path& folder, Json manifest, const RecordLosses& losses,
                    std::uint64_t rows, std::string_view end_reason, const ArmSummaries& summaries,
                    const Json* files) {
  manifest["parts"] = files_of_log(folder / kTickLogName);
  manifest["rows"] = rows;
  if (rows > 0) {
    const bool names_arms = manifest.contains("arms");
    manifest["first_rows"] =
        first_rows(folder, names_arms ? manifest.at("arms").get<std::size_t>() : 1);
  }
  manifest["lost_ticks"] = losses.lost;
  manifest["missed_before_start"] = losses.missed_before_start;
  manifest["gaps"] = Json::List{};
  for (const RecordGap& gap : losses.gaps) {
    manifest["gaps"].push_back({{"first_index", gap.first_index}, {"count", gap.count}});
  }
  manifest["end_reason"] = end_reason;
  if (!summaries.empty()) manifest["summary"] = figures_of(summaries[0]);
  if (summaries.size() > 1) manifest["summary_2"] = figures_of(summaries[1]);
  manifest["files"] = files == nullptr ? checksums_of(folder) : *files;
  write_new_file(folder / kManifestName, sealed(manifest));
}

std::string not_a_manifest(const std::filesystem::path& folder) {
  return (folder / kManifestName).string() + ": not a manifest of this version" +
         std::string(kWayToNewManifest);
}

std::string manifest_text(const std::filesystem::path& folder) {
  std::ifstream file =
      open_recorded(folder / kManifestName, way_to_manifest(folder), kMostManifestBytes);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string shown(const Json& value) {
  constexpr std::size_t kMost = 60;
  const std::string text = value.canonical();
  return one_line(text.size() > kMost ? text.substr(0, kMost) + "..." : text);
}

namespace {

/// Reads the members of a manifest. One of another kind is named.
class Members {
 public:
  Members(const std::filesystem::path& folder, const Json& json) : folder_(folder), json_(json) {}

  /// Calls `read` with a member. `kind`: what it has to be.
  template <class Read>
  void take(std::string_view key, std::string_view kind, const Read& read) const {
    std::string is = "missing";
    if (json_.contains(key)) {
      try {
        if (read(json_.at(key))) return;
      } catch (const JsonError&) {  // NOLINT(bugprone-empty-catch): refused below
      }
      is = shown(json_.at(key));
    }
    refuse_recording(folder_, (folder_ / kManifestName).string() + ": " + std::string(key) +
                                  " is " + is + ", and not " + std::string(kind) +
                                  std::string(kWayToNewManifest));
  }
  /// Takes the member if it is there.
  template <class Read>
  void take_if_there(std::string_view key, std::string_view kind, const Read& read) const {
    if (json_.contains(key)) take(key, kind, read);
  }
  template <class Value>
  void take(std::string_view key, std::string_view kind, Value& value) const {
    take(key, kind, [&](const Json& member) {
      value = member.get<Value>();
      return true;
    });
  }

 private:
  const std::filesystem::path& folder_;
  const Json& json_;
};

RecordGap gap_of(const Json& json) {
  return {json.at("first_index").get<std::uint64_t>(), json.at("count").get<std::uint64_t>()};
}

/// Of a member "files" of another kind nothing is known; the check names it.
bool lists_inputs(const Json& manifest) {
  try {
    return manifest.contains("files") &&
           std::ranges::any_of(manifest.at("files").members(), [](const Json::Member& file) {
             return file.key.starts_with(std::string(kInputsName) + "/");
           });
  } catch (const JsonError&) {
    return false;
  }
}

double voxel_of(const Json& volume) {
  const auto mm = volume.at("spacing_mm").get<std::array<double, 3>>();
  return mm[0] * mm[1] * mm[2];
}

}  // namespace

Manifest read_manifest(const std::filesystem::path& folder) {
  const std::string text = manifest_text(folder);
  Json json;
  try {
    json = Json::parse(text);
    static_cast<void>(json.members());
  } catch (const JsonError&) {
    refuse_recording(folder, not_a_manifest(folder));
  }
  Manifest out;
  const Members members(folder, json);
  members.take("tick_ns", "a whole number of ns above 0",
               [&](const Json& member) { return (out.tick_ns = member.get<std::uint32_t>()) > 0; });
  members.take("end_reason", "a text", out.end_reason);
  members.take("session_id", "a text", out.session_id);
  members.take("lost_ticks", "a number of ticks", out.losses.lost);
  members.take("missed_before_start", "a number of ticks", out.losses.missed_before_start);
  members.take("gaps", "a list of gaps with first_index and count", [&](const Json& gaps) {
    for (const Json& gap : gaps) out.losses.gaps.push_back(gap_of(gap));
    return true;
  });
  out.has_clock = json.contains("clock");
  out.has_inputs = lists_inputs(json);
  members.take_if_there("start_ns", "a time in ns", [](const Json& member) {
    static_cast<void>(member.get<std::uint64_t>());
    return true;
  });
  members.take_if_there("arms", "1 or 2, which this version knows", [&](const Json& member) {
    out.arms = member.get<std::size_t>();
    return out.arms > 0 && out.arms <= kMaxArms;
  });
  members.take_if_there("parts", "a number of files above 0", [&](const Json& member) {
    return (out.parts = member.get<std::size_t>()) > 0;
  });
  members.take_if_there("first_rows", "a list of checksums", [&](const Json& list) {
    for (const Json& checksum : list) out.first_rows.push_back(checksum.get<std::uint32_t>());
    return out.first_rows.size() <= kMaxArms;
  });
  members.take_if_there("repaired_by", "a text", [&](const Json& member) {
    out.repaired_by = member.get<std::string>();
    return true;
  });
  for (const char* const key : {"summary", "summary_2"}) {
    members.take_if_there(key, "a table of figures", [&](const Json& member) {
      if (auto figures = summary_of(member)) out.summaries.push_back(std::move(*figures));
      return true;
    });
  }
  members.take("volumes", "a list of volumes with a spacing_mm above 0", [&](const Json& volumes) {
    for (const Json& volume : volumes) out.voxel_mm3.push_back(voxel_of(volume));
    const auto positive = [](double mm3) { return std::isfinite(mm3) && mm3 > 0; };
    return !out.voxel_mm3.empty() && std::ranges::all_of(out.voxel_mm3, positive);
  });
  return out;
}

std::string recorded_scene(const std::filesystem::path& folder) {
  std::ifstream file = open_recorded(folder / kSceneName, way_to_recording(folder), kMaxSceneBytes);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace kerf
