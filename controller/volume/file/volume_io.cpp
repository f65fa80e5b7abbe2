// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_io.hpp"

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
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/volume_header.hpp"
#include "controller/volume/file/volume_limits.hpp"
#include "controller/volume/file/volume_source.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "shared/posix/unreachable.hpp"
#include "shared/text/words.hpp"

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
  throw SceneError(path.string() + ": " + std::to_string(fs::file_size(path)) +
                   " bytes without a header; ./kerf volume import takes it with --dims NXxNYxNZ "
                   "--type uint16 --spacing x,y,z");
}

struct Kind {
  VolumeKind kind;
  const char* name;
};

/// What a folder holds, by the names of its files.
Kind kind_of_folder(const std::vector<fs::path>& files) {
  std::size_t png = 0, tiff = 0;
  for (const fs::path& file : files) {
    const std::string end = lower(file.extension().string());
    png += end == ".png" ? 1 : 0;
    tiff += end == ".tif" || end == ".tiff" ? 1 : 0;
  }
  if (2 * std::max(png, tiff) <= files.size()) return {VolumeKind::dicom_series, "DICOM"};
  return png >= tiff ? Kind{VolumeKind::png_stack, "PNG"} : Kind{VolumeKind::tiff_stack, "TIFF"};
}

Kind kind_of(const fs::path& path, const std::vector<fs::path>& folder, bool raw) {
  std::error_code fault;
  if (const std::string why = why_unreachable(path); !why.empty()) {
    throw SceneError(path.string() + why);
  }
  const fs::file_status status = fs::status(path, fault);
  if (!fs::exists(status)) {
    throw SceneError(path.string() + ": no such file or folder; check the path");
  }
  if (fs::is_directory(status)) return kind_of_folder(folder);
  if (!fs::is_regular_file(status)) {
    throw SceneError(path.string() +
                     ": a pipe, socket or device; copy what it gives to a file, and name that");
  }
  if (::access(path.c_str(), R_OK) != 0) {
    throw SceneError(path.string() + ": cannot be read (" + std::generic_category().message(errno) +
                     "); check its permissions");
  }
  if (raw) return {VolumeKind::raw, "raw voxels"};
  const std::string name = lower(path.filename().string());
  constexpr std::pair<const char*, Kind> kEnds[] = {
      {".nrrd", {VolumeKind::nrrd, "NRRD"}},      {".nhdr", {VolumeKind::nrrd, "NRRD"}},
      {".mha", {VolumeKind::meta, "MetaImage"}},  {".mhd", {VolumeKind::meta, "MetaImage"}},
      {".nii", {VolumeKind::nifti, "NIfTI"}},     {".nii.gz", {VolumeKind::nifti, "NIfTI"}},
      {".tif", {VolumeKind::tiff, "TIFF"}},       {".tiff", {VolumeKind::tiff, "TIFF"}},
      {".dcm", {VolumeKind::dicom_file, "DICOM"}}};
  for (const auto& [end, kind] : kEnds) {
    if (name.ends_with(end)) return kind;
  }
  if (name.ends_with(".raw")) refuse_raw(path);
  throw SceneError(path.string() +
                   ": not a kind of volume that kerf reads; use .nrrd .nhdr .mha .mhd .nii .nii.gz "
                   ".tif .dcm, a folder of DICOM, PNG or TIFF slices, or --dims of kerf volume "
                   "import");
}

/// Runs of digits count as numbers: slice2 comes before slice10.
bool in_natural_order(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto number = [&](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t first = at;
      while (at < text.size() && digit(text[at])) ++at;
      return text.substr(first, at - first);
    };
    const std::string x = number(a, i), y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

/// The regular files of a folder, but hidden ones, in the order of their names, or, where there is
/// none but an index, those of its folders, as on a disc of DICOM; none where `path` is no folder.
std::vector<fs::path> files_in(const fs::path& path) {
  constexpr int kDeepest = 5;
  constexpr std::size_t kMostFiles = 20000;
  std::vector<fs::path> files, below;
  std::error_code fault;
  if (!fs::is_directory(path, fault)) return files;
  for (fs::recursive_directory_iterator entry(path, fault), end; !fault && entry != end;
       entry.increment(fault)) {
    if (entry.depth() >= kDeepest) entry.disable_recursion_pending();
    const std::string name = entry->path().filename().string();
    const bool hidden = name.starts_with('.');  // as those that macOS puts beside each file
    if (hidden) entry.disable_recursion_pending();
    std::error_code gone;
    if (hidden || name == "DICOMDIR" || !entry->is_regular_file(gone)) continue;
    (entry.depth() == 0 ? files : below).push_back(entry->path());
    if (files.size() + below.size() > kMostFiles) {
      throw SceneError(path.string() + ": more than " + std::to_string(kMostFiles) +
                       " files; name the folder that holds the slices");
    }
  }
  if (fault && files.empty()) {
    throw SceneError(path.string() + ": cannot be listed (" + fault.message() +
                     "); check its permissions");
  }
  if (files.empty()) files = std::move(below);
  std::ranges::sort(files, in_natural_order, [](const fs::path& file) { return file.string(); });
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
  const std::uint64_t each = std::clamp<std::uint64_t>(claim.voxel_bytes, bytes_of(claim.kind), 8);
  return source.grid.voxel_count() * each;
}

/// On one line of a terminal.
std::string note_of(const VolumeClaim& claim) {
  return escaped(std::string(claim.note.begin(), std::ranges::find(claim.note, '\0')));
}

}  // namespace

SourceVolume read_volume(const fs::path& path, const ReadOptions& options) {
  const std::vector<fs::path> folder = files_in(path);
  const Kind kind = kind_of(path, folder, options.raw.has_value());
  SourceVolume source;
  VolumeClaim claim;
  SharedBytes memory = read_in_sandbox(
      {path.string(), kind.name, largest_bytes(folder.empty() ? std::vector{path} : folder),
       options.cpu_s},
      [&](SandboxReader& sandbox) {
        if (kind.kind == VolumeKind::raw) {
          return volume::read_raw(path, *options.raw, [&](const VolumeClaim& raw) {
            return sandbox.offer(std::as_bytes(std::span(&raw, 1)));
          });
        }
        volume::read_foreign_volume(path, kind.kind, folder, options.series, sandbox);
      },
      [&](std::span<const std::byte> header) {
        if (header.size() != sizeof claim) {
          throw SceneError(path.string() + ": its reader says nothing of its size; copy it again");
        }
        std::memcpy(&claim, header.data(), sizeof claim);
        if (claim.kind > ValueKind::uint16) claim.kind = ValueKind::float32;
        return accept(path, options, claim, source);
      });
  source.values = VoxelValues(memory.bytes(), claim.kind, source.grid.voxel_count());
  source.note = note_of(claim);
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
  image.labels.resize(source.values.size());
  source.values.visit([&](auto values) {
    std::ranges::transform(values, image.labels.begin(),
                           [](auto v) { return static_cast<Label>(v); });
  });
}

}  // namespace kerf
