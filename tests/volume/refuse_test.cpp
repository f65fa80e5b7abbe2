// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

const std::string kBytes = bytes_of(counting<std::uint16_t>());
const std::string kLittle = "endian: little\n" + kSpacings;

/// Reading `path` is refused in one line that holds `what`.
void check_refused(const std::filesystem::path& path, const std::string& what) {
  const std::string message = refusal(path);
  CAPTURE(message);
  CHECK(is_one_line(message));
  CHECK(message.find(what) != std::string::npos);
}

}  // namespace

TEST_CASE("a missing file, a missing data file and an unknown kind are refused") {
  const TempFolder folder;
  check_refused(folder / "nothing.nrrd", "nothing.nrrd: no such file");
  check_refused(folder.write("a.nhdr", nrrd("ushort", kLittle + "data file: gone.raw\n")),
                "gone.raw cannot be read");
  check_refused(folder.write("a.mhd", meta("MET_USHORT", kElementSpacing, "gone.raw")),
                "gone.raw cannot be read");
  check_refused(folder.write("a.png", "x"), "not a kind of volume");
  check_refused(folder.write("a.nrrd", "something else"), "no NRRD header");
  check_refused(folder.write("a.mha", ""), "no MetaImage header");
  check_refused(folder.write("a.nii", "short"), "no NIfTI header");
  check_refused(folder.write("a.dcm", "short"), "cannot be read");
}

TEST_CASE("voxels without a header are refused with the name of the header beside them") {
  const TempFolder folder;
  const auto raw = folder.write("tooth.raw", kBytes);
  check_refused(raw, "120 bytes without a header; ./kerf volume import takes it with --dims");
  folder.write("tooth.mhd", meta("MET_USHORT", kElementSpacing, "tooth.raw"));
  check_refused(raw, "name its header tooth.mhd");
}

TEST_CASE("a file that ends too early is refused in every format") {
  const TempFolder folder;
  const std::string half = kBytes.substr(0, 60);
  check_refused(folder.write("a.nrrd", nrrd("ushort", kLittle) + "\n" + half), "60 of 120 bytes");
  check_refused(folder.write("b.nrrd", nrrd("ushort", kLittle, "gzip") + "\n" + gzipped(half)),
                "cannot be read");
  const std::string packed = gzipped(kBytes);
  check_refused(folder.write("c.nrrd", nrrd("ushort", kLittle, "gzip") + "\n" +
                                           packed.substr(0, packed.size() - 30)),
                "cannot be read");
  folder.write("half.raw", half);
  check_refused(folder.write("d.nhdr", nrrd("ushort", kLittle + "data file: half.raw\n")),
                "60 of 120 bytes");
  check_refused(folder.write("e.mha", meta("MET_USHORT", kElementSpacing) + half),
                "60 of 120 bytes");
  check_refused(folder.write("f.mhd", meta("MET_USHORT", kElementSpacing, "half.raw")),
                "60 of 120 bytes");
  check_refused(
      folder.write("g.mha", meta("MET_USHORT", "CompressedData = True\nCompressedDataSize = 200\n" +
                                                   kElementSpacing) +
                                packed.substr(0, 40)),
      "voxels are missing");
  const std::string whole = nifti({}) + bytes_of(counting<float>());
  check_refused(folder.write("h.nii", whole.substr(0, 400)), "48 of 240 bytes");
  check_refused(folder.write("i.nii.gz", gzipped(whole.substr(0, 400))), "48 of 240 bytes");
  const std::string packed_nifti = gzipped(whole);
  check_refused(folder.write("j.nii.gz", packed_nifti.substr(0, packed_nifti.size() - 40)),
                "of 240 bytes");
}

TEST_CASE("what MetaImage leaves out in silence is refused: data files, and what is packed") {
  const TempFolder folder;
  std::string names;
  for (const std::string name : {"a", "b", "c", "d", "e"}) {  // one layer each
    const auto at = static_cast<std::size_t>(name[0] - 'a') * 24;
    folder.write(name, kBytes.substr(at, 24));
    names += "\n" + name;
  }
  const auto listed = [&](const std::string& list) {
    return folder.write("a.mhd", meta("MET_USHORT", kElementSpacing, "LIST" + list));
  };
  CHECK(refusal(listed(names)) == "no error");
  check_refused(listed("\na\nb\nnowhere\nd\ne"), "a.mhd: voxels are missing");
  check_refused(listed("\na\nb\nc\nd"), "a.mhd: voxels are missing");

  const std::string packed = gzipped(kBytes);
  const auto with_size = [&](const std::string& bytes) {
    return folder.write(
        "b.mha", meta("MET_USHORT", "CompressedData = True\nCompressedDataSize = " +
                                        std::to_string(bytes.size()) + "\n" + kElementSpacing) +
                     bytes);
  };
  CHECK(refusal(with_size(packed)) == "no error");
  std::string flipped = packed;
  flipped[packed.size() / 2] = static_cast<char>(~flipped[packed.size() / 2]);
  check_refused(with_size(flipped), "b.mha: voxels are missing or broken");
  check_refused(with_size(gzipped(kBytes.substr(0, 60))), "b.mha: voxels are missing");
}

TEST_CASE("a NRRD whose lengths are no millimetres is refused, and one in mm is not") {
  const TempFolder folder;
  const auto with_units = [&](const std::string& units) {
    return folder.write("a.nrrd", nrrd("ushort", kLittle + units) + "\n" + kBytes);
  };
  for (const std::string unit : {"um", "\u00b5m", "m", "cm", "microns"}) {
    CAPTURE(unit);
    check_refused(with_units("units: \"" + unit + "\" \"" + unit + "\" \"" + unit + "\"\n"),
                  "a.nrrd: units: " + unit + " where kerf reads mm");
  }
  CHECK(refusal(with_units("units: \"mm\" \"mm\" \"mm\"\n")) == "no error");
  CHECK(refusal(with_units("units: \"\" \"\" \"\"\n")) == "no error");
}

TEST_CASE("a packed NRRD is good only to its checksum, whatever its reader stops at") {
  const TempFolder folder;
  const std::string head = nrrd("ushort", kLittle, "gzip") + "\n";
  const auto more = bytes_of(counting<std::uint16_t>(80));  // longer than the header says
  std::string packed = gzipped(more);
  CHECK(refusal(folder.write("a.nrrd", head + packed)) == "no error");
  packed[packed.size() - 6] = static_cast<char>(~packed[packed.size() - 6]);  // of the checksum
  check_refused(folder.write("b.nrrd", head + packed), "b.nrrd: its packed voxels are broken");
}

TEST_CASE("a header that promises more than its file can hold takes no memory") {
  const TempFolder folder;
  // 512 Mi voxels of 8 bytes would be 4 GiB.
  const std::string sizes = "1024 1024 512";
  check_refused(folder.write("a.nrrd", nrrd("double", kLittle, "raw", sizes) + "\n" + kBytes),
                "120 of 4294967296 bytes");
  check_refused(folder.write("b.nrrd", nrrd("double", kLittle, "gzip", sizes) + "\n" + kBytes),
                "of 4294967296 bytes");
  check_refused(folder.write("c.nrrd", nrrd("double", kLittle, "ascii", sizes) + "\n1 2 3"),
                "20 of 4294967296 bytes");
  check_refused(folder.write("d.mha",
                             "ObjectType = Image\nNDims = 3\nDimSize = 1024 1024 512\n"
                             "BinaryData = False\nElementType = MET_DOUBLE\n" +
                                 kElementSpacing + "ElementDataFile = LOCAL\n1 2 3"),
                "20 of 4294967296 bytes");
}

TEST_CASE("sizes of zero or above the limits are refused from the header") {
  const TempFolder folder;
  const auto sized = [&](const std::string& sizes) {
    return folder.write("a.nrrd", nrrd("ushort", kLittle, "raw", sizes) + "\n" + kBytes);
  };
  check_refused(sized("0 4 5"), "is empty");
  check_refused(sized("1025 4 5"), "above the limit");
  check_refused(sized("1024 1024 513"), "above the limit");
  check_refused(sized("4294967299 4 5"), "4294967299 x 4 x 5");  // 3 in 32 bits
  NiftiSpec spec;
  spec.dim = {2000, 4, 5};
  check_refused(folder.write("a.nii", nifti(spec)), "above the limit");
  spec.dim = {3, 0, 5};
  check_refused(folder.write("b.nii", nifti(spec)), "is empty");
}

TEST_CASE("what is not one grey value per voxel of three axes is refused") {
  const TempFolder folder;
  check_refused(folder.write("a.nrrd",
                             "NRRD0004\ntype: ushort\ndimension: 2\nsizes: 6 10\n"
                             "encoding: raw\nendian: little\nspacings: 1 1\n\n" +
                                 kBytes),
                "2 axes");
  check_refused(folder.write("b.nrrd",
                             "NRRD0004\ntype: ushort\ndimension: 4\nsizes: 2 3 2 5\n"
                             "encoding: raw\nendian: little\nspacings: nan 1 1 1\n"
                             "kinds: vector domain domain domain\n\n" +
                                 kBytes),
                "2 values per voxel");
  check_refused(folder.write("c.mha",
                             "ObjectType = Image\nNDims = 3\nDimSize = 2 2 5\n"
                             "ElementNumberOfChannels = 3\nElementType = MET_USHORT\n"
                             "ElementSpacing = 1 1 1\nElementDataFile = LOCAL\n" +
                                 kBytes),
                "3 values per voxel");
  NiftiSpec spec;
  spec.dim = {3, 4, 5, 2};
  check_refused(folder.write("d.nii", nifti(spec) + bytes_of(counting<float>(120))),
                "2 volumes along axis 4");
  spec.dim = {3, 4, 5};
  spec.datatype = 128;  // RGB
  spec.bits = 24;
  check_refused(folder.write("e.nii", nifti(spec) + std::string(180, 'x')), "3 values per voxel");
}

TEST_CASE("a path that cannot be reached is not told to be absent, and bzip2 is told by name") {
  const TempFolder folder;
  std::filesystem::create_symlink("around.nrrd", folder / "around.nrrd");
  check_refused(folder / "around.nrrd", "cannot be reached");
  check_refused(folder / "none.nrrd", "no such file or folder");
  for (const std::string word : {"bzip2", "BZ2"}) {
    check_refused(folder.write("a.nrrd", nrrd("ushort", kSpacings, word) + "\n" + kBytes),
                  "encoding: bzip2 cannot be unpacked; save it as gzip or raw");
  }
}

TEST_CASE("voxels that are not numbers are counted and the first is named") {
  const TempFolder folder;
  std::vector<float> values = counting<float>();
  values[16] = std::numeric_limits<float>::quiet_NaN();  // (1, 1, 1)
  values[40] = std::numeric_limits<float>::infinity();
  const std::string expected = "2 voxels are NaN or infinite, the first at (1, 1, 1)";
  check_refused(folder.write("a.nrrd", nrrd("float", kLittle) + "\n" + bytes_of(values)), expected);
  check_refused(folder.write("a.mha", meta("MET_FLOAT", kElementSpacing) + bytes_of(values)),
                expected);
  check_refused(folder.write("a.nii", nifti({}) + bytes_of(values)), expected);
  check_refused(folder.write("b.nii.gz", gzipped(nifti({}) + bytes_of(values))), expected);
  NiftiSpec big;
  big.order = std::endian::big;
  check_refused(folder.write("c.nii", nifti(big) + bytes_of(values, big.order)), expected);
  const std::vector<double> wide(values.begin(), values.end());
  check_refused(folder.write("b.nrrd", nrrd("double", kLittle) + "\n" + bytes_of(wide)), expected);
}

TEST_CASE("a file without spacing is refused with the two ways to give it") {
  const TempFolder folder;
  for (const auto& path :
       {folder.write("a.nrrd", nrrd("ushort", "endian: little\n") + "\n" + kBytes),
        folder.write("a.mha", meta("MET_USHORT", "") + kBytes)}) {
    check_refused(path, "spacing is not in the file");
    check_refused(path, "`spacing_mm = [x, y, z]`");
    check_refused(path, "`--spacing x,y,z`");
  }
  NiftiSpec spec;
  spec.pixdim = {1, 0, 3};
  check_refused(folder.write("a.nii", nifti(spec) + bytes_of(counting<float>())),
                "spacing is not in the file");
}

TEST_CASE("a spacing that is not positive is refused, from the file and from the options") {
  const TempFolder folder;
  const auto with = [&](const std::string& line) {
    return folder.write("a.nrrd", nrrd("ushort", "endian: little\n" + line) + "\n" + kBytes);
  };
  check_refused(with("spacings: 1 -2 1\n"), "1 -2 1 mm is not a voxel size");
  check_refused(with("spacings: 1 0 1\n"), "holds a zero");
  check_refused(folder.write("a.mha", meta("MET_USHORT", "ElementSpacing = 0 1 1\n") + kBytes),
                "0 1 1 mm is not a voxel size");
  ReadOptions options;
  options.spacing_mm = {1, std::numeric_limits<double>::quiet_NaN(), 1};
  CHECK(refusal(with(kSpacings), options).find("not a voxel size") != std::string::npos);
}

TEST_CASE("a spacing that is no number is refused in every format") {
  const TempFolder folder;
  for (const std::string word : {"nan", "inf", "-inf", "x", "1e999"}) {
    CAPTURE(word);
    for (const std::string& line :
         {"spacings: " + word + " 1 1\n", "space: left-posterior-superior\nspace directions: (" +
                                              word + ",0,0) (0,1,0) (0,0,1)\n"}) {
      const auto path =
          folder.write("a.nrrd", nrrd("ushort", "endian: little\n" + line) + "\n" + kBytes);
      CHECK(is_one_line(refusal(path)));
    }
    CHECK(is_one_line(refusal(folder.write(
        "a.mha", meta("MET_USHORT", "ElementSpacing = " + word + " 1 1\n") + kBytes))));
  }
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), infinity, -infinity}) {
    NiftiSpec spec;
    spec.pixdim = {1, bad, 3};
    CHECK(is_one_line(refusal(folder.write("a.nii", nifti(spec) + bytes_of(counting<float>())))));
  }
}

TEST_CASE("a pipe, a socket, a device or a folder in the place of a volume is refused at once") {
  const TempFolder folder;
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

TEST_CASE("axes that are not at right angles are refused") {
  const TempFolder folder;
  check_refused(folder.write("a.nrrd", nrrd("ushort",
                                            "endian: little\nspace: left-posterior-superior\n"
                                            "space directions: (1,0,0) (0.1,1,0) (0,0,1)\n"
                                            "space origin: (0,0,0)\n") +
                                           "\n" + kBytes),
                "not at right angles");
}
