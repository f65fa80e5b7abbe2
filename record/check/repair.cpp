// SPDX-License-Identifier: Apache-2.0
#include "record/check/repair.hpp"

#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "record/check/recording_check.hpp"
#include "record/kept_volumes.hpp"
#include "record/losses_of_rows.hpp"
#include "record/manifest_seal.hpp"
#include "record/recorder.hpp"
#include "record/scene_facts.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOldName = "manifest-old.json";

/// What the rows of the ticks that all arms have say, up to the first that is damaged.
struct RowFacts {
  std::uint64_t rows = 0;
  std::uint64_t start_ns = 0;  ///< 0 in lock-step
  RecordLosses losses;
};

RowFacts row_facts(const fs::path& folder, std::size_t arms, std::uint32_t tick_ns) {
  std::vector<TickLogReader> logs = open_logs(folder, arms);
  TickLogReader& log = logs.front();
  if (logs.back().rows() < log.rows()) {  // which the first one counts
    throw DamagedRecording((folder / tick_log_name(arms - 1)).string() + ": " +
                           std::to_string(logs.back().rows()) + " rows, and " +
                           std::string(kTickLogName) + " has " + std::to_string(log.rows()) +
                           ", so no manifest is rebuilt; copy the recording again");
  }
  std::optional<LossesOfRows> losses;
  RowFacts out;
  out.rows = log.rows();
  std::vector<TickRecord> chunk(TickLogReader::kChunkRows);
  std::string damage;
  for (std::uint64_t row = 0; row < log.rows() && damage.empty();) {
    const std::size_t count = log.read(row, chunk, damage);
    for (const TickRecord& record : std::span(chunk).first(count)) {
      if (!losses) {
        losses.emplace(record_index(record));
        out.start_ns = record.start_ns == record.tick * tick_ns ? 0 : record.start_ns;
      }
      losses->add(record);
    }
    row += count;
  }
  if (losses) out.losses = losses->as_losses(Recorder::kMaxGaps);
  return out;
}

/// The first manifest that is replaced stays beside it.
void keep_old(const fs::path& folder) {
  std::error_code fault;
  if (!fs::is_regular_file(folder / kManifestName, fault)) return;
  if (fs::exists(folder / kOldName, fault)) return;
  fs::copy_file(folder / kManifestName, folder / kOldName, fault);
  if (fault)
    throw FileError((folder / kOldName).string() + ": " + fault.message() +
                    "; copy the recording to a disk that can be written");
}

Json volumes_of(const fs::path& folder, const SceneFacts& scene) {
  Json out = Json::List{};
  for (const SceneFacts::Volume& volume : scene.volumes) {
    Json one = {{"size_vox", volume.size_vox}, {"spacing_mm", volume.spacing_mm}};
    const auto [nx, ny, nz] = volume.size_vox;
    try {
      const auto content = read_starting_volume(folder, volume.density_hash, {nx, ny, nz});
      if (content) one["initial_hash"] = hex64(density_hash(content->density));
    } catch (const DamagedRecording&) {  // NOLINT(bugprone-empty-catch): the check reports it
    }
    out.push_back(std::move(one));
  }
  return out;
}

/// Of the files that are the recording's by its scene and rows.
Json checksums(const fs::path& folder, const SceneFacts& scene, std::uint64_t missed) {
  Json files = Json::Members{};
  for (const std::string& name : names_of_files(folder)) {
    if (may_have_file(scene, name, missed)) files[name] = crc32_of_file(folder / name);
  }
  return files;
}

}  // namespace

bool has_wrong_manifest(const fs::path& folder) {
  try {
    static_cast<void>(read_manifest(folder));
  } catch (const DamagedRecording&) {
    return true;
  }
  return check_recording(folder).in_manifest;
}

void repair_manifest(const fs::path& folder) {
  SceneFacts scene;
  try {
    scene = scene_facts(recorded_scene(folder));
  } catch (const JsonError&) {
  }
  if (!scene.tick_ns || !scene.arms || scene.volumes.empty()) {
    throw DamagedRecording(
        (folder / kSceneName).string() +
        ": has no rate, device or volumes, so no manifest can be made of it; copy the "
        "recording again");
  }
  if (const std::string line = contradiction_to_manifest(folder, scene); !line.empty()) {
    throw DamagedRecording(line);
  }
  // What only the old one said is not proved: its own checksum is wrong.
  Json manifest = Json::Members{};
  manifest["session_id"] = "0000000000000000";  // of no run
  manifest["repaired_by"] = KERF_VERSION;
  manifest["config_hash"] = scene.config_hash;
  manifest["tick_ns"] = *scene.tick_ns;
  manifest["scene"] = kSceneName;
  std::error_code none;
  if (fs::exists(folder / kClockName, none)) manifest["clock"] = kClockName;
  manifest["volumes"] = volumes_of(folder, scene);
  if (*scene.arms > 1) manifest["arms"] = *scene.arms;
  const RowFacts facts = row_facts(folder, *scene.arms, *scene.tick_ns);
  manifest["start_ns"] = facts.start_ns;
  keep_old(folder);
  const Json files = checksums(folder, scene, facts.losses.missed_before_start);
  write_with_end(folder, std::move(manifest), facts.losses, facts.rows, kUnknownEnd, {}, &files);
}

}  // namespace kerf
