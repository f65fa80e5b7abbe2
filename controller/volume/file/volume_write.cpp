// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <string>
#include <string_view>
#include <system_error>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/gzip_writer.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "the header says little-endian");

/// Shortest text that reads back as the same number.
void append(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(digits.data(), end);
}

void append_vector(std::string& text, double x, double y, double z) {
  text += " (";
  append(text, x);
  text += ',';
  append(text, y);
  text += ',';
  append(text, z);
  text += ')';
}

std::string nrrd_header(const VolumeImage& image, std::string_view type, VolumeEncoding encoding) {
  std::string text = "NRRD0004\n# written by kerf " KERF_VERSION "\ntype: ";
  text += type;
  text += "\ndimension: 3\nspace: left-posterior-superior\nsizes: ";
  text += std::to_string(image.grid.nx) + ' ' + std::to_string(image.grid.ny) + ' ' +
          std::to_string(image.grid.nz) + "\nspace directions:";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double s = image.spacing_mm[axis];
    append_vector(text, image.direction[axis] * s, image.direction[3 + axis] * s,
                  image.direction[6 + axis] * s);
  }
  text += "\nkinds: domain domain domain\nendian: little\nencoding: ";
  text += encoding == VolumeEncoding::gzip ? "gzip" : "raw";
  text += "\nspace origin:";
  append_vector(text, image.origin_mm[0], image.origin_mm[1], image.origin_mm[2]);
  text += "\n\n";
  return text;
}

template <class T>
void write_voxels(AtomicFile& file, const VolumeImage& image, const std::vector<T>& voxels,
                  std::string_view type, VolumeEncoding encoding) {
  const std::string header = nrrd_header(image, type, encoding);
  file.write(header.data(), header.size());
  const std::size_t size = voxels.size() * sizeof(T);
  if (encoding == VolumeEncoding::gzip) {
    constexpr int kLevel = 4;  // near the best size for volumes, at twice the speed
    GzipWriter gzip(file, kLevel);
    gzip.write(voxels.data(), size);
    gzip.finish();
  } else {
    file.write(voxels.data(), size);
  }
  file.close();
}

constexpr std::string_view kLabelsEnd = "-labels";

void check_extension(const fs::path& path) {
  if (path.extension() != ".nrrd") {
    throw LoadError(path.string() + ": kerf writes .nrrd only; give a name that ends in .nrrd");
  }
}

}  // namespace

fs::path labels_path(const fs::path& volume_path) {
  return volume_path.parent_path() /
         (volume_path.stem().string() + std::string(kLabelsEnd) + ".nrrd");
}

void check_volume_path(const fs::path& path) {
  check_extension(path);
  const std::string stem = path.stem().string();
  if (stem.ends_with(kLabelsEnd)) {
    const std::string of = stem.substr(0, stem.size() - kLabelsEnd.size());
    throw LoadError(path.string() + ": is the name of the labels of " + of +
                    ".nrrd; give another one");
  }
  check_new_file(path);
}

void add_volume(const VolumeImage& image, const fs::path& path, VolumeEncoding encoding,
                AtomicFiles& files) {
  check_extension(path);
  write_voxels(files.add(path), image, image.density, "uint16", encoding);
  if (image.labels.empty()) return;
  write_voxels(files.add(labels_path(path)), image, image.labels, "uint8", encoding);
}

void write_volume(const VolumeImage& image, const fs::path& path, VolumeEncoding encoding) {
  AtomicFiles files;
  add_volume(image, path, encoding, files);
  files.commit();
  if (image.labels.empty()) remove_labels(path);
}

void remove_labels(const fs::path& volume_path) {
  std::error_code ignored;  // none there is the usual case
  fs::remove(labels_path(volume_path), ignored);
}

}  // namespace kerf
