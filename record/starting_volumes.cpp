// SPDX-License-Identifier: Apache-2.0
#include "record/starting_volumes.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "record/manifest_seal.hpp"
#include "record/packed_npy.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

/// One volume of a run: name and content hash as scene.json has them.
struct NamedVolume {
  std::string name, hash;
};

/// Empty if the scene has no such volumes.
std::vector<NamedVolume> volumes_in(std::string_view scene_json) {
  std::vector<NamedVolume> out;
  try {
    const Json scene = Json::parse(scene_json);
    for (const Json& volume : scene.at("volumes")) {
      out.push_back({one_line(volume.at("name").get<std::string>()),
                     volume.at("density_hash").get<std::string>()});
    }
  } catch (const JsonError&) {
    out.clear();
  }
  return out;
}

/// Whether the recording in `folder` has that volume, whole.
bool is_kept(const fs::path& folder, std::string_view hash, const VoxelGrid& grid) {
  try {
    return read_starting_volume(folder, hash, grid).has_value();
  } catch (const RecordError&) {
    return false;
  }
}

}  // namespace

void write_starting_volume(const fs::path& folder, std::string_view hash, const VoxelGrid& grid,
                           std::span<const Density> density, std::span<const Label> labels) {
  const fs::path volumes = folder / kVolumesName;
  std::error_code fault;
  fs::create_directory(volumes, fault);
  if (fs::is_symlink(volumes, fault) || !fs::is_directory(volumes, fault)) {
    throw RecordError(volumes.string() + ": no folder of its own; choose another --out");
  }
  AtomicFiles files;
  write_packed_npy(files.add(density_path(folder, hash)), volume_header(grid, sizeof(Density)),
                   std::as_bytes(density));
  if (!labels.empty()) {
    write_packed_npy(files.add(labels_path(folder, hash)), volume_header(grid, sizeof(Label)),
                     std::as_bytes(labels));
  }
  files.commit();
}

StartingVolumes::StartingVolumes(std::string name, fs::path folder)
    : name_(std::move(name)), folder_(std::move(folder)), thread_([this] { run(); }) {}

const std::vector<std::string>& StartingVolumes::finish() {
  if (thread_.joinable()) thread_.join();
  return problems_;
}

void StartingVolumes::run() {
  try {
    copy();
  } catch (const std::exception& error) {
    problems_.push_back(std::string("the volumes are not kept beside the log: ") + error.what());
  }
  copied_ = true;
  for (const std::string& name : names_below(folder_, kVolumesName)) {
    checksums_[name] = crc32_of_file(folder_ / name);
  }
  done_ = true;
}

void StartingVolumes::copy() {
  const SegmentConnection connection = connect_segment(name_);
  const SegmentReader& reader = connection.reader();
  const std::vector<SegmentVolumeInfo>& infos = reader.info().volumes;
  const std::vector<NamedVolume> named = volumes_in(reader.info().scene_json);
  std::vector<VolumeSnapshot> copies(infos.size());
  for (std::size_t v = 0; v < infos.size() && v < named.size(); ++v) reader.update(v, copies[v]);
  copied_ = true;
  std::set<std::string> kept;
  for (std::size_t v = 0; v < infos.size() && v < named.size(); ++v) {
    const auto& [volume, hash] = named[v];
    if (!is_volume_hash(hash) || !kept.insert(hash).second) continue;
    const std::vector<Density>& density = copies[v].density;
    const std::span<const Label> labels = reader.labels(v);
    const bool is_whole = hex64(volume_hash(density, labels)) == hash;
    if (is_whole) {
      write_starting_volume(folder_, hash, infos[v].grid, density, labels);
    } else if (!is_kept(folder_, hash, infos[v].grid)) {  // by the recorder before, of --resume
      problems_.push_back("volume " + volume +
                          ": not kept beside the log, it was cut before it was copied; a replay "
                          "reads its file again");
    }
  }
}

}  // namespace kerf
