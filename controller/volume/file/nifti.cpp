// SPDX-License-Identifier: Apache-2.0
// NIfTI-1 and -2, in one file or as header and voxels apart (.hdr, .img), packed or not. The
// headers are read here and not by niftilib: it prints, replaces NaN by 0 and hides which fields
// were unset.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <optional>
#include <string>

#include <nifti/nifti1.h>
#include <nifti/nifti2.h>
#include <zlib.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/file/voxel_files.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

using Three = vec3::Vec;

/// The fields that are used, of either version, in this machine's byte order. Their names and
/// meanings are those of nifti1.h.
struct Nifti {
  bool swapped = false;               ///< the file has the other byte order
  bool pair = false;                  ///< the voxels are in a file of their own
  bool extended = false;              ///< an extension follows the header
  std::int64_t least_offset = 0;      ///< where the voxels of a single file can begin
  std::array<std::int64_t, 8> dim{};  ///< dim[0] is the number of axes
  std::array<double, 4> pixdim{};     ///< pixdim[0] is qfac
  std::int64_t datatype = 0, bitpix = 0, units = 0, qform_code = 0, sform_code = 0;
  double vox_offset = 0;
  Scaling scaling;
  Three quatern{}, qoffset{};
  std::array<std::array<double, 4>, 3> srow{};
};

template <class Raw>
Nifti fields_of(const Raw& raw, bool swapped) {
  const auto field = [&]<class T>(T value) {
    if (!swapped) return value;
    auto bytes = std::bit_cast<std::array<unsigned char, sizeof(T)>>(value);
    std::ranges::reverse(bytes);
    return std::bit_cast<T>(bytes);
  };
  const auto number = [&](auto value) { return static_cast<double>(field(value)); };
  Nifti h;
  h.swapped = swapped;
  h.pair = raw.magic[1] == 'i';
  h.least_offset = sizeof raw + 4;
  for (std::size_t i = 0; i < 8; ++i) h.dim[i] = field(raw.dim[i]);
  for (std::size_t i = 0; i < 4; ++i) h.pixdim[i] = number(raw.pixdim[i]);
  h.datatype = field(raw.datatype);
  h.bitpix = field(raw.bitpix);
  h.units = field(raw.xyzt_units) & 7;  // the other bits are the unit of time
  h.qform_code = field(raw.qform_code);
  h.sform_code = field(raw.sform_code);
  h.vox_offset = number(raw.vox_offset);
  h.scaling = {number(raw.scl_slope), number(raw.scl_inter)};
  h.quatern = {number(raw.quatern_b), number(raw.quatern_c), number(raw.quatern_d)};
  h.qoffset = {number(raw.qoffset_x), number(raw.qoffset_y), number(raw.qoffset_z)};
  for (std::size_t i = 0; i < 4; ++i) {
    h.srow[0][i] = number(raw.srow_x[i]);
    h.srow[1][i] = number(raw.srow_y[i]);
    h.srow[2][i] = number(raw.srow_z[i]);
  }
  return h;
}

[[noreturn]] void refuse_header(const fs::path& path, const std::string& what,
                                const std::string& way_out = "correct the header") {
  kerf::refuse(path.string(), ": " + what + "; " + way_out);
}

Nifti read_header(const fs::path& path) {
  static_assert(sizeof(nifti_1_header) == 348 && sizeof(nifti_2_header) == 540);
  const GzFile file(gzopen(path.c_str(), "rb"));
  if (!file) refuse_header(path, "cannot be opened", "check that it is there, and its permissions");
  std::array<char, sizeof(nifti_2_header) + 4> bytes{};
  const int got = gzread(file.get(), bytes.data(), bytes.size());
  if (got < 0) refuse_unreadable(path, "its packed bytes are broken");
  const auto as = [&]<class Raw>(Raw raw) -> std::optional<Nifti> {
    std::memcpy(&raw, bytes.data(), sizeof raw);
    constexpr auto kSize = static_cast<std::int32_t>(sizeof raw);
    const bool swapped = raw.sizeof_hdr == static_cast<std::int32_t>(__builtin_bswap32(kSize));
    if (got < kSize || (!swapped && raw.sizeof_hdr != kSize)) return {};
    const std::string magic(raw.magic, 3), version = std::to_string(kSize == 348 ? 1 : 2);
    if (magic != "n+" + version && magic != "ni" + version) {
      refuse_header(path, "has no magic word of NIfTI, so it is Analyze 7.5 or broken",
                    "convert it to NIfTI with a program that knows its left and right");
    }
    Nifti h = fields_of(raw, swapped);
    h.extended = bytes[sizeof raw] != 0 && got > kSize;
    return h;
  };
  if (auto h = as(nifti_1_header{})) return *h;
  if (auto h = as(nifti_2_header{})) return *h;
  refuse_unreadable(path, "no NIfTI header");
}

VoxelType type_in(const fs::path& path, const Nifti& h) {
  struct Type {
    std::int64_t code;
    VoxelType type;
  };
  constexpr Type kTypes[] = {{DT_UINT8, VoxelType::uint8},     {DT_INT8, VoxelType::int8},
                             {DT_UINT16, VoxelType::uint16},   {DT_INT16, VoxelType::int16},
                             {DT_UINT32, VoxelType::uint32},   {DT_INT32, VoxelType::int32},
                             {DT_UINT64, VoxelType::uint64},   {DT_INT64, VoxelType::int64},
                             {DT_FLOAT32, VoxelType::float32}, {DT_FLOAT64, VoxelType::float64}};
  constexpr std::pair<std::int64_t, const char*> kOthers[] = {
      {DT_BINARY, "bits"},           {DT_RGB24, "colours"},      {DT_RGBA32, "colours"},
      {DT_COMPLEX64, "complex"},     {DT_COMPLEX128, "complex"}, {DT_COMPLEX256, "complex"},
      {DT_FLOAT128, "128-bit float"}};
  const auto* const known = std::ranges::find(kTypes, h.datatype, &Type::code);
  if (known != std::end(kTypes) &&
      h.bitpix == static_cast<std::int64_t>(8 * bytes_of(known->type))) {
    return known->type;
  }
  const auto* const other =
      std::ranges::find(kOthers, h.datatype, [](const auto& row) { return row.first; });
  refuse_header(
      path,
      "voxels of type " + std::to_string(h.datatype) +
          (other == std::end(kOthers) ? "" : std::string(", ") + other->second) + ", of " +
          std::to_string(h.bitpix) + " bits each",
      "save it as one grey value per voxel, integers of 8..64 bits or floats of 32 or 64");
}

void check_axes(const fs::path& path, const Nifti& h) {
  if (h.dim[0] < 3 || h.dim[0] > 7) {
    refuse_header(path, std::to_string(h.dim[0]) + " axes", "kerf needs a volume of three");
  }
  check_grid(path.string(), h.dim[1], h.dim[2], h.dim[3]);
  for (std::size_t axis = 4; axis <= static_cast<std::size_t>(h.dim[0]); ++axis) {
    if (h.dim[axis] <= 1) continue;  // 0 there: unset
    refuse_header(path,
                  std::to_string(h.dim[axis]) +
                      (axis == 4 ? " volumes along axis " : " values per voxel along axis ") +
                      std::to_string(axis),
                  "save one of them as a separate file");
  }
}

/// Positions of the voxels in the header's unit, in RAS as NIfTI has them: an edge of a voxel along
/// each axis, and the centre of the first.
struct Placing {
  std::array<Three, 3> edges{};
  Three origin{};
};

using vec3::length, vec3::operator+, vec3::operator-, vec3::operator*;

/// Method 3 of nifti1.h.
Placing sform_of(const fs::path& path, const Nifti& h) {
  Placing at;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t axis = 0; axis < 3; ++axis) at.edges[axis][r] = h.srow[r][axis];
    at.origin[r] = h.srow[r][3];
  }
  for (const Three& edge : at.edges) {
    if (length(edge) > 0 && std::isfinite(length(edge))) continue;
    refuse_header(path, "its sform has an axis without length",
                  "correct it, or set sform_code to 0");
  }
  return at;
}

/// Spacings as positive numbers; 1 for those that are 0, which is unset.
Three spacings_of(const fs::path& path, const Nifti& h) {
  Three edges{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double edge = h.pixdim[axis + 1];
    if (!std::isfinite(edge) || edge < 0) {
      refuse_header(path, "pixdim[" + std::to_string(axis + 1) + "] = " + short_text(edge) +
                              " is no spacing, which is positive");
    }
    edges[axis] = edge == 0 ? 1 : edge;
  }
  return edges;
}

/// By how much b^2 + c^2 + d^2 is above 1; the rotation's cosine a would be a root of a negative.
double quaternion_excess(const Nifti& h) {
  const auto [b, c, d] = h.quatern;
  return b * b + c * c + d * d - 1;
}

/// The largest excess that rounding makes if a program computes the quaternion in float32 from the
/// entries r of a rotation matrix, as nifti1.h does in double: s = 1 + r11 - (r22 + r33),
/// b = sqrt(s) / 2, c = (r12 + r21) / (4 b), d = (r13 + r31) / (4 b), with b the largest. Let
/// u = 2^-24. The error of s is 3 u from its entries and 8 u from its sums, that of b is
/// e = 11 u / (8 b) + u, that of c is u / b + e c / b + u. So the sum of squares has the error
/// 2 (e / b + (c + d) (u / b + u)), at most 18.1 u at b = c = d = 1 / sqrt(3); rounded up to 20 u.
constexpr double kQuaternionRounding = 10 * std::numeric_limits<float>::epsilon();

/// Method 2 of nifti1.h. A quaternion that rounding has made too long is scaled to length 1.
Placing qform_of(const fs::path& path, const Nifti& h) {
  const auto [b, c, d] = h.quatern;
  const double excess = quaternion_excess(h), qfac = h.pixdim[0];
  if (!(excess <= kQuaternionRounding)) {
    refuse_header(path, "its quaternion (" + short_text(b) + ", " + short_text(c) + ", " +
                            short_text(d) + ") has b^2 + c^2 + d^2 above 1 by " +
                            text_beside(excess, kQuaternionRounding) + ", and rounding reaches " +
                            text_beside(kQuaternionRounding, excess));
  }
  if (!(qfac >= 0) && qfac != -1) {
    refuse_header(path, "pixdim[0] = " + short_text(qfac) + " is neither 1 nor -1");
  }
  const double a = std::sqrt(std::max(-excess, 0.0));
  const double scale = 1 / std::sqrt(1 + std::max(excess, 0.0));
  const Matrix3 turn = rotation_of({scale * b, scale * c, scale * d, scale * a});
  Three edges = spacings_of(path, h);
  if (qfac < 0) edges[2] = -edges[2];
  Placing at{{}, h.qoffset};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at.edges[axis] = edges[axis] * Three{turn[axis], turn[3 + axis], turn[6 + axis]};
  }
  return at;
}

/// Method 1 of nifti1.h, which leaves the orientation open: as nibabel, FSL and SPM take it, in the
/// way of radiologists, with the middle of the volume at the origin.
Placing pixdim_of(const fs::path& path, const Nifti& h) {
  const Three edge = spacings_of(path, h);
  Placing at{{Three{-edge[0], 0, 0}, Three{0, edge[1], 0}, Three{0, 0, edge[2]}}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at.origin = at.origin - (static_cast<double>(h.dim[axis + 1] - 1) / 2) * at.edges[axis];
  }
  return at;
}

/// The largest distance between the positions of a corner of the grid.
double apart(const Nifti& h, const Placing& a, const Placing& b) {
  double most = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Three difference = a.origin - b.origin;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto last = static_cast<double>((corner >> axis & 1) * (h.dim[axis + 1] - 1));
      difference = difference + last * (a.edges[axis] - b.edges[axis]);
    }
    most = std::max(most, length(difference));
  }
  return most;
}

/// With as many digits as make the two differ.
std::string mm_text(const Three& mm, const Three& beside) {
  return text_beside(mm[0], beside[0]) + " " + text_beside(mm[1], beside[1]) + " " +
         text_beside(mm[2], beside[2]) + " mm";
}

double mm_of_unit(const fs::path& path, const Nifti& h, UntrustedHeader& claim) {
  switch (h.units) {
    case NIFTI_UNITS_UNKNOWN:
      add_note(claim, "the header names no unit of length, mm are taken");
      return 1;
    case NIFTI_UNITS_METER:
      return 1000;
    case NIFTI_UNITS_MM:
      return 1;
    case NIFTI_UNITS_MICRON:
      return 1e-3;
    default:
      refuse_header(path, "unit " + std::to_string(h.units) + " of lengths is none of NIfTI");
  }
}

/// Notes a qform that puts voxels elsewhere than the sform, which counts. One that is broken is not
/// used, so it is no fault of the file.
void note_other_place(const fs::path& path, const Nifti& h, const Placing& sform, double unit,
                      UntrustedHeader& claim) {
  try {
    const double mm = unit * apart(h, sform, qform_of(path, h));
    const double edge = *std::ranges::min_element(claim.spacing_mm);
    if (mm <= edge / 2) return;  // each voxel is nearest to its own in the other
    add_note(claim, "its sform counts, which is up to " + short_text(mm) + " mm from its qform");
  } catch (const LoadError&) {
  }
}

/// Sets spacing, origin and axes of the claim, and notes which of the header's ways they follow.
void place(const fs::path& path, const Nifti& h, UntrustedHeader& claim) {
  const auto is_used = [&](const char* name, std::int64_t code) {
    if (code >= 0 && code <= NIFTI_XFORM_TEMPLATE_OTHER) return code > 0;
    refuse_header(path, std::string(name) + " = " + std::to_string(code) + " is none of NIfTI");
  };
  const double unit = mm_of_unit(path, h, claim);
  const bool sform = is_used("sform_code", h.sform_code);
  const bool qform = !sform && is_used("qform_code", h.qform_code);  // else nothing is read of it
  const Placing at = sform ? sform_of(path, h) : qform ? qform_of(path, h) : pixdim_of(path, h);
  Three header_mm{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double edge = length(at.edges[axis]);
    const auto [x, y, z] = (1 / edge) * at.edges[axis];
    claim.axes[axis] = {0.0 - x, 0.0 - y, z};  // RAS to LPS; no -0
    claim.spacing_mm[axis] = unit * edge;
    header_mm[axis] = unit * h.pixdim[axis + 1];
    if (!sform && h.pixdim[axis + 1] == 0) claim.spacing_known &= ~(1U << axis);
  }
  claim.origin_mm = unit * Three{0.0 - at.origin[0], 0.0 - at.origin[1], at.origin[2]};
  claim.axes_known = sform || qform ? 1 : 0;
  // Rounded to float32, from a product of rotation and scale.
  constexpr double kRounding = 8 * std::numeric_limits<float>::epsilon();
  const bool contradicts = std::ranges::any_of(std::array{0U, 1U, 2U}, [&](unsigned axis) {
    const double mm = claim.spacing_mm[axis];
    return header_mm[axis] != 0 && !(std::abs(std::abs(header_mm[axis]) - mm) <= kRounding * mm);
  });
  if (sform && contradicts) {
    add_note(claim, "its sform has a spacing of " + mm_text(claim.spacing_mm, header_mm) +
                        " and counts, its pixdim has " + mm_text(header_mm, claim.spacing_mm));
  }
  constexpr double kStored = std::numeric_limits<float>::epsilon();  // of b, c and d themselves
  if (const double excess = quaternion_excess(h); qform && excess > kStored) {
    add_note(claim, "its quaternion, longer than 1 by rounding (b^2 + c^2 + d^2 = " +
                        text_beside(1 + excess, 1) + "), is scaled to 1");
  }
  if (sform && h.qform_code > 0) note_other_place(path, h, at, unit, claim);
}

/// The other file of a pair, packed if only that is there. `end`: .hdr or .img.
fs::path partner(fs::path path, const char* end) {
  if (lower(path.extension().string()) == ".gz") path.replace_extension();
  path.replace_extension(end);
  const fs::path packed = path.string() + ".gz";
  std::error_code fault;
  return fs::exists(packed, fault) && !fs::exists(path, fault) ? packed : path;
}

/// Where the voxels begin in their file, unpacked.
std::int64_t offset_in(const fs::path& path, const Nifti& h) {
  constexpr double kFarthest = 9e15;  // whole in a double
  const bool whole = h.vox_offset == std::floor(h.vox_offset);
  if (!whole || !(h.vox_offset >= 0 && h.vox_offset < kFarthest)) {
    refuse_header(path, "vox_offset = " + short_text(h.vox_offset) + " is no position in a file");
  }
  const auto offset = static_cast<std::int64_t>(h.vox_offset);
  if (h.pair || offset >= h.least_offset) return offset;
  if (h.extended) {
    refuse_header(
        path, "vox_offset = " + std::to_string(offset) + " lies before the end of its extension");
  }
  return h.least_offset;  // "it is equivalent to 352"
}

/// Whether the file is packed by gzip, whatever its name.
bool is_packed(const fs::path& path) {
  const GzFile file(gzopen(path.c_str(), "rb"));
  return file && gzdirect(file.get()) == 0;
}

}  // namespace

void read_nifti(const fs::path& named, const MemoryRequest& offer) {
  const std::string name = lower(named.string());
  const bool voxels = name.ends_with(".img") || name.ends_with(".img.gz");
  const fs::path path = voxels ? partner(named, ".hdr") : named;
  const Nifti h = read_header(path);
  check_axes(path, h);
  UntrustedHeader claim;
  claim.size = {h.dim[1], h.dim[2], h.dim[3]};
  place(path, h, claim);
  const fs::path data = h.pair ? partner(path, ".img") : path;
  VoxelFiles files;
  files.type = type_in(path, h);
  files.packing = is_packed(data) ? Packing::deflated : Packing::raw;
  files.big_endian = h.swapped == (std::endian::native == std::endian::little);
  // "If scl_slope is nonzero"; one that is no number is unset, as nibabel has it.
  if (h.scaling.slope != 0 && std::isfinite(h.scaling.slope)) files.scaling = h.scaling;
  if (!std::isfinite(files.scaling.intercept)) {
    refuse_header(path, "scl_inter = " + short_text(h.scaling.intercept) + " is no number");
  }
  files.parts = {{.file = data, .bytes = offset_in(path, h)}};
  read_voxel_files(path, files, claim, offer);
}

}  // namespace kerf::volume
