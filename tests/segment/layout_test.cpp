// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <set>
#include <string>

#include <doctest/doctest.h>

#include "shared/segment/layout_table.hpp"

namespace kerf::layout_test {

TEST_CASE("the ABI hash is that of layout 1.4; a changed field needs a new version") {
  CHECK(kLayoutMajor == 1);
  CHECK(kLayoutMinor == 4);
  CHECK(kAbiHash == 14932787646132555344U);
}

TEST_CASE("the magic reads KERFSHM1 in a hex dump") {
  char text[8];
  std::memcpy(text, &kSegmentMagic, sizeof text);
  CHECK(std::string(text, sizeof text) == "KERFSHM1");
}

TEST_CASE("each hot word has a cache line of its own") {
  std::set<std::size_t> lines;
  for (const std::size_t offset :
       {offsetof(SegmentHeader, state_head), offsetof(SegmentHeader, dirty_head),
        offsetof(SegmentHeader, epoch), offsetof(SegmentHeader, heartbeat_ns),
        offsetof(SegmentHeader, state_head_2)}) {
    CHECK(offset % 64 == 0);
    CHECK(lines.insert(offset / 64).second);
  }
}

TEST_CASE("no field name occurs twice in a record and every type is known") {
  std::set<std::pair<std::string_view, std::string_view>> names;
  for (const LayoutField& field : kLayoutTable) {
    CAPTURE(field.name);
    CHECK(names.insert({field.record, field.name}).second);
    CHECK(type_bytes(field.type) != 0);
    CHECK(field.offset % type_bytes(field.type) == 0);
  }
  CHECK(names.size() == 117);
}

TEST_CASE("a version tells its tick, and tick 0 is not 'never seen'") {
  CHECK(stable_version(0) == 2);
  for (const Tick tick : {Tick{0}, Tick{1}, Tick{123456789}}) {
    CHECK(tick_of_version(stable_version(tick)) == tick);
    CHECK(writing_version(tick) % 2 == 1);
    CHECK(writing_version(tick + 1) > stable_version(tick));
  }
}

}  // namespace kerf::layout_test
