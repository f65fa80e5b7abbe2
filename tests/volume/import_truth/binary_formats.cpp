// SPDX-License-Identifier: Apache-2.0
// NIfTI (nifti1.h, nifti2.h), TIFF (revision 6.0, BigTIFF), stacks of PNG (ISO 15948) and of TIFF,
// and files without a header.
#include <algorithm>
#include <cmath>
#include <map>

#include <zlib.h>

#include "tests/volume/import_truth/numbered.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::test {
namespace {
using vec3::Vec, vec3::operator*, vec3::operator+, vec3::operator-;

struct Nifti {
  Draw& draw;
  Written out{};
  bool second = false, gzip = false;
  std::vector<std::int64_t> dim{};
  std::array<double, 3> pixdim{};
  double qfac = 1;
  int qform = 0, sform = 1;
  std::array<Vec, 4> srow{};  ///< columns in RAS: the three steps, the origin
  Vec qform_shift_mm{};       ///< of its origin from that of the sform
  double slope = 0, intercept = 0;
  int units = 2, intent = 0;
  std::optional<int> datatype{};  ///< in place of the one of the volume
  std::int64_t offset = 0;        ///< 0: at the end of the header and its extensions
  std::string extension = std::string(4, '\0'), data{};
  std::string name{"a.nii"};
};

Vec ras(const Vec& lps) {
  return {-lps[0], -lps[1], lps[2]};
}

/// The sform of a volume.
void set_frame(Nifti& f) {
  const Numbered& v = f.out.truth;
  for (std::size_t a = 0; a < 3; ++a) f.srow[a] = ras(v.spacing_mm[a] * v.axes[a]);
  f.srow[3] = ras(v.origin_mm);
  f.pixdim = v.spacing_mm;
}

Nifti nifti_file(Draw& draw, VoxelType type) {
  Nifti f{draw, {{}, {}, numbered(draw, type)}};
  f.second = draw.coin();
  f.gzip = draw.coin();
  f.dim = {f.out.truth.size[0], f.out.truth.size[1], f.out.truth.size[2]};
  f.out.truth.digits = 1e-6;  // of float32
  f.units = draw.of({2, 10, 0});
  set_frame(f);
  f.data = f.out.truth.bytes();
  return f;
}

/// The quaternion (b, c, d) of nifti1.h of a rotation with the columns x, y, z in RAS.
Vec quatern(const Vec& x, const Vec& y, const Vec& z) {
  const auto q = quaternion_of({x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]});
  return (q[3] < 0 ? -1.0 : 1.0) * Vec{q[0], q[1], q[2]};
}

void write_nifti(Nifti& f, const TemporaryFolder& folder) {
  const std::endian order = f.out.truth.order;
  std::string header(f.second ? 540 : 348, '\0');
  const auto put = [&](std::size_t at, auto value) {
    const std::string raw = bytes_of(value, order);
    std::ranges::copy(raw, header.begin() + static_cast<std::ptrdiff_t>(at));
  };
  // A field of this offset in NIfTI-1 and -2, of 4 bytes in one and 8 in the other.
  const auto real = [&](std::size_t first, std::size_t second, double value) {
    if (f.second)
      put(second, value);
    else
      put(first, static_cast<float>(value));
  };
  constexpr std::array<std::int16_t, 10> kCodes{2, 256, 512, 4, 768, 8, 1280, 1024, 16, 64};
  put(0, static_cast<std::int32_t>(header.size()));
  for (std::size_t i = 0; i < 8; ++i) {
    const std::int64_t n = i == 0              ? static_cast<std::int64_t>(f.dim.size())
                           : i <= f.dim.size() ? f.dim[i - 1]
                                               : 1;
    if (f.second)
      put(16 + 8 * i, n);
    else
      put(40 + 2 * i, static_cast<std::int16_t>(n));
  }
  const auto type = static_cast<std::int16_t>(
      f.datatype.value_or(kCodes[static_cast<std::size_t>(f.out.truth.type)]));
  put(f.second ? 12 : 70, type);
  put(f.second ? 14 : 72, static_cast<std::int16_t>(type == 128  ? 24
                                                    : type == 32 ? 64
                                                                 : 8 * bytes_of(f.out.truth.type)));
  real(76, 104, f.qfac);
  for (std::size_t i = 0; i < 3; ++i) real(80 + 4 * i, 112 + 8 * i, f.pixdim[i]);
  real(112, 176, f.slope);
  real(116, 184, f.intercept);
  if (f.second)
    put(500, static_cast<std::int32_t>(f.units));
  else
    put(123, static_cast<std::int8_t>(f.units));
  const auto code = [&](std::size_t first, std::size_t second, int value) {
    if (f.second)
      put(second, static_cast<std::int32_t>(value));
    else
      put(first, static_cast<std::int16_t>(value));
  };
  code(68, 504, f.intent);
  code(252, 344, f.qform);
  code(254, 348, f.sform);
  const double turn = f.qfac < 0 ? -1.0 : 1.0;
  const Vec q = quatern(vec3::unit(f.srow[0]), vec3::unit(f.srow[1]), turn * vec3::unit(f.srow[2]));
  for (std::size_t i = 0; i < 3; ++i) {
    real(256 + 4 * i, 352 + 8 * i, q[i]);
    real(268 + 4 * i, 376 + 8 * i, f.srow[3][i] + f.qform_shift_mm[i]);
    for (std::size_t c = 0; c < 4; ++c) {
      real(280 + 16 * i + 4 * c, 400 + 32 * i + 8 * c, f.srow[c][i]);
    }
  }
  const std::string magic = f.second ? std::string("n+2\0\r\n\x1a\n", 8) : std::string("n+1\0", 4);
  header.replace(f.second ? 4 : 344, magic.size(), magic);
  const auto end = static_cast<std::int64_t>(header.size() + f.extension.size());
  if (f.second)
    put(168, f.offset < 0 ? 0 : end + f.offset);
  else
    put(108, static_cast<float>(f.offset < 0 ? 0 : end + f.offset));
  std::string all = header + f.extension;
  if (f.offset > 0) all += std::string(static_cast<std::size_t>(f.offset), 'x');
  all += f.data;
  f.out.path = folder.write(f.name + (f.gzip ? ".gz" : ""), f.gzip ? gzipped(all) : all);
}

struct NiftiRow {
  const char* name;
  Expected expected;
  const char* word;
  void (*change)(Nifti&);
};

void set_qform(Nifti& f) {
  f.qform = 1;
  f.sform = 0;
  // The fourth number of the quaternion is a root: rounding of 2^-24 in the others may become
  // 2^-12.
  if (!f.second) {
    const Numbered& v = f.out.truth;
    f.out.truth.slack_mm =
        1e-3 * vec3::length(v.position(v.size[0], v.size[1], v.size[2]) - v.origin_mm);
  }
  f.qfac = vec3::dot(vec3::cross(f.srow[0], f.srow[1]), f.srow[2]) < 0 ? -1 : 1;
}

constexpr NiftiRow kNiftiRows[] = {
    {"each type, byte order, orientation (sform); NIfTI-1 and -2; gzip", kRead, "", [](Nifti&) {}},
    {"qform alone", kRead, "", set_qform},
    {"qform and sform that agree", kRead, "",
     [](Nifti& f) {
       set_qform(f);
       f.sform = 2;
     }},
    {"qform and sform that differ", kEither, "sform",
     [](Nifti& f) {
       set_qform(f);
       f.sform = 1;
       f.qform_shift_mm = {0, 0, 50};
     }},
    {"neither qform nor sform", kEither, "form",
     [](Nifti& f) {
       f.sform = 0;
       f.out.truth.lay_flat();
       f.out.truth.axes = {{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}}};  // as nibabel reads it
       f.out.truth.any_origin = true;
     }},
    {"sform scale that differs from pixdim", kEither, "",
     [](Nifti& f) {
       f.pixdim = {1, 1, f.draw.of<double>({1, 2, 0, NAN})};
     }},
    {"pixdim 0 or no number, without sform", kEither, "",
     [](Nifti& f) {
       set_qform(f);
       f.pixdim[static_cast<std::size_t>(f.draw.below(3))] = f.draw.of({0.0, double(NAN)});
       f.out.truth.spacing_mm = {-1, -1, -1};  // no position is right
     }},
    {"pixdim below 0", kEither, "",
     [](Nifti& f) { f.pixdim[static_cast<std::size_t>(f.draw.below(3))] *= -1; }},
    {"lengths in micron", kRead, "",
     [](Nifti& f) {
       f.units = f.draw.of({3, 3 + 8});
       if (f.draw.coin()) set_qform(f);
       for (double& edge : f.out.truth.spacing_mm) edge *= 1e-3;
       f.out.truth.origin_mm = 1e-3 * f.out.truth.origin_mm;
     }},
    {"lengths in metre", kRead, "",
     [](Nifti& f) {
       f.units = f.draw.of({1, 1 + 16});
       if (f.draw.coin()) set_qform(f);
       for (double& edge : f.pixdim) edge *= 1e-3;
       for (Vec& column : f.srow) column = 1e-3 * column;
     }},
    {"slope and intercept", kRead, "",
     [](Nifti& f) {
       f.slope = f.draw.of({0.5, 2.0, -1.0, 0.1});
       f.intercept = f.draw.of({0.0, -1024.0, 3.5});
       const double exact = f.second ? f.slope : double{static_cast<float>(f.slope)};
       f.out.truth.scale([&](int) { return std::array{exact, f.intercept}; });
     }},
    {"slope 0 with an intercept: no scaling", kRead, "", [](Nifti& f) { f.intercept = -1024; }},
    {"slope or intercept that is no number", kEither, "",
     [](Nifti& f) {
       f.slope = f.draw.of({double(NAN), double(INFINITY), 1.0});
       f.intercept = f.slope == 1 ? NAN : 0;
     }},
    {"extensions before the voxels", kRead, "",
     [](Nifti& f) {
       f.extension[0] = 1;
       f.extension += bytes_of(std::int32_t{32}, f.out.truth.order) +
                      bytes_of(std::int32_t{6}, f.out.truth.order) + std::string(24, 'c');
     }},
    {"bytes before the voxels (vox_offset)", kRead, "",
     [](Nifti& f) { f.offset = 16 * (1 + f.draw.below(5)); }},
    {"vox_offset 0 in one file", kEither, "vox_offset", [](Nifti& f) { f.offset = -1; }},
    {"a fourth axis of length 1", kRead, "",
     [](Nifti& f) {
       f.dim.insert(f.dim.end(), {1, 1});
     }},
    {"a fourth axis of several times", kRefused, "volumes",
     [](Nifti& f) {
       f.dim.push_back(2);
       f.data += f.data;
     }},
    {"axes not at right angles", kRefused, "right angles",
     [](Nifti& f) { f.srow[1] = f.srow[1] + 0.2 * f.srow[0]; }},
    {"colours, complex numbers, bits", kRefused, "",
     [](Nifti& f) {
       f.datatype = f.draw.of({128, 32, 1, 2304, 0});
       f.data += f.data + f.data + f.data + f.data + f.data + f.data + f.data;
     }},
    {"an intent (label, statistic)", kRead, "",
     [](Nifti& f) {
       f.intent = f.draw.of({1002, 5});
     }},
    {"a voxel that is no number", kRefused, "NaN",
     [](Nifti& f) {
       number_anew(f.draw, f.out.truth, VoxelType::float32);
       f.out.truth.stored[f.out.truth.count() / 2] = NAN;
       f.data = f.out.truth.bytes();
     }},
    {"--spacing that contradicts the file", kRefused, "spacing",
     [](Nifti& f) {
       f.out.options.spacing_mm = f.out.truth.spacing_mm;
       (*f.out.options.spacing_mm)[static_cast<std::size_t>(f.draw.below(3))] += 1;
     }},
    {"cut off", kRefused, "",
     [](Nifti& f) { f.data.resize(static_cast<std::size_t>(f.draw.below(int(f.data.size())))); }},
};

/// A page of a TIFF: what its tags say. Values of more than 4 bytes are kept apart.
struct TaggedPage {
  std::map<int, std::pair<int, std::vector<std::uint64_t>>> tags;  ///< type (3 or 4), values
  std::vector<std::string> strips;
};

struct Tiff {
  Draw& draw;
  Written out{};
  bool big = false;
  int rows_per_strip = 0;
  std::vector<TaggedPage> pages{};
};

constexpr int kSubfile = 254, kWidth = 256, kHeight = 257, kBits = 258, kPacking = 259,
              kPhotometric = 262, kOrientation = 274, kSamples = 277, kFormat = 339;

TaggedPage tiff_page(const Numbered& v, int k, int rows_per_strip) {
  TaggedPage page;
  const int kind = v.type >= VoxelType::float32 ? 3 : static_cast<int>(v.type) % 2 == 1 ? 2 : 1;
  const auto bits = static_cast<std::uint64_t>(8 * bytes_of(v.type));
  page.tags = {{kWidth, {4, {static_cast<std::uint64_t>(v.size[0])}}},
               {kHeight, {4, {static_cast<std::uint64_t>(v.size[1])}}},
               {kBits, {3, {bits}}},
               {kPacking, {3, {1}}},
               {kPhotometric, {3, {1}}},
               {kSamples, {3, {1}}},
               {278, {4, {static_cast<std::uint64_t>(rows_per_strip)}}},
               {284, {3, {1}}},
               {kFormat, {3, {static_cast<std::uint64_t>(kind)}}}};
  const std::string all = v.bytes(k, k + 1);
  const std::size_t step =
      all.size() / static_cast<std::size_t>(v.size[1]) * static_cast<std::size_t>(rows_per_strip);
  for (std::size_t at = 0; at < all.size(); at += step) page.strips.push_back(all.substr(at, step));
  return page;
}

std::string tiff_bytes(const Tiff& f) {
  const std::endian order = f.out.truth.order;
  const std::size_t wide = f.big ? 8 : 4;
  const auto number = [&](std::uint64_t value, std::size_t bytes) {
    return bytes == 2   ? bytes_of(static_cast<std::uint16_t>(value), order)
           : bytes == 4 ? bytes_of(static_cast<std::uint32_t>(value), order)
                        : bytes_of(value, order);
  };
  std::string all = (order == std::endian::little ? "II" : "MM") + number(f.big ? 43 : 42, 2);
  if (f.big) all += number(8, 2) + number(0, 2);
  all += number(all.size() + wide, wide);
  for (std::size_t p = 0; p < f.pages.size(); ++p) {
    auto tags = f.pages[p].tags;
    auto& offsets = tags[273] = {4, {}};
    auto& counts = tags[279] = {4, {}};
    const auto& strips = f.pages[p].strips;
    std::size_t end = all.size() + (f.big ? 8 + 20 * tags.size() : 2 + 12 * tags.size()) + wide;
    const auto apart = [&](const auto& tag) {
      const std::size_t bytes = tag.second.size() * (tag.first == 3 ? 2 : 4);
      return bytes > wide ? bytes : 0;
    };
    offsets.second.resize(strips.size());
    counts.second.resize(strips.size());
    std::size_t data = end;
    for (const auto& [id, tag] : tags) data += apart(tag);
    for (std::size_t s = 0; s < strips.size(); ++s) {
      offsets.second[s] = data;
      counts.second[s] = strips[s].size();
      data += strips[s].size();
    }
    data += data % 2;
    std::string values;
    all += number(tags.size(), f.big ? 8 : 2);
    for (const auto& [id, tag] : tags) {
      const std::size_t each = tag.first == 3 ? 2 : 4;
      std::string text;
      for (const std::uint64_t value : tag.second) text += number(value, each);
      all += number(static_cast<std::uint64_t>(id), 2) +
             number(static_cast<std::uint64_t>(tag.first), 2) + number(tag.second.size(), wide);
      if (apart(tag) != 0) {
        all += number(end + values.size(), wide);
        values += text;
      } else {
        text.resize(wide, '\0');
        all += text;
      }
    }
    all += number(p + 1 < f.pages.size() ? data : 0, wide) + values;
    for (const std::string& strip : strips) all += strip;
    all.resize(data, '\0');
  }
  return all;
}

constexpr VoxelType kTiffTypes[] = {VoxelType::uint8,  VoxelType::int8,   VoxelType::uint16,
                                    VoxelType::int16,  VoxelType::uint32, VoxelType::int32,
                                    VoxelType::float32};

void renew_pages(Tiff& f) {
  const Numbered& v = f.out.truth;
  f.pages.clear();
  for (int k = 0; k < v.size[2]; ++k) f.pages.push_back(tiff_page(v, k, f.rows_per_strip));
}

Tiff tiff_file(Draw& draw) {
  Tiff f{draw, {{}, {}, numbered(draw, kTiffTypes[draw.below(7)], 2)}};
  Numbered& v = f.out.truth;
  v.lay_flat();
  f.big = draw.coin();
  f.rows_per_strip = 1 + draw.below(v.size[1]);
  renew_pages(f);
  f.out.options.spacing_mm = v.spacing_mm;
  return f;
}

/// A page that is no slice: a reduced copy or a mask, of the size of the slices or smaller.
TaggedPage other_page(Tiff& f, std::uint64_t kind) {
  Numbered small = f.out.truth;
  small.size[2] = 1;
  if (f.draw.coin())
    small.size = {std::max(1, small.size[0] / 2), std::max(1, small.size[1] / 2), 1};
  number_anew(f.draw, small, small.type);
  TaggedPage page = tiff_page(small, 0, small.size[1]);
  page.tags[kSubfile] = {4, {kind}};
  return page;
}

void insert_page(Tiff& f, TaggedPage page) {
  const int at = f.draw.below(static_cast<int>(f.pages.size()) + 1);
  f.pages.insert(f.pages.begin() + at, std::move(page));
}

/// A slice of grey bits that are packed in bytes, or a colour, in place of each page.
void set_tag(Tiff& f, int tag, std::uint64_t value) {
  for (TaggedPage& page : f.pages) page.tags[tag] = {3, {value}};
}

struct TiffRow {
  const char* name;
  Expected expected;
  const char* word;
  void (*change)(Tiff&);
};

constexpr TiffRow kTiffRows[] = {
    {"each type, byte order, strips; classic and big; --spacing given", kRead, "", [](Tiff&) {}},
    {"no spacing", kAsked, "--spacing", [](Tiff& f) { f.out.options.spacing_mm.reset(); }},
    {"packed by deflate", kRead, "",
     [](Tiff& f) {
       set_tag(f, kPacking, f.draw.of<std::uint64_t>({8, 32946}));
       for (TaggedPage& page : f.pages) {
         for (std::string& strip : page.strips) strip = zlib_packed(strip);
       }
     }},
    {"packed by PackBits", kRead, "",
     [](Tiff& f) {
       set_tag(f, kPacking, 32773);
       for (TaggedPage& page : f.pages) {
         for (std::string& strip : page.strips) {
           std::string packed;
           const std::size_t row =
               f.out.truth.bytes(0, 1).size() / static_cast<std::size_t>(f.out.truth.size[1]);
           for (std::size_t at = 0; at < strip.size(); at += row) {  // each row is packed apart
             packed += static_cast<char>(row - 1) + strip.substr(at, row);
           }
           strip = packed;
         }
       }
     }},
    {"reduced copies among the pages, of any size", kRead, "",
     [](Tiff& f) {
       for (int n = 1 + f.draw.below(3); n > 0; --n) insert_page(f, other_page(f, 1));
     }},
    {"masks among the pages", kEither, "",
     [](Tiff& f) {
       insert_page(f, other_page(f, f.draw.of<std::uint64_t>({4, 5})));
     }},
    {"pages marked as pages (NewSubfileType 2, page numbers)", kRead, "",
     [](Tiff& f) {
       for (std::size_t p = 0; p < f.pages.size(); ++p) {
         f.pages[p].tags[kSubfile] = {4, {2}};
         f.pages[p].tags[297] = {3, {p, f.pages.size()}};
       }
     }},
    {"page numbers in another order", kEither, "",
     [](Tiff& f) {
       for (std::size_t p = 0; p < f.pages.size(); ++p) {
         f.pages[p].tags[297] = {3, {f.pages.size() - 1 - p, f.pages.size()}};
       }
       f.out.truth.origin_mm = f.out.truth.position(0, 0, f.out.truth.size[2] - 1);
       f.out.truth.axes[2] = {0, 0, -1};
     }},
    {"a page of another size", kRefused, "",
     [](Tiff& f) {
       Numbered other = f.out.truth;
       ++other.size[static_cast<std::size_t>(f.draw.below(2))];
       number_anew(f.draw, other, other.type);
       insert_page(f, tiff_page(other, 0, other.size[1]));
     }},
    {"a page of another type", kRefused, "",
     [](Tiff& f) {
       Numbered other = f.out.truth;
       number_anew(f.draw, other,
                   other.type == VoxelType::uint8 ? VoxelType::uint16 : VoxelType::uint8);
       insert_page(f, tiff_page(other, 0, other.size[1]));
     }},
    {"white is zero (tag of display)", kEither, "", [](Tiff& f) { set_tag(f, kPhotometric, 0); }},
    {"floats of 64 bits", kEither, "",
     [](Tiff& f) {
       number_anew(f.draw, f.out.truth, VoxelType::float64);
       renew_pages(f);
     }},
    {"colours or a palette", kRefused, "",
     [](Tiff& f) {
       Numbered& v = f.out.truth;
       const bool palette = f.draw.coin();
       if (!palette) v.size[0] *= 3;
       number_anew(f.draw, v, VoxelType::uint8);
       renew_pages(f);
       for (TaggedPage& page : f.pages) {
         page.tags[kPhotometric] = {3, {palette ? 3U : 2U}};
         if (palette) page.tags[320] = {3, std::vector<std::uint64_t>(768, 99)};
         if (palette) continue;
         page.tags[kWidth].second[0] /= 3;
         page.tags[kSamples] = {3, {3}};
         page.tags[kBits] = {3, {8, 8, 8}};
         page.tags[kFormat] = {3, {1, 1, 1}};
       }
     }},
    {"rows that run upwards or backwards (Orientation)", kEither, "",
     [](Tiff& f) {
       const int way = f.draw.of({2, 3, 4});  // 0th column right; both; 0th row at the bottom
       set_tag(f, kOrientation, static_cast<std::uint64_t>(way));
       Numbered& v = f.out.truth;
       const double last[] = {way == 4 ? 0.0 : v.size[0] - 1.0, way == 2 ? 0.0 : v.size[1] - 1.0};
       v.origin_mm = {last[0] * v.spacing_mm[0], last[1] * v.spacing_mm[1], 0};
       v.axes[0] = {way == 4 ? 1.0 : -1.0, 0, 0};
       v.axes[1] = {0, way == 2 ? 1.0 : -1.0, 0};
     }},
    {"cut off", kRefused, "", [](Tiff& f) { f.rows_per_strip = -1; }},
};

std::string png_bytes_of(const Numbered& v, int k, int colour) {
  const auto big = [](std::size_t value) {
    return bytes_of(static_cast<std::uint32_t>(value), std::endian::big);
  };
  const auto chunk = [&](const std::string& name, const std::string& data) {
    const std::string checked = name + data;
    return big(data.size()) + checked +
           big(crc32(0, reinterpret_cast<const Bytef*>(checked.data()),
                     static_cast<uInt>(checked.size())));
  };
  const std::string pixels = v.bytes(k, k + 1);
  const std::size_t row = pixels.size() / static_cast<std::size_t>(v.size[1]);
  std::string rows;
  for (std::size_t at = 0; at < pixels.size(); at += row) rows += '\0' + pixels.substr(at, row);
  const auto bits = static_cast<char>(8 * bytes_of(v.type));
  const int channels = colour == 2 ? 3 : colour == 4 ? 2 : 1;
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", big(static_cast<std::size_t>(v.size[0] / channels)) +
                           big(static_cast<std::size_t>(v.size[1])) + bits +
                           static_cast<char>(colour) + std::string(3, '\0')) +
         chunk("gAMA", big(45455)) + chunk("IDAT", zlib_packed(rows)) + chunk("IEND", "");
}

struct Stack {
  Draw& draw;
  Written out{};
  std::vector<std::string> files{};
  int first = 1, step = 1, colour = 0;
  bool tiff = false;
  std::size_t left_out = SIZE_MAX;
};

Stack slice_files(Draw& draw, bool tiff, int slices) {
  Stack f{draw};
  f.tiff = tiff;
  Numbered& v = f.out.truth = numbered(
      draw, tiff ? kTiffTypes[draw.below(7)] : draw.of({VoxelType::uint8, VoxelType::uint16}),
      slices);
  v.lay_flat();
  if (!tiff) v.order = std::endian::big;
  f.first = draw.below(120);
  f.step = 1 + draw.below(3);
  f.out.options.spacing_mm = v.spacing_mm;
  return f;
}

void write_stack(Stack& f, const TemporaryFolder& folder) {
  const Numbered& v = f.out.truth;
  for (int k = 0; k < v.size[2]; ++k) {
    if (static_cast<std::size_t>(k) == f.left_out) continue;
    Tiff page{f.draw, f.out};
    page.pages = {tiff_page(v, k, v.size[1])};
    folder.write("slice" + std::to_string(f.first + f.step * k) + (f.tiff ? ".tif" : ".png"),
                 f.tiff ? tiff_bytes(page) : png_bytes_of(v, k, f.colour));
  }
  f.out.path = folder.path();
}

struct StackRow {
  const char* name;
  Expected expected;
  const char* word;
  void (*change)(Stack&, const TemporaryFolder&);
  int slices = 2;
};

constexpr StackRow kStackRows[] = {
    {"slices in the order of the numbers in their names; --spacing given", kRead, "",
     [](Stack&, const TemporaryFolder&) {}},
    {"no spacing", kAsked, "--spacing",
     [](Stack& f, const TemporaryFolder&) { f.out.options.spacing_mm.reset(); }},
    {"a slice is missing", kRefused, "missing",
     [](Stack& f, const TemporaryFolder&) {
       f.left_out = static_cast<std::size_t>(1 + f.draw.below(f.out.truth.size[2] - 2));
     },
     4},
    {"other files in the same folder", kRead, "",
     [](Stack&, const TemporaryFolder& folder) {
       folder.write("notes.txt", "x");
       folder.write(".hidden", "x");
     }},
    {"colours", kRefused, "",
     [](Stack& f, const TemporaryFolder&) {
       f.tiff = false;
       number_anew(f.draw, f.out.truth, VoxelType::uint8);
       Numbered& v = f.out.truth;
       v.size[0] *= 6;
       number_anew(f.draw, v, VoxelType::uint8);
       f.colour = f.draw.of({2, 4});
     }},
};

}  // namespace

void add_nifti(std::vector<Situation>& all) {
  for (const NiftiRow& row : kNiftiRows) {
    all.push_back(
        {"NIfTI", row.name, row.expected, row.word, [=](Draw& draw, const TemporaryFolder& folder) {
           Nifti file = nifti_file(draw, static_cast<VoxelType>(draw.below(10)));
           row.change(file);
           write_nifti(file, folder);
           return file.out;
         }});
  }
}

void add_tiff(std::vector<Situation>& all) {
  for (const TiffRow& row : kTiffRows) {
    all.push_back(
        {"TIFF", row.name, row.expected, row.word, [=](Draw& draw, const TemporaryFolder& folder) {
           Tiff file = tiff_file(draw);
           row.change(file);
           std::string bytes = tiff_bytes(file);
           if (file.rows_per_strip < 0) {
             bytes.resize(static_cast<std::size_t>(draw.below(int(bytes.size()) - 1)));
           }
           file.out.path = folder.write("a.tif", bytes);
           return file.out;
         }});
  }
}

void add_stacks_and_raw(std::vector<Situation>& all) {
  for (const bool tiff : {false, true}) {
    for (const StackRow& row : kStackRows) {
      all.push_back({tiff ? "stack of TIFF" : "stack of PNG", row.name, row.expected, row.word,
                     [=](Draw& draw, const TemporaryFolder& folder) {
                       Stack stack = slice_files(draw, tiff, row.slices);
                       row.change(stack, folder);
                       write_stack(stack, folder);
                       return stack.out;
                     }});
    }
  }
  const auto raw = [&all](const char* name, Expected expected, const char* word,
                          void (*change)(Draw&, Written&, std::string&)) {
    all.push_back(
        {"raw", name, expected, word, [=](Draw& draw, const TemporaryFolder& folder) {
           Written out{{}, {}, numbered(draw, static_cast<VoxelType>(draw.below(10)))};
           Numbered& v = out.truth;
           v.lay_flat();
           const auto skip = static_cast<std::uint64_t>(draw.below(30));
           out.options.spacing_mm = v.spacing_mm;
           out.options.raw = RawLayout{
               {v.size[0], v.size[1], v.size[2]}, v.type, v.order == std::endian::big, skip};
           std::string bytes = std::string(skip, 'x') + v.bytes();
           change(draw, out, bytes);
           out.path = folder.write("a.raw", bytes);
           return out;
         }});
  };
  raw("each type and byte order, after bytes to skip; --dims and --spacing given", kRead, "",
      [](Draw&, Written&, std::string&) {});
  raw("no spacing", kAsked, "--spacing",
      [](Draw&, Written& out, std::string&) { out.options.spacing_mm.reset(); });
  raw("no --dims", kAsked, "--dims",
      [](Draw&, Written& out, std::string&) { out.options.raw.reset(); });
  raw("more or fewer bytes than --dims asks for", kRefused, "bytes",
      [](Draw& draw, Written&, std::string& bytes) {
        bytes.resize(draw.coin() ? bytes.size() + 1 : bytes.size() - 1, 'x');
      });
}

}  // namespace kerf::test
