// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "controller/input/load_error.hpp"
#include "controller/input/sandbox.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// A whole file of one kind; read, it gives a volume or a mesh.
struct Sample {
  std::string name, bytes;
};

DicomSpec slices_in_one() {
  DicomSpec spec;
  spec.frames = 5;
  spec.slice_spacing = "1";
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
void check_survived(const TempFolder& folder, const Sample& broken) {
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
  const TempFolder folder;
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
  const TempFolder folder;
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
  const TempFolder folder;
  const auto refused = [&](const std::string& name, const std::string& bytes,
                           const std::string& how) {
    const std::string message = refusal(folder.write(name, bytes));
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK(message.find((folder / name).string() + ": ") == 0);
    CHECK(message.find(how) != std::string::npos);
  };
  for (const int axes : {10, 13, 16}) {  // ITK has room for nine
    std::string sizes = "3 4 5", spacings = "1 2 3";
    for (int i = 3; i < axes; ++i) {
      sizes += " 1";
      spacings += " 1";
    }
    refused("many.nrrd",
            "NRRD0004\ntype: ushort\ndimension: " + std::to_string(axes) + "\nsizes: " + sizes +
                "\nencoding: raw\nendian: little\nspacings: " + spacings + "\n\n" +
                bytes_of(counting<std::uint16_t>()),
            "the reader of NRRD ended with SIG");
  }
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
  const TempFolder folder;
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
  const long most_kib = std::max(before.ru_maxrss, own.ru_maxrss) + (kSandboxBytes >> 10);
  CHECK(after.ru_maxrss < most_kib);
#endif
}
