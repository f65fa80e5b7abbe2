// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/raw_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <string>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_header.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;

void read_raw(const fs::path& path, const RawLayout& layout, const Offer& offer) {
  const std::uint64_t each = bytes_of(layout.type);
  const std::uint64_t wanted = layout.grid.voxel_count() * each;
  const std::uint64_t size = fs::file_size(path);
  const std::uint64_t held = size - std::min(size, layout.skip);
  if (held < wanted) {
    throw SceneError(path.string() + ": " + std::to_string(held) +
                     " bytes of voxels, and --dims, " + "--type ask for " + std::to_string(wanted) +
                     "; correct them (and --skip), or copy the file again");
  }
  if (held > wanted) {
    throw SceneError(path.string() + ": " + std::to_string(held - wanted) +
                     " bytes more than --dims and --type ask for; correct them, or skip a header " +
                     "with --skip " + std::to_string(size - wanted));
  }
  VolumeClaim claim;
  claim.size = {layout.grid.nx, layout.grid.ny, layout.grid.nz};
  claim.voxel_bytes = static_cast<std::uint32_t>(each);
  claim.kind = kerf::kind_of(layout.type);
  claim.has_spacing = 0;
  claim.axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const std::span<std::byte> memory = offer(claim);
  const std::span<std::byte> own = memory.last(wanted);
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(layout.skip));
  in.read(reinterpret_cast<char*>(own.data()), static_cast<std::streamsize>(own.size()));
  if (static_cast<std::uint64_t>(in.gcount()) != wanted) {
    refuse_truncated(path.string(), static_cast<std::uint64_t>(in.gcount()), wanted);
  }
  if (layout.big_endian) {
    for (std::size_t at = 0; each > 1 && at < own.size(); at += each) {
      std::ranges::reverse(own.subspan(at, each));
    }
  }
  convert_values(layout.type, own, claim.kind, memory);
}

}  // namespace kerf::volume
