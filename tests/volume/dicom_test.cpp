// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// Slice k of a 3 x 4 x 5 series with the values 12 k .. 12 k + 11, 2 mm apart.
DicomSpec slice(int k) {
  DicomSpec spec;
  spec.instance = k + 1;
  spec.position_mm = {-10, 20, 100.0 + 2 * k};
  for (int i = 0; i < 12; ++i) spec.values.push_back(static_cast<std::int16_t>(12 * k + i));
  return spec;
}

/// Writes five slices, in an order of names that is not their order in space.
void write_series(const TemporaryFolder& folder,
                  const std::function<void(DicomSpec&, int)>& change) {
  for (int k = 0; k < 5; ++k) {
    DicomSpec spec = slice(k);
    change(spec, k);
    folder.write("image" + std::to_string((k * 3) % 5) + ".dcm", dicom(spec));
  }
}

}  // namespace

TEST_CASE("a DICOM series is put together by position, with spacing and rescaling") {
  const TemporaryFolder folder;
  write_series(folder, [](DicomSpec& spec, int) {
    spec.slope = 2;
    spec.intercept = -1000;
  });
  folder.write("notes.txt", "not an image");
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.grid == kSmall);
  CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
  CHECK(v.origin_mm == std::array<double, 3>{-10, 20, 100});
  CHECK(v.direction == std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1});
  for (std::size_t i = 0; i < 60; ++i) CHECK(v.values[i] == 2.0F * static_cast<float>(i) - 1000.0F);
}

TEST_CASE("a turned DICOM series keeps right-handed axes") {
  const TemporaryFolder folder;
  // Coronal: rows run along +x, columns down along -z, so slices follow +y.
  write_series(folder, [](DicomSpec& spec, int k) {
    spec.orientation = "1\\0\\0\\0\\0\\-1";
    spec.position_mm = {0, 3.0 * k, 50};
  });
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.spacing_mm[2] == doctest::Approx(3.0));
  CHECK(v.direction == std::array<double, 9>{1, 0, 0, 0, 0, 1, 0, -1, 0});
  CHECK(same_values(v, counting<float>()));
}

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
    write_series(folder, change);
    const std::string message = refusal(folder.path());
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK(has(message, why));
  }
  const TemporaryFolder none, one, whole;
  CHECK(has(refusal(none.path()), "no DICOM series"));
  one.write("only.dcm", dicom(slice(0)));
  CHECK(has(refusal(one.path()), "one slice"));
  write_series(whole, [](DicomSpec&, int) {});
  for (const std::string name : {"image0.dcm", "image3.dcm"}) {
    const std::string bytes = text_of(whole / name);
    whole.write(name, bytes.substr(0, bytes.size() - 10));
    CHECK(has(refusal(whole.path()), name + ": voxels are missing or broken"));
    whole.write(name, bytes);
  }
  whole.write("image3 (copy).dcm", dicom(slice(1)));
  CHECK(has(refusal(whole.path()), ": image3.dcm has the position of image3 (copy).dcm"));
}

TEST_CASE("one of several DICOM series is taken by its number or identifier") {
  const TemporaryFolder folder;
  write_series(folder, [](DicomSpec& spec, int k) {
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
  write_series(folder, [](DicomSpec& spec, int k) {
    if (k == 4) spec.series = "1.1";
  });
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.grid == VoxelGrid{3, 4, 4});
  CHECK(has(v.note, "of 2, "));
}

TEST_CASE("a spacing at the detector is not in the file") {
  const TemporaryFolder folder;
  for (const char* text : {"0.4\\0.4", "1\\1"}) {
    write_series(folder, [&](DicomSpec& spec, int) {
      spec.pixel_spacing.reset();
      spec.set(0x0018, 0x1164, "DS", text);
    });
    CHECK(has(refusal(folder.path()), "spacing along x, y is not in the file"));
  }
}

TEST_CASE(
    "a spacing that is no two distances is not in the file, whatever the library makes of it") {
  const std::string nul(1, '\0');
  for (const std::string& text :
       {std::string(""), std::string("0\\0"), std::string("0.3\\0"), std::string("0\\0.3"),
        std::string("nan\\nan"), std::string("inf\\inf"), std::string("1e999\\1"),
        std::string("-0.5\\0.5"), std::string("abc\\def"), std::string("0.5x\\0.5"),
        std::string("0,3\\0,3"), std::string("0x1\\0x1"), std::string("0.3"), std::string("0.3\\"),
        std::string("\\0.3"), std::string("0.3\\0.3\\0.3"), "0.3" + nul + "1\\0.3",
        std::string("0 .3\\0.3")}) {
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    const std::string message = refusal(folder.path());
    CAPTURE(text);
    CAPTURE(message);
    CHECK(has(message,
              ": spacing along x, y is not in the file; add `spacing_mm = [x, y, 2]` to the scene "
              "or `--spacing x,y,2` (mm)"));
    ReadOptions options;
    options.spacing_mm = {0.25, 0.5, 2};
    CHECK(read_volume(folder.path(), options).spacing_mm == *options.spacing_mm);
  }
  for (const std::string& text : {std::string("0.5\\0.25"), std::string(" 0.5 \\ 0.25"),
                                  std::string("+5e-1\\2.5E-1"), "0.5\\0.25" + nul}) {
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    CAPTURE(text);
    CHECK(read_volume(folder.path()).spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
  }
}

namespace {

std::string u16(int value) {
  return bytes_of(static_cast<std::uint16_t>(value));
}

/// A sequence of one item.
void set_group(std::string& elements, std::uint16_t group, std::uint16_t number,
               const std::string& inside) {
  elements += dicom_element(group, number, "SQ", dicom_item(inside));
}

/// A frame of an enhanced CT.
struct Frame {
  std::string z;  ///< empty: no position
  std::vector<std::int16_t> values;
  std::string slope;       ///< empty: none of its own
  std::uint32_t time = 0;  ///< 0: none
  std::string stack;
};

/// Slice k of 3 x 4 voxels with the values 12 k .. 12 k + 11, 2 mm apart.
Frame frame(int k) {
  Frame made{std::to_string(100 + 2 * k), {}, {}, 0, {}};
  for (int i = 0; i < 12; ++i) made.values.push_back(static_cast<std::int16_t>(12 * k + i));
  return made;
}

/// One file with functional groups (PS3.3 C.7.6.16.2).
DicomSpec enhanced(const std::vector<Frame>& frames) {
  DicomSpec spec;
  spec.set(0x0008, 0x0016, "UI", "1.2.840.10008.5.1.4.1.1.2.1");
  for (const int number : {0x0032, 0x0037}) {
    spec.set(0x0020, static_cast<std::uint16_t>(number), "");
  }
  for (const int number : {0x0030, 0x1052, 0x1053}) {
    spec.set(0x0028, static_cast<std::uint16_t>(number), "");
  }
  spec.set(0x0028, 0x0008, "IS", std::to_string(frames.size()));
  std::string shared;
  set_group(shared, 0x0020, 0x9116, dicom_element(0x0020, 0x0037, "DS", spec.orientation));
  set_group(shared, 0x0028, 0x9110, dicom_element(0x0028, 0x0030, "DS", *spec.pixel_spacing));
  spec.set(0x5200, 0x9229, "SQ", dicom_item(shared));
  std::string items;
  for (const Frame& each : frames) {
    std::string own, content;
    if (!each.stack.empty()) content += dicom_element(0x0020, 0x9056, "SH", each.stack);
    if (each.time != 0) content += dicom_element(0x0020, 0x9128, "UL", bytes_of(each.time));
    set_group(own, 0x0020, 0x9111, content);
    if (!each.z.empty()) {
      set_group(own, 0x0020, 0x9113, dicom_element(0x0020, 0x0032, "DS", "-10\\20\\" + each.z));
    }
    if (!each.slope.empty()) {
      set_group(own, 0x0028, 0x9145,
                dicom_element(0x0028, 0x1052, "DS", "0") +
                    dicom_element(0x0028, 0x1053, "DS", each.slope));
    }
    items += dicom_item(own);
    spec.values.insert(spec.values.end(), each.values.begin(), each.values.end());
  }
  spec.set(0x5200, 0x9230, "SQ", items);
  return spec;
}

SourceVolume read(const TemporaryFolder& folder, const DicomSpec& spec,
                  const std::string& series = {}) {
  ReadOptions options;
  options.series = series;
  return read_volume(folder.write("a.dcm", dicom(spec)), options);
}

std::string refusal_of(const TemporaryFolder& folder, const DicomSpec& spec) {
  const std::string message = refusal(folder.write("a.dcm", dicom(spec)));
  CAPTURE(message);
  CHECK(is_one_line(message));
  return message;
}

/// Writes the slices with a change of each; returns the message of reading them.
std::string message_of(const std::function<void(DicomSpec&, int)>& change) {
  const TemporaryFolder folder;
  write_series(folder, change);
  const std::string message = refusal(folder.path());
  const bool fine = message == "no error" || is_one_line(message);
  CHECK(fine);
  return message;
}

}  // namespace

TEST_CASE("the frames of one file are put in order by their positions") {
  const TemporaryFolder folder;
  for (const std::vector<int>& order :
       {std::vector{0, 1, 2, 3, 4}, std::vector{4, 3, 2, 1, 0}, std::vector{3, 0, 4, 1, 2}}) {
    std::vector<Frame> frames;
    for (const int k : order) frames.push_back(frame(k));
    const SourceVolume v = read(folder, enhanced(frames));
    CHECK(v.grid == kSmall);
    CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
    CHECK(v.origin_mm == std::array<double, 3>{-10, 20, 100});
    CHECK(same_values(v, counting<float>()));
  }
}

TEST_CASE("each frame of one file has a rescale of its own") {
  const TemporaryFolder folder;
  std::vector<Frame> frames;
  for (int k = 0; k < 5; ++k) {
    frames.push_back(frame(k));
    const int halvings = k % 3;
    frames[static_cast<std::size_t>(k)].slope =
        std::array{"1", "0.5", "0.25"}.at(static_cast<std::size_t>(halvings));
    for (auto& value : frames[static_cast<std::size_t>(k)].values) {
      value = static_cast<std::int16_t>(value << halvings);
    }
  }
  CHECK(same_values(read(folder, enhanced(frames)), counting<float>()));
}

TEST_CASE("frames of one file that are not one even stack are refused by name") {
  const TemporaryFolder folder;
  const auto message = [&](std::vector<Frame> frames) {
    return refusal_of(folder, enhanced(frames));
  };
  CHECK(has(message({frame(0), frame(1), frame(3), frame(4)}),
            "4 mm before slice frame 3 of a.dcm where 2 mm is usual"));
  CHECK(has(message({frame(0), frame(1), frame(1), frame(2)}),
            "frame 3 of a.dcm has the position of frame 2 of a.dcm"));
  CHECK(has(message({frame(0), frame(0), frame(0)}), "its 3 slices have one position"));
  Frame lost = frame(2);
  lost.z.clear();
  CHECK(has(message({frame(0), frame(1), lost}), "frame 3 of a.dcm has no position"));
  DicomSpec fewer = enhanced({frame(0), frame(1), frame(2)});
  fewer.set(0x0028, 0x0008, "IS", "2");
  CHECK(has(refusal_of(folder, fewer), "2 frames, and the facts of 3"));
  for (const char* count : {"0", "-3", "4000000000", "2.5"}) {
    fewer.set(0x0028, 0x0008, "IS", count);
    CHECK(has(refusal_of(folder, fewer), std::string("NumberOfFrames ") + count));
  }
}

TEST_CASE("several times in one file are several volumes, of which one is chosen") {
  const TemporaryFolder folder;
  std::vector<Frame> frames;
  for (const int k : {0, 2, 1}) {
    for (const std::uint32_t time : {1U, 2U}) {
      frames.push_back(frame(k + (time == 2 ? 100 : 0)));
      frames.back().z = frame(k).z;
      frames.back().time = time;
    }
  }
  CHECK(has(refusal_of(folder, enhanced(frames)),
            "2 DICOM series; choose one with ./kerf volume import --series: 1 '', "
            "TemporalPositionIndex 1 (3 slices of 3 x 4), 2 '', TemporalPositionIndex 2 (3"));
  CHECK(read(folder, enhanced(frames), "1").values[12] == 12);
  CHECK(read(folder, enhanced(frames), "2").values[12] == 1212);
  CHECK(read(folder, enhanced(frames), "TemporalPositionIndex 2").values[0] == 1200);
  // Half a distance apart, they would be one even stack.
  std::vector<Frame> between;
  for (int k = 0; k < 6; ++k) {
    between.push_back(frame(k));
    between.back().time = 1 + static_cast<std::uint32_t>(k % 2);
  }
  CHECK(has(refusal_of(folder, enhanced(between)), "2 DICOM series"));
}

TEST_CASE("slices in one file without positions have the distance that it names, or none") {
  const TemporaryFolder folder;
  DicomSpec spec;
  spec.set(0x0028, 0x0008, "IS", "5");
  spec.values = counting<std::int16_t>();
  CHECK(has(refusal_of(folder, spec), "spacing along z is not in the file"));
  for (const char* distance : {"1", "2"}) {
    spec.set(0x0018, 0x0088, "DS", distance);
    const SourceVolume v = read(folder, spec);
    CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, std::stod(distance)});
    CHECK(same_values(v, counting<float>()));
    CHECK(has(v.note, "frames in the order of the file"));
  }
  spec.set(0x0018, 0x0088, "DS", "-1");
  CHECK(has(refusal_of(folder, spec), "SpacingBetweenSlices -1 is negative"));
  spec.set(0x0028, 0x0009, "AT", u16(0x0018) + u16(0x1063));
  CHECK(has(refusal_of(folder, spec), "counted by (0018,1063), a time or a view"));
}

TEST_CASE("slices without positions are put in order by location or number, which is noted") {
  const auto no_position = [](DicomSpec& spec) { spec.set(0x0020, 0x0032, ""); };
  const TemporaryFolder by_location, by_number;
  write_series(by_location, [&](DicomSpec& spec, int k) {
    no_position(spec);
    spec.set(0x0020, 0x1041, "DS", std::to_string(3 * k));
  });
  const SourceVolume located = read_volume(by_location.path());
  CHECK(same_values(located, counting<float>()));
  CHECK(located.spacing_mm == std::array<double, 3>{0.25, 0.5, 3});
  CHECK(has(located.note, "in the order of SliceLocation"));
  write_series(by_number, [&](DicomSpec& spec, int) { no_position(spec); });
  CHECK(has(refusal(by_number.path()), "spacing along z is not in the file"));
  ReadOptions options;
  options.spacing_mm = {0.25, 0.5, 2};
  const SourceVolume numbered = read_volume(by_number.path(), options);
  CHECK(same_values(numbered, counting<float>()));
  CHECK(has(numbered.note, "in the order of InstanceNumber"));

  CHECK(has(message_of([&](DicomSpec& spec, int k) {
              if (k == 3) no_position(spec);
            }),
            "image4.dcm has no position, and"));
  CHECK(has(message_of([&](DicomSpec& spec, int k) {
              no_position(spec);
              spec.set(0x0020, 0x1041, "DS", std::to_string((2 * k) % 5));
            }),
            "in different orders"));
  CHECK(has(message_of([&](DicomSpec& spec, int k) {
              no_position(spec);
              spec.set(0x0020, 0x1041, "DS", std::to_string(k == 4 ? 5 : k));
            }),
            "2 mm before slice image2.dcm where 1 mm is usual"));
  CHECK(has(message_of([&](DicomSpec& spec, int k) {
              no_position(spec);
              if (k == 4) spec.set(0x0020, 0x0013, "IS", "6");
            }),
            "has the number 6 and follows 4"));
  CHECK(has(message_of([&](DicomSpec& spec, int) {
              no_position(spec);
              spec.set(0x0020, 0x0013, "");
            }),
            "its 5 slices have one number"));
}

TEST_CASE("tags that concern the display alone change no value") {
  const std::vector<std::function<void(DicomSpec&)>> changes{
      [](DicomSpec& spec) { spec.set(0x0028, 0x0004, "CS", "MONOCHROME1"); },
      [](DicomSpec& spec) { spec.set(0x2050, 0x0020, "CS", "INVERSE"); },
      [](DicomSpec& spec) {
        spec.set(0x0028, 0x1050, "DS", "40");
        spec.set(0x0028, 0x1051, "DS", "8");
        spec.set(0x0028, 0x3010, "SQ", dicom_item(dicom_element(0x0028, 0x3002, "US", "xxxxxx")));
      },
      [](DicomSpec& spec) {  // 12 bits of 16, an overlay in the others
        spec.set(0x0028, 0x0101, "US", u16(12));
        spec.set(0x0028, 0x0102, "US", u16(11));
        for (auto& value : spec.values) value = static_cast<std::int16_t>(value & 0xfff);
        for (auto& value : spec.values) value = static_cast<std::int16_t>(value | 0x5000);
      },
      [](DicomSpec& spec) {  // the same, stored from bit 4 on
        spec.set(0x0028, 0x0101, "US", u16(12));
        spec.set(0x0028, 0x0102, "US", u16(15));
        for (auto& value : spec.values) value = static_cast<std::int16_t>(value << 4 | 5);
      }};
  for (const auto& change : changes) {
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) {
      for (auto& value : spec.values) value = static_cast<std::int16_t>(value - 30);
      spec.intercept = 30;
      change(spec);
    });
    CHECK(same_values(read_volume(folder.path()), counting<float>()));
  }
}

TEST_CASE("padding becomes air, and nothing else does") {
  const auto padded = [](const std::function<void(DicomSpec&)>& change) {
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) {
      spec.values[5] = -2000;
      change(spec);
    });
    std::vector<float> values;
    const SourceVolume v = read_volume(folder.path());
    for (std::size_t i = 0; i < 60; ++i) values.push_back(v.values[i]);
    return values;
  };
  const auto expected = [](float slope, float intercept, float air) {
    std::vector<float> values;
    for (int i = 0; i < 60; ++i) {
      values.push_back(i % 12 == 5 ? air : slope * static_cast<float>(i) + intercept);
    }
    return values;
  };
  // In HU: -1000. The number may be written as signed or not: 63536 is -2000.
  CHECK(padded([](DicomSpec& spec) { spec.set(0x0028, 0x0120, "SS", u16(63536)); }) ==
        expected(1, 0, -1000));
  const auto unsigned_cells = [](DicomSpec& spec) {
    spec.set(0x0028, 0x0103, "US", u16(0));
    spec.intercept = -1024;
    spec.set(0x0028, 0x0120, "US", u16(63536));
  };
  CHECK(padded(unsigned_cells) == expected(1, -1024, -1000));
  // Values that are no HU: the lowest other value.
  CHECK(padded([&](DicomSpec& spec) {
          unsigned_cells(spec);
          spec.intercept = 7;
        }) == expected(1, 7, 7));
  CHECK(padded([&](DicomSpec& spec) {
          unsigned_cells(spec);
          spec.set(0x0008, 0x0060, "CS", "MR");
          spec.slope = 0.5;
        }) == expected(0.5, -1024, -1024));
  // A range, either way round.
  for (const auto& [from, to] : {std::pair{63000, 63600}, std::pair{63600, 63000}}) {
    CHECK(padded([&](DicomSpec& spec) {
            unsigned_cells(spec);
            spec.set(0x0028, 0x0120, "US", u16(from));
            spec.set(0x0028, 0x0121, "US", u16(to));
          }) == expected(1, -1024, -1000));
  }
  // 63536 in twelve bits would be 2096: the bits that the file stores have no such number.
  CHECK(padded([&](DicomSpec& spec) {
          unsigned_cells(spec);
          spec.set(0x0028, 0x0101, "US", u16(12));
          spec.set(0x0028, 0x0102, "US", u16(11));
          spec.values[5] = 2096;
        }) == expected(1, -1024, 2096 - 1024));
}

TEST_CASE("a Modality LUT gives the values, clamped at both ends") {
  const auto lut = [](const std::string& descriptor, const std::string& data) {
    return dicom_item(dicom_element(0x0028, 0x3002, "US", descriptor) +
                      dicom_element(0x0028, 0x3004, "LO", "HU") +
                      dicom_element(0x0028, 0x3006, "OW", data));
  };
  std::string wide, narrow;
  for (int i = 0; i < 10; ++i) {
    wide += u16(60000 - 1000 * i);
    narrow += static_cast<char>(200 - 10 * i);
  }
  const auto values = [&](const std::string& item) {
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) {
      for (auto& value : spec.values) value = static_cast<std::int16_t>(value - 10);
      spec.set(0x0028, 0x1052, "");
      spec.set(0x0028, 0x1053, "");
      spec.set(0x0028, 0x3000, "SQ", item);
    });
    return read_volume(folder.path());
  };
  const SourceVolume by_words = values(lut(u16(10) + u16(-3) + u16(16), wide));
  const SourceVolume by_bytes = values(lut(u16(10) + u16(-3) + u16(8), narrow));
  for (int i = 0; i < 60; ++i) {
    const auto at = static_cast<float>(std::clamp(i - 10 + 3, 0, 9));
    CHECK(by_words.values[static_cast<std::size_t>(i)] == 60000 - 1000 * at);
    CHECK(by_bytes.values[static_cast<std::size_t>(i)] == 200 - 10 * at);
  }
  CHECK(has(message_of([&](DicomSpec& spec, int) {
              spec.slope = 2;
              spec.set(0x0028, 0x3000, "SQ", lut(u16(10) + u16(0) + u16(16), wide));
            }),
            "has a Modality LUT and a RescaleSlope"));
  CHECK(has(message_of([&](DicomSpec& spec, int) {
              spec.set(0x0028, 0x3000, "SQ", lut(u16(300) + u16(0) + u16(16), wide));
            }),
            "its Modality LUT has 20 bytes for 300 values"));
}

TEST_CASE("numbers that were rounded differently are the same numbers, as far as their digits go") {
  const auto spaced = [](const char* one, const char* other) {
    return message_of([&](DicomSpec& spec, int k) {
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

  CHECK(message_of([](DicomSpec& spec, int k) {
          spec.orientation = k % 2 == 0 ? "1.0\\-0.0000000010\\0.0\\0.0000000010\\1.0\\0.0"
                                        : "1.0\\0.0000000010\\0.0\\-0.0000000010\\1.0\\0.0";
        }) == "no error");
  CHECK(has(message_of([](DicomSpec& spec, int k) {
              if (k == 2) spec.orientation = "0.99\\0.14107\\0\\-0.14107\\0.99\\0";
            }),
            "differs in size or direction"));

  const auto at = [](const std::array<const char*, 5>& depths) {
    return message_of([&](DicomSpec& spec, int k) {
      spec.set(0x0020, 0x0032, "DS", std::string("0\\0\\") + depths[static_cast<std::size_t>(k)]);
    });
  };
  CHECK(at({"0", "0.6", "1.3", "1.9", "2.5"}) == "no error");  // 0.625 mm apart
  CHECK(at({"0.00", "0.60", "1.30", "1.90", "2.50"}) == "no error");
  CHECK(has(at({"0.00", "0.60", "1.31", "1.90", "2.50"}), "is usual"));
  CHECK(has(at({"0", "0.6", "1.3", "2.5", "3.1"}), "1.2 mm before slice image4.dcm"));
  CHECK(has(at({"0", "0.1", "0.2", "0.4", "0.5"}), "is usual"));   // rounding would hide a gap
  CHECK(has(at({"0", "1", "2", "4", "5"}), "2 mm before slice"));  // whole numbers are not rounded
}

TEST_CASE("what is no slice is left out and named; a slice that cannot be read is not") {
  const TemporaryFolder folder;
  write_series(folder, [](DicomSpec&, int) {});
  DicomSpec screenshot = slice(7);
  screenshot.series = "1.9";
  screenshot.set(0x0028, 0x0002, "US", u16(3));
  screenshot.set(0x0028, 0x0004, "CS", "RGB");
  folder.write("screenshot", dicom(screenshot));
  DicomSpec report = slice(7);
  report.series = "1.8";
  for (const int number : {0x0002, 0x0004, 0x0010, 0x0011}) {
    report.set(0x0028, static_cast<std::uint16_t>(number), "");
  }
  report.set(0x7fe0, 0x0010, "");
  folder.write("report", dicom(report));
  DicomSpec packed = slice(7);
  packed.series = "1.7";
  packed.syntax = "1.2.840.10008.1.2.4.201";
  folder.write("packed", dicom(packed));
  folder.write("broken", dicom(slice(7)).substr(0, 140));
  folder.write("readme", "none of DICOM");
  const SourceVolume v = read_volume(folder.path());
  CHECK(same_values(v, counting<float>()));
  CAPTURE(v.note);
  CHECK(has(v.note, "skipped broken (cannot be read)"));
  CHECK(has(v.note, "skipped packed (its encoding cannot be read (1.2.840.10008.1.2.4.201"));
  CHECK(has(v.note, "skipped report (holds no image)"));
  CHECK(has(v.note, "skipped 1 more"));

  packed.series = slice(0).series;
  folder.write("packed", dicom(packed));
  CHECK(has(refusal(folder.path()),
            "packed: its encoding cannot be read (1.2.840.10008.1.2.4.201, High-Throughput JPEG "
            "2000); export it"));
}

TEST_CASE("an overview among the slices of a series is left out and named") {
  const TemporaryFolder folder;
  write_series(folder, [](DicomSpec&, int) {});
  DicomSpec overview = slice(7);
  overview.orientation = "0\\1\\0\\0\\0\\-1";
  folder.write("overview", dicom(overview));
  const SourceVolume v = read_volume(folder.path());
  CHECK(same_values(v, counting<float>()));
  CHECK(has(v.note, "skipped overview (of another size or direction)"));
  CHECK(has(message_of([](DicomSpec& spec, int) { spec.orientation = "1\\0\\0\\1\\0\\0"; }),
            "is not two directions at right angles"));
}

TEST_CASE("images are found below a folder that has none of its own") {
  const TemporaryFolder folder;
  for (int k = 0; k < 5; ++k) folder.write("DICOM/S1/I" + std::to_string(k), dicom(slice(k)));
  folder.write("DICOMDIR", "an index");
  folder.write("README.TXT", "a text");
  folder.write("AUTORUN.INF", "a program");
  CHECK(same_values(read_volume(folder.path()), counting<float>()));
}

TEST_CASE("cells of any width are read, in the file's byte order") {
  const auto written = [](int bits, bool floats) {
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) {
      std::string bytes;
      for (const std::int16_t value : spec.values) {
        if (floats) {
          bytes += bits == 32 ? bytes_of(static_cast<float>(value))
                              : bytes_of(static_cast<double>(value));
        } else {
          bytes +=
              bits == 8 ? bytes_of(static_cast<std::int8_t>(value)) : bytes_of(std::int32_t{value});
        }
      }
      spec.set(0x0028, 0x0100, "US", u16(bits));
      spec.set(0x0028, 0x0101, "US", u16(bits));
      spec.set(0x0028, 0x0102, "US", u16(bits - 1));
      if (floats) spec.set(0x7fe0, 0x0010, "");
      spec.set(0x7fe0, floats ? (bits == 32 ? 0x0008 : 0x0009) : 0x0010,
               floats ? (bits == 32 ? "OF" : "OD") : "OW", bytes);
    });
    return same_values(read_volume(folder.path()), counting<float>());
  };
  CHECK(written(8, false));
  CHECK(written(32, false));
  CHECK(written(32, true));
  CHECK(written(64, true));
  for (const int bits : {1, 12, 24}) {
    CHECK(has(message_of([&](DicomSpec& spec, int) { spec.set(0x0028, 0x0100, "US", u16(bits)); }),
              "bits"));
  }
  CHECK(has(message_of([](DicomSpec& spec, int) { spec.rows = 0; }), "has 3 x 0 pixels"));
  CHECK(has(message_of([](DicomSpec& spec, int) { spec.set(0x7fe0, 0x0010, ""); }),
            "holds no pixels"));
}

// A series in each of the codecs that scanners and archives write. GDCM writes them from slices
// that are made by hand.

namespace {

constexpr int kEdge = 16;

/// A value for each voxel with neighbours alike, as codecs expect; some below zero.
std::int16_t value_at(int x, int y, int z) {
  return static_cast<std::int16_t>(40 * x + 3 * y * y - 25 * z - 200);
}

/// A slice, packed by a codec; false where this GDCM has none for it.
bool write_packed(const TemporaryFolder& folder, int z, gdcm::TransferSyntax::TSType syntax) {
  DicomSpec spec;
  spec.rows = spec.columns = kEdge;
  spec.instance = z + 1;
  spec.position_mm = {0, 0, 1.5 * z};
  spec.intercept = -1000;
  for (int y = 0; y < kEdge; ++y) {
    for (int x = 0; x < kEdge; ++x) spec.values.push_back(value_at(x, y, z));
  }
  const std::string name = "slice" + std::to_string(z);  // scanners write no ending
  const std::filesystem::path path = folder.write(name, dicom(spec));
  gdcm::ImageReader reader;
  reader.SetFileName(path.c_str());
  if (!reader.Read()) return false;
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(syntax);
  change.SetInput(reader.GetImage());
  if (!change.Change()) return false;
  gdcm::ImageWriter writer;
  writer.SetFile(reader.GetFile());
  writer.SetImage(change.GetOutput());
  writer.SetFileName(path.c_str());
  return writer.Write();
}

}  // namespace

TEST_CASE("a DICOM series reads the same from every codec without loss") {
  using Syntax = gdcm::TransferSyntax;
  const std::pair<const char*, Syntax::TSType> kCodecs[] = {
      {"explicit little-endian", Syntax::ExplicitVRLittleEndian},
      {"implicit little-endian", Syntax::ImplicitVRLittleEndian},
      {"explicit big-endian", Syntax::ExplicitVRBigEndian},
      {"deflated", Syntax::DeflatedExplicitVRLittleEndian},
      {"RLE", Syntax::RLELossless},
      {"JPEG lossless", Syntax::JPEGLosslessProcess14_1},
      {"JPEG-LS", Syntax::JPEGLSLossless},
      {"JPEG 2000", Syntax::JPEG2000Lossless}};
  for (const auto& codec : kCodecs) {
    CAPTURE(std::string(codec.first));
    const TemporaryFolder folder;
    for (int z = 0; z < 3; ++z) REQUIRE(write_packed(folder, z, codec.second));
    const SourceVolume v = read_volume(folder.path());
    REQUIRE(v.grid == VoxelGrid{kEdge, kEdge, 3});
    CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 1.5});
    std::size_t wrong = 0;
    for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {kEdge, kEdge, 3}})) {
      wrong += v.values[v.grid.index(x, y, z)] != static_cast<float>(value_at(x, y, z) - 1000);
    }
    CHECK(wrong == 0);
    // A decoder of JPEG fills in what is missing before the end.
    std::string bytes = text_of(folder / "slice1");
    const std::size_t end = bytes.rfind("\xff\xd9");
    if (std::string(codec.first).find("JPEG") == std::string::npos) continue;
    REQUIRE(end != std::string::npos);
    folder.write("slice1", bytes.replace(end, 2, std::string(2, '\0')));
    CHECK(has(refusal(folder.path()), "slice1: voxels are missing or broken"));
  }
}
