// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include "controller/volume/file/foreign_io.hpp"
// ITK from here on.
#include <itkPNGImageIO.h>
#include <itkTIFFImageIO.h>

#include "controller/volume/file/library_messages.hpp"
#include "controller/volume/file/slice_names.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;

namespace {

/// Those of the kind; one of the other kind would be of another stack.
std::vector<fs::path> pictures_among(const std::vector<fs::path>& files, VolumeKind kind) {
  std::vector<fs::path> pictures;
  for (const fs::path& file : files) {
    const std::string end = lower(file.extension().string());
    const bool png = end == ".png", tiff = end == ".tif" || end == ".tiff";
    if (!png && !tiff) continue;
    if (png != (kind == VolumeKind::png_stack)) {
      throw SceneError(file.string() + (png ? ": a PNG among TIFF" : ": a TIFF among PNG") +
                       " slices; keep one stack of slices per folder");
    }
    pictures.push_back(file);
  }
  return pictures;
}

}  // namespace

void read_slice_stack(const fs::path& folder, const std::vector<fs::path>& beside, VolumeKind kind,
                      SandboxReader& sandbox, const Offer& offer) {
  const Quiet quiet;
  const std::vector<fs::path> files = pictures_among(beside, kind);
  if (files.size() < 2) {
    throw SceneError(folder.string() + ": one picture; name a folder that holds all slices");
  }
  check_slice_names(files);
  // One for each file: that of TIFF would tell of the first file again.
  const auto reader = [kind] {
    return kind == VolumeKind::png_stack ? ImageIo::Pointer(itk::PNGImageIO::New())
                                         : ImageIo::Pointer(itk::TIFFImageIO::New());
  };
  VolumeClaim claim;
  VoxelType type{};
  const auto word = [](VoxelType of) {
    return std::string(kVoxelTypeWords[static_cast<std::size_t>(of)]);
  };
  for (const fs::path& file : files) {
    sandbox.at(file.string());
    const ImageIo::Pointer io = reader();
    const std::array<std::int64_t, 3> size = open_image(file, *io, 2);
    const VoxelType own = type_of(file, *io);
    if (file == files.front()) {
      claim.size = {size[0], size[1], static_cast<std::int64_t>(files.size())};
      claim.kind = kind_of(own);
      type = own;
    } else if (size[0] != claim.size[0] || size[1] != claim.size[1]) {
      throw SceneError(file.string() + ": " + std::to_string(size[0]) + " x " +
                       std::to_string(size[1]) + " pixels, and " +
                       files.front().filename().string() + " has " + std::to_string(claim.size[0]) +
                       " x " + std::to_string(claim.size[1]) +
                       "; keep one stack of slices per folder");
    }
    if (own != type) {
      throw SceneError(file.string() + ": values of " + word(own) + ", and " +
                       files.front().filename().string() + " has " + word(type) +
                       "; save all slices with values of one type");
    }
  }
  claim.voxel_bytes = static_cast<std::uint32_t>(bytes_of(claim.kind));
  claim.has_spacing = 0;
  // Rows run downwards and slices upwards in a body that lies on its back, as in DICOM.
  claim.axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

  sandbox.at(folder.string());
  std::span<std::byte> rest = offer(claim);
  const std::size_t bytes =
      static_cast<std::size_t>(claim.size[0] * claim.size[1]) * bytes_of(claim.kind);
  std::vector<std::byte> own;
  for (const fs::path& file : files) {
    sandbox.at(file.string());
    const ImageIo::Pointer io = reader();
    static_cast<void>(open_image(file, *io, 2));
    own.resize(static_cast<std::size_t>(io->GetImageSizeInBytes()));
    read_voxels(file, *io, own);
    quiet.refuse_if_missing(file);
    convert_values(type_of(file, *io), own, claim.kind, rest.first(bytes));
    rest = rest.subspan(bytes);
  }
}

}  // namespace kerf::volume
