// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_io.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <new>
#include <string>

// clang-format off
#include "controller/volume/itk_on_clang.hpp"  // before any header of ITK
// clang-format on
#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/library_messages.hpp"
#include "controller/volume/volume_header.hpp"
#include "controller/volume/volume_source.hpp"
#include "controller/volume/volume_write.hpp"

// The only file that includes ITK. Its readers are driven one level below itk::Image, so that each
// size is checked before memory is taken, and no type is instantiated twelve times.

#ifdef KERF_SANITIZED
// NrrdIO and MetaIO forget memory where they refuse a file; that is their own to mend.
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libITKNrrdIO\nleak:libITKMetaIO\n";
}
#endif

namespace kerf {
namespace fs = std::filesystem;
namespace {

using ImageIo = itk::ImageIOBase;
using volume::cross, volume::dot;
using volume::Place, volume::set_frame, volume::set_grid, volume::set_range, volume::set_spacing;
using volume::Quiet, volume::Slice;

[[noreturn]] void refuse_unreadable(const fs::path& path, const std::string& reason) {
  throw SceneError(path.string() + ": cannot be read (" + volume::last_line(reason) +
                   "); check that the file is whole and of the kind its name says");
}

/// Runs a step of a library; its exceptions become one line that begins with the file.
template <class Step>
auto guarded(const fs::path& path, Step&& step) {
  try {
    return step();
  } catch (const itk::ExceptionObject& error) {
    refuse_unreadable(path, error.GetDescription());
  } catch (const std::bad_alloc&) {
    throw SceneError(path.string() +
                     ": not enough memory for its voxels; crop or resample it first");
  } catch (const SceneError&) {
    throw;
  } catch (const std::exception& error) {
    refuse_unreadable(path, error.what());
  }
}

template <class T>
void append(const void* from, std::size_t count, std::vector<float>& to) {
  const T* first = static_cast<const T*>(from);
  std::transform(first, first + count, std::back_inserter(to),
                 [](T value) { return static_cast<float>(value); });
}

void append_values(const fs::path& path, ImageIo::IOComponentEnum type, const void* from,
                   std::size_t count, std::vector<float>& to) {
  struct Kind {
    ImageIo::IOComponentEnum type;
    void (*append)(const void*, std::size_t, std::vector<float>&);
  };
  constexpr Kind kKinds[] = {{ImageIo::UCHAR, append<unsigned char>},
                             {ImageIo::CHAR, append<signed char>},
                             {ImageIo::USHORT, append<unsigned short>},
                             {ImageIo::SHORT, append<short>},
                             {ImageIo::UINT, append<unsigned int>},
                             {ImageIo::INT, append<int>},
                             {ImageIo::ULONG, append<unsigned long>},
                             {ImageIo::LONG, append<long>},
                             {ImageIo::ULONGLONG, append<unsigned long long>},
                             {ImageIo::LONGLONG, append<long long>},
                             {ImageIo::FLOAT, append<float>},
                             {ImageIo::DOUBLE, append<double>}};
  for (const Kind& kind : kKinds) {
    if (kind.type == type) return kind.append(from, count, to);
  }
  throw SceneError(path.string() + ": " + ImageIo::GetComponentTypeAsString(type) +
                   " voxels; save it as integers of 8..32 bits or as floats");
}

/// Reads the header; gives the three extents. More axes are fine where they hold one layer each.
std::array<std::int64_t, 3> open(const fs::path& path, ImageIo& io) {
  io.SetFileName(path.string());
  guarded(path, [&] { io.ReadImageInformation(); });
  const unsigned axes = io.GetNumberOfDimensions();
  bool flat = axes < 3;
  for (unsigned i = 3; i < axes; ++i) flat = flat || io.GetDimensions(i) != 1;
  if (flat) {
    throw SceneError(path.string() + ": " + std::to_string(axes) +
                     " axes; kerf needs a volume of three");
  }
  if (io.GetNumberOfComponents() != 1 || io.GetPixelType() != ImageIo::SCALAR) {
    throw SceneError(path.string() + ": " + std::to_string(io.GetNumberOfComponents()) +
                     " values per voxel (" + ImageIo::GetPixelTypeAsString(io.GetPixelType()) +
                     "); save it as one grey value per voxel");
  }
  return {static_cast<std::int64_t>(io.GetDimensions(0)),
          static_cast<std::int64_t>(io.GetDimensions(1)),
          static_cast<std::int64_t>(io.GetDimensions(2))};
}

/// Reads all voxels of the opened file to the end of `values`.
void read_voxels(const fs::path& path, ImageIo& io, std::vector<float>& values) {
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned i = 0; i < io.GetNumberOfDimensions(); ++i) {
    region.SetIndex(i, 0);
    region.SetSize(i, io.GetDimensions(i));
  }
  io.SetIORegion(region);
  const auto count = static_cast<std::size_t>(io.GetImageSizeInComponents());
  guarded(path, [&] {
    std::vector<char> bytes(static_cast<std::size_t>(io.GetImageSizeInBytes()));
    io.Read(bytes.data());
    append_values(path, io.GetComponentType(), bytes.data(), count, values);
  });
}

/// Column `axis` of the direction matrix: the way that axis points.
Place axis_of(const ImageIo& io, unsigned axis) {
  const std::vector<double> d = io.GetDirection(axis);
  return {d[0], d[1], d[2]};
}

SourceVolume read_one_file(const fs::path& path, ImageIo& io, const VolumeHeader& header,
                           const ReadOptions& options) {
  const Quiet quiet;
  SourceVolume volume;
  set_grid(path, open(path, io), volume);
  const std::array<double, 3> spacing{io.GetSpacing(0), io.GetSpacing(1), io.GetSpacing(2)};
  set_spacing(path, options, header.has_spacing, spacing, volume);
  const auto bytes = static_cast<std::uint64_t>(io.GetImageSizeInBytes());
  if (header.data_bytes_at_most < bytes) {
    refuse_truncated(header.data_file, header.data_bytes_at_most, bytes);
  }
  guarded(path, [&] { volume.values.reserve(volume.grid.voxel_count()); });
  read_voxels(path, io, volume.values);
  quiet.refuse_if_missing(path);
  set_range(path, volume);
  volume.origin_mm = {io.GetOrigin(0), io.GetOrigin(1), io.GetOrigin(2)};
  set_frame(path, axis_of(io, 0), axis_of(io, 1), axis_of(io, 2), volume);
  return volume;
}

/// GDCM fills in 1 mm where a file names no spacing between pixels.
bool names_spacing(const itk::GDCMImageIO& io) {
  std::string text;
  const bool tagged =
      itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), "0028|0030", text) ||
      itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), "0018|1164", text);
  return tagged || io.GetSpacing(0) != 1.0 || io.GetSpacing(1) != 1.0;
}

SourceVolume read_dicom_file(const fs::path& path, const ReadOptions& options) {
  const auto io = itk::GDCMImageIO::New();
  VolumeHeader header;
  {
    const Quiet quiet;
    if (open(path, *io)[2] == 1) {
      throw SceneError(path.string() +
                       ": one slice; name the folder that holds the whole DICOM series");
    }
    header.has_spacing = names_spacing(*io);
  }
  return read_one_file(path, *io, header, options);
}

/// The DICOM images in a folder, which must be of one series. Other files may lie beside them.
std::vector<fs::path> series_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::map<std::string, std::size_t> series;  // images per series
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path& file = entry.path();
    const auto io = itk::GDCMImageIO::New();
    if (!entry.is_regular_file() || file.filename() == "DICOMDIR") continue;
    if (!guarded(file, [&] { return io->CanReadFile(file.c_str()); })) continue;
    open(file, *io);
    std::string uid;
    itk::ExposeMetaData<std::string>(io->GetMetaDataDictionary(), "0020|000e", uid);
    ++series[uid];
    files.push_back(file);
  }
  if (files.empty()) {
    throw SceneError(folder.string() +
                     ": no DICOM series in this folder; name a volume file or another folder");
  }
  if (series.size() > 1) {
    throw SceneError(folder.string() + ": " + std::to_string(series.size()) +
                     " DICOM series in one folder; move the wanted one into its own");
  }
  std::sort(files.begin(), files.end());  // the order in which a folder lists is chance
  return files;
}

SourceVolume read_dicom_series(const fs::path& folder, const ReadOptions& options) {
  const Quiet quiet;
  const std::vector<fs::path> files = series_files(folder);
  if (files.size() == 1) return read_dicom_file(files.front(), options);

  const auto io = itk::GDCMImageIO::New();
  const std::array<std::int64_t, 3> size = open(files.front(), *io);
  SourceVolume volume;
  set_grid(folder, {size[0], size[1], static_cast<std::int64_t>(files.size())}, volume);
  const bool in_file = names_spacing(*io);
  const Place x = axis_of(*io, 0);
  const Place y = axis_of(*io, 1);
  const Place normal = cross(x, y);
  const std::array<double, 2> pixel{io->GetSpacing(0), io->GetSpacing(1)};

  std::vector<Slice> slices;
  for (const fs::path& file : files) {
    const bool same = open(file, *io) == size && size[2] == 1 && axis_of(*io, 0) == x &&
                      axis_of(*io, 1) == y && io->GetSpacing(0) == pixel[0] &&
                      io->GetSpacing(1) == pixel[1];
    if (!same) {
      throw SceneError(file.string() + ": its size, spacing or direction differs from " +
                       files.front().filename().string() + "; keep one stack of slices per folder");
    }
    quiet.refuse_if_missing(file);
    const Place origin{io->GetOrigin(0), io->GetOrigin(1), io->GetOrigin(2)};
    slices.push_back({file, origin, dot(origin, normal)});
  }
  std::sort(slices.begin(), slices.end(),
            [](const Slice& a, const Slice& b) { return a.depth_mm < b.depth_mm; });
  const double step = volume::slice_distance(folder, slices, normal);
  set_spacing(folder, options, in_file, {pixel[0], pixel[1], step}, volume);
  volume.origin_mm = slices.front().origin_mm;

  guarded(folder, [&] { volume.values.reserve(volume.grid.voxel_count()); });
  for (const Slice& slice : slices) {
    open(slice.file, *io);
    read_voxels(slice.file, *io, volume.values);
    quiet.refuse_if_missing(slice.file);
  }
  set_range(folder, volume);
  set_frame(folder, x, y, normal, volume);
  return volume;
}

}  // namespace

SourceVolume read_volume(const fs::path& path, const ReadOptions& options) {
  itk::Object::GlobalWarningDisplayOff();  // what it warns of is refused or fine
  if (!fs::exists(path)) {
    throw SceneError(path.string() + ": no such file or folder; check the path");
  }
  if (fs::is_directory(path)) return read_dicom_series(path, options);
  const std::string name = lower(path.filename().string());
  const auto ends_in = [&](const char* end) { return name.ends_with(end); };
  if (ends_in(".nrrd") || ends_in(".nhdr")) {
    return read_one_file(path, *itk::NrrdImageIO::New(), read_nrrd_header(path), options);
  }
  if (ends_in(".mha") || ends_in(".mhd")) {
    return read_one_file(path, *itk::MetaImageIO::New(), read_meta_header(path), options);
  }
  if (ends_in(".nii") || ends_in(".nii.gz")) {
    return read_one_file(path, *itk::NiftiImageIO::New(), read_nifti_header(path), options);
  }
  if (ends_in(".dcm")) return read_dicom_file(path, options);
  if (ends_in(".raw")) {
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
  throw SceneError(path.string() +
                   ": not a kind of volume that kerf reads; use .nrrd .nhdr .mha .mhd .nii .nii.gz "
                   ".dcm or a folder with a DICOM series");
}

void read_labels_beside(const fs::path& volume_path, VolumeImage& image) {
  const fs::path path = labels_path(volume_path);
  if (!fs::exists(path)) return;
  ReadOptions options;
  options.allow_missing_spacing = true;
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
