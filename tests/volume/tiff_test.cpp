// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "controller/volume/file/volume_image.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::tiff_test {

using namespace kerf::test;

namespace {

constexpr std::uint16_t kNewSubfileType = 254, kSubfileType = 255, kPhotometric = 262,
                        kStripOffsets = 273, kOrientation = 274, kSamples = 277,
                        kRowsPerStrip = 278, kStripBytes = 279, kXResolution = 282,
                        kYResolution = 283, kResolutionUnit = 296, kTileWidth = 322,
                        kTileLength = 323, kTileOffsets = 324, kTileBytes = 325, kSubIfd = 330,
                        kSampleFormat = 339, kImageDepth = 32997;
const ReadOptions kSpaced{.spacing_mm = std::array<double, 3>{0.5, 0.5, 2}};

std::vector<TiffPage> five() {
  std::vector<TiffPage> pages;
  for (int z = 0; z < 5; ++z) pages.push_back({slice<std::uint8_t>(z)});
  return pages;
}

/// A page that another one is about.
TiffPage extra(std::uint32_t kind, std::uint32_t width = 3) {
  TiffPage page{std::string(std::size_t{4} * width, '\x7f'), width};
  page.longs[kNewSubfileType] = {kind};
  if ((kind & 4) != 0) page.shorts[kPhotometric] = {4};
  return page;
}

SourceVolume read(const std::vector<TiffPage>& pages, std::endian order = std::endian::little) {
  const TemporaryFolder folder;
  return read_volume(folder.write("a.tif", tiff(pages, order)), kSpaced);
}

void check_counting(const SourceVolume& v) {
  CHECK(v.grid == kSmall);
  CHECK(same_values(v, counting<float>()));
}

std::string refusal_of(const std::vector<TiffPage>& pages) {
  const TemporaryFolder folder;
  const std::string message = refusal(folder.write("a.tif", tiff(pages)), kSpaced);
  CAPTURE(message);
  CHECK(is_one_line(message));
  return message;
}

/// What is refused if the page z = 2 is another.
std::string refusal_with(const std::function<void(TiffPage&)>& change) {
  std::vector<TiffPage> pages = five();
  change(pages[2]);
  return refusal_of(pages);
}

/// Of a description of the first page.
std::vector<TiffPage> described(const std::string& text) {
  std::vector<TiffPage> pages = five();
  pages[0].description = text;
  return pages;
}

}  // namespace

TEST_CASE("a TIFF of several pages is a volume, in both byte orders") {
  check_counting(read(five()));
  check_counting(read(five(), std::endian::big));
}

TEST_CASE_TEMPLATE("TIFF pages of every integer and floating type keep their values", T,
                   std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t,
                   std::uint32_t, std::int64_t, std::uint64_t, float, double) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    std::vector<TiffPage> pages;
    const std::uint16_t format = std::is_floating_point_v<T> ? 3 : std::is_signed_v<T> ? 2 : 1;
    for (int z = 0; z < 5; ++z) {
      std::string pixels = slice<T>(z, order);
      if (z == 0 && format != 1) pixels.replace(0, sizeof(T), bytes_of(T(-100), order));
      pages.push_back(
          {.pixels = pixels, .bits = 8 * sizeof(T), .shorts = {{kSampleFormat, {format}}}});
    }
    const SourceVolume v = read(pages, order);
    CHECK(v.values[0] == (format == 1 ? 0.0F : -100.0F));
    CHECK(v.values[1] == 1);
    CHECK(v.values[59] == 59);
  }
}

TEST_CASE(
    "copies, masks and depth maps among the pages of a TIFF are left out, and the note says so") {
  for (const std::size_t at : {0U, 2U, 5U}) {
    std::vector<TiffPage> pages = five();
    pages.insert(pages.begin() + static_cast<std::ptrdiff_t>(at), extra(1));
    check_counting(read(pages));
    pages.insert(pages.begin(),
                 {extra(4, 2), extra(3, 1), extra(5, 7), extra(0), extra(8), extra(16)});
    pages[3].shorts[kSubfileType] = {2};  // of TIFF 5.0
    const SourceVolume v = read(pages);
    check_counting(v);
    CHECK(v.note == "pages left out as copies, masks or depth maps: 7");
  }
  std::vector<TiffPage> many = five();
  for (int i = 0; i < 40; ++i) many.push_back(extra(i % 2 == 0 ? 4 : 1, 9));
  check_counting(read(many));
  std::vector<TiffPage> paged = five();
  for (TiffPage& page : paged) page.longs[kNewSubfileType] = {2};  // one of several
  check_counting(read(paged));
  CHECK(has(refusal_of({five()[0]}), "a.tif: one page; name the folder that holds all slices"));
  CHECK(has(refusal_of({extra(1), extra(4)}),
            "no page of it is a slice (pages left out as copies, masks or depth maps: 2)"));
}

TEST_CASE("a page within a page is left out, and the note says so") {
  std::vector<TiffPage> pages = five();
  pages[1].longs[kSubIfd] = {8};
  const SourceVolume v = read(pages);
  check_counting(v);
  CHECK(v.note == "images within its pages are left out");
}

TEST_CASE("a page that is no grey slice as the others is refused by its number") {
  CHECK(has(refusal_with([](TiffPage& p) {
              p = {std::string(12, 'x'), 4, 3};
            }),
            "page 3: 4 x 3 pixels of uint8, and the pages before have 3 x 4 pixels of uint8"));
  CHECK(has(refusal_with([](TiffPage& p) {
              p = {slice<std::uint16_t>(2), 3, 4, 16};
            }),
            "page 3: 3 x 4 pixels of uint16, and"));
  const auto with = [](std::uint16_t tag, std::uint16_t value) {
    return refusal_with([=](TiffPage& p) {
      p.shorts[tag] = {value};
      p.pixels += std::string(40, 'x');
    });
  };
  CHECK(has(refusal_with([](TiffPage& p) {
              p.shorts = {{kPhotometric, {3}}, {320, std::vector<std::uint16_t>(768, 7)}};
            }),
            "page 3: colours of a palette"));
  CHECK(has(with(kPhotometric, 2), "page 3: photometric interpretation 2"));
  CHECK(has(with(kSamples, 3), "page 3: 3 values per pixel"));
  CHECK(
      has(with(kOrientation, 4), "page 3: orientation 4, so its rows and columns do not run from"));
  CHECK(has(with(kImageDepth, 2), "page 3: a block of 2 slices"));
  CHECK(has(with(259, 34712), "page 3: compression 34712 cannot be unpacked"));
  CHECK(has(with(258, 12), "page 3: unsigned numbers of 12 bits"));
  CHECK(has(with(258, 1), "page 3: unsigned numbers of 1 bits"));
  CHECK(has(with(kSampleFormat, 3), "page 3: floats of 8 bits"));
  CHECK(has(with(kSampleFormat, 5), "page 3: complex or unknown numbers"));
}

TEST_CASE("a TIFF that shows 0 as white, or leaves its kind of number open, keeps its values") {
  std::vector<TiffPage> pages = five();
  for (TiffPage& page : pages) page.shorts = {{kPhotometric, {0}}, {kSampleFormat, {4}}};
  const SourceVolume v = read(pages);
  check_counting(v);
  CHECK(v.note == "it shows 0 as white, its values are taken as they are");
}

TEST_CASE("strips in any order and tiles beyond the border give the same slices") {
  std::vector<TiffPage> strips = five(), tiles = five();
  for (std::size_t z = 0; z < 5; ++z) {
    const std::string rows = five()[z].pixels;
    TiffPage& page = strips[z];
    page.pixels = rows.substr(9) + rows.substr(0, 9);  // the last row first; all pages are as long
    const auto at = static_cast<std::uint32_t>(
        tiff({strips.begin(), strips.begin() + static_cast<std::ptrdiff_t>(z)}).size());
    page.longs = {{kRowsPerStrip, {3}}, {kStripOffsets, {at + 3, at}}, {kStripBytes, {9, 3}}};

    std::string tile(256, '\x55');
    for (std::size_t y = 0; y < 4; ++y) tile.replace(16 * y, 3, rows.substr(3 * y, 3));
    TiffPage& tiled = tiles[z];
    tiled.pixels = tile;
    const auto begin = static_cast<std::uint32_t>(
        tiff({tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(z)}).size());
    tiled.longs = {
        {kTileWidth, {16}}, {kTileLength, {16}}, {kTileOffsets, {begin}}, {kTileBytes, {256}}};
  }
  check_counting(read(strips));
  check_counting(read(tiles));
}

TEST_CASE("a TIFF that is cut off, or whose pages do not end, is refused") {
  const TemporaryFolder folder;
  const std::string whole = tiff(five());
  for (std::size_t held = 0; held < whole.size(); held += 7) {
    const std::string message = refusal(folder.write("a.tif", whole.substr(0, held)), kSpaced);
    CAPTURE(held);
    CAPTURE(message);
    CHECK(is_one_line(message));
  }
  std::string endless = whole;  // the last page is followed by the first
  endless.replace(whole.size() - 4, 4, whole.substr(4, 4));
  const std::string message = refusal(folder.write("b.tif", endless), kSpaced);
  CHECK(has(message, "b.tif: cannot be read ("));
  CHECK(is_one_line(message));
}

TEST_CASE("spacing that ImageJ or OME-XML names is known, a resolution for printing is not") {
  const TemporaryFolder folder;
  ReadOptions open;
  open.allow_missing_spacing = true;
  const auto with = [&](const std::string& description, std::uint16_t unit) {
    std::vector<TiffPage> pages = described(description);
    pages[0].ratios = {{kXResolution, {4, 1}}, {kYResolution, {2, 1}}};
    pages[0].shorts[kResolutionUnit] = {unit};
    return read_volume(folder.write("a.tif", tiff(pages)), open);
  };
  const std::array<double, 3> wanted{0.25, 0.5, 0.75};
  const std::string stack = "ImageJ=1.53t\nimages=5\nslices=5\n";
  const SourceVolume mm = with(stack + "unit=mm\nspacing=0.75\nloop=false\n", 1);
  check_counting(mm);
  CHECK(mm.spacing_known == kAllAxes);
  CHECK(mm.spacing_mm == wanted);
  const SourceVolume um = with(stack + "unit=\\u00B5m\nspacing=750.0\n", 1);
  CHECK(um.spacing_mm == std::array<double, 3>{0.25e-3, 0.5e-3, 0.75});
  CHECK(with(stack + "unit=pixel\nspacing=0.75\n", 1).spacing_known == 0);
  CHECK(with(stack + "unit=mm\n", 1).spacing_known == 0b011);
  const SourceVolume ome = with(
      "<?xml?><OME><Image><Pixels SizeX=\"3\" SizeY=\"4\" SizeC=\"1\" SizeT=\"1\"\nSizeZ=\"5\" "
      "PhysicalSizeX=\"0.25\" PhysicalSizeXUnit=\"mm\" PhysicalSizeY=\"500\" "
      "PhysicalSizeZ=\"0.75\" PhysicalSizeZUnit=\"mm\"><TiffData IFD=\"0\" PlaneCount=\"5\"/>"
      "</Pixels></Image></OME>",
      2);
  CHECK(ome.spacing_known == kAllAxes);
  CHECK(ome.spacing_mm == wanted);
  const SourceVolume print = with("a scan", 3);
  CHECK(print.spacing_known == 0);
  CHECK(print.note ==
        "its resolution for printing, 2.5 x 5 mm a pixel, is not taken as its spacing");
}

TEST_CASE("ImageJ's straight line is applied, another calibration refused") {
  std::vector<TiffPage> pages;
  for (int z = 0; z < 5; ++z) pages.push_back({.pixels = slice<std::uint16_t>(z), .bits = 16});
  const auto with = [&](const std::string& lines) {
    pages[0].description = "ImageJ=1.53t\nimages=5\nslices=5\n" + lines + "vunit=HU\n";
    return pages;
  };
  const SourceVolume v = read(with("cf=0\nc0=-32768.0\nc1=1.0\n"));
  CHECK(v.min == -32768);
  CHECK(v.values[59] == 59 - 32768);
  CHECK(v.values.bytes().size() == 120);
  check_counting(read(with("cf=20\n")));
  CHECK(has(refusal_of(with("cf=3\nc0=1.0\nc1=1.0\n")),
            "calibration function 3 is no straight line"));
}

TEST_CASE("pages of several channels or times, or fewer pages than images, are no volume") {
  const std::string image_j = "ImageJ=1.53t\n";
  CHECK(has(refusal_of(described(image_j + "images=10\nslices=5\nframes=2\n")),
            "its description has slices and frames; save one volume"));
  CHECK(has(refusal_of(described(image_j + "images=20\nslices=20\n")),
            "its description names 20 images, and the file has pages for 5"));
  const SourceVolume frames = read(described(image_j + "images=5\nframes=5\n"));
  check_counting(frames);
  CHECK(frames.note == "its frames are taken as slices");
  CHECK(has(refusal_of(described("<OME><Pixels SizeC=\"2\" SizeZ=\"5\" SizeT=\"1\"/></OME>")),
            "its description has SizeC and SizeZ"));
  CHECK(has(refusal_of(described("<OME><Pixels SizeC=\"1\" SizeZ=\"5\" SizeT=\"1\">"
                                 "<TiffData FirstZ=\"4\" IFD=\"0\"/></Pixels></OME>")),
            "OME-XML has the pages in another order"));
  CHECK(has(refusal_of(described(image_j + "images=5\nchannels=5\n")),
            "its description has 5 channels; save one of them"));
  CHECK(has(refusal_of(described("<OME><Pixels SizeC=\"5\" SizeZ=\"1\" SizeT=\"1\"/></OME>")),
            "its description has 5 channels"));
  CHECK(has(refusal_of(described("{\"shape\": [5, 4, 3], \"axes\": \"CYX\"}")),
            "its description has 5 channels"));
  CHECK(read(described("{\"shape\": [5, 4, 3], \"axes\": \"TYX\"}")).note ==
        "its frames are taken as slices");
  CHECK(has(refusal_of(described("{\"shape\": [2, 5, 4, 3]}")), "axis 1 and axis 2"));
  check_counting(read(described("{\"shape\": [1, 5, 4, 3], \"axes\": \"CZYX\"}")));
  check_counting(read(described("{\"shape\": [4, 3]}")));
}

}  // namespace kerf::tiff_test
