// SPDX-License-Identifier: Apache-2.0
#include "record/kept_volumes.hpp"

#include <span>
#include <system_error>

#include "record/npy_header.hpp"
#include "record/packed_npy.hpp"
#include "record/tick_log.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

/// Reads exactly such a file. Throws DamagedRecording.
template <class Voxel>
std::vector<Voxel> read_voxels(const fs::path& path, const VoxelGrid& grid) {
  PackedNpyReader file(path, volume_header(grid, sizeof(Voxel)));
  std::vector<Voxel> voxels(file.is_sound() ? grid.voxel_count() : 0);
  if (!file.read(std::as_writable_bytes(std::span(voxels))) || !file.at_end()) {
    throw DamagedRecording(path.string() +
                           ": not the volume that scene.json names; copy the recording again");
  }
  return voxels;
}

}  // namespace

bool is_volume_hash(std::string_view text) {
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

fs::path density_path(const fs::path& folder, std::string_view hash) {
  return folder / kVolumesName / (std::string(hash) + ".npy.gz");
}
fs::path labels_path(const fs::path& folder, std::string_view hash) {
  return folder / kVolumesName / (std::string(hash) + "-labels.npy.gz");
}

std::string volume_header(const VoxelGrid& grid, std::size_t voxel_bytes) {
  constexpr std::size_t kBytes = 128;
  const std::string shape =
      std::to_string(grid.nz) + ", " + std::to_string(grid.ny) + ", " + std::to_string(grid.nx);
  return npy_header(voxel_bytes == 1 ? "'|u1'" : "'<u2'", shape, kBytes);
}

std::optional<VolumeContent> read_starting_volume(const fs::path& folder, std::string_view hash,
                                                  const VoxelGrid& grid) {
  const fs::path path = density_path(folder, hash);
  require_rights(path);
  std::error_code fault;
  if (!is_volume_hash(hash) || !fs::is_regular_file(path, fault)) return std::nullopt;
  VolumeContent out;
  out.density = read_voxels<Density>(path, grid);
  if (fs::is_regular_file(labels_path(folder, hash), fault)) {
    out.labels = read_voxels<Label>(labels_path(folder, hash), grid);
  }
  if (hex64(volume_hash(out.density, out.labels)) != hash) {
    throw DamagedRecording(path.string() +
                           ": damaged, or without its labels; copy the recording again");
  }
  return out;
}

}  // namespace kerf
