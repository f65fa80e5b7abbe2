// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "controller/servo/servo.hpp"
#include "record/export/log_page.hpp"
#include "shared/segment/tick_table.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::log_columns_test {

TEST_CASE("docs/log.md is what the table says") {
  INFO("renew it: ./kerf record columns > docs/log.md");
  CHECK((test::file_text(KERF_DOCS "/log.md") == log_page()));
}

TEST_CASE("the page's codes are the servo's") {
  for (const TickCode& code : std::span(kTickFaults)) {
    CHECK(code.name == fault_name(static_cast<Fault>(code.value)));
  }
  CHECK(fault_name(static_cast<Fault>(std::span(kTickFaults).size())) ==
        std::string_view("unknown"));
  CHECK(std::span(kTickPhases).size() == static_cast<std::size_t>(Phase::fault) + 1);
  CHECK(std::span(kTickPhases)[static_cast<std::size_t>(Phase::ramping)].name == "ramping");
  for (std::size_t i = 0; i < std::span(kTickPhases).size(); ++i)
    CHECK(std::span(kTickPhases)[i].value == i);
}

TEST_CASE("every flag that a record can have is on the page, once") {
  std::uint32_t seen = 0;
  for (const TickCode& flag : kTickFlags) {
    CHECK((seen & flag.value) == 0);
    seen |= flag.value;
  }
  CHECK(seen == (kFlagButton1 | kFlagButton2 | kFlagContact | kFlagClamped | kFlagStaleInput |
                 kFlagDeviceFault | kFlagMotorsOn | kFlagParked | kFlagStarted | kFlagForbidden |
                 kFlagRefused | kFlagShaft | kFlagReset | kFlagUndo | kFlagUndoable | kFlagRedo |
                 kFlagRedoable | kFlagPedal));
}

}  // namespace kerf::log_columns_test
