// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>

#include <doctest/doctest.h>

#include "controller/volume/file/volume_image.hpp"
#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::nifti_test {

using namespace kerf::test;

namespace {

using Three = std::array<double, 3>;
using Position = std::function<Three(double, double, double)>;

/// A header with other bytes from an offset of nifti1.h on.
struct Patch {
  std::size_t at;
  std::string bytes;
};
std::string patched(std::string header, const std::vector<Patch>& patches) {
  for (const Patch& patch : patches) header.replace(patch.at, patch.bytes.size(), patch.bytes);
  return header;
}
std::string i16(int value) {
  return bytes_of(static_cast<std::int16_t>(value));
}
std::string f32(const std::vector<float>& values) {
  return bytes_of(values);
}

// Offsets of fields in nifti1.h.
constexpr std::size_t kDim = 40, kDatatype = 70, kQfac = 76, kPixdim = 80, kVoxOffset = 108,
                      kSlope = 112, kUnits = 123, kCalMax = 124, kQform = 252, kSform = 254,
                      kQuatern = 256, kQoffset = 268, kSrow = 280, kMagic = 344, kExtension = 348;

const std::string kFloats = bytes_of(counting<float>());
const std::string kShorts = bytes_of(counting<std::int16_t>());
const Patch kInt16{kDatatype, i16(4) + i16(16)};

std::string file(const std::vector<Patch>& patches, const std::string& voxels = kFloats) {
  return patched(nifti({}), patches) + voxels;
}

SourceVolume read(const std::string& bytes, const std::string& name = "a.nii") {
  const TemporaryFolder folder;
  return read_volume(folder.write(name, bytes));
}

std::string refusal_of(const std::string& bytes, const std::string& name = "a.nii") {
  const TemporaryFolder folder;
  const std::string message = refusal(folder.write(name, bytes));
  CAPTURE(message);
  CHECK(is_one_line(message));
  return message;
}

/// Each value of kSmall counts its voxel in the file: it lies where `position` has that one.
void check_numbered(const SourceVolume& v, const Position& position) {
  REQUIRE(v.values.size() == kSmall.voxel_count());
  std::vector<bool> seen(kSmall.voxel_count());
  double away = 0;
  for (const auto& [i, j, k] : voxels(v.grid)) {
    const auto n = static_cast<int>(v.values[v.grid.index(i, j, k)]);
    seen[static_cast<std::size_t>(n)] = true;
    const Three wanted = position(n % 3, n / 3 % 4, n / 12);
    const Three there = position_of(v, i, j, k);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      away = std::max(away, std::abs(wanted[axis] - there[axis]));
    }
  }
  CHECK(std::ranges::count(seen, false) == 0);
  CHECK(away < 1e-5);  // of float32
}
Three along_lps(double i, double j, double k) {
  return {i, 2 * j, 3 * k};
}

}  // namespace

TEST_CASE("NIfTI is read plain and gzipped, in both byte orders, with one layer of time") {
  NiftiSpec spec;
  check_numbered(read(nifti(spec) + kFloats), along_lps);
  check_numbered(read(gzipped(nifti(spec) + kFloats), "b.nii.gz"), along_lps);
  for (const std::vector<std::int16_t>& dim :
       {std::vector<std::int16_t>{3, 4, 5, 1}, {3, 4, 5, 1, 1}, {3, 4, 5, 0}}) {
    spec.dim = dim;
    check_numbered(read(nifti(spec) + kFloats), along_lps);
  }
  spec.order = std::endian::big;
  spec.datatype = 4;
  spec.bits = 16;
  check_numbered(read(nifti(spec) + bytes_of(counting<std::int16_t>(), std::endian::big)),
                 along_lps);
}

TEST_CASE("a NIfTI-2 is read, in both byte orders") {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    std::string header(544, '\0');
    const auto put = [&](std::size_t at, auto value) {
      const std::string bytes = bytes_of(value, order);
      header.replace(at, bytes.size(), bytes);
    };
    put(0, std::int32_t{540});
    header.replace(4, 8, std::string("n+2\0\r\n\x1a\n", 8));
    put(12, std::int16_t{4});
    put(14, std::int16_t{16});
    for (std::size_t i = 0; i < 4; ++i)
      put(16 + 8 * i, std::int64_t{i == 0 ? 3 : 2 + static_cast<int>(i)});
    for (std::size_t i = 0; i < 3; ++i) put(112 + 8 * i, 1.0 + static_cast<double>(i));
    put(168, std::int64_t{544});
    put(176, 2.0);    // slope
    put(184, -10.0);  // intercept
    put(348, std::int32_t{2});
    put(400, -1.0);
    put(400 + 24, 7.0);
    put(440, -2.0);
    put(480, 3.0);
    put(500, std::int32_t{2});
    const SourceVolume v = read(header + bytes_of(counting<std::int16_t>(), order));
    CHECK(v.values[0] == -10);
    CHECK(v.values[59] == 108);
    CHECK(v.spacing_mm == Three{1, 2, 3});
    CHECK(v.origin_mm == Three{-7, 0, 0});
  }
}

TEST_CASE("a NIfTI in two files is read by either name, and its Analyze forebear is refused") {
  const TemporaryFolder folder;
  const std::string header = patched(nifti({}), {{kMagic, "ni1"}, {kVoxOffset, f32({8})}});
  folder.write("a.hdr", header);
  CHECK(has(refusal(folder / "a.hdr"), "a.hdr: data file a.img cannot be read"));
  folder.write("a.img", "8 bytes." + kFloats);
  check_numbered(read_volume(folder / "a.hdr"), along_lps);
  check_numbered(read_volume(folder / "a.img"), along_lps);
  folder.write("b.hdr.gz", gzipped(header));
  folder.write("b.img.gz", gzipped("8 bytes." + kFloats));
  check_numbered(read_volume(folder / "b.img.gz"), along_lps);
  folder.write("a.img", "8 bytes." + kFloats.substr(0, 100));
  CHECK(has(refusal(folder / "a.hdr"), "a.img: 100 of 240 bytes"));
  folder.write("a.hdr", patched(header, {{kMagic, std::string(3, '\0')}}));
  CHECK(has(refusal(folder / "a.img"), "a.hdr: has no magic word of NIfTI, so it is Analyze 7.5"));
  CHECK(has(refusal_of(file({{kMagic, "n+2"}})), "no magic word"));
}

TEST_CASE(
    "the sform counts before the qform, the qform before pixdim, and the note has conflicts") {
  const double turn = std::numbers::pi / 6;
  // A turn about z, which LPS has as RAS has it.
  const std::vector<Patch> qform{{kQform, i16(1)},
                                 {kQuatern, f32({0, 0, static_cast<float>(std::sin(turn / 2))})},
                                 {kQoffset, f32({10, 20, 30})},
                                 {kSform, i16(0)}};
  const auto turned = [&](double i, double j, double k) {
    const double x = i * std::cos(turn) - 2 * j * std::sin(turn);
    const double y = i * std::sin(turn) + 2 * j * std::cos(turn);
    return Three{-(x + 10), -(y + 20), 3 * k + 30};
  };
  const SourceVolume by_qform = read(file(qform));
  check_numbered(by_qform, turned);
  CHECK(by_qform.note.empty());

  std::vector<Patch> both = qform;
  both.push_back({kSform, i16(2)});
  const SourceVolume by_sform = read(file(both));
  check_numbered(by_sform, along_lps);
  CHECK(has(by_sform.note, "its sform counts, which is up to "));
  // The same in both: nothing to note.
  CHECK(read(file({{kQform, i16(1)}, {kQuatern, f32({0, 0, 1})}})).note.empty());

  // As nibabel, FSL and SPM have it: x to the left, y to the front, the middle at the origin.
  const SourceVolume bare = read(file({{kSform, i16(0)}}));
  check_numbered(bare, [](double i, double j, double k) {
    return Three{i - 1, -(2 * j - 3), 3 * k - 6};
  });
  CHECK(has(bare.axes_note, "LAS (columns to the left, rows to the front, slices to the top of a"));
}

TEST_CASE("a NIfTI's qfac of -1 mirrors, 0 does not, and a broken qform is refused") {
  const auto with = [](const std::vector<Patch>& more) {
    std::vector<Patch> all{{kQform, i16(1)}, {kSform, i16(0)}};
    all.insert(all.end(), more.begin(), more.end());
    return file(all);
  };
  const auto plain = [](double sign) {
    return [=](double i, double j, double k) { return Three{-i, -2 * j, sign * 3 * k}; };
  };
  check_numbered(read(with({})), plain(1));
  check_numbered(read(with({{kQfac, f32({0})}})), plain(1));
  check_numbered(read(with({{kQfac, f32({-1})}})), plain(-1));
  // Of float32, longer than 1 by what its computation can reach: squares of 1.0000005 and 1.000001,
  // and not that of 1.0000014.
  constexpr float kEpsilon = std::numeric_limits<float>::epsilon();
  for (const float z : {1 + kEpsilon, 1 + 4 * kEpsilon}) {
    const SourceVolume v = read(with({{kQuatern, f32({0, 0, z})}}));
    check_numbered(v, along_lps);
    CHECK(has(v.note, "its quaternion, longer than 1 by rounding (b^2 + c^2 + d^2 = 1.00000"));
    CHECK(has(v.note, "), is scaled to 1"));
  }
  CHECK(has(refusal_of(with({{kQuatern, f32({0, 0, 1 + 6 * kEpsilon})}})),
            "its quaternion (0, 0, 1) has b^2 + c^2 + d^2 above 1 by 1.43051e-06, and rounding "
            "reaches 1.19209e-06"));
  CHECK(has(refusal_of(with({{kQfac, f32({-2})}})), "pixdim[0] = -2 is neither 1 nor -1"));
  CHECK(has(refusal_of(with({{kQuatern, f32({1, 1, 0})}})),
            "quaternion (1, 1, 0) has b^2 + c^2 + d^2 above 1 by 1, and rounding"));
  CHECK(has(refusal_of(with({{kPixdim, f32({-1})}})), "pixdim[1] = -1 is no spacing"));
  CHECK(has(refusal_of(with({{kQform, i16(9)}})), "qform_code = 9 is none of NIfTI"));
  CHECK(has(refusal_of(with({{kPixdim, f32({0})}})), "spacing along x is not in the file"));
}

TEST_CASE("a form of a NIfTI that is not used is not judged") {
  const auto beside_sform = [](const Patch& broken) {
    return file({{kSform, i16(1)}, {kQform, i16(1)}, broken});
  };
  for (const Patch& broken :
       {Patch{kQuatern, f32({0, 0, 1.000001F})}, Patch{kQuatern, f32({1, 1, 0})},
        Patch{kQuatern, f32({NAN, 0, 0})}, Patch{kQfac, f32({-2})}, Patch{kQform, i16(9)}}) {
    check_numbered(read(beside_sform(broken)), along_lps);
  }
  // Nor an sform and a quaternion without their codes.
  check_numbered(read(file({{kQform, i16(1)},
                            {kQuatern, f32({0, 0, 1})},
                            {kSform, i16(0)},
                            {kSrow, f32({NAN, 0, 0, 0})}})),
                 along_lps);
  CHECK(read(file({{kSform, i16(0)}, {kQuatern, f32({1, 1, 1})}})).grid == kSmall);
  // A code that is none of NIfTI leaves open what counts.
  CHECK(has(refusal_of(file({{kSform, i16(9)}})), "sform_code = 9 is none of NIfTI"));
}

TEST_CASE("a NIfTI whose sform differs from pixdim has the sform's spacing, and says so") {
  const SourceVolume v = read(file({{kPixdim, f32({1, 1, 1})}}));
  check_numbered(v, along_lps);
  CHECK(v.note == "its sform has a spacing of 1 2 3 mm and counts, its pixdim has 1 1 1 mm");
  CHECK(read(file({{kPixdim, f32({1, 2.0000002F, 3})}})).note.empty());
  CHECK(read(file({{kPixdim, f32({1, 2.000004F, 3})}})).note ==
        "its sform has a spacing of 1 2 3 mm and counts, its pixdim has 1 2.000004 3 mm");
  CHECK(has(refusal_of(file({{kSrow, f32({0})}})), "its sform has an axis without length"));
  CHECK(has(refusal_of(file({{kSrow, f32({NAN})}})), "its sform has an axis without length"));
  CHECK(has(refusal_of(file({{kSrow + 4, f32({0.5F})}})), "not at right angles"));
}

TEST_CASE("lengths of a NIfTI in metres and micrometres come in mm, those without a unit are mm") {
  const auto scaled = [](int unit, float factor) {
    return file({{kUnits, std::string(1, static_cast<char>(unit | 16))},  // and a unit of time
                 {kPixdim, f32({factor, 2 * factor, 3 * factor})},
                 {kSrow, f32({-factor, 0, 0, 1 * factor})},
                 {kSrow + 20, f32({-2 * factor, 0})},
                 {kSrow + 40, f32({3 * factor, 0})}});
  };
  const auto moved = [](double i, double j, double k) { return Three{i - 1, 2 * j, 3 * k}; };
  check_numbered(read(scaled(1, 1e-3F)), moved);
  check_numbered(read(scaled(2, 1)), moved);
  check_numbered(read(scaled(3, 1e3F)), moved);
  const SourceVolume unknown = read(scaled(0, 1));
  check_numbered(unknown, moved);
  CHECK(unknown.note == "the header names no unit of length, mm are taken");
  CHECK(has(refusal_of(scaled(5, 1)), "unit 5 of lengths is none of NIfTI"));
}

TEST_CASE("slope and intercept of a NIfTI are applied unless the slope is 0 or no number") {
  const auto scaled = [](float slope, float intercept) {
    return file({kInt16, {kSlope, f32({slope, intercept})}}, kShorts);
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float slope : {0.0F, kNan, std::numeric_limits<float>::infinity()}) {
    for (const float intercept : {-1024.0F, kNan}) {
      CHECK(same_values(read(scaled(slope, intercept)), counting<float>()));
    }
  }
  const SourceVolume half = read(scaled(0.1F, -1024));
  CHECK(half.values[59] == static_cast<float>(double{0.1F} * 59 - 1024));
  CHECK(read(scaled(-1, 0)).values[59] == -59);
  CHECK(has(refusal_of(scaled(1, kNan)), "scl_inter = nan is no number"));
  CHECK(read(file({{kCalMax, f32({10, 5})}})).max == 59);
}

TEST_CASE("values that a slope keeps whole take 16 bits") {
  const auto bytes_each = [](int datatype, const std::string& voxels, float slope,
                             float intercept) {
    const SourceVolume v =
        read(file({{kDatatype, i16(datatype) + i16(static_cast<int>(8 * voxels.size() / 60))},
                   {kSlope, f32({slope, intercept})}},
                  voxels));
    CHECK(v.values[59] == 59 * slope + intercept);
    return v.values.bytes().size() / v.values.size();
  };
  const std::string bytes = bytes_of(counting<std::uint8_t>()),
                    words = bytes_of(counting<std::uint16_t>());
  CHECK(bytes_each(2, bytes, 10, -1024) == 2);
  CHECK(bytes_each(2, bytes, 257, 0) == 2);
  CHECK(bytes_each(512, words, 1, -32768) == 2);
  CHECK(bytes_each(512, words, 1, -1024) == 4);
  CHECK(bytes_each(2, bytes, 0.5F, 0) == 4);
  CHECK(bytes_each(4, words, 2, 0) == 4);
}

TEST_CASE("the voxels of a NIfTI begin at its vox_offset, and never before byte 352") {
  const auto at = [](float offset, std::size_t before) {
    return file({{kVoxOffset, f32({offset})}}, std::string(before, '\x55') + kFloats);
  };
  for (const float offset : {0.0F, 1.0F, 348.0F, 351.0F, 352.0F}) {
    check_numbered(read(at(offset, 0)), along_lps);
  }
  check_numbered(read(at(353, 1)), along_lps);
  check_numbered(read(gzipped(at(400, 48)), "a.nii.gz"), along_lps);
  const std::string extension = bytes_of(std::int32_t{16}) + std::string(12, '\1');
  const auto extended = [&](float offset) {
    return file({{kVoxOffset, f32({offset})}, {kExtension, "\1"}}, extension + kFloats);
  };
  check_numbered(read(extended(368)), along_lps);
  CHECK(has(refusal_of(extended(0)), "vox_offset = 0 lies before the end of its extension"));
  for (const float offset : {-1.0F, 352.5F, 1e30F, std::numeric_limits<float>::quiet_NaN()}) {
    CHECK(has(refusal_of(at(offset, 0)), "is no position in a file"));
  }
  CHECK(has(refusal_of(at(600, 0)), " of 240 bytes"));
  CHECK(has(refusal_of(gzipped(at(1e9F, 0)), "a.nii.gz"), " of 240 bytes"));
}

TEST_CASE("a NIfTI of other voxels or axes is refused by their name") {
  const auto typed = [](int datatype, int bits) {
    return refusal_of(file({{kDatatype, i16(datatype) + i16(bits)}}, std::string(2000, '\0')));
  };
  CHECK(has(typed(128, 24), "voxels of type 128, colours, of 24 bits each"));
  CHECK(has(typed(2304, 32), "colours"));
  CHECK(has(typed(32, 64), "complex"));
  CHECK(has(typed(1536, 128), "128-bit float"));
  CHECK(has(typed(1, 1), "bits"));
  CHECK(has(typed(4, 32), "voxels of type 4, of 32 bits each"));
  const auto sized = [](const std::vector<int>& dim) {
    std::string bytes;
    for (const int d : dim) bytes += i16(d);
    return refusal_of(file({{kDim, bytes}}));
  };
  CHECK(has(sized({2, 3, 20, 1}), "2 axes; "));
  CHECK(has(sized({0}), "0 axes"));
  CHECK(has(sized({-3}), "-3 axes"));
  CHECK(has(sized({3, -3, 4, 5}), "is empty"));
  CHECK(has(sized({4, 3, 4, 5, 2}), "2 volumes along axis 4"));
  CHECK(has(sized({5, 3, 4, 5, 1, 3}), "3 values per voxel along axis 5"));
}

TEST_CASE("a packed NIfTI is good to its checksum") {
  std::string packed = gzipped(file({}));
  packed[packed.size() - 6] = static_cast<char>(~packed[packed.size() - 6]);
  CHECK(has(refusal_of(packed, "a.nii.gz"),
            "a.nii.gz: cannot be read (its packed bytes are broken)"));
}

}  // namespace kerf::nifti_test
