// SPDX-License-Identifier: Apache-2.0
// Which field of a tick is named if a replay differs.
#include "replay/tick_stages.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <string>

#include <doctest/doctest.h>

#include "shared/segment/layout_table.hpp"

namespace kerf::tick_stages_test {
namespace {

const std::set<std::string_view> kGiven{"seq",
                                        "tick",
                                        "start_ns",
                                        "period_error_ns",
                                        "execution_ns",
                                        "raw",
                                        "stale",
                                        "missed_deadlines",
                                        "lost_packets",
                                        "last_command",
                                        "refused_packets",
                                        "command",
                                        "crc32c",
                                        "command_argument"};

}  // namespace

TEST_CASE("a difference in any element of any computed column is found, and in no other") {
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != "TickRecord") continue;
    for (std::uint32_t i = 0; i < field.count; ++i) {
      TickRecord recorded{}, replayed{};
      auto* const byte = reinterpret_cast<unsigned char*>(&replayed) + field.offset +
                         std::size_t{i} * type_bytes(field.type);
      *byte = 1;
      const auto found = first_difference(recorded, replayed);
      CAPTURE(field.name);
      CHECK(found.has_value() != kGiven.contains(field.name));
      if (!found) continue;
      const std::string element = field.count > 1 ? "[" + std::to_string(i) + "]" : "";
      CHECK(found->field == std::string(field.name) + element);
    }
  }
}

TEST_CASE("the earliest stage of the step is named, and both values") {
  TickRecord recorded{}, replayed{};
  recorded.contact_force_n[1] = 0.5F;
  replayed.contact_force_n[1] = 0.25F;
  recorded.output_hash = 7;
  recorded.removed = 3;
  const auto found = first_difference(recorded, replayed);
  REQUIRE(found);
  CHECK(found->stage == "contact");
  CHECK(found->field == "contact_force_n[1]");
  CHECK(found->recorded == "0.5");
  CHECK(found->replayed == "0.25");
}

TEST_CASE("equal bits are equal: unknown places before docking, but not the other zero") {
  TickRecord recorded{}, replayed{};
  recorded.position_mm[2] = replayed.position_mm[2] = std::numeric_limits<double>::quiet_NaN();
  CHECK(!first_difference(recorded, replayed));
  recorded.position_mm[0] = -0.0;
  const auto found = first_difference(recorded, replayed);
  REQUIRE(found);
  CHECK(found->field == "position_mm[0]");
}

}  // namespace kerf::tick_stages_test
