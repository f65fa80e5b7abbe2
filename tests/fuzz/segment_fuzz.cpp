// SPDX-License-Identifier: Apache-2.0
// A reader's look at a segment of a hostile controller, and a controller's at a hostile command.
// The input patches a good segment: 2 bytes of its length, then 6 bytes each of place and content.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include "shared/segment/command.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/writer.hpp"
#include "tests/segment/segment_support.hpp"

namespace {

constexpr std::size_t kPatchBytes = 6;
constexpr std::size_t kPlaces = 65536;  // header, tables and scene lie below

/// The start of a segment is all that parsing reads; what comes after it only counts.
std::vector<std::byte> good_segment() {
  kerf::test::NoiseVolume volume({20, 9, 5});
  kerf::SegmentSpec spec = kerf::test::spec_of(volume);
  spec.arms = 2;
  const auto writer = kerf::SegmentWriter::create(spec);
  std::vector<std::byte> bytes(writer.total_bytes());
  if (pread(writer.fd(), bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    std::abort();
  }
  return bytes;
}

std::uint16_t u16_at(const std::uint8_t* data) {
  return static_cast<std::uint16_t>(data[0] | data[1] << 8);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::byte> good = good_segment();
  static std::vector<std::byte> patched = good;
  if (size >= sizeof(kerf::SegmentCommand)) {
    kerf::SegmentCommand command;
    std::memcpy(&command, data, sizeof command);
    static_cast<void>(kerf::is_valid(command, {.tools = 3, .arms = 2}));
  }
  if (size < 2) return 0;
  const std::size_t cut = std::min<std::size_t>(u16_at(data), patched.size());
  const auto patches = std::span(data, size).subspan(2);
  const auto each_patch = [&](auto act) {
    for (std::size_t at = 0; at + kPatchBytes <= patches.size(); at += kPatchBytes) {
      const std::size_t place = u16_at(&patches[at]) % std::min(kPlaces, patched.size() - 4);
      act(place, &patches[at + 2]);
    }
  };
  each_patch([&](std::size_t place, const std::uint8_t* content) {
    std::memcpy(&patched[place], content, 4);
  });
  try {
    static_cast<void>(kerf::parse_segment(std::span(patched).first(patched.size() - cut)));
  } catch (const kerf::SegmentError&) {
  }
  each_patch([&](std::size_t place, const std::uint8_t*) {
    std::memcpy(&patched[place], &good[place], 4);
  });
  return 0;
}
