// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/foreign_io.hpp"

#include <algorithm>
#include <functional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "controller/volume/file/library_messages.hpp"
#include "controller/volume/file/volume_limits.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;

void refuse_unreadable(const fs::path& path, const std::string& reason) {
  std::error_code fault;
  if (fs::file_size(path, fault) == 0 && !fault) {
    throw SceneError(path.string() + ": is empty; copy the file again");
  }
  throw SceneError(path.string() + ": cannot be read (" + last_line(reason) +
                   "); check that the file is whole and of the kind its name says");
}

std::array<std::int64_t, 3> open_image(const fs::path& path, ImageIo& io, unsigned axes) {
  io.SetFileName(path.string());
  guarded(path, [&] { io.ReadImageInformation(); });
  const unsigned there = io.GetNumberOfDimensions();
  bool fits = there >= axes;
  for (unsigned i = axes; i < there; ++i) fits = fits && io.GetDimensions(i) == 1;
  if (!fits) {
    throw SceneError(path.string() + ": " + std::to_string(there) +
                     (axes == 3
                          ? " axes; kerf needs a volume of three"
                          : " axes; a stack is one picture in each file, name this file alone"));
  }
  if (io.GetNumberOfComponents() != 1 || io.GetPixelType() != ImageIo::SCALAR) {
    throw SceneError(path.string() + ": " + std::to_string(io.GetNumberOfComponents()) +
                     " values per voxel (" + ImageIo::GetPixelTypeAsString(io.GetPixelType()) +
                     "); save it as one grey value per voxel");
  }
  return {static_cast<std::int64_t>(io.GetDimensions(0)),
          static_cast<std::int64_t>(io.GetDimensions(1)),
          axes == 3 ? static_cast<std::int64_t>(io.GetDimensions(2)) : 1};
}

VoxelType type_of(const fs::path& path, const ImageIo& io) {
  static_assert(sizeof(long) == 8, "as ITK's LONG");
  constexpr std::pair<ImageIo::IOComponentEnum, VoxelType> kTypes[] = {
      {ImageIo::UCHAR, VoxelType::uint8},      {ImageIo::CHAR, VoxelType::int8},
      {ImageIo::USHORT, VoxelType::uint16},    {ImageIo::SHORT, VoxelType::int16},
      {ImageIo::UINT, VoxelType::uint32},      {ImageIo::INT, VoxelType::int32},
      {ImageIo::ULONG, VoxelType::uint64},     {ImageIo::LONG, VoxelType::int64},
      {ImageIo::ULONGLONG, VoxelType::uint64}, {ImageIo::LONGLONG, VoxelType::int64},
      {ImageIo::FLOAT, VoxelType::float32},    {ImageIo::DOUBLE, VoxelType::float64}};
  const auto found =
      std::ranges::find(kTypes, io.GetComponentType(), [](const auto& row) { return row.first; });
  if (found != std::end(kTypes)) return found->second;
  throw SceneError(path.string() + ": " + ImageIo::GetComponentTypeAsString(io.GetComponentType()) +
                   " voxels; save it as integers of 8..32 bits or as floats");
}

void read_voxels(const fs::path& path, ImageIo& io, std::span<std::byte> bytes) {
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned i = 0; i < io.GetNumberOfDimensions(); ++i) {
    region.SetIndex(i, 0);
    region.SetSize(i, io.GetDimensions(i));
  }
  io.SetIORegion(region);
  guarded(path, [&] { io.Read(bytes.data()); });
}

VolumeClaim claim_of(const fs::path& path, const ImageIo& io,
                     const std::array<std::int64_t, 3>& size, bool has_spacing) {
  VolumeClaim claim;
  claim.size = size;
  claim.voxel_bytes = static_cast<std::uint32_t>(io.GetComponentSize());
  claim.kind = kind_of(type_of(path, io));
  claim.has_spacing = has_spacing ? 1 : 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const std::vector<double> way = io.GetDirection(axis);
    claim.spacing_mm[axis] = io.GetSpacing(axis);
    claim.origin_mm[axis] = io.GetOrigin(axis);
    claim.axes[axis] = {way[0], way[1], way[2]};
  }
  return claim;
}

namespace {

/// MetaIO leaves out, without a word, what it cannot unpack and which of its data files are not
/// there: those bytes stay as they were before. So they show by a second reading over other bytes.
void read_all_voxels(const fs::path& path, ImageIo& io, std::span<std::byte> bytes) {
  const auto hash_over = [&](std::byte before) {
    std::ranges::fill(bytes, before);
    read_voxels(path, io, bytes);
    return std::hash<std::string_view>{}(
        {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  };
  if (hash_over(std::byte{0xff}) == hash_over(std::byte{0})) return;
  throw SceneError(path.string() +
                   ": voxels are missing in its data; copy it again, with all of its data files");
}

}  // namespace

void read_one_file(const fs::path& path, ImageIo& io, const VolumeHeader& header,
                   const Offer& offer) {
  const Quiet quiet;
  const std::array<std::int64_t, 3> size = open_image(path, io);
  check_grid(path.string(), size[0], size[1], size[2]);
  const auto bytes = static_cast<std::uint64_t>(io.GetImageSizeInBytes());
  if (header.data_bytes_at_most < bytes) {
    refuse_truncated(header.data_file, header.data_bytes_at_most, bytes);
  }
  const VolumeClaim claim = claim_of(path, io, size, header.has_spacing);
  const std::span<std::byte> memory = offer(claim);
  // The file's own voxels fill the end of the memory, their values then its begin.
  const std::span<std::byte> own = memory.last(bytes);
  if (header.leaves_out) {
    read_all_voxels(path, io, own);
  } else {
    read_voxels(path, io, own);
  }
  quiet.refuse_if_missing(path);
  convert_values(type_of(path, io), own, claim.kind, memory);
}

}  // namespace kerf::volume
