// SPDX-License-Identifier: Apache-2.0
// A DICOM file, or the slices of a series in a folder.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/volume/file/foreign_itk.hpp"
// ITK from here on.
#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>

#include "controller/volume/file/volume_image.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
using vec3::Vec, vec3::cross, vec3::dot, vec3::length;
using vec3::operator-, vec3::operator*;
namespace {

/// The value of a tag on the first level of the file.
std::optional<std::string> value_of(const itk::GDCMImageIO& io, const char* tag) {
  std::string text;
  const bool there = itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), tag, text);
  return there ? std::optional(text) : std::nullopt;
}

/// Without the padding to an even length.
std::string trimmed(const std::string& text) {
  constexpr std::string_view kPadding{" \0", 2};
  const std::size_t first = text.find_first_not_of(kPadding);
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(kPadding) + 1 - first);
}

/// The distances in a DICOM value: decimal numbers, finite and above 0, with backslashes between
/// (PS3.5 6.2, DS). None if any part is something else.
std::vector<double> dicom_distances(std::string_view text) {
  constexpr std::string_view kPadding{" \0", 2};  // to an even length
  std::vector<double> distances;
  for (std::size_t next = 0; next != text.npos;) {
    next = text.find('\\');
    std::string_view word = text.substr(0, next);
    if (next != text.npos) text.remove_prefix(next + 1);
    word.remove_prefix(std::min(word.find_first_not_of(kPadding), word.size()));
    word = word.substr(0, word.find_last_not_of(kPadding) + 1);
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto value = number_in(word);
    if (!value || !(*value > 0)) return {};
    distances.push_back(*value);
  }
  return distances;
}

constexpr const char* kPixelSpacing = "0028|0030";

/// GDCM fills in 1 mm if a file has no spacing between pixels, none that is a number, or only one
/// that does not count for its kind of image, such as that of a CT at the detector (0018|1164). A
/// spacing without a tag on the first level of the file may come from deeper in it.
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

/// The same for the slices of one file: their distance is on the same level as the spacing of
/// pixels.
bool names_slice_distance(const itk::GDCMImageIO& io) {
  if (!value_of(io, kPixelSpacing) || io.GetSpacing(2) != 1.0) return true;
  return dicom_distances(value_of(io, "0018|0088").value_or("")) == std::vector{1.0};
}

/// GDCM takes a factor of 0, or one that is no number, for 1.
void refuse_broken_rescale(const fs::path& file, const itk::GDCMImageIO& io) {
  for (const auto& [tag, name] :
       {std::pair{"0028|1053", "RescaleSlope"}, {"0028|1052", "RescaleIntercept"}}) {
    const auto text = value_of(io, tag);
    if (!text || trimmed(*text).empty()) continue;
    const auto value = number_in(trimmed(*text).substr(trimmed(*text).starts_with('+') ? 1 : 0));
    if (value && (*value != 0 || tag == std::string_view("0028|1052"))) continue;
    throw LoadError(file.string() + ": " + name + " " + one_line(trimmed(*text)) +
                    " makes no values; correct the file, or export it again");
  }
}

}  // namespace

void read_dicom_file(const fs::path& path, const MemoryRequest& offer) {
  const auto io = itk::GDCMImageIO::New();
  VolumeHeader header;
  {
    const Quiet quiet;
    if (open_image(path, *io)[2] == 1) {
      throw LoadError(path.string() +
                      ": one slice; name the folder that holds the whole DICOM series");
    }
    refuse_broken_rescale(path, *io);
    header.spacing_known = names_spacing(*io) && names_slice_distance(*io) ? kAllAxes : 0;
  }
  read_one_file(path, *io, header, offer);
}

namespace {

/// One image of a folder, as its header has it.
struct Image {
  fs::path file;
  UntrustedHeader claim;
};

/// Images of one series.
struct Series {
  std::string uid, name;
  std::vector<Image> images;
};

/// The DICOM images among `files`, by their series; those in the order of their numbers.
std::vector<Series> all_series(const std::vector<fs::path>& files, SandboxReader& sandbox,
                               const Quiet& quiet) {
  std::map<std::pair<double, std::string>, Series> found;
  const auto io = itk::GDCMImageIO::New();
  for (const fs::path& file : files) {
    sandbox.at(file.string());
    if (!guarded(file, [&] { return io->CanReadFile(file.c_str()); })) continue;
    const std::array<std::int64_t, 3> size = open_image(file, *io);
    quiet.refuse_if_missing(file);
    refuse_broken_rescale(file, *io);
    const std::string uid = value_of(*io, "0020|000e").value_or("");
    const double number = number_in(trimmed(value_of(*io, "0020|0011").value_or(""))).value_or(0);
    Series& series = found[{number, uid}];
    series.uid = uid;
    series.name = trimmed(value_of(*io, "0008|103e").value_or(""));
    series.images.push_back({file, claim_of(file, *io, size, names_spacing(*io) ? kAllAxes : 0)});
  }
  std::vector<Series> all;
  for (auto& [key, series] : found) all.push_back(std::move(series));
  return all;
}

std::string text_of(const Series& series) {
  const auto& size = series.images.front().claim.size;
  const std::size_t slices = series.images.size();
  return "'" + series.name + "' (" + std::to_string(slices) +
         (slices == 1 ? " slice of " : " slices of ") + std::to_string(size[0]) + " x " +
         std::to_string(size[1]) + ")";
}

/// Index of the wanted series: by its number in the list, or by a part of its name or identifier.
/// Without a word the only one that has more than one slice: the others are overviews.
std::size_t chosen_series(const fs::path& folder, const std::vector<Series>& all,
                          const std::string& wanted) {
  std::vector<std::size_t> fit;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool by_name = all[i].name.find(wanted) != std::string::npos ||
                         all[i].uid.find(wanted) != std::string::npos;
    if (wanted.empty() ? all[i].images.size() > 1 || all.size() == 1
                       : std::to_string(i + 1) == wanted) {
      fit.push_back(i);
    } else if (!wanted.empty() && !number_in(wanted) && by_name) {
      fit.push_back(i);
    }
  }
  if (fit.size() == 1) return fit.front();
  std::string list;
  for (std::size_t i = 0; i < all.size(); ++i) {
    list += (i == 0 ? " " : ", ") + std::to_string(i + 1) + " " + text_of(all[i]);
  }
  throw LoadError(folder.string() + ": " + std::to_string(all.size()) + " DICOM series" +
                  (wanted.empty() ? "" : ", and --series " + wanted + " is not one of them") +
                  "; choose one with ./kerf volume import --series:" + list);
}

/// One slice of a DICOM series and its depth along the normal.
struct Slice {
  fs::path file;
  Vec origin_mm;
  double depth_mm;
};

/// The slices do not follow one another evenly: names the one whose distance to the slice before it
/// is the oddest. Most others are right, so the median is what is usual.
[[noreturn]] void refuse_uneven(const fs::path& folder, const std::vector<Slice>& slices) {
  std::vector<double> apart;
  for (std::size_t i = 1; i < slices.size(); ++i) {
    apart.push_back(slices[i].depth_mm - slices[i - 1].depth_mm);
  }
  std::vector<double> sorted = apart;
  std::ranges::sort(sorted);
  const double usual = sorted[sorted.size() / 2];
  const auto oddest = std::ranges::max_element(
      apart, {}, [&](double distance) { return std::abs(distance - usual); });
  const auto slice = static_cast<std::size_t>(oddest - apart.begin()) + 1;
  std::ostringstream text;
  text << folder.string() << ": " << *oddest << " mm before slice "
       << slices[slice].file.filename().string() << " where " << usual
       << " mm is usual; add the missing slices or remove doubled ones";
  throw LoadError(text.str());
}

/// The common distance along `normal`, mm, of two slices or more in the order of their depths.
/// Refuses gaps and a slanted stack: throws LoadError with `folder` as the place.
double slice_distance(const fs::path& folder, const std::vector<Slice>& slices, const Vec& normal) {
  const double step =
      (slices.back().depth_mm - slices.front().depth_mm) / static_cast<double>(slices.size() - 1);
  const double slack_mm = std::max(0.02 * step, 1e-3);  // positions are rounded in the files
  for (std::size_t i = 1; i < slices.size(); ++i) {
    const Vec apart = slices[i].origin_mm - slices[i - 1].origin_mm;
    const double depth = dot(apart, normal);
    const Vec aside = apart - depth * normal;
    if (std::abs(depth - step) > slack_mm) refuse_uneven(folder, slices);
    if (length(aside) > slack_mm) {
      throw LoadError(folder.string() +
                      ": its axes are not at right angles (tilted gantry); resample it to a "
                      "straight grid first");
    }
  }
  return step;
}

/// Kind of the values of all slices.
constexpr ValueKind common_kind(ValueKind a, ValueKind b) noexcept {
  return a == b ? a : ValueKind::float32;
}

/// The images as one stack: their common properties, and their order in space.
struct Stack {
  UntrustedHeader claim;
  std::vector<Slice> slices;
};

Stack stack_of(const fs::path& folder, const std::vector<Image>& images) {
  const Image& first = images.front();
  Stack stack{first.claim, {}};
  const Vec x = first.claim.axes[0], y = first.claim.axes[1];
  const Vec normal = cross(x, y);
  for (const Image& image : images) {
    const UntrustedHeader& own = image.claim;
    // What no tag names is a guess, and differs from one time to the next.
    const bool same_spacing =
        own.spacing_known == first.claim.spacing_known &&
        (own.spacing_known == 0 || (own.spacing_mm[0] == first.claim.spacing_mm[0] &&
                                    own.spacing_mm[1] == first.claim.spacing_mm[1]));
    if (own.size != first.claim.size || own.size[2] != 1 || own.axes[0] != x || own.axes[1] != y ||
        !same_spacing) {
      throw LoadError(image.file.string() + ": its size, spacing or direction differs from " +
                      first.file.filename().string() + "; keep one stack of slices per folder");
    }
    stack.claim.kind = common_kind(stack.claim.kind, own.kind);
    stack.slices.push_back({image.file, own.origin_mm, dot(own.origin_mm, normal)});
  }
  std::ranges::sort(stack.slices, {}, &Slice::depth_mm);
  stack.claim.size[2] = static_cast<std::int64_t>(images.size());
  stack.claim.spacing_mm[2] = slice_distance(folder, stack.slices, normal);
  stack.claim.origin_mm = stack.slices.front().origin_mm;
  stack.claim.axes[2] = normal;
  // A slice is small, so each is read apart.
  stack.claim.voxel_bytes = static_cast<std::uint32_t>(bytes_of(stack.claim.kind));
  return stack;
}

}  // namespace

void read_dicom_series(const fs::path& folder, const std::vector<fs::path>& beside,
                       const std::string& wanted, SandboxReader& sandbox,
                       const MemoryRequest& offer) {
  const Quiet quiet;
  const std::vector<Series> all = all_series(beside, sandbox, quiet);
  sandbox.at(folder.string());
  if (all.empty()) {
    throw LoadError(folder.string() +
                    ": no DICOM series in this folder; name a volume file or another folder");
  }
  const std::size_t chosen = chosen_series(folder, all, wanted);
  const std::vector<Image>& images = all[chosen].images;
  if (images.size() == 1) return read_dicom_file(images.front().file, offer);

  Stack stack = stack_of(folder, images);
  if (all.size() > 1) {
    add_note(stack.claim, "series " + std::to_string(chosen + 1) + " of " +
                              std::to_string(all.size()) + ", " + text_of(all[chosen]) +
                              " (import --series chooses another)");
  }
  std::span<std::byte> rest = offer(stack.claim);
  const std::size_t bytes = static_cast<std::size_t>(stack.claim.size[0] * stack.claim.size[1]) *
                            bytes_of(stack.claim.kind);
  const auto io = itk::GDCMImageIO::New();
  std::vector<std::byte> own;
  for (const Slice& slice : stack.slices) {
    sandbox.at(slice.file.string());
    static_cast<void>(open_image(slice.file, *io));
    own.resize(static_cast<std::size_t>(io->GetImageSizeInBytes()));
    read_voxels(slice.file, *io, own);
    quiet.refuse_if_missing(slice.file);
    convert_values(type_of(slice.file, *io), own, stack.claim.kind, rest.first(bytes));
    rest = rest.subspan(bytes);
  }
}

}  // namespace kerf::volume
