// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_io.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "controller/input/sandbox.hpp"
#include "controller/volume/file/folder_files.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/volume_frame.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

using volume::UntrustedHeader, volume::VolumeKind;

[[noreturn]] void refuse_raw(const fs::path& path) {
  for (const char* header : {".mhd", ".nhdr"}) {
    const fs::path beside = fs::path(path).replace_extension(header);
    if (fs::exists(beside)) {
      throw LoadError(path.string() + ": voxels without a header; name its header " +
                      beside.filename().string() + " instead");
    }
  }
  throw LoadError(path.string() + ": " + std::to_string(fs::file_size(path)) +
                  " bytes without a header; ./kerf volume import takes it with --dims NXxNYxNZ "
                  "--type uint16 --spacing x,y,z");
}

struct Kind {
  VolumeKind kind;
  const char* name;
};

/// Kind of the volume in a file.
Kind kind_of(const fs::path& path, bool raw) {
  std::error_code fault;
  if (const std::string why = access_error(path); !why.empty()) {
    throw LoadError(path.string() + why);
  }
  const fs::file_status status = fs::status(path, fault);
  if (!fs::exists(status)) {
    throw LoadError(path.string() + ": no such file or folder; check the path");
  }
  if (!fs::is_regular_file(status)) {
    throw LoadError(path.string() +
                    ": a pipe, socket or device; copy what it gives to a file, and name that");
  }
  if (::access(path.c_str(), R_OK) != 0) {
    throw LoadError(path.string() + ": cannot be read (" + std::generic_category().message(errno) +
                    "); check its permissions");
  }
  if (raw) return {VolumeKind::raw, "raw voxels"};
  const std::string name = lower(path.filename().string());
  constexpr std::pair<const char*, Kind> kEnds[] = {
      {".nrrd", {VolumeKind::nrrd, "NRRD"}},
      {".nhdr", {VolumeKind::nrrd, "NRRD"}},
      {".mha", {VolumeKind::meta, "MetaImage"}},
      {".mhd", {VolumeKind::meta, "MetaImage"}},
      {".nii", {VolumeKind::nifti, "NIfTI"}},
      {".nii.gz", {VolumeKind::nifti, "NIfTI"}},
      {".hdr", {VolumeKind::nifti, "NIfTI"}},
      {".hdr.gz", {VolumeKind::nifti, "NIfTI"}},
      {".img", {VolumeKind::nifti, "NIfTI"}},
      {".img.gz", {VolumeKind::nifti, "NIfTI"}},
      {".tif", {VolumeKind::tiff, "TIFF"}},
      {".tiff", {VolumeKind::tiff, "TIFF"}},
      {".dcm", {VolumeKind::dicom_file, "DICOM"}},
      {".inv3", {VolumeKind::invesalius, "InVesalius"}}};
  for (const auto& [end, kind] : kEnds) {
    if (name.ends_with(end)) return kind;
  }
  if (volume::begins_as_dicom(path)) return {VolumeKind::dicom_file, "DICOM"};
  if (name.ends_with(".raw")) refuse_raw(path);
  throw LoadError(
      path.string() +
      ": not a kind of volume that kerf reads; use .nrrd .nhdr .mha .mhd .nii .nii.gz "
      ".tif .dcm .inv3, a folder of DICOM, PNG or TIFF slices, or --dims of kerf volume "
      "import");
}

/// Size of the largest file, at most that of the largest volume's voxels.
std::uint64_t largest_bytes(const std::vector<fs::path>& files) {
  std::uint64_t most = 0;
  for (const fs::path& file : files) {
    std::error_code fault;
    const std::uintmax_t size = fs::file_size(file, fault);
    if (!fault) most = std::max<std::uint64_t>(most, size);
  }
  return std::min(most, static_cast<std::uint64_t>(kMaxVoxels) * sizeof(double));
}

// The steps that fill a SourceVolume, whatever library read the file. Each checks its part and
// throws LoadError with `path` as the place.

using Axis = vec3::Vec;
using vec3::cross, vec3::dot, vec3::unit;
using vec3::operator-, vec3::operator*;

/// Refuses sizes that are empty or above the limits.
void set_grid(const fs::path& path, const std::array<std::int64_t, 3>& size, SourceVolume& volume) {
  check_grid(path.string(), size[0], size[1], size[2]);
  volume.grid = {static_cast<std::int32_t>(size[0]), static_cast<std::int32_t>(size[1]),
                 static_cast<std::int32_t>(size[2])};
}

/// Refuses an origin that is not finite, or so far away that no position would be exact.
void set_origin(const fs::path& path, const std::array<double, 3>& origin_mm,
                SourceVolume& volume) {
  for (const double o : origin_mm) {
    constexpr double kFarthestMm = 1e6;
    if (std::abs(o) <= kFarthestMm) continue;
    throw LoadError(path.string() + ": its origin is " +
                    (std::isfinite(o) ? "farther than 1 km" : "not a number of mm") +
                    "; correct the header, or leave it out");
  }
  volume.origin_mm = origin_mm;
}

/// Of floats, which may be no numbers.
void set_float_range(const fs::path& path, std::span<const float> values, SourceVolume& volume) {
  float min = std::numeric_limits<float>::infinity();
  float max = -min;
  std::uint64_t bad = 0;
  std::uint64_t first_bad = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float v = values[i];
    if (!std::isfinite(v) && bad++ == 0) first_bad = i;
    min = std::min(min, v);
    max = std::max(max, v);
  }
  if (bad != 0) {
    refuse_not_finite(path, bad, first_bad, static_cast<std::uint64_t>(volume.grid.nx),
                      static_cast<std::uint64_t>(volume.grid.ny));
  }
  volume.min = static_cast<double>(min);
  volume.max = static_cast<double>(max);
}

/// Sets `min` and `max` from the values; refuses NaN and infinity.
void set_range(const fs::path& path, SourceVolume& volume) {
  volume.values.visit([&]<class T>(std::span<const T> values) {
    if constexpr (std::is_same_v<T, float>) {
      set_float_range(path, values, volume);
    } else {
      T least = values.front(), most = least;
      for (const T v : values) {  // a loop that the compiler turns into vectors
        least = std::min(least, v);
        most = std::max(most, v);
      }
      volume.min = least;
      volume.max = most;
    }
  });
}

/// Sets the direction from three axes that should be at right angles, exactly so afterwards. A
/// left-handed file has its last axis reversed: same picture, right-handed axes. After the values,
/// the spacing and the origin.
void set_frame(const fs::path& path, Axis x, Axis y, Axis z, SourceVolume& volume) {
  constexpr double kSkew = 2e-3;  // files round their cosines; a shear is far above this
  const double skew =
      std::max({std::abs(dot(x, y)), std::abs(dot(y, z)), std::abs(dot(z, x)),
                std::abs(dot(x, x) - 1.0), std::abs(dot(y, y) - 1.0), std::abs(dot(z, z) - 1.0)});
  if (!(skew < kSkew)) {
    throw LoadError(path.string() +
                    ": its axes are not at right angles; resample it to a straight grid first");
  }
  x = unit(x);
  y = unit(y - dot(x, y) * x);
  const Axis right_handed = cross(x, y);
  if (dot(right_handed, z) < 0.0) {
    const auto layer = static_cast<std::ptrdiff_t>(volume.values.bytes().size()) / volume.grid.nz;
    auto low = volume.values.bytes().begin();
    auto high = volume.values.bytes().end();
    for (; high - low >= 2 * layer; low += layer) {
      high -= layer;
      std::swap_ranges(low, low + layer, high);
    }
    const double depth_mm = volume.spacing_mm[2] * (volume.grid.nz - 1);
    volume.origin_mm = volume.origin_mm - depth_mm * right_handed;
  }
  volume.direction = {x[0], y[0], right_handed[0], x[1], y[1], right_handed[1],
                      x[2], y[2], right_handed[2]};
}

/// Whether the axes of the labels' file are those of the image, and no voxel lies more than half a
/// voxel from its own. A file that names no frame has that of its voxels, and lies as the image.
bool lies_as(const VolumeFrame& labels, const VolumeFrame& image) {
  const VolumeFrame unnamed;
  if (labels.direction == unnamed.direction && labels.origin_mm == unnamed.origin_mm) return true;
  const double shortest_mm = std::ranges::min(image.spacing_mm);
  const std::array<double, 3> far_mm{image.spacing_mm[0] * (image.grid.nx - 1),
                                     image.spacing_mm[1] * (image.grid.ny - 1),
                                     image.spacing_mm[2] * (image.grid.nz - 1)};
  for (std::size_t row = 0; row < 3; ++row) {
    double apart_mm = std::abs(labels.origin_mm[row] - image.origin_mm[row]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t at = 3 * row + axis;
      apart_mm += std::abs(labels.direction[at] - image.direction[at]) * far_mm[axis];
    }
    if (apart_mm > shortest_mm / 2) return false;
  }
  return true;
}

/// Checks the header that the sandbox reports; returns the bytes of memory for it.
std::size_t accept(const fs::path& path, const ReadOptions& options, UntrustedHeader& claim,
                   SourceVolume& source) {
  const std::string note(claim.note.begin(), std::ranges::find(claim.note, '\0'));
  if (!note.empty()) source.note += (source.note.empty() ? "" : "; ") + escaped(note);
  set_grid(path, claim.size, source);
  take_spacing(path.string(), options, claim, source);
  source.axes_note = take_axes(path.string(), options.axes, claim);
  set_origin(path, claim.origin_mm, source);
  const std::uint64_t each = std::clamp<std::uint64_t>(claim.voxel_bytes, bytes_of(claim.kind), 8);
  return source.grid.voxel_count() * each;
}

}  // namespace

SourceVolume read_volume(const fs::path& path, const ReadOptions& options) {
  if (options.spacing_mm && options.override_spacing_mm) {
    throw LoadError(path.string() +
                    ": a spacing and one that overrides it are both given; leave one of them out");
  }
  volume::FolderFiles folder;
  std::error_code fault;
  const bool is_folder = fs::is_directory(path, fault);
  if (is_folder) folder = volume::files_of_volume(path);
  const Kind kind =
      is_folder ? Kind{folder.kind, folder.name} : kind_of(path, options.raw.has_value());
  const bool is_dicom =
      kind.kind == VolumeKind::dicom_file || kind.kind == VolumeKind::dicom_series;
  if (!options.series.empty() && !is_dicom) {
    throw LoadError("--series: " + path.string() + " is no DICOM; leave it out");
  }
  SourceVolume source;
  UntrustedHeader claim;
  SharedBytes memory = read_in_sandbox(
      {path.string(), kind.name, largest_bytes(is_folder ? folder.files : std::vector{path}),
       options.cpu_s},
      [&](SandboxReader& sandbox) {
        if (kind.kind == VolumeKind::raw) {
          return volume::read_raw(path, *options.raw, [&](const UntrustedHeader& raw) {
            return sandbox.offer(std::as_bytes(std::span(&raw, 1)));
          });
        }
        volume::read_foreign_volume(path, kind.kind, folder.files, options.series, sandbox);
      },
      [&](std::span<const std::byte> header) {
        if (header.size() != sizeof claim) {
          throw LoadError(path.string() + ": its reader says nothing of its size; copy it again");
        }
        std::memcpy(&claim, header.data(), sizeof claim);
        if (claim.kind > ValueKind::uint16) claim.kind = ValueKind::float32;
        source.note = escaped(folder.note);
        return accept(path, options, claim, source);
      });
  source.values = VoxelValues(memory.bytes(), claim.kind, source.grid.voxel_count());
  source.memory = std::move(memory);
  set_range(path, source);
  set_frame(path, claim.axes[0], claim.axes[1], claim.axes[2], source);
  return source;
}

void read_labels_beside(const fs::path& volume_path, VolumeImage& image, int cpu_s) {
  const fs::path path = labels_path(volume_path);
  if (!fs::exists(path)) return;
  ReadOptions options;
  options.allow_missing_spacing = true;
  options.cpu_s = cpu_s;
  const SourceVolume source = read_volume(path, options);
  bool fits = source.grid == image.grid && source.min >= 0.0 &&
              source.max <= std::numeric_limits<Label>::max();
  source.values.visit([&](auto values) {
    fits = fits && std::ranges::all_of(values, [](auto v) { return v == static_cast<Label>(v); });
  });
  if (!fits) {
    throw LoadError(path.string() + ": labels do not fit " + volume_path.filename().string() +
                    " (same size, whole values 0..255); remove or rename them");
  }
  if (!lies_as(source, image)) {
    throw LoadError(path.string() + ": labels lie elsewhere than the voxels of " +
                    volume_path.filename().string() +
                    " (other axes or origin); resample them to its grid, or remove them");
  }
  image.labels.resize(source.values.size());
  source.values.visit([&](auto values) {
    std::ranges::transform(values, image.labels.begin(),
                           [](auto v) { return static_cast<Label>(v); });
  });
}

}  // namespace kerf
