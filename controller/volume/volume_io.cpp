// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_io.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>

#include "controller/sandbox/sandbox.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/volume/foreign_volume.hpp"
#include "controller/volume/volume_header.hpp"
#include "controller/volume/volume_limits.hpp"
#include "controller/volume/volume_source.hpp"
#include "controller/volume/volume_write.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

using volume::VolumeClaim, volume::VolumeKind;

[[noreturn]] void refuse_raw(const fs::path& path) {
  for (const char* header : {".mhd", ".nhdr"}) {
    const fs::path beside = fs::path(path).replace_extension(header);
    if (fs::exists(beside)) {
      throw SceneError(path.string() + ": voxels without a header; name its header " +
                       beside.filename().string() + " instead");
    }
  }
  throw SceneError(path.string() +
                   ": voxels without a header; write a .nhdr or .mhd beside it that tells size, "
                   "type and spacing, and name that");
}

struct Kind {
  VolumeKind kind;
  const char* name;
};

Kind kind_of(const fs::path& path) {
  std::error_code fault;
  const fs::file_status status = fs::status(path, fault);
  if (!fs::exists(status)) {
    throw SceneError(path.string() + ": no such file or folder; check the path");
  }
  if (fs::is_directory(status)) return {VolumeKind::dicom_series, "DICOM"};
  if (!fs::is_regular_file(status)) {
    throw SceneError(path.string() +
                     ": a pipe, socket or device; copy what it gives to a file, and name that");
  }
  if (::access(path.c_str(), R_OK) != 0) {
    throw SceneError(path.string() + ": cannot be read (" + std::generic_category().message(errno) +
                     "); check its permissions");
  }
  const std::string name = lower(path.filename().string());
  constexpr std::pair<const char*, Kind> kEnds[] = {
      {".nrrd", {VolumeKind::nrrd, "NRRD"}},      {".nhdr", {VolumeKind::nrrd, "NRRD"}},
      {".mha", {VolumeKind::meta, "MetaImage"}},  {".mhd", {VolumeKind::meta, "MetaImage"}},
      {".nii", {VolumeKind::nifti, "NIfTI"}},     {".nii.gz", {VolumeKind::nifti, "NIfTI"}},
      {".dcm", {VolumeKind::dicom_file, "DICOM"}}};
  for (const auto& [end, kind] : kEnds) {
    if (name.ends_with(end)) return kind;
  }
  if (name.ends_with(".raw")) refuse_raw(path);
  throw SceneError(path.string() +
                   ": not a kind of volume that kerf reads; use .nrrd .nhdr .mha .mhd .nii .nii.gz "
                   ".dcm or a folder with a DICOM series");
}

/// The regular files of a folder by their names; none where `path` is no folder.
std::vector<fs::path> files_in(const fs::path& path) {
  std::vector<fs::path> files;
  std::error_code fault;
  if (!fs::is_directory(path, fault)) return files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, fault)) {
    const bool index = entry.path().filename() == "DICOMDIR";
    if (!index && entry.is_regular_file(fault)) files.push_back(entry.path());
  }
  if (fault && files.empty()) {
    throw SceneError(path.string() + ": cannot be listed (" + fault.message() +
                     "); check its permissions");
  }
  std::sort(files.begin(), files.end());  // the order in which a folder lists is chance
  return files;
}

/// The largest file. None that can be read is larger than the largest volume's voxels.
std::uint64_t largest_bytes(const std::vector<fs::path>& files) {
  std::uint64_t most = 0;
  for (const fs::path& file : files) {
    std::error_code fault;
    const std::uintmax_t size = fs::file_size(file, fault);
    if (!fault) most = std::max<std::uint64_t>(most, size);
  }
  return std::min(most, static_cast<std::uint64_t>(kMaxVoxels) * sizeof(double));
}

/// Checks what the sandbox says of the file; gives the memory for it.
std::size_t accept(const fs::path& path, const ReadOptions& options, const VolumeClaim& claim,
                   SourceVolume& source) {
  volume::set_grid(path, claim.size, source);
  volume::set_spacing(path, options, claim.has_spacing != 0, claim.spacing_mm, source);
  volume::set_origin(path, claim.origin_mm, source);
  const std::uint64_t each = std::clamp<std::uint64_t>(claim.voxel_bytes, sizeof(float), 8);
  return source.grid.voxel_count() * each;
}

}  // namespace

SourceVolume read_volume(const fs::path& path, const ReadOptions& options) {
  const Kind kind = kind_of(path);
  const std::vector<fs::path> folder = files_in(path);
  SourceVolume source;
  VolumeClaim claim;
  SharedBytes memory = read_in_sandbox(
      {path.string(), kind.name, largest_bytes(folder.empty() ? std::vector{path} : folder),
       options.cpu_s},
      [&](SandboxReader& sandbox) {
        volume::read_foreign_volume(path, kind.kind, folder, sandbox);
      },
      [&](std::span<const std::byte> header) {
        if (header.size() != sizeof claim) {
          throw SceneError(path.string() + ": its reader says nothing of its size; copy it again");
        }
        std::memcpy(&claim, header.data(), sizeof claim);
        return accept(path, options, claim, source);
      });
  source.values = {reinterpret_cast<float*>(memory.bytes().data()), source.grid.voxel_count()};
  source.memory = std::move(memory);
  volume::set_range(path, source);
  volume::set_frame(path, claim.axes[0], claim.axes[1], claim.axes[2], source);
  return source;
}

void read_labels_beside(const fs::path& volume_path, VolumeImage& image, int cpu_s) {
  const fs::path path = labels_path(volume_path);
  if (!fs::exists(path)) return;
  ReadOptions options;
  options.allow_missing_spacing = true;
  options.cpu_s = cpu_s;
  const SourceVolume source = read_volume(path, options);
  const bool fits = source.grid == image.grid && source.min >= 0.0 &&
                    source.max <= std::numeric_limits<Label>::max();
  if (!fits) {
    throw SceneError(path.string() + ": labels do not fit " + volume_path.filename().string() +
                     " (same size, values 0..255); remove or rename them");
  }
  image.labels.assign(source.values.size(), 0);
  std::transform(source.values.begin(), source.values.end(), image.labels.begin(),
                 [](float v) { return static_cast<Label>(v); });
}

}  // namespace kerf
