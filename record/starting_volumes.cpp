// SPDX-License-Identifier: Apache-2.0
#include "record/starting_volumes.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <span>
#include <system_error>
#include <utility>

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

template <class Voxel>
constexpr std::string_view type_of() {
  return sizeof(Voxel) == 1 ? "'|u1'" : "'<u2'";
}

template <class Voxel>
std::string header_of(const VoxelGrid& grid) {
  constexpr std::size_t kBytes = 128;
  const std::string shape =
      std::to_string(grid.nz) + ", " + std::to_string(grid.ny) + ", " + std::to_string(grid.nx);
  return npy_header(type_of<Voxel>(), shape, kBytes);
}

fs::path density_path(const fs::path& folder, std::string_view hash) {
  return folder / kVolumesName / (std::string(hash) + ".npy.gz");
}
fs::path labels_path(const fs::path& folder, std::string_view hash) {
  return folder / kVolumesName / (std::string(hash) + "-labels.npy.gz");
}

/// Reads exactly such a file. Throws RecordError.
template <class Voxel>
std::vector<Voxel> read_voxels(const fs::path& path, const VoxelGrid& grid) {
  PackedNpyReader file(path, header_of<Voxel>(grid));
  std::vector<Voxel> voxels(file.is_sound() ? grid.voxel_count() : 0);
  if (!file.read(std::as_writable_bytes(std::span(voxels))) || !file.at_end()) {
    throw RecordError(path.string() +
                      ": not the volume that scene.json names; copy the recording again");
  }
  return voxels;
}

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

/// A hash is a part of a path, and scene.json of another machine may hold anything.
bool is_hash(std::string_view text) {
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
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
  write_packed_npy(files.add(density_path(folder, hash)), header_of<Density>(grid),
                   std::as_bytes(density));
  if (!labels.empty()) {
    write_packed_npy(files.add(labels_path(folder, hash)), header_of<Label>(grid),
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
    if (!is_hash(hash) || !kept.insert(hash).second) continue;
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

std::optional<VolumeContent> read_starting_volume(const fs::path& folder, std::string_view hash,
                                                  const VoxelGrid& grid) {
  const fs::path path = density_path(folder, hash);
  std::error_code fault;
  if (!is_hash(hash) || !fs::is_regular_file(path, fault)) return std::nullopt;
  VolumeContent out;
  out.density = read_voxels<Density>(path, grid);
  if (fs::is_regular_file(labels_path(folder, hash), fault)) {
    out.labels = read_voxels<Label>(labels_path(folder, hash), grid);
  }
  if (hex64(volume_hash(out.density, out.labels)) != hash) {
    throw RecordError(path.string() + ": damaged, or without its labels; copy the recording again");
  }
  return out;
}

}  // namespace kerf
