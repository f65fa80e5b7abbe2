// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "record/check/recording_check.hpp"
#include "record/kept_volumes.hpp"
#include "record/losses_of_rows.hpp"
#include "record/manifest_seal.hpp"
#include "record/recorder.hpp"
#include "record/recording.hpp"
#include "record/scene_facts.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOldName = "manifest-old.json";

/// Members of the old manifest whose value may be kept: nothing else says it.
constexpr std::string_view kOnlyThere[] = {"kerf",     "compiler", "flags",      "cpu",
                                           "build_id", "abi_hash", "session_id", "replay_of"};

Json old_manifest(const fs::path& folder) {
  try {
    Json json = Json::parse(manifest_text(folder));
    static_cast<void>(json.members());
    return json;
  } catch (const RecordError&) {
  } catch (const JsonError&) {
  }
  return Json::Members{};
}

/// What the rows say, up to the first that is damaged.
struct RowFacts {
  std::uint64_t rows = 0;
  std::uint64_t start_ns = 0;  ///< 0 in lock-step
  RecordLosses losses;
  RecordSummary figures;
};

RowFacts row_facts(const fs::path& path, const Manifest& scene, std::string_view end_reason) {
  TickLogReader log(path);
  SummaryBuilder figures(scene.tick_ns, scene.voxel_mm3);
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
        out.start_ns = record.start_ns == record.tick * scene.tick_ns ? 0 : record.start_ns;
      }
      losses->add(record);
      figures.add(record);
    }
    row += count;
  }
  if (losses) out.losses = losses->as_losses(Recorder::kMaxGaps);
  out.figures = figures.result(out.losses, end_reason);
  return out;
}

/// How the run ended: only the old manifest says it.
std::string end_of(const Json& old) {
  const bool says_it = old.contains("end_reason") && old.at("end_reason").is_text();
  return says_it ? old.at("end_reason").get<std::string>() : std::string(kUnknownEnd);
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
    } catch (const RecordError&) {  // NOLINT(bugprone-empty-catch): the check reports it
    }
    out.push_back(std::move(one));
  }
  return out;
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
  Manifest by_scene;
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
  take_facts(scene, by_scene);
  const Json old = old_manifest(folder);
  Json manifest = Json::Members{};
  manifest["session_id"] = "0000000000000000";  // of no run
  for (const std::string_view key : kOnlyThere) {
    if (old.contains(key)) manifest[key] = old.at(key);
  }
  manifest["repaired_by"] = KERF_VERSION;
  manifest["config_hash"] = scene.config_hash;
  manifest["tick_ns"] = *scene.tick_ns;
  manifest["scene"] = kSceneName;
  std::error_code none;
  if (fs::exists(folder / kClockName, none)) manifest["clock"] = kClockName;
  manifest["volumes"] = volumes_of(folder, scene);
  if (by_scene.arms > 1) manifest["arms"] = by_scene.arms;
  const std::string end_reason = end_of(old);
  RowFacts first;
  ArmSummaries figures;
  for (std::size_t arm = 0; arm < by_scene.arms; ++arm) {
    RowFacts facts = row_facts(folder / tick_log_name(arm), by_scene, end_reason);
    figures.push_back(facts.figures);
    if (arm == 0) first = std::move(facts);
  }
  manifest["start_ns"] = first.start_ns;
  if (!is_of_whole_log(end_reason)) figures.clear();
  keep_old(folder);
  write_with_end(folder, std::move(manifest), first.losses, first.rows, end_reason, figures);
}

}  // namespace kerf
