// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/foreign_itk.hpp"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <functional>
#include <iostream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <itkNiftiImageIO.h>
#include <itkTIFFImageIO.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/dicom_series.hpp"
#include "controller/volume/file/file_headers.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/file/voxel_files.hpp"

#ifdef KERF_SANITIZED
// GDCM leaks memory when an assertion of it fails.
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:gdcm\n";
}
#endif

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

/// The last line of a library's message, which is the most precise one, without its prefix.
std::string last_line(const std::string& message) {
  std::istringstream lines(message);
  std::string line;
  std::string last = "no reason given";
  while (std::getline(lines, line)) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  }
  const std::size_t object = last.find("): ");  // "ITK ERROR: Class(0x1234): text"
  if (object != std::string::npos) last.erase(0, object + 3);
  const std::size_t biff = last.find("] ");  // "[nrrd] function: text"
  if (last.starts_with('[') && biff != std::string::npos) last.erase(0, biff + 2);
  if (last.starts_with("_nrrd") || last.starts_with("nrrd")) {  // "_nrrdReadNrrdParse_type: text"
    const std::size_t step = last.find(": ");
    if (step != std::string::npos) last.erase(0, step + 2);
  }
  return last;
}

}  // namespace

void add_note(UntrustedHeader& header, std::string_view sentence) {
  const auto end = std::ranges::find(header.note, '\0');
  constexpr std::string_view kCut = "...";
  const std::string text = (end == header.note.begin() ? "" : "; ") + std::string(sentence);
  const auto room = static_cast<std::size_t>(header.note.end() - end) - 1;  // ends in a zero
  if (text.size() <= room) {
    std::ranges::copy(text, end);
  } else {
    std::copy_n(text.begin(), room, end);
    std::ranges::copy(kCut, header.note.end() - 1 - kCut.size());
  }
}

Quiet::Quiet() : cerr_(std::cerr.rdbuf(kept_.rdbuf())), cout_(std::cout.rdbuf(kept_.rdbuf())) {}

Quiet::~Quiet() {
  std::cerr.rdbuf(cerr_);
  std::cout.rdbuf(cout_);
}

void Quiet::refuse_if_missing(const std::filesystem::path& path) const {
  const std::string text = kept_.str();
  if (text.find("not read completely") != std::string::npos ||
      text.find("Uncompress failed") != std::string::npos) {
    throw LoadError(path.string() + ": voxels are missing or broken; copy the file again");
  }
}

void refuse_unreadable(const fs::path& path, const std::string& reason) {
  std::error_code fault;
  if (fs::file_size(path, fault) == 0 && !fault) {
    throw LoadError(path.string() + ": is empty; copy the file again");
  }
  throw LoadError(path.string() + ": cannot be read (" + last_line(reason) +
                  "); check that the file is whole and of the kind its name says");
}

std::array<std::int64_t, 3> open_image(const fs::path& path, ImageIo& io, unsigned axes) {
  io.SetFileName(path.string());
  guarded(path, [&] { io.ReadImageInformation(); });
  const unsigned there = io.GetNumberOfDimensions();
  bool fits = there >= axes;
  for (unsigned i = axes; i < there; ++i) fits = fits && io.GetDimensions(i) == 1;
  if (!fits) {
    throw LoadError(path.string() + ": " + std::to_string(there) +
                    (axes == 3
                         ? " axes; kerf needs a volume of three"
                         : " axes; a stack is one picture in each file, name this file alone"));
  }
  if (io.GetNumberOfComponents() != 1 || io.GetPixelType() != ImageIo::SCALAR) {
    throw LoadError(path.string() + ": " + std::to_string(io.GetNumberOfComponents()) +
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
  throw LoadError(path.string() + ": " + ImageIo::GetComponentTypeAsString(io.GetComponentType()) +
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

UntrustedHeader claim_of(const fs::path& path, const ImageIo& io,
                         const std::array<std::int64_t, 3>& size, std::uint32_t spacing_known) {
  UntrustedHeader claim;
  claim.size = size;
  claim.voxel_bytes = static_cast<std::uint32_t>(io.GetComponentSize());
  claim.kind = kind_of(type_of(path, io));
  claim.spacing_known = spacing_known;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const std::vector<double> way = io.GetDirection(axis);
    claim.spacing_mm[axis] = io.GetSpacing(axis);
    claim.origin_mm[axis] = io.GetOrigin(axis);
    claim.axes[axis] = {way[0], way[1], way[2]};
  }
  return claim;
}

void read_one_file(const fs::path& path, ImageIo& io, const VolumeHeader& header,
                   const MemoryRequest& offer) {
  const Quiet quiet;
  const std::array<std::int64_t, 3> size = open_image(path, io);
  check_grid(path.string(), size[0], size[1], size[2]);
  const auto bytes = static_cast<std::uint64_t>(io.GetImageSizeInBytes());
  if (header.data_bytes_at_most < bytes) {
    refuse_truncated(header.data_file, header.data_bytes_at_most, bytes);
  }
  const UntrustedHeader claim = claim_of(path, io, size, header.spacing_known);
  const std::span<std::byte> memory = offer(claim);
  // The file's own voxels fill the end of the memory, their values then its begin.
  const std::span<std::byte> own = memory.last(bytes);
  read_voxels(path, io, own);
  quiet.refuse_if_missing(path);
  convert_values(type_of(path, io), own, claim.kind, memory);
}

void read_raw(const fs::path& path, const RawLayout& layout, const MemoryRequest& offer) {
  const std::uint64_t each = bytes_of(layout.type);
  const std::uint64_t wanted = layout.grid.voxel_count() * each;
  const std::uint64_t size = fs::file_size(path);
  const std::uint64_t held = size - std::min(size, layout.skip);
  if (held < wanted) {
    throw LoadError(path.string() + ": " + std::to_string(held) + " bytes of voxels, and --dims, " +
                    "--type ask for " + std::to_string(wanted) +
                    "; correct them (and --skip), or copy the file again");
  }
  if (held > wanted) {
    throw LoadError(path.string() + ": " + std::to_string(held - wanted) +
                    " bytes more than --dims and --type ask for; correct them, or skip a header " +
                    "with --skip " + std::to_string(size - wanted));
  }
  UntrustedHeader claim;
  claim.size = {layout.grid.nx, layout.grid.ny, layout.grid.nz};
  claim.spacing_known = 0;
  claim.axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  read_voxel_files(path, {layout.type, Packing::raw, layout.big_endian, {{path, layout.skip}}},
                   claim, offer);
}

void read_foreign_volume(const std::filesystem::path& path, VolumeKind kind,
                         const std::vector<std::filesystem::path>& folder,
                         const std::string& series, SandboxReader& sandbox) {
  itk::Object::GlobalWarningDisplayOff();  // its warnings are of cases that are refused or harmless
  const MemoryRequest offer = [&](const UntrustedHeader& claim) {
    return sandbox.offer(std::as_bytes(std::span(&claim, 1)));
  };
  switch (kind) {
    case VolumeKind::nrrd:
      return read_nrrd(path, offer);
    case VolumeKind::meta:
      return read_meta(path, offer);
    case VolumeKind::nifti:
      return read_one_file(path, *itk::NiftiImageIO::New(), read_nifti_header(path), offer);
    case VolumeKind::tiff:
      return read_one_file(path, *itk::TIFFImageIO::New(), read_tiff_header(path), offer);
    case VolumeKind::dicom_file:
      return read_dicom(path, {path}, series, sandbox, offer);
    case VolumeKind::invesalius:
      return read_invesalius(path, offer);
    case VolumeKind::dicom_series:
      return read_dicom(path, folder, series, sandbox, offer);
    case VolumeKind::png_stack:
    case VolumeKind::tiff_stack:
      return read_slice_stack(path, folder, kind, sandbox, offer);
    case VolumeKind::raw:
      break;  // read_raw, which takes the layout
  }
}

}  // namespace kerf::volume
