// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "tests/volume/volume_files.hpp"

namespace kerf::dicom_test {

using namespace kerf::test;

TEST_CASE("a DICOM folder that is not one even stack is refused in one line") {
  using Change = std::function<void(DicomSpec&, int)>;
  const std::pair<Change, std::string> cases[] = {
      {[](DicomSpec& spec, int k) { spec.series += k >= 3 ? ".2" : ""; },
       "2 DICOM series; choose one with ./kerf volume import --series: 1 '' (3 slices of 3 x 4), 2 "
       "'' (2 slices"},
      {[](DicomSpec& spec, int k) { spec.series += std::to_string(k); }, "5 DICOM series"},
      {[](DicomSpec& spec, int k) { spec.position_mm[2] += k == 4 ? 2 : 0; },
       ": 4 mm before slice image2.dcm where 2 mm is usual; add the missing slices"},
      {[](DicomSpec& spec, int) { spec.position_mm[2] = 100; }, "its 5 slices have one position"},
      {[](DicomSpec& spec, int k) { spec.position_mm[1] += 0.5 * k; },
       "not at right angles"},  // a tilted gantry
      {[](DicomSpec& spec, int k) {
         if (k == 2) std::swap(spec.rows, spec.columns);
       },
       "differs"},
      {[](DicomSpec& spec, int) { spec.pixel_spacing.reset(); },
       "spacing along x, y is not in the file"}};
  for (const auto& [change, why] : cases) {
    const TemporaryFolder folder;
    write_dicom_series(folder, change);
    const std::string message = refusal(folder.path());
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK(has(message, why));
  }
  const TemporaryFolder none, one, whole;
  CHECK(has(refusal(none.path()), "no DICOM series"));
  one.write("only.dcm", dicom(dicom_slice(0)));
  CHECK(has(refusal(one.path()), "one slice"));
  write_dicom_series(whole, [](DicomSpec&, int) {});
  for (const std::string name : {"image0.dcm", "image3.dcm"}) {
    const std::string bytes = text_of(whole / name);
    whole.write(name, bytes.substr(0, bytes.size() - 10));
    CHECK(has(refusal(whole.path()), name + ": voxels are missing or broken"));
    whole.write(name, bytes);
  }
  whole.write("image3 (copy).dcm", dicom(dicom_slice(1)));
  CHECK(has(refusal(whole.path()), ": image3.dcm has the position of image3 (copy).dcm"));
  std::filesystem::remove(whole / "image3 (copy).dcm");
  std::filesystem::create_directory(whole / "copy");
  whole.write("copy/image3.dcm", dicom(dicom_slice(1)));
  CHECK(has(refusal(whole.path()), ": image3.dcm has the position of copy/image3.dcm"));
}

TEST_CASE("one of several DICOM series is taken by its number or identifier") {
  const TemporaryFolder folder;
  write_dicom_series(folder, [](DicomSpec& spec, int k) {
    if (k >= 3) spec.series += ".2";
  });
  ReadOptions options;
  options.series = "1";
  CHECK(read_volume(folder.path(), options).grid == VoxelGrid{3, 4, 3});
  options.series = "2";
  const SourceVolume second = read_volume(folder.path(), options);
  CHECK(second.grid == VoxelGrid{3, 4, 2});
  CHECK(second.values[0] == 36);
  CHECK(second.note == "series 2 of 2, '' (2 slices of 3 x 4) (import --series chooses another)");
  options.series = "125.1.2";
  CHECK(read_volume(folder.path(), options).grid == VoxelGrid{3, 4, 2});
  for (const char* none : {"0", "3", "head"}) {
    options.series = none;
    CHECK(refusal(folder.path(), options).find("is not one of them; choose one") !=
          std::string::npos);
  }
}

TEST_CASE("beside an overview of one slice the series is taken, and told") {
  const TemporaryFolder folder;
  write_dicom_series(folder, [](DicomSpec& spec, int k) {
    if (k == 4) spec.series = "1.1";
  });
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.grid == VoxelGrid{3, 4, 4});
  CHECK(has(v.note, "of 2, "));
}

TEST_CASE("a spacing at the detector is not in the file") {
  const TemporaryFolder folder;
  for (const char* text : {"0.4\\0.4", "1\\1"}) {
    write_dicom_series(folder, [&](DicomSpec& spec, int) {
      spec.pixel_spacing.reset();
      spec.set(0x0018, 0x1164, "DS", text);
    });
    CHECK(has(refusal(folder.path()), "spacing along x, y is not in the file"));
  }
}

TEST_CASE(
    "a spacing that is no two distances is not used and is shown, whatever the library makes of "
    "it") {
  const std::string nul(1, '\0');
  for (const std::string& text :
       {std::string(""), std::string("0\\0"), std::string("0.3\\0"), std::string("0\\0.3"),
        std::string("nan\\nan"), std::string("inf\\inf"), std::string("1e999\\1"),
        std::string("-0.5\\0.5"), std::string("abc\\def"), std::string("0.5x\\0.5"),
        std::string("0,3\\0,3"), std::string("0x1\\0x1"), std::string("0.3"), std::string("0.3\\"),
        std::string("\\0.3"), std::string("0.3\\0.3\\0.3"), "0.3" + nul + "1\\0.3",
        std::string("0 .3\\0.3")}) {
    const TemporaryFolder folder;
    write_dicom_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    const std::string message = refusal(folder.path());
    CAPTURE(text);
    CAPTURE(message);
    CHECK(has(message, text.empty() ? ": spacing along x, y is not in the file; add"
                                    : ": spacing along x, y cannot be read from PixelSpacing '"));
    CHECK(has(message, "; add `spacing_mm = [x, y, 2]` to the scene or `--spacing x,y,2` (mm)"));
    ReadOptions options;
    options.spacing_mm = {0.25, 0.5, 2};
    const SourceVolume v = read_volume(folder.path(), options);
    CHECK(v.spacing_mm == *options.spacing_mm);
    CHECK(has(v.note, "is no two distances and is not used") == !text.empty());
  }
  for (const std::string& text : {std::string("0.5\\0.25"), std::string(" 0.5 \\ 0.25"),
                                  std::string("+5e-1\\2.5E-1"), "0.5\\0.25" + nul}) {
    const TemporaryFolder folder;
    write_dicom_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    CAPTURE(text);
    CHECK(read_volume(folder.path()).spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
  }
}

TEST_CASE("numbers that were rounded differently are the same numbers, as far as their digits go") {
  const auto spaced = [](const char* one, const char* other) {
    return series_message([&](DicomSpec& spec, int k) {
      spec.rows = spec.columns = 16;
      spec.values.resize(256);
      spec.pixel_spacing = k % 2 == 0 ? one : other;
    });
  };
  CHECK(spaced("0.48828125\\0.48828125", "0.488281\\0.488281") == "no error");
  CHECK(spaced("0.48828125\\0.48828125", "0.488\\0.488") == "no error");
  CHECK(has(spaced("0.48828125\\0.48828125", "0.49\\0.49"), "the spacing of image"));
  CHECK(has(spaced("0.48828125\\0.48828125", "0.5\\0.5"), "the spacing of image"));
  CHECK(has(spaced("0.48828125\\0.48828125", "0.4883\\0.4783"), "the spacing of image"));

  CHECK(series_message([](DicomSpec& spec, int k) {
          spec.orientation = k % 2 == 0 ? "1.0\\-0.0000000010\\0.0\\0.0000000010\\1.0\\0.0"
                                        : "1.0\\0.0000000010\\0.0\\-0.0000000010\\1.0\\0.0";
        }) == "no error");
  CHECK(has(series_message([](DicomSpec& spec, int k) {
              if (k == 2) spec.orientation = "0.99\\0.14107\\0\\-0.14107\\0.99\\0";
            }),
            "differs in size or direction"));

  const auto at = [](const std::array<const char*, 5>& depths) {
    return series_message([&](DicomSpec& spec, int k) {
      spec.set(0x0020, 0x0032, "DS", std::string("0\\0\\") + depths[static_cast<std::size_t>(k)]);
    });
  };
  CHECK(at({"0", "0.6", "1.3", "1.9", "2.5"}) == "no error");  // 0.625 mm apart
  CHECK(at({"0", "0.0004", "0.0008", "0.0012", "0.0016"}) == "no error");
  CHECK(has(at({"0", "0.0004", "0.0012", "0.0016", "0.002"}), "0.0008 mm before slice"));
  CHECK(at({"0.00", "0.60", "1.30", "1.90", "2.50"}) == "no error");
  CHECK(has(at({"0.00", "0.60", "1.31", "1.90", "2.50"}), "is usual"));
  CHECK(has(at({"0", "0.6", "1.3", "2.5", "3.1"}), "1.2 mm before slice image4.dcm"));
  CHECK(has(at({"0", "0.1", "0.2", "0.4", "0.5"}), "is usual"));   // rounding would hide a gap
  CHECK(has(at({"0", "1", "2", "4", "5"}), "2 mm before slice"));  // whole numbers are not rounded
}

TEST_CASE("slices are even as far as each coordinate is written, at every distance") {
  const auto rounded = [](double apart, double from, int count, const char* beside) {
    const TemporaryFolder folder;
    for (int k = 0; k < count; ++k) {
      DicomSpec spec = dicom_slice(0);
      std::array<char, 64> z{};
      std::snprintf(z.data(), z.size(), "%.1f", from + apart * k);
      spec.set(0x0020, 0x0032, "DS", beside + std::string(z.data()));
      folder.write("I" + std::to_string(k), dicom(spec));
    }
    return refusal(folder.path());
  };
  for (const double apart : {0.625, 1.25, 0.75, 0.375, 0.45, 0.35}) {
    for (const double from : {-30.0, -30.01, 12.3, -1000.0, 2.0}) {
      CAPTURE(apart);
      CAPTURE(from);
      CHECK(rounded(apart, from, 20, "0\\0\\") == "no error");
    }
    CHECK(rounded(apart, -1000.0, 200, "-10.123456\\20.654321\\") == "no error");
  }
}

TEST_CASE("slices of two patients, studies or frames of reference are refused by name") {
  const std::pair<std::uint32_t, std::string> tags[] = {{0x00100020, "PatientID"},
                                                        {0x0020000d, "StudyInstanceUID"},
                                                        {0x00200052, "FrameOfReferenceUID"}};
  for (const auto& [tag, name] : tags) {
    const auto message = [&](const std::function<const char*(int)>& text) {
      return series_message([&](DicomSpec& spec, int k) {
        spec.set(static_cast<std::uint16_t>(tag >> 16), static_cast<std::uint16_t>(tag & 0xffff),
                 "LO", text(k));
      });
    };
    CHECK(has(message([](int k) { return k < 3 ? "1.2.9" : "1.2.10"; }),
              name + " 1.2.10, and image0.dcm of the same series has 1.2.9; keep one"));
    CHECK(has(message([](int k) { return k < 4 ? "1.2.9" : "1.2.10"; }), "image2.dcm: " + name));
    CHECK(has(message([](int k) { return k % 2 == 0 ? "1.2.9" : "1.2.10"; }), "2 DICOM series"));
    CHECK(message([](int k) { return k == 2 ? "" : "1.2.9"; }) == "no error");
  }
}

TEST_CASE("a note names what the values depend on and the slices do not share") {
  const auto note = [](const std::function<const char*(int)>& kv) {
    const TemporaryFolder folder;
    write_dicom_series(folder, [&](DicomSpec& spec, int k) {
      if (*kv(k) != 0) spec.set(0x0018, 0x0060, "DS", kv(k));
    });
    return read_volume(folder.path()).note;
  };
  CHECK(has(note([](int k) { return k % 2 == 0 ? "80" : "140"; }),
            "its slices differ in KVP (140, 80)"));
  CHECK(has(note([](int k) { return k == 2 ? "" : "80"; }), "differ in KVP (none, 80)"));
  CHECK(note([](int) { return "80"; }).empty());
}

TEST_CASE("a DICOM object that is no image is named, whole or cut off, alone or beside slices") {
  const TemporaryFolder folder;
  for (const auto& [uid, name] :
       {std::pair{"1.2.840.10008.5.1.4.1.1.481.3", "RT Structure Set"},
        std::pair{"1.2.840.10008.5.1.4.1.1.88.33", "Comprehensive SR"},
        std::pair{"1.2.840.10008.5.1.4.1.1.104.1", "Encapsulated PDF"},
        std::pair{"1.2.840.10008.5.1.4.1.1.66.1", "Spatial Registration"}}) {
    DicomSpec spec = dicom_slice(7);
    spec.series = "1.8";
    for (const int number : {0x0002, 0x0004, 0x0010, 0x0011}) {
      spec.set(0x0028, static_cast<std::uint16_t>(number), "");
    }
    spec.set(0x7fe0, 0x0010, "");
    spec.set(0x0008, 0x0016, "UI", uid);
    std::string bytes = dicom(spec);
    const std::string meta = dicom_element(0x0002, 0x0002, "UI", "1.2.840.10008.5.1.4.1.1.2");
    const std::string own = dicom_element(0x0002, 0x0002, "UI", uid);
    bytes.replace(bytes.find(meta), meta.size(), own);
    const auto grown = static_cast<std::uint32_t>(own.size() - meta.size());
    // The length of the meta header, which it begins with.
    bytes[140] = static_cast<char>(static_cast<unsigned char>(bytes[140]) + grown);
    const std::string is = std::string(": is a DICOM ") + name + ", which holds no image";
    CHECK(has(refusal(folder.write("a.dcm", bytes)), is));
    CHECK(has(refusal(folder.write("a.dcm", bytes.substr(0, bytes.size() - 3))), is));
  }
}

TEST_CASE("what is no slice is left out and named; a slice that cannot be read is not") {
  const TemporaryFolder folder;
  write_dicom_series(folder, [](DicomSpec&, int) {});
  DicomSpec screenshot = dicom_slice(7);
  screenshot.series = "1.9";
  screenshot.set(0x0028, 0x0002, "US", u16(3));
  screenshot.set(0x0028, 0x0004, "CS", "RGB");
  folder.write("screenshot", dicom(screenshot));
  DicomSpec report = dicom_slice(7);
  report.series = "1.8";
  for (const int number : {0x0002, 0x0004, 0x0010, 0x0011}) {
    report.set(0x0028, static_cast<std::uint16_t>(number), "");
  }
  report.set(0x7fe0, 0x0010, "");
  folder.write("report", dicom(report));
  DicomSpec packed = dicom_slice(7);
  packed.series = "1.7";
  packed.syntax = "1.2.840.10008.1.2.4.201";
  folder.write("packed", dicom(packed));
  folder.write("below/broken", dicom(dicom_slice(7)).substr(0, 140));
  folder.write("readme", "none of DICOM");
  const SourceVolume v = read_volume(folder.path());
  CHECK(same_values(v, counting<float>()));
  CAPTURE(v.note);
  CHECK(has(v.note, "skipped broken (cannot be read)"));
  CHECK(has(v.note, "skipped packed (its encoding cannot be read (1.2.840.10008.1.2.4.201"));
  CHECK(has(v.note, "skipped report (holds no image)"));
  CHECK(has(v.note, "skipped 1 more"));

  packed.series = dicom_slice(0).series;
  folder.write("packed", dicom(packed));
  CHECK(has(refusal(folder.path()),
            "packed: its encoding cannot be read (1.2.840.10008.1.2.4.201, High-Throughput JPEG "
            "2000); export it"));
}

TEST_CASE("a file of no series beside the slices may be one of them and is refused by name") {
  const std::string slice = dicom(dicom_slice(4));
  const std::size_t series = slice.find(std::string("\x20\x00\x0e\x00UI", 6)) + 8;
  const std::pair<std::string, const char*> lost[] = {
      {"", "is empty"},
      {std::string(1100, '\0'), "holds zeroes alone"},
      {slice.substr(0, 100), "holds zeroes alone"},
      {slice.substr(0, 140), "cannot be read"},
      {slice.substr(0, series - 8), ""},
      {slice.substr(0, series + 5), "cannot be read"}};
  for (const char* name : {"image4.dcm", "image2.dcm", "IM7"}) {
    for (const auto& [bytes, why] : lost) {
      const TemporaryFolder folder;
      write_dicom_series(folder, [](DicomSpec&, int) {});
      folder.write(name, bytes);
      const std::string message = refusal(folder.path());
      CAPTURE(message);
      CHECK(is_one_line(message));
      CHECK(has(message, std::string(name) + ": " + why));
      CHECK(has(message, ", and may be a slice of this series; "));
    }
  }
  const TemporaryFolder folder;
  write_dicom_series(folder, [](DicomSpec&, int) {});
  const std::string series_text = dicom_slice(4).series;
  folder.write("image2.dcm", slice.substr(0, series + series_text.size() + series_text.size() % 2));
  CHECK(has(refusal(folder.path()), "image2.dcm: holds no image"));
  folder.write("image2.dcm", slice);
  std::filesystem::create_symlink(folder / "gone", folder / "image9");
  CHECK(has(refusal(folder.path()), "image9: cannot be opened (No such file or directory)"));
  std::filesystem::remove(folder / "image9");
  folder.write("below/nothing", "");
  folder.write("below/broken.dcm", "none of DICOM");
  const SourceVolume v = read_volume(folder.path());
  CHECK(same_values(v, counting<float>()));
  CHECK(has(v.note, "skipped nothing (is empty)"));
  CHECK(has(v.note, "skipped broken.dcm (cannot be read)"));
}

TEST_CASE("an overview among the slices of a series is left out and named") {
  const TemporaryFolder folder;
  write_dicom_series(folder, [](DicomSpec&, int) {});
  DicomSpec overview = dicom_slice(7);
  overview.orientation = "0\\1\\0\\0\\0\\-1";
  folder.write("overview", dicom(overview));
  const SourceVolume v = read_volume(folder.path());
  CHECK(same_values(v, counting<float>()));
  CHECK(has(v.note, "skipped overview (of another size or direction)"));
  CHECK(has(series_message([](DicomSpec& spec, int) { spec.orientation = "1\\0\\0\\1\\0\\0"; }),
            "is not two directions at right angles"));
}

TEST_CASE("images are found below a folder that has none of its own") {
  const TemporaryFolder folder;
  for (int k = 0; k < 5; ++k) folder.write("DICOM/S1/I" + std::to_string(k), dicom(dicom_slice(k)));
  folder.write("DICOMDIR", "an index");
  folder.write("README.TXT", "a text");
  folder.write("AUTORUN.INF", "a program");
  CHECK(same_values(read_volume(folder.path()), counting<float>()));
}

}  // namespace kerf::dicom_test
