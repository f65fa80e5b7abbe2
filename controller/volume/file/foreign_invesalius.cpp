// SPDX-License-Identifier: Apache-2.0
// A project of InVesalius 3 (.inv3): a tar file, packed by gzip or not, with a property list
// `main.plist` (XML) and a matrix of voxels. As its source writes them: invesalius/project.py
// (SavePlistProject, Compress) and invesalius/data/imagedata_utils.py (dcm2memmap, img2memmap).
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <archive.h>
#include <archive_entry.h>
#include <expat.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
using vec3::Vec, vec3::cross, vec3::length;
using vec3::operator-, vec3::operator*;
namespace {

[[noreturn]] void refuse(const fs::path& path, const std::string& what) {
  throw LoadError(path.string() + ": " + what);
}

/// The tar file, read from its begin to its end through zlib, which checks the checksum of what is
/// packed.
class Archive {
 public:
  explicit Archive(const fs::path& path)
      : path_(path),
        file_(gzopen(path.c_str(), "rb")),
        archive_(archive_read_new(), archive_read_free) {
    archive_read_support_format_tar(archive_.get());
    if (!file_ || archive_read_open(archive_.get(), this, nullptr, next_block, nullptr) != 0) {
      refuse_broken();
    }
  }

  /// Goes on to the next regular file; none at the end.
  std::optional<std::string> next_file() {
    archive_entry* entry = nullptr;
    for (;;) {
      const int result = archive_read_next_header(archive_.get(), &entry);
      if (result == ARCHIVE_EOF) break;
      if (result < ARCHIVE_WARN) refuse_broken();
      if (archive_entry_filetype(entry) != AE_IFREG) continue;
      size_ = archive_entry_size(entry);
      const char* const name = archive_entry_pathname(entry);
      return name == nullptr ? "" : name;
    }
    while (next_block(archive_.get(), this, &rest_) > 0) {  // the checksum is at the end
    }
    if (is_broken_) refuse_broken();
    return std::nullopt;
  }
  [[nodiscard]] std::int64_t size() const { return size_; }

  /// Fills `bytes` from the file.
  void read(std::span<std::byte> bytes) {
    while (!bytes.empty()) {
      const auto got = archive_read_data(archive_.get(), bytes.data(), bytes.size());
      if (got <= 0) refuse_broken();
      bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
  }

 private:
  [[noreturn]] void refuse_broken() const {
    refuse(path_,
           "no whole InVesalius project (a tar file, packed by gzip or not); copy the file again");
  }
  static la_ssize_t next_block(archive* of, void* self, const void** block) {
    auto& me = *static_cast<Archive*>(self);
    *block = me.block_.data();
    const int got =
        gzread(me.file_.get(), me.block_.data(), static_cast<unsigned>(me.block_.size()));
    int fault = Z_OK;
    gzerror(me.file_.get(), &fault);
    if (got >= 0 && fault == Z_OK) return got;
    me.is_broken_ = true;
    archive_set_error(of, -1, "broken");
    return -1;
  }

  const fs::path& path_;
  std::vector<char> block_ = std::vector<char>(std::size_t{64} << 10);
  GzFile file_;
  std::unique_ptr<archive, int (*)(archive*)> archive_;
  std::int64_t size_ = 0;
  const void* rest_ = nullptr;
  bool is_broken_ = false;
};

/// The texts of a property list, by the keys on the way to each, with a slash between; those of an
/// array are in the order of the array.
class PropertyList {
 public:
  PropertyList(const fs::path& path, std::string_view xml) : path_(path) {
    const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                         XML_ParserFree);
    XML_SetUserData(parser.get(), this);
    XML_SetElementHandler(
        parser.get(),
        [](void* self, const XML_Char* name, const XML_Char**) {
          static_cast<PropertyList*>(self)->begin(name);
        },
        [](void* self, const XML_Char* name) { static_cast<PropertyList*>(self)->end(name); });
    XML_SetCharacterDataHandler(parser.get(), [](void* self, const XML_Char* text, int count) {
      static_cast<PropertyList*>(self)->text_.append(text, static_cast<std::size_t>(count));
    });
    const XML_Status status =
        XML_Parse(parser.get(), xml.data(), static_cast<int>(xml.size()), XML_TRUE);
    if (status == XML_STATUS_OK) return;
    refuse(path, std::string("its main.plist is no XML (") +
                     XML_ErrorString(XML_GetErrorCode(parser.get())) + "); copy the file again");
  }

  /// All texts of a key; empty if it is not there.
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const {
    const auto found = values_.find("/" + key);
    return found == values_.end() ? std::vector<std::string>{} : found->second;
  }
  /// That of a key with one.
  [[nodiscard]] std::string text(const std::string& key) const {
    const std::vector<std::string> all = texts(key);
    return all.size() == 1 ? all.front() : std::string();
  }
  /// The numbers of a key; none if it is not there, or empty as `affine` often is. Refuses others
  /// than `count` of them.
  [[nodiscard]] std::vector<double> numbers(const std::string& key, std::size_t count) const {
    std::vector<double> values;
    const std::vector<std::string> all = texts(key);
    for (const std::string& text : all) {
      if (const auto value = number_in(text)) values.push_back(*value);
    }
    const bool absent = all.empty() || (all.size() == 1 && all.front().empty());
    if (!absent && (all.size() != count || values.size() != count)) {
      refuse(path_, "its " + key + " has not " + std::to_string(count) +
                        " numbers; save the project again");
    }
    return values;
  }

 private:
  static bool holds_others(std::string_view name) { return name == "dict" || name == "array"; }

  void begin(std::string_view name) {
    text_.clear();
    if (holds_others(name)) before_.push_back(way_.size());
  }
  void end(std::string_view name) {
    if (name == "plist") return;
    if (holds_others(name)) {
      way_.resize(before_.back());
      before_.pop_back();
    } else if (name == "key") {
      way_.resize(before_.empty() ? 0 : before_.back());
      way_ += "/" + text_;
    } else {
      values_[way_].push_back(text_);
    }
  }

  const fs::path& path_;
  std::map<std::string, std::vector<std::string>> values_;
  std::string way_, text_;
  std::vector<std::size_t> before_;  ///< for each open dict and array: length of the way to it
};

/// The property list of the project, and the folder of its files. Reads the archive whole.
std::string read_plist(const fs::path& path, std::string& folder) {
  constexpr std::int64_t kMostBytes = 1 << 20;
  constexpr std::string_view kName = "main.plist";
  std::optional<std::string> xml;
  Archive archive(path);
  while (const auto name = archive.next_file()) {
    if (*name != kName && !name->ends_with("/" + std::string(kName))) continue;
    if (xml) refuse(path, "holds two main.plist; save the project again");
    if (archive.size() > kMostBytes)
      refuse(path, "its main.plist is above 1 MiB; is it a project?");
    xml.emplace(static_cast<std::size_t>(archive.size()), '\0');
    archive.read(std::as_writable_bytes(std::span(*xml)));
    folder = name->substr(0, name->size() - kName.size());
  }
  if (!xml) refuse(path, "holds no main.plist; is it an InVesalius project?");
  return *xml;
}

/// Direction and origin of the matrix in LPS. The y axis of InVesalius' matrix goes against the
/// rows of a picture, so the matrix is left-handed.
///
/// `affine` is there for an import of NIfTI: p = affine (x, y, z, 1) with RAS x, y, z gives the mm
/// in the matrix, y counted from its last row (convert_invesalius_to_world). Otherwise the slices
/// are those of DICOM, whose row and column directions newer versions keep as
/// `patient_orientation`; if it is missing they are taken to be those of `orientation`, 1 axial, 2
/// coronal, 3 sagittal, as for the cube in InVesalius' window.
void set_frame(const fs::path& path, const PropertyList& project, UntrustedHeader& claim) {
  const std::vector<double> a = project.numbers("affine", 16);
  if (!a.empty()) {
    const Vec rows[] = {{a[0], a[1], a[2]}, {a[4], a[5], a[6]}, {a[8], a[9], a[10]}};
    if (a[12] != 0 || a[13] != 0 || a[14] != 0 || a[15] != 1 || claim.spacing_known != kAllAxes) {
      refuse(path, "its affine is no rigid transform of known spacing; save the project again");
    }
    const double height_mm = static_cast<double>(claim.size[1] - 1) * claim.spacing_mm[1];
    const Vec from{-a[3], height_mm - a[7], -a[11]};  // inverse of a rotation: its transpose
    for (std::size_t i = 0; i < 3; ++i) {
      const double lps = i < 2 ? -1 : 1;
      claim.axes[0][i] = lps * rows[0][i];
      claim.axes[1][i] = -lps * rows[1][i];
      claim.axes[2][i] = lps * rows[2][i];
      claim.origin_mm[i] =
          lps * (from[0] * rows[0][i] + from[1] * rows[1][i] + from[2] * rows[2][i]);
    }
    return;
  }
  const std::string orientation = project.text("orientation");
  const bool coronal = orientation == "2", sagittal = orientation == "3";
  if (orientation != "1" && !coronal && !sagittal) {
    refuse(path, "its orientation is '" + one_line(orientation) +
                     "', not 1 (axial), 2 (coronal) or 3 (sagittal); save the project again");
  }
  Vec row = sagittal ? Vec{0, 1, 0} : Vec{1, 0, 0};
  Vec column = coronal || sagittal ? Vec{0, 0, -1} : Vec{0, 1, 0};
  const std::vector<double> told = project.numbers("patient_orientation", 6);
  if (!told.empty()) {
    row = {told[0], told[1], told[2]};
    column = {told[3], told[4], told[5]};
  }
  const Vec normal = cross(row, column);
  claim.axes = coronal    ? std::array{row, -1.0 * normal, -1.0 * column}
               : sagittal ? std::array{normal, row, -1.0 * column}
                          : std::array{row, -1.0 * column, normal};
  claim.axes_known = told.empty() ? 0 : 1;
  add_note(claim,
           told.empty()
               ? std::string("the project keeps no directions of the patient: they are taken "
                             "from ") +
                     (coronal    ? "coronal"
                      : sagittal ? "sagittal"
                                 : "axial") +
                     " DICOM slices of a patient on the back" +
                     (project.text("modality") == "UNKNOWN"
                          ? ", although it was made of pictures: left and right may be changed"
                          : "")
               : "the project keeps no position: the first voxel is at 0 0 0 mm");
}

VoxelType type_of(const fs::path& path, const std::string& word) {
  const auto found = std::ranges::find(kVoxelTypeWords, word);
  if (found == std::end(kVoxelTypeWords)) {
    refuse(path, "its matrix is of '" + one_line(word) + "' numbers; save the project again");
  }
  return static_cast<VoxelType>(found - std::begin(kVoxelTypeWords));
}

}  // namespace

void read_invesalius(const fs::path& path, const MemoryRequest& offer) {
  std::string folder;
  const PropertyList project(path, read_plist(path, folder));
  UntrustedHeader claim;
  const std::vector<double> shape = project.numbers("matrix/shape", 3);
  if (shape.empty()) refuse(path, "its matrix has no shape of three; save the project again");
  for (std::size_t axis = 0; axis < 3; ++axis) {  // z, y, x in the file
    const double count = shape[2 - axis];
    if (count != static_cast<double>(static_cast<std::int32_t>(std::clamp(count, 0.0, 1e9)))) {
      refuse(path, "its matrix has " + number_text(count) + " voxels along an axis; save it again");
    }
    claim.size[axis] = static_cast<std::int64_t>(count);
  }
  check_grid(path.string(), claim.size[0], claim.size[1], claim.size[2]);
  const std::vector<double> spacing = project.numbers("spacing", 3);
  claim.spacing_known = 0;
  for (std::size_t axis = 0; axis < spacing.size(); ++axis) {
    if (spacing[axis] == 0) continue;  // it writes 0 if DICOM had none
    claim.spacing_mm[axis] = spacing[axis];
    claim.spacing_known |= 1U << axis;
  }
  const VoxelType type = type_of(path, project.text("matrix/dtype"));
  claim.kind = kind_of(type);
  claim.voxel_bytes = static_cast<std::uint32_t>(bytes_of(type));
  const auto wanted =
      static_cast<std::uint64_t>(claim.size[0] * claim.size[1] * claim.size[2]) * bytes_of(type);
  set_frame(path, project, claim);
  const std::string version = project.text("active_image_version");
  if (!version.empty() && version != "original") {
    add_note(claim, "the original image is read, not the version '" + one_line(version) + "'");
  }

  const std::string matrix = folder + project.text("matrix/filename");
  Archive archive(path);
  for (;;) {
    const auto name = archive.next_file();
    if (!name) refuse(path, "its matrix '" + one_line(matrix) + "' is missing; save it again");
    if (*name == matrix) break;
  }
  const auto held = static_cast<std::uint64_t>(std::max<std::int64_t>(archive.size(), 0));
  if (held < wanted) refuse_truncated(path.string(), held, wanted);
  if (held > wanted) {
    refuse(path, "its matrix has " + std::to_string(held) + " bytes where its shape asks for " +
                     std::to_string(wanted) + "; save it again");
  }
  const std::span<std::byte> memory = offer(claim);
  const std::span<std::byte> own = memory.last(wanted);
  archive.read(own);
  convert_values(type, own, claim.kind, memory);
}

}  // namespace kerf::volume
