// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iostream>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "controller/input/sandbox.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::read_test {

using namespace kerf::test;

namespace {

using Three = std::array<double, 3>;

void check_counting(const SourceVolume& v) {
  CHECK(v.grid == kSmall);
  CHECK(same_values(v, counting<float>()));
  CHECK(v.min == 0.0);
  CHECK(v.max == 59.0);
  CHECK(v.spacing_mm == Three{1, 2, 3});
  CHECK(v.spacing_known == kAllAxes);
}

}  // namespace

TEST_CASE("NRRD is read attached and detached, in both byte orders, raw, gzip and text") {
  const TemporaryFolder folder;
  const std::string little = "endian: little\n" + kSpacings;
  const std::string big = "endian: big\n" + kSpacings;
  const auto u16 = bytes_of(counting<std::uint16_t>());
  const auto u16_big = bytes_of(counting<std::uint16_t>(), std::endian::big);

  check_counting(read_volume(folder.write("a.nrrd", nrrd("ushort", little) + "\n" + u16)));
  check_counting(read_volume(folder.write("b.nrrd", nrrd("ushort", big) + "\n" + u16_big)));
  check_counting(
      read_volume(folder.write("c.nrrd", nrrd("ushort", little, "gzip") + "\n" + gzipped(u16))));

  folder.write("voxels.bin", u16_big);
  check_counting(
      read_volume(folder.write("d.nhdr", nrrd("ushort", big + "data file: voxels.bin\n"))));
  folder.write("voxels.gz", gzipped(u16));
  check_counting(read_volume(
      folder.write("e.nhdr", nrrd("ushort", little + "data file: voxels.gz\n", "gzip"))));

  std::ostringstream words;
  for (const int value : counting<int>()) words << value << '\n';
  check_counting(
      read_volume(folder.write("f.nrrd", nrrd("short", kSpacings, "ascii") + "\n" + words.str())));
}

TEST_CASE("MetaImage is read attached and detached, in both byte orders") {
  const TemporaryFolder folder;
  const auto u16 = bytes_of(counting<std::uint16_t>());
  const auto u16_big = bytes_of(counting<std::uint16_t>(), std::endian::big);
  check_counting(read_volume(folder.write("a.mha", meta("MET_USHORT", kElementSpacing) + u16)));
  check_counting(read_volume(folder.write(
      "b.mha", meta("MET_USHORT", "ElementByteOrderMSB = True\n" + kElementSpacing) + u16_big)));
  folder.write("voxels.raw", u16);
  check_counting(
      read_volume(folder.write("c.mhd", meta("MET_USHORT", kElementSpacing, "voxels.raw"))));
}

TEST_CASE("a spacing of the options fills in what the file lacks") {
  const TemporaryFolder folder;
  const auto path =
      folder.write("a.nrrd", nrrd("uint8", "") + "\n" + bytes_of(counting<std::uint8_t>()));
  const SourceVolume v = read_volume(path, {.spacing_mm = Three{0.5, 0.25, 0.125}});
  CHECK(v.spacing_mm == Three{0.5, 0.25, 0.125});
  CHECK(v.spacing_known == kAllAxes);
  CHECK(v.note.empty());
}

TEST_CASE("a spacing of the options that contradicts the file is refused with both values") {
  const TemporaryFolder folder;
  const auto path =
      folder.write("a.nrrd", nrrd("uint8", kSpacings) + "\n" + bytes_of(counting<std::uint8_t>()));
  CHECK(read_volume(path, {.spacing_mm = Three{1, 2, 3}}).note.empty());
  for (const auto& [given, what] :
       {std::pair{Three{1, 2, 2}, "spacing 2 mm along z is given, and the file has 3;"},
        {Three{1, 2.001, 3}, "spacing 2.001 mm along y is given, and the file has 2;"},
        {Three{3, 2, 1}, "spacing 3 mm along x is given, and the file has 1;"}}) {
    const std::string message = refusal(path, {.spacing_mm = given});
    CAPTURE(message);
    CHECK(has(message, what));
    CHECK(has(message, "--override-spacing"));
    CHECK(is_one_line(message));
  }
}

TEST_CASE("a spacing that is the file's but for rounding is accepted, and the file's is used") {
  const TemporaryFolder folder;
  const auto read = [&](const char* in_file, double given) {
    const auto path =
        folder.write("a.nrrd", nrrd("uint8", std::string("spacings: ") + in_file + " 1 1\n") +
                                   "\n" + bytes_of(counting<std::uint8_t>()));
    return read_volume(path, {.spacing_mm = Three{given, 1, 1}});
  };
  const SourceVolume v = read("0.48828125", 0.488);
  CHECK(v.spacing_mm == Three{0.48828125, 1, 1});
  CHECK(has(v.note, "spacing 0.488 mm along x is given, rounded; the file's 0.48828125 is used"));
  CHECK(read("0.488281", 0.48828125).spacing_mm[0] == 0.488281);
  CHECK(read("0.7000000000000001", 0.7).note.empty());  // noise of floats is no rounding
  CHECK(read("0.699999988079071", 0.7).note.empty());
  CHECK_THROWS_AS(static_cast<void>(read("0.70001", 0.7)), LoadError);
  CHECK_THROWS_AS(static_cast<void>(read("0.48828125", 0.487)), LoadError);
  CHECK_THROWS_AS(static_cast<void>(read("0.488", 0.5)), LoadError);  // another value
  CHECK_THROWS_AS(static_cast<void>(read("1", 1.0001)), LoadError);
}

TEST_CASE("a spacing that overrides replaces the file's, and the note has both") {
  const TemporaryFolder folder;
  const auto bytes = bytes_of(counting<std::uint8_t>());
  const auto with = folder.write("a.nrrd", nrrd("uint8", kSpacings) + "\n" + bytes);
  const SourceVolume v = read_volume(with, {.override_spacing_mm = Three{0.5, 0.25, 0.125}});
  CHECK(v.spacing_mm == Three{0.5, 0.25, 0.125});
  CHECK(v.note == "OVERRIDDEN: spacing 0.5 x 0.25 x 0.125 mm in place of the file's 1 x 2 x 3 mm");
  const auto without = folder.write("b.nrrd", nrrd("uint8", "") + "\n" + bytes);
  CHECK(read_volume(without, {.override_spacing_mm = Three{1, 1, 2}}).note ==
        "OVERRIDDEN: spacing 1 x 1 x 2 mm in place of the file's none");
  CHECK(has(refusal(with, {.spacing_mm = Three{1, 2, 3}, .override_spacing_mm = Three{1, 2, 3}}),
            "both given"));
  for (const double bad : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(has(refusal(with, {.override_spacing_mm = Three{1, 1, bad}}), "is not a voxel size"));
  }
}

TEST_CASE("a first look may go without spacing, and is told so") {
  const TemporaryFolder folder;
  const auto path =
      folder.write("a.nrrd", nrrd("uint8", "") + "\n" + bytes_of(counting<std::uint8_t>()));
  const SourceVolume v = read_volume(path, {.allow_missing_spacing = true});
  CHECK(v.spacing_known == 0);
  CHECK(v.spacing_mm == Three{1, 1, 1});
}

TEST_CASE("reading prints nothing, whatever the library has to say") {
  const TemporaryFolder folder;
  const auto cut = folder.write("a.mha", meta("MET_USHORT", kElementSpacing) + "too few");
  const std::ostringstream printed;
  std::streambuf* const before = std::cerr.rdbuf(printed.rdbuf());
  const std::string message = refusal(cut);
  std::cerr.rdbuf(before);
  CHECK(message != "no error");
  CHECK(printed.str().empty());
}

namespace {

const std::string kBytes = bytes_of(counting<std::uint16_t>());
const std::string kLittle = "endian: little\n" + kSpacings;

/// Reading `path` is refused in one line that holds `what`.
void check_refused(const std::filesystem::path& path, const std::string& what) {
  const std::string message = refusal(path);
  CAPTURE(message);
  CHECK(is_one_line(message));
  CHECK(has(message, what));
}

/// A file by its bytes, and why it is refused.
struct Refused {
  const char* name;
  std::string bytes;
  const char* why;
};
void check_refused(const std::vector<Refused>& files) {
  const TemporaryFolder folder;
  folder.write("half.raw", kBytes.substr(0, 60));
  for (const Refused& file : files) {
    CAPTURE(file.name);
    check_refused(folder.write(file.name, file.bytes), file.why);
  }
}

std::string nrrd_file(const std::string& more, const std::string& voxels = kBytes,
                      const std::string& encoding = "raw", const std::string& sizes = "3 4 5",
                      const std::string& type = "ushort") {
  return nrrd(type, more, encoding, sizes) + "\n" + voxels;
}
std::string mha_file(const std::string& more, const std::string& voxels = kBytes) {
  return meta("MET_USHORT", more) + voxels;
}
std::string packed_mha(const std::string& packed) {
  return mha_file("CompressedData = True\nCompressedDataSize = " + std::to_string(packed.size()) +
                      "\n" + kElementSpacing,
                  packed);
}

}  // namespace

TEST_CASE("a file that is not there, of no known kind or without a header is refused") {
  const TemporaryFolder folder;
  check_refused(folder / "nothing.nrrd", "nothing.nrrd: no such file");
  std::filesystem::create_symlink("around.nrrd", folder / "around.nrrd");
  check_refused(folder / "around.nrrd", "cannot be reached");
  check_refused(
      {{"a.nhdr", nrrd("ushort", kLittle + "data file: gone.raw\n"), "gone.raw cannot be read"},
       {"a.mhd", meta("MET_USHORT", kElementSpacing, "gone.raw"), "gone.raw cannot be read"},
       {"a.png", "x", "not a kind of volume"},
       {"a.nrrd", "something else", "no NRRD header"},
       {"a.mha", "something else", "no MetaImage header"},
       {"a.nii", "short", "no NIfTI header"},
       {"a.dcm", "short", "cannot be read"}});
  const auto raw = folder.write("tooth.raw", kBytes);
  check_refused(raw, "120 bytes without a header; ./kerf volume import takes it with --dims");
  folder.write("tooth.mhd", meta("MET_USHORT", kElementSpacing, "tooth.raw"));
  check_refused(raw, "name its header tooth.mhd");
}

TEST_CASE("a file whose voxels are not all there, or broken, is refused in every format") {
  const std::string half = kBytes.substr(0, 60), packed = gzipped(kBytes);
  const std::string whole = nifti({}) + bytes_of(counting<float>()), packed_whole = gzipped(whole);
  std::string flipped = packed;
  flipped[packed.size() / 2] = static_cast<char>(~flipped[packed.size() / 2]);
  std::string checked = packed;
  checked[checked.size() - 6] = static_cast<char>(~checked[checked.size() - 6]);  // the checksum
  const std::string longer = gzipped(bytes_of(counting<std::uint16_t>(80)));
  check_refused(
      {{"a.nrrd", nrrd_file(kLittle, half), "60 of 120 bytes"},
       {"b.nrrd", nrrd_file(kLittle, gzipped(half), "gzip"), "60 of 120 bytes"},
       {"c.nrrd", nrrd_file(kLittle, packed.substr(0, packed.size() - 30), "gzip"), "of 120 bytes"},
       {"d.nrrd", nrrd_file(kLittle, checked, "gzip"), "d.nrrd: its packed voxels are broken"},
       {"e.nrrd", nrrd_file(kLittle, longer, "gzip"), "e.nrrd: holds more voxels than its header"},
       {"d.nhdr", nrrd("ushort", kLittle + "data file: half.raw\n"), "60 of 120 bytes"},
       {"e.mha", mha_file(kElementSpacing, half), "60 of 120 bytes"},
       {"f.mhd", meta("MET_USHORT", kElementSpacing, "half.raw"), "60 of 120 bytes"},
       {"g.mha",
        mha_file("CompressedData = True\nCompressedDataSize = 200\n" + kElementSpacing,
                 packed.substr(0, 40)),
        "of 120 bytes"},
       {"h.mha", packed_mha(flipped), "h.mha: its packed voxels are broken"},
       {"i.mha", packed_mha(gzipped(half)), "i.mha: 60 of 120 bytes"},
       {"h.nii", whole.substr(0, 400), "48 of 240 bytes"},
       {"i.nii.gz", gzipped(whole.substr(0, 400)), "48 of 240 bytes"},
       {"j.nii.gz", packed_whole.substr(0, packed_whole.size() - 40), "of 240 bytes"}});
  const TemporaryFolder folder;
  CHECK(refusal(folder.write("b.mha", packed_mha(packed))) == "no error");
}

TEST_CASE("a header that promises more than its file or the limits hold takes no memory") {
  const std::string huge = "1024 1024 512";  // of 8 bytes each: 4 GiB
  NiftiSpec wide, flat;
  wide.dim = {2000, 4, 5};
  flat.dim = {3, 0, 5};
  check_refused(
      {{"a.nrrd", nrrd_file(kLittle, kBytes, "raw", huge, "double"), "120 of 4294967296 bytes"},
       {"b.nrrd", nrrd_file(kLittle, kBytes, "gzip", huge, "double"), "of 4294967296 bytes"},
       {"c.nrrd", nrrd_file(kLittle, "1 2 3", "ascii", huge, "double"), "24 of 4294967296 bytes"},
       {"d.mha",
        "ObjectType = Image\nNDims = 3\nDimSize = 1024 1024 512\nBinaryData = False\nElementType = "
        "MET_DOUBLE\n" +
            kElementSpacing + "ElementDataFile = LOCAL\n1 2 3",
        "24 of 4294967296 bytes"},
       {"e.nrrd", nrrd_file(kLittle, kBytes, "raw", "0 4 5"), "is empty"},
       {"f.nrrd", nrrd_file(kLittle, kBytes, "raw", "1025 4 5"), "above the limit"},
       {"g.nrrd", nrrd_file(kLittle, kBytes, "raw", "1024 1024 513"), "above the limit"},
       {"h.nrrd", nrrd_file(kLittle, kBytes, "raw", "4294967299 4 5"),
        "4294967299 x 4 x 5"},  // 3 in 32 bits
       {"a.nii", nifti(wide), "above the limit"},
       {"b.nii", nifti(flat), "is empty"}});
}

TEST_CASE("what is not one finite grey value per voxel of three axes at right angles is refused") {
  NiftiSpec times, rgb, big;
  times.dim = {3, 4, 5, 2};
  rgb.datatype = 128;
  rgb.bits = 24;
  big.order = std::endian::big;
  std::vector<float> values = counting<float>();
  values[16] = std::numeric_limits<float>::quiet_NaN();  // (1, 1, 1)
  values[40] = std::numeric_limits<float>::infinity();
  const std::string floats = bytes_of(values);
  const std::string doubles = bytes_of(std::vector<double>(values.begin(), values.end()));
  const char* const nan = "2 voxels are NaN or infinite, the first at (1, 1, 1)";
  const std::string axes = "encoding: raw\nendian: little\nspacings: ";
  check_refused(
      {{"a.nrrd", "NRRD0004\ntype: ushort\ndimension: 2\nsizes: 6 10\n" + axes + "1 1\n\n" + kBytes,
        "2 axes"},
       {"b.nrrd",
        "NRRD0004\ntype: ushort\ndimension: 4\nsizes: 2 3 2 5\n" + axes +
            "nan 1 1 1\nkinds: vector domain domain domain\n\n" + kBytes,
        "2 values per voxel"},
       {"c.mha",
        "ObjectType = Image\nNDims = 3\nDimSize = 2 2 5\nElementNumberOfChannels = 3\nElementType "
        "= MET_USHORT\n"
        "ElementSpacing = 1 1 1\nElementDataFile = LOCAL\n" +
            kBytes,
        "3 values per voxel"},
       {"d.nii", nifti(times) + bytes_of(counting<float>(120)), "2 volumes along axis 4"},
       {"e.nii", nifti(rgb) + std::string(180, 'x'), "voxels of type 128, colours"},
       {"f.nrrd",
        nrrd_file("endian: little\nspace: left-posterior-superior\nspace directions: (1,0,0) "
                  "(0.1,1,0) (0,0,1)\n"
                  "space origin: (0,0,0)\n"),
        "not at right angles"},
       {"g.nrrd", nrrd_file(kLittle, floats, "raw", "3 4 5", "float"), nan},
       {"h.nrrd", nrrd_file(kLittle, doubles, "raw", "3 4 5", "double"), nan},
       {"a.mha", meta("MET_FLOAT", kElementSpacing) + floats, nan},
       {"a.nii", nifti({}) + floats, nan},
       {"b.nii.gz", gzipped(nifti({}) + floats), nan},
       {"c.nii", nifti(big) + bytes_of(values, big.order), nan}});
}

TEST_CASE(
    "a spacing that is missing, not positive or no number is refused, with the two ways to give "
    "it") {
  const auto spaced = [](const std::string& line) { return nrrd_file("endian: little\n" + line); };
  NiftiSpec zero;
  zero.pixdim = {1, 0, 3};
  zero.sform = false;
  const std::string floats = bytes_of(counting<float>());
  check_refused({{"a.nrrd", spaced(""), "spacing is not in the file"},
                 {"a.nrrd", spaced(""), "`spacing_mm = [x, y, z]`"},
                 {"a.nrrd", spaced(""), "`--spacing x,y,z`"},
                 {"a.mha", mha_file(""), "spacing is not in the file"},
                 {"a.nii", nifti(zero) + floats, "spacing along y is not in the file"},
                 {"b.nrrd", spaced("spacings: 1 -2 1\n"), "1 -2 1 mm is not a voxel size"},
                 {"c.nrrd", spaced("spacings: 1 0 1\n"), "1 0 1 mm is not a voxel size"},
                 {"b.mha", mha_file("ElementSpacing = 0 1 1\n"), "0 1 1 mm is not a voxel size"}});
  for (const std::string word : {"nan", "inf", "-inf", "x", "1e999"}) {
    check_refused({{"a.nrrd", spaced("spacings: " + word + " 1 1\n"), ""},
                   {"b.nrrd",
                    spaced("space: left-posterior-superior\nspace directions: (" + word +
                           ",0,0) (0,1,0) (0,0,1)\n"),
                    ""},
                   {"a.mha", mha_file("ElementSpacing = " + word + " 1 1\n"), ""}});
  }
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), infinity, -infinity}) {
    NiftiSpec spec;
    spec.pixdim = {1, bad, 3};
    check_refused({{"a.nii", nifti(spec) + floats, ""}});
  }
  const TemporaryFolder folder;
  ReadOptions options;
  options.spacing_mm = {1, std::numeric_limits<double>::quiet_NaN(), 1};
  CHECK(has(refusal(folder.write("a.nrrd", spaced(kSpacings)), options), "not a voxel size"));
}

TEST_CASE("a pipe, a socket, a device or a folder in the place of a volume is refused at once") {
  const TemporaryFolder folder;
  const std::string pipe = (folder / "pipe.nrrd").string();
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  check_refused(pipe, "pipe.nrrd: a pipe, socket or device; copy what it gives to a file");
  check_refused("/dev/zero", "/dev/zero: a pipe, socket or device");
  const std::string end = (folder / "end.nii").string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  REQUIRE(end.size() < sizeof address.sun_path);
  std::copy(end.begin(), end.end(), address.sun_path);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  REQUIRE(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  ::close(listener);
  check_refused(end, "end.nii: a pipe, socket or device");
  std::filesystem::create_symlink(pipe, folder / "link.mha");
  check_refused(folder / "link.mha", "link.mha: a pipe");
  std::filesystem::create_directory(folder / "empty.nrrd");
  check_refused(folder / "empty.nrrd", "no DICOM series");
  // Named by a header, and beside a series.
  check_refused(folder.write("a.nhdr", nrrd("ushort", kLittle + "data file: pipe.nrrd\n")),
                "pipe.nrrd cannot be read");
  check_refused(folder.write("a.mhd", meta("MET_USHORT", kElementSpacing, "pipe.nrrd")),
                "pipe.nrrd cannot be read");
  std::filesystem::create_directory(folder / "series");
  REQUIRE(::mkfifo((folder / "series/pipe.dcm").c_str(), 0600) == 0);
  check_refused(folder / "series", "no DICOM series");
}

namespace {

/// A whole file of one kind; read, it gives a volume or a mesh.
struct Sample {
  std::string name, bytes;
};

DicomSpec slices_in_one() {
  DicomSpec spec;
  spec.set(0x0028, 0x0008, "IS", "5");
  spec.set(0x0018, 0x0088, "DS", "1");
  spec.values = counting<std::int16_t>();
  return spec;
}

std::string stl(int triangles) {
  std::string bytes = std::string(80, 'k') + bytes_of(static_cast<std::uint32_t>(triangles));
  for (int i = 0; i < triangles; ++i) bytes += bytes_of(counting<float>(12)) + "\1\2";
  return bytes;
}

std::vector<Sample> samples() {
  const std::string u16 = bytes_of(counting<std::uint16_t>());
  const std::string little = "endian: little\n" + kSpacings;
  const std::string deflated = "CompressedData = True\n" + kElementSpacing;
  const std::string f32 = bytes_of(counting<float>());
  std::string text_stl = "solid a\n";
  for (int i = 0; i < 3; ++i) {
    text_stl += "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e-3 " +
                std::to_string(i) + "\nendloop\nendfacet\n";
  }
  return {{"raw.nrrd", nrrd("ushort", little) + "\n" + u16},
          {"gzip.nrrd", nrrd("ushort", little, "gzip") + "\n" + gzipped(u16)},
          {"ascii.nrrd", nrrd("short", kSpacings, "ascii") + "\n1 2 3 4 5 6 7 8 9 10 11 12 13 14 "
                                                             "15 16 17 18 19 20 21 22 23 24"},
          {"raw.mha", meta("MET_USHORT", kElementSpacing) + u16},
          {"packed.mha", meta("MET_USHORT", deflated) + gzipped(u16)},
          {"a.nii", nifti({}) + f32},
          {"a.nii.gz", gzipped(nifti({}) + f32)},
          {"a.dcm", dicom(slices_in_one())},
          {"binary.stl", stl(3)},
          {"text.stl", text_stl + "endsolid\n"}};
}

std::string read_as_named(const std::filesystem::path& path) {
  if (path.extension() != ".stl") return refusal(path);
  try {
    static_cast<void>(read_stl(path));
  } catch (const LoadError& error) {
    return error.what();
  }
  return "no error";
}

/// A broken file is one line or still a volume, and leaves nothing behind.
void check_survived(const TemporaryFolder& folder, const Sample& broken) {
  const std::string message = read_as_named(folder.write(broken.name, broken.bytes));
  CAPTURE(message);
  const bool fine = message == "no error" || is_one_line(message);
  CHECK(fine);
  CHECK(message.size() < 1000);
#ifdef KERF_SANITIZED  // what ends so has found a fault of our own
  CHECK(message.find("without a word") == std::string::npos);
#endif
  CHECK(waitpid(-1, nullptr, WNOHANG) == -1);
}

#ifdef KERF_FEWER_CASES
constexpr int kCases = 12;
#else
constexpr int kCases = 32;
#endif

}  // namespace

TEST_CASE("a file of any kind that is cut off anywhere gives one line, or a volume") {
  const TemporaryFolder folder;
  for (const Sample& whole : samples()) {
    CAPTURE(whole.name);
    for (int i = 0; i < kCases; ++i) {
      const auto length = whole.bytes.size() * static_cast<std::size_t>(i) / kCases;
      CAPTURE(length);
      check_survived(folder, {whole.name, whole.bytes.substr(0, length)});
    }
  }
}

TEST_CASE("a file of any kind with wrong bits anywhere gives one line, or a volume") {
  const TemporaryFolder folder;
  std::mt19937 random(17);
  for (const Sample& whole : samples()) {
    CAPTURE(whole.name);
    for (int i = 0; i < kCases; ++i) {
      CAPTURE(i);
      Sample broken = whole;
      for (unsigned flips = 1 + random() % 4; flips > 0; --flips) {
        char& byte = broken.bytes[random() % broken.bytes.size()];
        byte = static_cast<char>(byte ^ (1 << random() % 8));
      }
      check_survived(folder, broken);
    }
  }
}

TEST_CASE("what ends a library ends nothing else") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& name, const std::string& bytes,
                           const std::string& how) {
    const std::string message = refusal(folder.write(name, bytes));
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK(message.find((folder / name).string() + ": ") == 0);
    CHECK(has(message, how));
  };
  // A length of all ones, but for the lowest four bits, in a file that ends there: 4 GB.
  const std::string whole = dicom(slices_in_one());
  const std::size_t voxels = whole.size() - 60 * sizeof(std::int16_t);
  const std::string length = bytes_of(std::uint32_t{0xfffffff0});
  const std::string endless = whole.substr(0, voxels - 4) + length;
  for (const std::size_t left : {std::size_t{0}, std::size_t{8}, std::size_t{120}}) {
    refused("length.dcm", endless + whole.substr(voxels, left), "");
  }
  refused("cut.dcm", whole.substr(0, voxels - 6), "");
}

TEST_CASE("the reader of a small file takes little memory, whatever the file promises") {
  rusage before{};
  getrusage(RUSAGE_CHILDREN, &before);
  rusage own{};
  getrusage(RUSAGE_SELF, &own);
  const TemporaryFolder folder;
  for (const Sample& whole : samples()) {
    CAPTURE(whole.name);
    for (const std::size_t at : {whole.bytes.size() / 4, whole.bytes.size() / 2}) {
      std::string bytes = whole.bytes;
      bytes.replace(at, 4, std::string(4, '\xff'));
      check_survived(folder, {whole.name, bytes});
    }
  }
  rusage after{};
  getrusage(RUSAGE_CHILDREN, &after);
#ifndef KERF_SANITIZED  // whose allocator keeps what was freed
  // What a child shows is also what it inherited.
  const long most_kib =
      std::max(before.ru_maxrss, own.ru_maxrss) + static_cast<long>(kSandboxBytes >> 10);
  CHECK(after.ru_maxrss < most_kib);
#endif
}

}  // namespace kerf::read_test
