// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <doctest/doctest.h>

#include "hil/hil_error.hpp"
#include "hil/script/fault_script.hpp"

using kerf::FaultKind;
using kerf::parse_fault_script;

namespace {

std::string error_of(const std::string& text) {
  try {
    static_cast<void>(parse_fault_script(text, "faults.toml"));
  } catch (const kerf::HilError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("a fault script is read whole") {
  const auto script = parse_fault_script(R"(
    seed = 7
    latches = "overspeed"
    [[fault]]
    kind = "lose"
    packets = "commands"
    every = 3
    at_s = 0.5
    for_s = 0.25
    [[fault]]
    kind = "jump"
    axis = 2
    counts = -200
    [[fault]]
    kind = "host_late"
    ms = 10
  )",
                                         "faults.toml");
  CHECK(script.seed == 7);
  CHECK(script.latches == "overspeed");
  CHECK(script.seconds == 4);
  CHECK_FALSE(script.is_random);
  REQUIRE(script.faults.size() == 3);
  CHECK(script.faults[0].kind == FaultKind::lose);
  CHECK(script.faults[0].of_commands);
  CHECK(script.faults[0].every == 3);
  CHECK(script.faults[0].at_s == 0.5);
  CHECK(script.faults[0].for_s == 0.25);
  CHECK(script.faults[1].axis == 2);
  CHECK(script.faults[1].counts == -200);
  CHECK(script.faults[2].ms == 10);
}

TEST_CASE("a script that says how long needs no faults") {
  const auto script = parse_fault_script("seconds = 12", "well.toml");
  CHECK(script.seconds == 12);
  CHECK(script.faults.empty());
  CHECK(error_of("seconds = 0").starts_with("faults.toml:1: seconds = 0 is out of range"));
}

TEST_CASE("bad fault scripts are refused with file, line, value and way out") {
  CHECK(error_of("") == "faults.toml: no faults; add at least one [[fault]]");
  CHECK(error_of("[[fault]]\n") ==
        "faults.toml:1: fault: no kind; add one, for example kind = \"lose\"");
  CHECK(
      error_of("[[fault]]\nkind = \"loose\"\n").starts_with("faults.toml:2: fault.kind: unknown"));
  CHECK(error_of("[[fault]]\nkind = \"lose\"\naxis = 1\n") ==
        "faults.toml:1: fault: lose has no axis; leave it out");
  CHECK(error_of("[[fault]]\nkind = \"delay\"\n") ==
        "faults.toml:1: fault: delay without ms; add ms = 10");
  CHECK(error_of("[[fault]]\nkind = \"jump\"\n") ==
        "faults.toml:1: fault: jump without counts; add counts = 200");
  CHECK(error_of("[[fault]]\nkind = \"stick\"\naxis = 3\n")
            .starts_with("faults.toml:3: fault.axis = 3 is out of range"));
  CHECK(error_of("[[fault]]\nkind = \"stick\"\naxis = 0.5\n") ==
        "faults.toml:1: fault: axis is not whole; use a whole number");
  CHECK(error_of("clock = \"noon\"\n[[fault]]\nkind = \"lose\"\n")
            .starts_with("faults.toml:1: clock: unknown"));
  CHECK(error_of("latches = \"fear\"\n[[fault]]\nkind = \"lose\"\n")
            .starts_with("faults.toml:1: latches: unknown"));
  CHECK(error_of("[[fault]]\nkind = \"lose\"\nat = 1\n").starts_with("faults.toml:3: fault.at"));
  CHECK(error_of("[[fault]\n").starts_with("faults.toml:"));
}

TEST_CASE("the scripts of the project are read, and random ones differ by seed") {
  CHECK(kerf::read_fault_script(KERF_FAULTS_DIR "/late_host.toml").faults.size() == 5);
  const auto one = kerf::random_faults(1);
  CHECK(one.faults.size() >= 3);
  CHECK(kerf::random_faults(1).faults.size() == one.faults.size());
  CHECK((kerf::random_faults(2).faults.size() != one.faults.size() ||
         kerf::random_faults(2).faults[0].at_s != one.faults[0].at_s));
}
