// SPDX-License-Identifier: Apache-2.0
#include <set>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <rapidcheck.h>
#include <sys/mman.h>
#include <unistd.h>

#include "shared/segment/layout_table.hpp"
#include "shared/segment/reader.hpp"
#include "shared/text/text.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::corrupt_segment_test {

using namespace kerf::test;

namespace {

/// A copy of a good segment that stays writable, sealed only as far as a reader insists.
class ForgedSegment {
 public:
  ForgedSegment() : fd_(memfd_create("forged", MFD_ALLOW_SEALING)) {
    NoiseVolume volume({20, 9, 5});
    volume.labels.assign(volume.density.size(), 1);
    SegmentSpec spec = spec_of(volume);
    spec.arms = 2;
    SegmentWriter writer = SegmentWriter::create(spec);
    for (Tick tick = 1; tick < 10; ++tick) {
      cut_and_publish(writer, volume, tick, {{0, 0, 0}, {9, 9, 5}}, 2);
    }
    good_.resize(writer.total_bytes());
    REQUIRE(pread(writer.fd(), good_.data(), good_.size(), 0) ==
            static_cast<ssize_t>(good_.size()));
    REQUIRE(pwrite(fd_, good_.data(), good_.size(), 0) == static_cast<ssize_t>(good_.size()));
    REQUIRE(fcntl(fd_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW) == 0);
  }
  ~ForgedSegment() { close(fd_); }
  ForgedSegment(const ForgedSegment&) = delete;
  ForgedSegment& operator=(const ForgedSegment&) = delete;

  [[nodiscard]] std::size_t size() const { return good_.size(); }
  [[nodiscard]] std::byte good(std::size_t at) const { return good_[at]; }
  void put(std::size_t at, std::byte value) const {
    REQUIRE(pwrite(fd_, &value, 1, (off_t)at) == 1);
  }
  void restore(std::size_t at) const { put(at, good_[at]); }

  /// Reads all there is to read; "" or the refusal.
  [[nodiscard]] std::string read_everything() const {
    try {
      const SegmentReader reader = SegmentReader::map(fd_);
      TickRecord tick;
      DirtyRecord dirty;
      static_cast<void>(reader.latest());
      static_cast<void>(reader.latest(1));
      static_cast<void>(reader.lifecycle());
      for (std::uint64_t i = 0; i < 12; ++i) {
        static_cast<void>(reader.state_at(i, tick));
        static_cast<void>(reader.state_at(i, tick, 1));
        static_cast<void>(reader.state_at(reader.state_head(1) - i, tick, 1));
        static_cast<void>(reader.state_at(reader.state_head() - i, tick));
        static_cast<void>(reader.dirty_at(reader.dirty_head() - i, dirty));
      }
      unsigned sum = 0;
      for (std::size_t v = 0; v < reader.info().volumes.size(); ++v) {
        VolumeSnapshot snapshot;
        reader.update(v, snapshot);
        for (const Label label : reader.labels(v)) sum += label;
      }
      return sum == 0xffffffff ? "never" : "";
    } catch (const SegmentError& error) {
      return error.what();
    }
  }

 private:
  int fd_;
  std::vector<std::byte> good_;
};

// Fields without which the rest cannot be trusted: any flipped bit must be refused.
const std::set<std::string_view> kGuarded = {
    "magic",       "layout_major",       "layout_minor",       "abi_hash",    "total_bytes",
    "state_slots", "state_record_bytes", "dirty_record_bytes", "log2_brick",  "bits_per_voxel",
    "bricks_x",    "bricks_y",           "bricks_z",           "brick_count", "volume_count"};

}  // namespace

TEST_CASE("every bit of header and descriptor, flipped in turn, is refused or harmless") {
  const ForgedSegment forged;
  REQUIRE(forged.read_everything().empty());
  int refused = 0;
  for (const LayoutField& field : kLayoutTable) {
    const bool in_header = field.record == "SegmentHeader";
    if (!in_header && field.record != "VolumeDescriptor") continue;
    if (in_header && field.name == "pad_page") continue;
    const std::size_t first = field.offset + (in_header ? 0 : sizeof(SegmentHeader));
    for (std::size_t at = first; at < first + field.actual_bytes; ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        CAPTURE(field.name);
        CAPTURE(bit);
        forged.put(at, forged.good(at) ^ std::byte(1 << bit));
        const std::string error = forged.read_everything();
        refused += error.empty() ? 0 : 1;
        if (kGuarded.contains(field.name)) CHECK(!error.empty());
        CHECK(error.find('\n') == std::string::npos);
      }
      forged.restore(at);
    }
  }
  CHECK(refused > 600);
  CHECK(forged.read_everything().empty());
}

TEST_CASE("another version names both versions, another layout both hashes") {
  const ForgedSegment forged;
  forged.put(0x008, std::byte{7});
  CHECK(forged.read_everything().find("layout version = 7.4; expected 1.4") != std::string::npos);
  forged.restore(0x008);
  forged.put(0x010, forged.good(0x010) ^ std::byte{1});
  const std::string error = forged.read_everything();
  CHECK(error.find("abi hash = ") != std::string::npos);
  CHECK(error.find("expected " + hex64(kAbiHash)) != std::string::npos);
}

TEST_CASE("random bytes anywhere in the segment never crash or stall a reader") {
  const ForgedSegment forged;
  CHECK(rc::check([&forged] {
    std::set<std::size_t> places;
    const int edits = *rc::gen::inRange(1, 16);
    for (int i = 0; i < edits; ++i) {
      // The first two pages decide; of the rest, versions and rings take an edit at times.
      const bool early = *rc::gen::inRange(0, 4) != 0;
      const auto at = *rc::gen::inRange<std::size_t>(0, early ? 0x1200 : forged.size());
      forged.put(at, static_cast<std::byte>(*rc::gen::inRange(0, 256)));
      places.insert(at);
    }
    const std::string error = forged.read_everything();
    for (const std::size_t at : places) forged.restore(at);
    RC_ASSERT(error.find('\n') == std::string::npos);
  }));
}

TEST_CASE("offsets at the end of the number range do not wrap around the checks") {
  const ForgedSegment forged;
  for (const char* const name :
       {"off_state", "off_state_2", "off_dirty", "off_volume_table", "off_scene", "scene_bytes",
        "off_versions", "off_bricks", "off_labels"}) {
    for (const LayoutField& field : kLayoutTable) {
      if (field.name != name) continue;
      const std::size_t first =
          field.offset + (field.record == "SegmentHeader" ? 0 : sizeof(SegmentHeader));
      CAPTURE(name);
      for (std::size_t i = 0; i < 8; ++i) {
        forged.put(first + i, i == 0 ? std::byte{0xf8} : std::byte{0xff});
      }
      CHECK(!forged.read_everything().empty());
      for (std::size_t i = 0; i < 8; ++i) forged.restore(first + i);
    }
  }
}

TEST_CASE("a second ring that does not fit is refused by name; 0 says that there is none") {
  const ForgedSegment forged;
  constexpr std::size_t kAt = offsetof(SegmentHeader, off_state_2);
  const auto put = [&forged](std::uint64_t offset) {
    for (std::size_t i = 0; i < 8; ++i) forged.put(kAt + i, std::byte(offset >> 8 * i & 0xff));
    return forged.read_everything();
  };
  const std::uint64_t last = forged.size() - std::uint64_t{kStateSlots} * sizeof(TickRecord);
  CHECK(put(last).empty());
  CHECK(put(0).empty());
  for (const std::uint64_t wrong : {last + 8, last - 4, std::uint64_t{8}, ~std::uint64_t{7}}) {
    CHECK(put(wrong) == "segment: off_state_2 = " + std::to_string(wrong) +
                            "; expected 0 or a ring inside the memory");
  }
}

TEST_CASE("a segment cut short is refused") {
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  std::vector<std::byte> bytes(writer.total_bytes());
  REQUIRE(pread(writer.fd(), bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
  CHECK_NOTHROW(static_cast<void>(parse_segment(bytes)));
  for (std::size_t size = 0; size < bytes.size(); size += 4096) {
    CHECK_THROWS_AS(static_cast<void>(parse_segment(std::span(bytes).first(size))), SegmentError);
  }
}

}  // namespace kerf::corrupt_segment_test
