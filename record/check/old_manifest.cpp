// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <optional>
#include <vector>

#include "record/check/findings.hpp"
#include "record/check/repair.hpp"
#include "record/input_rows.hpp"
#include "record/kept_volumes.hpp"
#include "record/manifest_seal.hpp"
#include "record/packed_npy.hpp"
#include "record/tick_log.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

/// The object in manifest.json; empty if there is none.
Json readable_manifest(const fs::path& folder) {
  try {
    Json json = Json::parse(manifest_text(folder));
    static_cast<void>(json.members());
    return json;
  } catch (const JsonError&) {         // NOLINT(bugprone-empty-catch): it says nothing then
  } catch (const DamagedRecording&) {  // NOLINT(bugprone-empty-catch): it is lost
  }
  return Json::Members{};
}

/// What `read` makes of a member; nothing if that is missing or has another form.
template <class Read>
auto member(const Json& manifest, std::string_view key, const Read& read)
    -> std::optional<decltype(read(manifest))> {
  try {
    if (manifest.contains(key)) return read(manifest.at(key));
  } catch (const JsonError&) {  // NOLINT(bugprone-empty-catch): it says nothing then
  }
  return std::nullopt;
}

bool is_hex(std::string_view text, std::size_t digits) {
  return text.size() == digits &&
         text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string refusal(const fs::path& file, const std::string& what) {
  return file.string() + ": " + what + ", so no manifest is rebuilt; copy the recording again";
}

/// A recorder writes a row of clock.npy before its checksum.
bool is_clock_ahead(const fs::path& folder, const Json& manifest, std::string_view checksum) {
  const auto end =
      member(manifest, "end_reason", [](const Json& m) { return m.get<std::string>(); });
  if (end && is_of_whole_log(*end)) return false;
  return checksum == checksum_before_last_row(folder, read_clock(folder, true));
}

std::string contradiction_to_files(const fs::path& folder, const SceneFacts& scene,
                                   const Json& manifest) {
  const auto files = member(manifest, "files", [](const Json& m) { return m.members(); });
  if (!files) return {};
  for (const auto& [name, listed] : *files) {
    if (!may_have_file(scene, name, UINT64_MAX) || !listed.is_text()) continue;
    const auto checksum = listed.get<std::string>();
    require_rights(folder / name);
    const std::string is = crc32_of_file(folder / name);
    if (!is_hex(checksum, 8) || checksum == is) continue;
    if (is.empty()) {
      return refusal(folder / name, "cannot be read, and manifest.json has its checksum");
    }
    if (name == kClockName && is_clock_ahead(folder, manifest, checksum)) continue;
    return refusal(folder / name,
                   "its checksum is " + is + ", and \"" + checksum + "\" in manifest.json");
  }
  return {};
}

std::string contradiction_to_first_rows(const fs::path& folder, std::size_t arms,
                                        const Json& manifest) {
  const auto first_rows = member(manifest, "first_rows",
                                 [](const Json& m) { return m.get<std::vector<std::uint32_t>>(); });
  if (!first_rows) return {};
  std::vector<TickLogReader> logs = open_logs(folder, arms);
  for (std::size_t arm = 0; arm < std::min(arms, first_rows->size()); ++arm) {
    std::array<TickRecord, 1> row;
    std::string problem;  // of an unsound row, which the check finds
    if (logs[arm].read(0, row, problem) == 0 || row[0].crc32c == (*first_rows)[arm]) continue;
    return refusal(folder / tick_log_name(arm),
                   "does not begin with the row that manifest.json has the checksum of");
  }
  return {};
}

std::string contradiction_to_config_hash(const fs::path& folder, const SceneFacts& scene,
                                         const Json& manifest) {
  const auto text = [](const Json& m) { return m.get<std::string>(); };
  const auto hash = member(manifest, "config_hash", text);
  if (!hash || !is_hex(*hash, 16) || *hash == scene.config_hash) return {};
  const auto of_scene =
      member(manifest, "files", [&](const Json& m) { return text(m.at(kSceneName)); });
  if (of_scene == crc32_of_file(folder / kSceneName)) return {};
  return refusal(folder / kSceneName, "its config_hash is \"" + scene.config_hash + "\", and \"" +
                                          *hash + "\" in manifest.json");
}

}  // namespace

bool may_have_file(const SceneFacts& scene, std::string_view name, std::uint64_t missed) {
  if (name == kSceneName || name == kClockName) return true;
  for (const SceneFacts::Volume& volume : scene.volumes) {
    if (name == density_path({}, volume.density_hash).string() ||
        name == labels_path({}, volume.density_hash).string()) {
      return true;
    }
  }
  for (std::size_t arm = 0; arm < scene.arms.value_or(1); ++arm) {
    const std::size_t begin = inputs_name(arm).size() + 1;
    Tick first = 0;
    if (name.size() > begin) {
      std::from_chars(name.data() + begin, name.data() + name.size(), first);
    }
    if (first != 0 && first % kInputsAFile == 1 && first <= missed &&
        name == inputs_file({}, arm, first).string()) {
      return true;
    }
  }
  return false;
}

std::string contradiction_to_manifest(const fs::path& folder, const SceneFacts& scene) {
  const Json manifest = readable_manifest(folder);
  std::string line = contradiction_to_files(folder, scene, manifest);
  if (line.empty()) line = contradiction_to_first_rows(folder, scene.arms.value_or(1), manifest);
  if (line.empty()) line = contradiction_to_config_hash(folder, scene, manifest);
  return line;
}

}  // namespace kerf
