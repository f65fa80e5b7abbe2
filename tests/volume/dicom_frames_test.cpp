// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/volume/volume_files.hpp"

namespace kerf::dicom_frames_test {

using namespace kerf::test;

namespace {

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
  std::string orientation{};  ///< empty: that of all
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
    if (!each.orientation.empty()) {
      set_group(own, 0x0020, 0x9116, dicom_element(0x0020, 0x0037, "DS", each.orientation));
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

TEST_CASE(
    "a file of thousands of small frames takes two seconds of CPU at most, whatever differs") {
#ifdef KERF_SANITIZED
  constexpr int kCpuS = 20;
#else
  constexpr int kCpuS = 2;
#endif
  const TemporaryFolder folder;
  const auto read_fast = [&](const std::vector<Frame>& frames) {
    return refusal(folder.write("a.dcm", dicom(enhanced(frames))), {.cpu_s = kCpuS});
  };
  std::vector<Frame> slopes, parts, directions;
  for (int k = 0; k < 1000; ++k) {  // at most 1024 slices are a volume
    slopes.push_back(frame(k));
    for (auto& value : slopes.back().values) value = 1;
    slopes.back().slope = std::to_string(1 + 0.001 * k);
  }
  CHECK(read_fast(slopes) == "no error");
  for (int k = 0; k < 6000; ++k) {  // two at each position, which each mark separates and none all
    parts.push_back(frame(k / 2 % 1500));
    for (auto& value : parts.back().values) value = 1;
    parts.back().time = 1 + static_cast<std::uint32_t>(k % 7);
    parts.back().stack = std::to_string(k % 3000 / 2);
    directions.push_back(parts.back());
    directions.back().orientation =
        std::to_string(std::cos(1e-4 * k)) + "\\" + std::to_string(std::sin(1e-4 * k)) + "\\0\\" +
        std::to_string(-std::sin(1e-4 * k)) + "\\" + std::to_string(std::cos(1e-4 * k)) + "\\0";
  }
  for (const auto& frames : {parts, directions}) {
    const std::string message = read_fast(frames);
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK_FALSE(has(message, "CPU"));
    CHECK(message != "no error");
  }
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
  ReadOptions second;
  second.series = "2";  // a file is DICOM by its mark, whatever its name
  CHECK(read_volume(folder.write("IM0001", dicom(enhanced(frames))), second).values[0] == 1200);
  CHECK(has(refusal(folder.write("a.mha", meta("MET_USHORT", kElementSpacing)), second),
            "--series: "));
  // Half a distance apart, they would be one even stack.
  std::vector<Frame> between;
  for (int k = 0; k < 6; ++k) {
    between.push_back(frame(k));
    between.back().time = 1 + static_cast<std::uint32_t>(k % 2);
  }
  CHECK(has(refusal_of(folder, enhanced(between)), "2 DICOM series"));
}

TEST_CASE("stacks of one file that form one regular grid are one volume, others are named so") {
  const TemporaryFolder folder;
  const auto stacked = [](const std::vector<int>& stack_of_slice) {
    std::vector<Frame> frames;
    for (std::size_t k = 0; k < stack_of_slice.size(); ++k) {
      frames.push_back(frame(static_cast<int>(k)));
      frames.back().stack = std::to_string(stack_of_slice[k]);
    }
    std::ranges::stable_sort(frames, {}, &Frame::stack);
    return frames;
  };
  const std::vector<float> five = counting<float>();
  for (const std::vector<int>& stacks :
       {std::vector{1, 2, 1, 2, 1}, std::vector{1, 1, 1, 2, 2}, std::vector{2, 1, 1, 2, 1}}) {
    const SourceVolume v = read(folder, enhanced(stacked(stacks)));
    CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
    CHECK(same_values(v, five));
    CHECK(has(v.note, "joined of 2 stacks (StackID), whose slices form one regular grid"));
  }
  // Each regular, but not together: a slice is missing, or the second lies 0.5 mm too high.
  std::vector<Frame> gap = stacked({1, 2, 1, 2, 1, 2, 1, 2}), high = gap;
  gap.erase(gap.begin() + 3);
  for (std::size_t i = 4; i < 8; ++i) high[i].z = std::to_string(102.5 + 4 * double(i - 4));
  for (const auto& frames : {gap, high}) {
    CHECK(has(refusal_of(folder, enhanced(frames)),
              "; the stacks of a series form no regular grid together"));
  }
  CHECK(read(folder, enhanced(high), "StackID 2").values[0] == 12);
  // Two times of two stacks: two volumes, not four.
  std::vector<Frame> twice;
  for (const std::uint32_t time : {1U, 2U}) {
    for (Frame each : stacked({1, 2, 1, 2, 1})) {
      each.time = time;
      twice.push_back(each);
    }
  }
  CHECK(has(refusal_of(folder, enhanced(twice)), "2 DICOM series; choose one"));
  CHECK(same_values(read(folder, enhanced(twice), "2"), five));
}

TEST_CASE("frames of several files are one volume, or one in each file") {
  const TemporaryFolder parts, copies;
  parts.write("a.dcm", dicom(enhanced({frame(4), frame(0)})));
  parts.write("b.dcm", dicom(enhanced({frame(1), frame(3), frame(2)})));
  CHECK(same_values(read_volume(parts.path()), counting<float>()));
  for (const char* name : {"a.dcm", "b.dcm"}) {
    copies.write(name, dicom(enhanced({frame(0), frame(1)})));
  }
  CHECK(has(refusal(copies.path()), "1 '', file a.dcm (2 slices of 3 x 4), 2 '', file b.dcm"));
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
  CHECK(has(refusal_of(folder, spec), "counted by (0018,1063), a time, view or page"));
}

TEST_CASE("frames are put in order by SliceVector, or refused") {
  const TemporaryFolder folder;
  DicomSpec spec;
  spec.set(0x0028, 0x0008, "IS", "5");
  spec.set(0x0018, 0x0088, "DS", "2");
  std::string vector;
  for (const int k : {3, 0, 4, 1, 2}) {
    for (int i = 0; i < 12; ++i) spec.values.push_back(static_cast<std::int16_t>(12 * k + i));
    vector += u16(k + 1);
  }
  const std::string pointer = u16(0x0054) + u16(0x0080);
  spec.set(0x0028, 0x0009, "AT", pointer);
  CHECK(has(refusal_of(folder, spec), "counted by (0054,0080), which is not in the file"));
  spec.set(0x0054, 0x0080, "US", vector);
  for (const bool named : {true, false}) {
    spec.set(0x0028, 0x0009, named ? "AT" : "", pointer);
    const SourceVolume v = read(folder, spec);
    CHECK(same_values(v, counting<float>()));
    CHECK(has(v.note, "in the order of SliceVector"));
  }
  spec.set(0x0020, 0x0032, "");
  CHECK(same_values(read(folder, spec), counting<float>()));
  for (const std::string& wrong :
       {u16(0) + vector.substr(2), u16(6) + vector.substr(2), vector.substr(0, 8),
        vector.substr(0, 8) + vector.substr(0, 2)}) {
    spec.set(0x0054, 0x0080, "US", wrong);
    CHECK(has(refusal_of(folder, spec), "SliceVector does not number its 5 frames from 1"));
  }
  for (const std::string& other : {pointer + u16(0x0054) + u16(0x0010), u16(0x0018) + u16(0x2001),
                                   u16(0x0054) + u16(0x0100)}) {
    spec.set(0x0054, 0x0080, "US", vector);
    spec.set(0x0028, 0x0009, "AT", other);
    CHECK(has(refusal_of(folder, spec), "a time, view or page, and are no slices"));
  }
}

TEST_CASE("slices without positions of which one has no number are refused by name") {
  const TemporaryFolder folder;
  std::vector<Frame> frames;
  for (int k = 0; k < 3; ++k) {
    frames.push_back(frame(k));
    frames.back().z.clear();
  }
  CHECK(
      has(refusal_of(folder, enhanced(frames)), "its 3 slices have neither positions nor numbers"));
  for (int without = 0; without < 5; ++without) {
    const std::string message = series_message([&](DicomSpec& spec, int k) {
      spec.set(0x0020, 0x0032, "");
      spec.set(0x0018, 0x0088, "DS", "2");
      if (k == without) spec.set(0x0020, 0x0013, "");
    });
    CAPTURE(message);
    CHECK(has(message, "has neither a position nor a number"));
  }
}

TEST_CASE("slices without positions are put in order by location or number, which is noted") {
  const auto no_position = [](DicomSpec& spec) { spec.set(0x0020, 0x0032, ""); };
  const TemporaryFolder by_location, by_number;
  write_dicom_series(by_location, [&](DicomSpec& spec, int k) {
    no_position(spec);
    spec.set(0x0020, 0x1041, "DS", std::to_string(3 * k));
  });
  const SourceVolume located = read_volume(by_location.path());
  CHECK(same_values(located, counting<float>()));
  CHECK(located.spacing_mm == std::array<double, 3>{0.25, 0.5, 3});
  CHECK(has(located.note, "in the order of SliceLocation"));
  write_dicom_series(by_number, [&](DicomSpec& spec, int) { no_position(spec); });
  CHECK(has(refusal(by_number.path()), "spacing along z is not in the file"));
  ReadOptions options;
  options.spacing_mm = {0.25, 0.5, 2};
  const SourceVolume numbered = read_volume(by_number.path(), options);
  CHECK(same_values(numbered, counting<float>()));
  CHECK(has(numbered.note, "in the order of InstanceNumber"));

  CHECK(has(series_message([&](DicomSpec& spec, int k) {
              if (k == 3) no_position(spec);
            }),
            "image4.dcm has no position, and"));
  CHECK(has(series_message([&](DicomSpec& spec, int k) {
              no_position(spec);
              spec.set(0x0020, 0x1041, "DS", std::to_string((2 * k) % 5));
            }),
            "in different orders"));
  CHECK(has(series_message([&](DicomSpec& spec, int k) {
              no_position(spec);
              spec.set(0x0020, 0x1041, "DS", std::to_string(k == 4 ? 5 : k));
            }),
            "2 mm before slice image2.dcm where 1 mm is usual"));
  CHECK(has(series_message([&](DicomSpec& spec, int k) {
              no_position(spec);
              if (k == 4) spec.set(0x0020, 0x0013, "IS", "6");
            }),
            "has the number 6 and follows 4"));
  CHECK(has(series_message([&](DicomSpec& spec, int) {
              no_position(spec);
              spec.set(0x0020, 0x0013, "");
            }),
            "its 5 slices have neither positions nor numbers"));
}

}  // namespace kerf::dicom_frames_test
