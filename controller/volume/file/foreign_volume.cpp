// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/foreign_volume.hpp"

#include <algorithm>
#include <cstddef>

#include "controller/input/load_error.hpp"
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
  claim.axes = kSliceAxes;
  claim.axes_known = 0;
  read_voxel_files(path, {layout.type, Packing::raw, layout.big_endian, {}, {{path, layout.skip}}},
                   claim, offer);
}

void read_foreign_volume(const std::filesystem::path& path, VolumeKind kind,
                         const std::vector<std::filesystem::path>& folder,
                         const std::string& series, SandboxReader& sandbox) {
  const MemoryRequest offer = [&](const UntrustedHeader& claim) {
    return sandbox.offer(std::as_bytes(std::span(&claim, 1)));
  };
  switch (kind) {
    case VolumeKind::nrrd:
      return read_nrrd(path, offer);
    case VolumeKind::meta:
      return read_meta(path, offer);
    case VolumeKind::nifti:
      return read_nifti(path, offer);
    case VolumeKind::tiff:
      return read_tiff(path, offer);
    case VolumeKind::invesalius:
      return read_invesalius(path, offer);
    case VolumeKind::dicom_file:
      return read_dicom(path, {path}, series, sandbox, offer);
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
