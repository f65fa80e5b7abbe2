// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include <doctest/doctest.h>
#include <zlib.h>

#include "tests/volume/volume_files.hpp"

namespace kerf::slice_stack_test {

using namespace kerf::test;

namespace {

std::string big(std::uint32_t value) {
  return bytes_of(value, std::endian::big);
}

std::string chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  const auto sum =
      crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
  return big(static_cast<std::uint32_t>(data.size())) + checked +
         big(static_cast<std::uint32_t>(sum));
}

/// PNG of `channels` numbers a pixel, all as they lie in `rows`.
std::string png(int width, int height, int bits, int colour, const std::string& pixels,
                const std::string& more_chunks = "") {
  std::string rows;
  const std::size_t row = pixels.size() / static_cast<std::size_t>(height);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    rows += '\0' + pixels.substr(y * row, row);
  }
  uLongf size = compressBound(rows.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(rows.data()), rows.size());
  packed.resize(size);
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", big(static_cast<std::uint32_t>(width)) +
                           big(static_cast<std::uint32_t>(height)) + static_cast<char>(bits) +
                           static_cast<char>(colour) + std::string(3, '\0')) +
         more_chunks + chunk("IDAT", packed) + chunk("IEND", "");
}
constexpr int kGrey = 0, kRgba = 6;

/// A TIFF of one page of 3 x 4.
std::string one_page(std::uint16_t bits, const std::string& pixels) {
  return tiff({{.pixels = pixels, .bits = bits}});
}

/// Five files whose numbers have no leading zeros: 8 .. 12.
void write_stack(const TemporaryFolder& folder, const std::string& end,
                 const std::function<std::string(int)>& bytes) {
  for (int z = 0; z < 5; ++z) folder.write("slice" + std::to_string(8 + z) + end, bytes(z));
}

const ReadOptions kSpaced{.spacing_mm = std::array<double, 3>{0.5, 0.5, 2}};

}  // namespace

TEST_CASE("a folder of grey pictures is a volume, in the order of the numbers in their names") {
  const TemporaryFolder folder;
  SUBCASE("PNG of 8 bits") {
    write_stack(folder, ".png", [](int z) { return png(3, 4, 8, kGrey, slice<std::uint8_t>(z)); });
  }
  SUBCASE("PNG of 16 bits") {
    write_stack(folder, ".PNG", [](int z) {
      return png(3, 4, 16, kGrey, slice<std::uint16_t>(z, std::endian::big));
    });
  }
  SUBCASE("TIFF") {
    write_stack(folder, ".tif", [](int z) { return one_page(16, slice<std::uint16_t>(z)); });
  }
  folder.write("notes.txt", "not a slice");
  const SourceVolume v = read_volume(folder.path(), kSpaced);
  CHECK(v.grid == kSmall);
  CHECK(same_values(v, counting<float>()));
  CHECK(v.note.starts_with("slices in the order of the numbers in their names, slice8"));
  CHECK(refusal(folder.path()).find("spacing is not in the file") != std::string::npos);
}

TEST_CASE("values of 16 bits come whole from the largest and the smallest") {
  const TemporaryFolder folder;
  for (int z = 0; z < 2; ++z) {
    folder.write(
        "s" + std::to_string(z) + ".png",
        png(2, 1, 16, kGrey, bytes_of(std::vector<std::uint16_t>{0, 65535}, std::endian::big)));
  }
  const SourceVolume v = read_volume(folder.path(), kSpaced);
  CHECK(v.min == 0);
  CHECK(v.max == 65535);
}

TEST_CASE("pixels of a palette, with transparency or of less than 8 bits are no grey values") {
  const auto refused = [](const std::string& picture) {
    const TemporaryFolder folder;
    write_stack(folder, ".png", [&](int) { return picture; });
    const std::string message = refusal(folder.path(), kSpaced);
    CAPTURE(message);
    CHECK(is_one_line(message));
    return message.substr(message.find_last_of('/') + 1);
  };
  const std::string twelve(12, 'x'), more(24, 'x');
  CHECK(refused(png(3, 4, 8, 3, twelve, chunk("PLTE", more)))
            .starts_with("slice8.png: pixels of a pal"));
  CHECK(refused(png(3, 4, 8, 4, more)).starts_with("slice8.png: pixels of grey with transparency"));
  CHECK(refused(png(3, 4, 8, kGrey, twelve, chunk("tRNS", std::string(2, '\1'))))
            .starts_with("slice8.png: pixels of grey with transparency"));
  CHECK(refused(png(3, 4, 4, kGrey, std::string(8, 'x')))
            .starts_with("slice8.png: values of 4 bits"));
}

TEST_CASE("pictures that are no stack are refused in one line") {
  const auto grey = [](int z) { return png(3, 4, 8, kGrey, slice<std::uint8_t>(z)); };
  const auto refused = [](const std::string& end, const std::function<std::string(int)>& bytes,
                          const std::string& what) {
    const TemporaryFolder folder;
    write_stack(folder, end, bytes);
    const std::string message = refusal(folder.path(), kSpaced);
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK(has(message, what));
  };
  refused(
      ".png", [](int) { return png(3, 4, 8, kRgba, std::string(std::size_t{4} * 12, 'x')); },
      "slice8.png: pixels of colours");
  refused(
      ".png", [&](int z) { return z == 3 ? png(4, 3, 8, kGrey, slice<std::uint8_t>(z)) : grey(z); },
      "slice11.png: 4 x 3 pixels, and slice8.png has 3 x 4");
  refused(
      ".png", [&](int z) { return z == 2 ? grey(z).substr(0, 50) : grey(z); }, "slice10.png");
  refused(
      ".png", [&](int z) { return z == 2 ? "no picture" : grey(z); }, "slice10.png");
  refused(
      ".tif",
      [](int z) {
        return tiff({{slice<std::uint8_t>(z)}, {slice<std::uint8_t>(z)}});
      },
      "slice8.tif");
  refused(
      ".png",
      [&](int z) {
        return z == 3 ? png(3, 4, 16, kGrey, slice<std::uint16_t>(z, std::endian::big)) : grey(z);
      },
      "slice11.png: values of uint16, and slice8");
  refused(
      ".tif",
      [](int z) {
        return z == 3 ? one_page(16, slice<std::uint16_t>(z)) : one_page(8, slice<std::uint8_t>(z));
      },
      "slice11.tif: values of uint16, and slice8");
  const TemporaryFolder folder;
  folder.write("a.png", grey(0));
  CHECK(has(refusal(folder.path(), kSpaced), "one picture"));
}

TEST_CASE("a stack that is not whole, or not one, is refused by the slice") {
  const auto grey = [](int z) { return png(3, 4, 8, kGrey, slice<std::uint8_t>(z % 5)); };
  const auto refused = [&](const std::vector<std::string>& names) {
    const TemporaryFolder folder;
    int z = 0;
    for (const std::string& name : names) {
      folder.write(name,
                   name.ends_with(".tif") ? one_page(8, slice<std::uint8_t>(z % 5)) : grey(z));
      ++z;
    }
    const std::string message = refusal(folder.path(), kSpaced);
    CAPTURE(message);
    if (message != "no error") CHECK(is_one_line(message));
    return message.substr(message.find_last_of('/') + 1);
  };
  const std::string whole = "no error";
  CHECK(refused({"s1.png", "s2.png", "s3.png", "s5.png"})
            .starts_with("s5.png: follows s3.png, s4.png is missing; "));
  CHECK(refused({"s008.tif", "s009.tif", "s011.tif"})
            .starts_with("s011.tif: follows s009.tif, s010.tif is missing"));
  CHECK(refused({"s1.png", "s2.png", "s4.png", "s6.png", "s8.png"})
            .starts_with("s2.png: follows s1.png, where steps of 2 are usual;"));
  CHECK(refused({"s0.png", "s5.png", "s10.png", "s15.png"}) == whole);
  CHECK(has(refused({"s0.png", "s5.png", "s15.png", "s20.png"}), "s10.png is missing"));
  CHECK(has(refused({"s1.png", "s01.png", "s2.png", "s3.png"}), "has the same number as s"));
  CHECK(has(refused({"s1.png", "s1.PNG"}), "has the same number as s1."));
  CHECK(refused({"a1.png", "a2.png", "b1.png", "b2.png"})
            .starts_with("b1.png: is no slice of the stack of a1.png; keep one stack"));
  CHECK(refused({"t1_z1.png", "t1_z2.png", "t2_z1.png", "t2_z2.png"})
            .starts_with("t2_z1.png: is no slice of the stack of t1_z1.png"));
  CHECK(refused({"cover.png", "s1.png", "s2.png"}).starts_with("cover.png: is no slice"));
  CHECK(refused({"s1.png", "s2.png", "s3.png", "s4.tif"}).starts_with("s4.tif: a TIFF among PNG"));
  CHECK(has(refused({"s1.png", "s99999999999999999999.png"}), "is no number of a slice"));
  CHECK(refused({"scan2_s1_8bit.png", "scan2_s2_8bit.png", "scan2_s3_8bit.png"}) == whole);
  CHECK(refused({"left.png", "right.png"}).starts_with("left.png: has no number in its name"));
  CHECK(refused({"s1.png", "s2.png", "._s1.png", ".hidden.png"}) == whole);
}

TEST_CASE("a file without a header is what its layout says") {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& bytes, const RawLayout& layout) {
    ReadOptions options = kSpaced;
    options.raw = layout;
    return read_volume(folder.write("voxels", bytes), options);
  };
  CHECK(same_values(read(bytes_of(counting<std::uint8_t>()), {kSmall, VoxelType::uint8}),
                    counting<float>()));
  CHECK(same_values(
      read(bytes_of(counting<std::int16_t>(), std::endian::big), {kSmall, VoxelType::int16, true}),
      counting<float>()));
  CHECK(same_values(read("header" + bytes_of(counting<double>(), std::endian::big),
                         {kSmall, VoxelType::float64, true, 6}),
                    counting<float>()));
  CHECK(same_values(read(bytes_of(counting<std::int64_t>()), {kSmall, VoxelType::int64}),
                    counting<float>()));
}

TEST_CASE("axes that no file names are said, and any that are given are obeyed, mirrored or not") {
  const TemporaryFolder folder;
  const auto raw = folder.write("a.bin", bytes_of(counting<std::uint16_t>()));
  const auto read = [&](const std::string& axes) {
    return read_volume(raw, {.spacing_mm = std::array<double, 3>{1, 2, 3},
                             .raw = RawLayout{kSmall, VoxelType::uint16, false, 0},
                             .axes = axes});
  };
  CHECK(has(read("").axes_note, "LPS (columns to the left, rows to the back, slices to the top"));
  constexpr std::array<std::string_view, 2> kLetters{"LPS", "rai"};  // in any case
  std::array<std::size_t, 3> order{0, 1, 2};
  int ways = 0;
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      FilePlaces places{{}, {}};
      std::string axes;
      for (std::size_t a = 0; a < 3; ++a) {
        const unsigned back = signs >> a & 1;
        axes += kLetters[back][order[a]];
        places.steps[a] = {};
        places.steps[a][order[a]] = static_cast<double>(a + 1) * (back != 0 ? -1 : 1);
      }
      CAPTURE(axes);
      const SourceVolume v = read(axes);
      CHECK(misplaced(v, places).empty());
      CHECK(v.axes_note.empty());
      ++ways;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  CHECK(ways == 48);
  for (const char* wrong : {"LP", "LPSS", "LRS", "LPX", "lp1", "LLP", "L P"}) {
    CHECK(has(test::error_of([&] { static_cast<void>(read(wrong)); }),
              std::string("--axes: ") + wrong + " is not three letters"));
  }
  const auto named = folder.write(
      "b.nrrd", nrrd("uint8", "space: LPS\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n") + "\n" +
                    bytes_of(counting<std::uint8_t>()));
  CHECK(read_volume(named).axes_note.empty());
  CHECK(has(refusal(named, {.axes = "RAS"}), "b.nrrd has axes; leave it out"));
}

TEST_CASE("a file without a header is refused where its size is not that of the layout") {
  const TemporaryFolder folder;
  const auto path = folder.write("voxels.raw", bytes_of(counting<std::uint16_t>()));
  const auto refused = [&](const RawLayout& layout) {
    ReadOptions options = kSpaced;
    options.raw = layout;
    const std::string message = refusal(path, options);
    CAPTURE(message);
    CHECK(is_one_line(message));
    return message;
  };
  CHECK(has(refused({{3, 4, 6}, VoxelType::uint16}), "120 bytes of voxels"));
  CHECK(has(refused({{3, 4, 4}, VoxelType::uint16}), "--skip 24"));
  CHECK(has(refused({kSmall, VoxelType::uint16, false, 200}), "0 bytes of voxels"));
  CHECK(refused({{1024, 1024, 1024}, VoxelType::float64}) != "no error");
}

}  // namespace kerf::slice_stack_test
