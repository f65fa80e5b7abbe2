// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "record/check/findings.hpp"
#include "record/input_rows.hpp"
#include "record/kept_volumes.hpp"
#include "record/manifest_seal.hpp"
#include "record/packed_npy.hpp"
#include "record/scene_facts.hpp"
#include "record/tick_log.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

/// A manifest may be foreign, and name any file.
bool is_below(const fs::path& name) {
  return name.is_relative() && std::ranges::find(name, "..") == name.end();
}

void check_listed_files(const SceneFacts& scene, bool is_final, Findings& findings) {
  const Json::Members& files = findings.files();
  if (files.empty()) return;
  for (const auto& [name, sum] : files) {
    // The facts of these two are compared by each reader.
    if (name != kSceneName && name != kClockName && is_below(name)) findings.compare_file(name);
  }
  std::vector<std::string> others;  // that a recorder which was killed had not listed yet
  for (const SceneFacts::Volume& volume : scene.volumes) {
    others.push_back(density_path({}, volume.density_hash));
    others.push_back(labels_path({}, volume.density_hash));
  }
  if (is_final) others.clear();
  for (const std::string& name : names_of_files(findings.folder())) {
    if (name == kSceneName || name == kClockName ||
        std::ranges::find(others, name) != others.end() ||
        std::ranges::find(files, name, &Json::Member::key) != files.end()) {
      continue;
    }
    findings.add(one_line(name), "manifest.json does not list it", "; remove it");
  }
}

/// Files with the name of a log that are none of this recording's.
void check_other_logs(std::size_t arms, Findings& findings) {
  const std::vector<fs::path> known = recording_files(findings.folder());
  const auto is_of_log = [&](std::string_view name) {
    return name.starts_with(kTickLogName) || name.starts_with(tick_log_name(1));
  };
  std::vector<std::string> others;
  std::error_code fault;
  for (fs::directory_iterator file(findings.folder(), fault), end; !fault && file != end;
       file.increment(fault)) {
    std::string name = file->path().filename().string();
    const bool is_known = std::ranges::find(known, file->path()) != known.end() &&
                          (arms > 1 || !name.starts_with(tick_log_name(1)));
    if (is_of_log(name) && !is_known) others.push_back(std::move(name));
  }
  std::ranges::sort(others);
  for (const std::string& name : others) {
    findings.add(one_line(name),
                 "no file of this log, of " + std::to_string(arms) + (arms == 1 ? " arm" : " arms"),
                 "; remove it");
  }
}

/// Of the densities of a volume the manifest has another hash than the scene.
void check_volume(const SceneFacts::Volume& volume, std::size_t number, Findings& findings) {
  const auto [nx, ny, nz] = volume.size_vox;
  std::optional<VolumeContent> content;
  try {
    content = read_starting_volume(findings.folder(), volume.density_hash, {nx, ny, nz});
  } catch (const DamagedRecording& error) {
    findings.add_line(error.what());
  }
  const Json& volumes = findings.json().at("volumes");
  if (!content || number >= volumes.size()) return;
  findings.compare(
      volumes.at(number), "initial_hash", "volumes[" + std::to_string(number) + "].initial_hash",
      hex64(density_hash(content->density)), density_path({}, volume.density_hash).string());
}

void check_inputs(std::size_t arms, Findings& findings) {
  std::error_code fault;
  if (!fs::is_directory(findings.folder() / kInputsName, fault)) return;
  try {
    InputReader inputs(findings.folder(), findings.manifest().losses.missed_before_start, arms);
    while (!inputs.next().empty()) {
    }
  } catch (const DamagedRecording& error) {
    findings.add_line(error.what());
  }
}

std::vector<std::string> without_checksum(const Findings& findings) {
  std::vector<std::string> names;
  for (const std::string& name : names_of_files(findings.folder())) {
    if (std::ranges::find(findings.files(), name, &Json::Member::key) != findings.files().end()) {
      continue;
    }
    std::string top = one_line(name.substr(0, name.find('/')));
    if (std::ranges::find(names, top) == names.end()) names.push_back(std::move(top));
  }
  return names;
}

}  // namespace

std::vector<std::string> check_files(const SceneFacts& scene, std::size_t arms, bool is_final,
                                     Findings& findings) {
  for (const std::string_view below : {inputs_name(0), inputs_name(1), kVolumesName}) {
    require_rights(findings.folder() / below);  // else its files are not known
  }
  check_listed_files(scene, is_final, findings);
  check_other_logs(arms, findings);
  for (std::size_t v = 0; v < scene.volumes.size(); ++v)
    check_volume(scene.volumes[v], v, findings);
  check_inputs(arms, findings);
  return without_checksum(findings);
}

}  // namespace kerf
