// SPDX-License-Identifier: Apache-2.0
#include "record/manifest.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <system_error>

#include "record/record_error.hpp"
#include "shared/posix/hex64.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/unreachable.hpp"
#include "shared/segment/layout_table.hpp"
#include "shared/text/json.hpp"

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
  if (const std::string why = why_unreachable(path); !why.empty()) {
    throw RecordError(path.string() + why);
  }
  std::error_code fault;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, fault)) file.open(path);  // a pipe would be waited for
  if (!file.is_open()) {
    throw RecordError(path.string() + ": cannot be read; give the folder of a recording");
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

}  // namespace kerf
