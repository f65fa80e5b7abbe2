// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/foreign_volume.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <new>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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
#include "controller/volume/volume_limits.hpp"
#include "controller/volume/volume_source.hpp"

// The only file that includes ITK. Its readers are driven one level below itk::Image, so that each
// size is checked before memory is taken, and no type is instantiated twelve times.

#ifdef KERF_SANITIZED
// NrrdIO and MetaIO forget memory where they refuse a file; that is their own to mend.
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libITKNrrdIO\nleak:libITKMetaIO\n";
}
#endif

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

using ImageIo = itk::ImageIOBase;
using Offer = std::function<std::span<std::byte>(const VolumeClaim&)>;

[[noreturn]] void refuse_unreadable(const fs::path& path, const std::string& reason) {
  throw SceneError(path.string() + ": cannot be read (" + last_line(reason) +
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
    throw;  // the sandbox knows how much there was
  } catch (const SceneError&) {
    throw;
  } catch (const std::exception& error) {
    refuse_unreadable(path, error.what());
  }
}

/// Values of one type to floats, in order; the begin of `to` may lie in `from`, not after it.
template <class T>
void convert(std::span<const std::byte> from, std::span<std::byte> to) {
  constexpr std::size_t kBlock = 1024;
  std::array<T, kBlock> values;
  std::array<float, kBlock> floats;
  for (std::size_t left = std::min(from.size() / sizeof(T), to.size() / sizeof(float)); left > 0;) {
    const std::size_t count = std::min(left, kBlock);
    std::memcpy(values.data(), from.data(), count * sizeof(T));
    std::transform(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count),
                   floats.begin(), [](T value) { return static_cast<float>(value); });
    std::memcpy(to.data(), floats.data(), count * sizeof(float));
    from = from.subspan(count * sizeof(T));
    to = to.subspan(count * sizeof(float));
    left -= count;
  }
}

struct Kind {
  ImageIo::IOComponentEnum type;
  void (*convert)(std::span<const std::byte>, std::span<std::byte>);
};
constexpr std::array<Kind, 12> kKinds{{{ImageIo::UCHAR, convert<unsigned char>},
                                       {ImageIo::CHAR, convert<signed char>},
                                       {ImageIo::USHORT, convert<unsigned short>},
                                       {ImageIo::SHORT, convert<short>},
                                       {ImageIo::UINT, convert<unsigned int>},
                                       {ImageIo::INT, convert<int>},
                                       {ImageIo::ULONG, convert<unsigned long>},
                                       {ImageIo::LONG, convert<long>},
                                       {ImageIo::ULONGLONG, convert<unsigned long long>},
                                       {ImageIo::LONGLONG, convert<long long>},
                                       {ImageIo::FLOAT, convert<float>},
                                       {ImageIo::DOUBLE, convert<double>}}};

void check_type(const fs::path& path, ImageIo::IOComponentEnum type) {
  if (std::ranges::find(kKinds, type, &Kind::type) != kKinds.end()) return;
  throw SceneError(path.string() + ": " + ImageIo::GetComponentTypeAsString(type) +
                   " voxels; save it as integers of 8..32 bits or as floats");
}

/// As many as `from` holds and `to` has room for.
void to_floats(const fs::path& path, ImageIo::IOComponentEnum type, std::span<const std::byte> from,
               std::span<std::byte> to) {
  check_type(path, type);
  std::ranges::find(kKinds, type, &Kind::type)->convert(from, to);
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

/// Reads all voxels of the opened file, as they are there, into `bytes`.
void read_voxels(const fs::path& path, ImageIo& io, std::span<std::byte> bytes) {
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned i = 0; i < io.GetNumberOfDimensions(); ++i) {
    region.SetIndex(i, 0);
    region.SetSize(i, io.GetDimensions(i));
  }
  io.SetIORegion(region);
  guarded(path, [&] { io.Read(bytes.data()); });
}

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

/// Column `axis` of the direction matrix: the way that axis points.
Place axis_of(const ImageIo& io, unsigned axis) {
  const std::vector<double> d = io.GetDirection(axis);
  return {d[0], d[1], d[2]};
}

VolumeClaim claim_of(const ImageIo& io, const std::array<std::int64_t, 3>& size, bool has_spacing) {
  VolumeClaim claim;
  claim.size = size;
  claim.voxel_bytes = static_cast<std::uint32_t>(io.GetComponentSize());
  claim.has_spacing = has_spacing ? 1 : 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    claim.spacing_mm[axis] = io.GetSpacing(axis);
    claim.origin_mm[axis] = io.GetOrigin(axis);
    claim.axes[axis] = axis_of(io, axis);
  }
  return claim;
}

void read_one_file(const fs::path& path, ImageIo& io, const VolumeHeader& header,
                   const Offer& offer) {
  const Quiet quiet;
  const std::array<std::int64_t, 3> size = open(path, io);
  check_grid(path.string(), size[0], size[1], size[2]);
  const auto bytes = static_cast<std::uint64_t>(io.GetImageSizeInBytes());
  if (header.data_bytes_at_most < bytes) {
    refuse_truncated(header.data_file, header.data_bytes_at_most, bytes);
  }
  check_type(path, io.GetComponentType());
  const std::span<std::byte> memory = offer(claim_of(io, size, header.has_spacing));
  // The file's own voxels fill the end of the memory, their values then its begin.
  const std::span<std::byte> own = memory.last(bytes);
  if (header.leaves_out) {
    read_all_voxels(path, io, own);
  } else {
    read_voxels(path, io, own);
  }
  quiet.refuse_if_missing(path);
  to_floats(path, io.GetComponentType(), own, memory);
}

/// The value of a tag on the first level of the file.
std::optional<std::string> value_of(const itk::GDCMImageIO& io, const char* tag) {
  std::string text;
  const bool there = itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), tag, text);
  return there ? std::optional(text) : std::nullopt;
}

constexpr const char* kPixelSpacing = "0028|0030";

/// GDCM fills in 1 mm where a file names no spacing between pixels, none that is a number, or only
/// one that its kind of image does not go by, such as a CT's at the detector (0018|1164). What no
/// tag of the file's first level tells may come from deeper in it.
bool names_spacing(const itk::GDCMImageIO& io) {
  const bool may_be_filled_in = io.GetSpacing(0) == 1.0 && io.GetSpacing(1) == 1.0;
  for (const char* tag : {kPixelSpacing, "0018|1164"}) {
    const auto text = value_of(io, tag);
    if (!text) continue;
    const std::vector<double> told = dicom_distances(*text);
    return told.size() == 2 && (!may_be_filled_in || told == std::vector{1.0, 1.0});
  }
  return !may_be_filled_in;
}

/// The same of the slices of one file: where its pixels' spacing is on the first level, theirs is.
bool names_slice_distance(const itk::GDCMImageIO& io) {
  if (!value_of(io, kPixelSpacing) || io.GetSpacing(2) != 1.0) return true;
  return dicom_distances(value_of(io, "0018|0088").value_or("")) == std::vector{1.0};
}

void read_dicom_file(const fs::path& path, const Offer& offer) {
  const auto io = itk::GDCMImageIO::New();
  VolumeHeader header;
  {
    const Quiet quiet;
    if (open(path, *io)[2] == 1) {
      throw SceneError(path.string() +
                       ": one slice; name the folder that holds the whole DICOM series");
    }
    header.has_spacing = names_spacing(*io) && names_slice_distance(*io);
  }
  read_one_file(path, *io, header, offer);
}

/// The DICOM images among `files`, which must be of one series.
std::vector<fs::path> series_files(const fs::path& folder, const std::vector<fs::path>& files,
                                   SandboxReader& sandbox, const Quiet& quiet) {
  std::vector<fs::path> images;
  std::set<std::string> series;
  for (const fs::path& file : files) {
    const auto io = itk::GDCMImageIO::New();
    sandbox.at(file.string());
    if (!guarded(file, [&] { return io->CanReadFile(file.c_str()); })) continue;
    open(file, *io);
    quiet.refuse_if_missing(file);
    std::string uid;
    itk::ExposeMetaData<std::string>(io->GetMetaDataDictionary(), "0020|000e", uid);
    series.insert(uid);
    images.push_back(file);
  }
  sandbox.at(folder.string());
  if (images.empty()) {
    throw SceneError(folder.string() +
                     ": no DICOM series in this folder; name a volume file or another folder");
  }
  if (series.size() > 1) {
    throw SceneError(folder.string() + ": " + std::to_string(series.size()) +
                     " DICOM series in one folder; move the wanted one into its own");
  }
  return images;
}

void read_dicom_series(const fs::path& folder, const std::vector<fs::path>& beside,
                       SandboxReader& sandbox, const Offer& offer) {
  const Quiet quiet;
  const std::vector<fs::path> files = series_files(folder, beside, sandbox, quiet);
  if (files.size() == 1) return read_dicom_file(files.front(), offer);

  const auto io = itk::GDCMImageIO::New();
  const std::array<std::int64_t, 3> size = open(files.front(), *io);
  const auto layers = static_cast<std::int64_t>(files.size());
  const bool in_file = names_spacing(*io);
  VolumeClaim claim = claim_of(*io, {size[0], size[1], layers}, in_file);
  const Place x = claim.axes[0], y = claim.axes[1];
  const Place normal = cross(x, y);
  // What no tag names is a guess, and differs from one time to the next.
  const auto same_spacing = [&] {
    return names_spacing(*io) == in_file &&
           (!in_file ||
            (io->GetSpacing(0) == claim.spacing_mm[0] && io->GetSpacing(1) == claim.spacing_mm[1]));
  };

  std::vector<Slice> slices;
  for (const fs::path& file : files) {
    sandbox.at(file.string());
    const bool same = open(file, *io) == size && size[2] == 1 && axis_of(*io, 0) == x &&
                      axis_of(*io, 1) == y && same_spacing();
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
  claim.spacing_mm[2] = slice_distance(folder, slices, normal);
  claim.origin_mm = slices.front().origin_mm;
  claim.axes[2] = normal;
  claim.voxel_bytes = sizeof(float);  // a slice is small, so each is read apart

  std::span<std::byte> rest = offer(claim);
  const std::size_t values = static_cast<std::size_t>(size[0] * size[1]) * sizeof(float);
  std::vector<std::byte> own;
  for (const Slice& slice : slices) {
    sandbox.at(slice.file.string());
    open(slice.file, *io);
    own.resize(static_cast<std::size_t>(io->GetImageSizeInBytes()));
    read_voxels(slice.file, *io, own);
    quiet.refuse_if_missing(slice.file);
    to_floats(slice.file, io->GetComponentType(), own, rest.first(values));
    rest = rest.subspan(values);
  }
}

}  // namespace

void read_foreign_volume(const fs::path& path, VolumeKind kind, const std::vector<fs::path>& folder,
                         SandboxReader& sandbox) {
  itk::Object::GlobalWarningDisplayOff();  // what it warns of is refused or fine
  const Offer offer = [&](const VolumeClaim& claim) {
    return sandbox.offer(std::as_bytes(std::span(&claim, 1)));
  };
  switch (kind) {
    case VolumeKind::nrrd:
      return read_one_file(path, *itk::NrrdImageIO::New(), read_nrrd_header(path), offer);
    case VolumeKind::meta:
      return read_one_file(path, *itk::MetaImageIO::New(), read_meta_header(path), offer);
    case VolumeKind::nifti:
      return read_one_file(path, *itk::NiftiImageIO::New(), read_nifti_header(path), offer);
    case VolumeKind::dicom_file:
      return read_dicom_file(path, offer);
    case VolumeKind::dicom_series:
      return read_dicom_series(path, folder, sandbox, offer);
  }
}

}  // namespace kerf::volume
