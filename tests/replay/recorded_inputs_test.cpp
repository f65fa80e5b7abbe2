// SPDX-License-Identifier: Apache-2.0
// What the servo was given in five runs (inputs/, made by make_inputs.py) ends in the bits of these
// runs, with the kernels of every instruction set of this machine.
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>

#include <doctest/doctest.h>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "replay/replay_step.hpp"
#include "shared/text/text.hpp"
#include "tests/support/sets_to_run.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// A file of inputs.
struct Inputs {
  std::string scene, output_hash, volume_hash;
  std::vector<TickRecord> ticks;  ///< raw, stale and command alone
};

/// Adds what a line says to what `raw` was before it.
TickRecord tick_of(const std::string& line, TickRecord before) {
  std::istringstream words(line);
  TickRecord tick = before;
  ++tick.tick;
  tick.stale = tick.command = tick.command_argument = 0;
  for (std::string word; words >> word;) {
    if (word == "-") {
      tick.stale = 1;
    } else if (word == "!") {
      words >> tick.command >> tick.command_argument;
    } else {
      const std::size_t colon = word.find(':');
      REQUIRE(colon != std::string::npos);
      tick.raw[std::stoul(word)] += std::stoi(word.substr(colon + 1));
    }
  }
  return tick;
}

Inputs read_inputs(const std::string& name) {
  std::ifstream file(std::string(KERF_INPUTS) + "/" + name + ".txt");
  Inputs inputs;
  TickRecord before{};
  for (std::string line; std::getline(file, line);) {
    const std::size_t space = line.find(' ');
    const std::string first = line.substr(0, space);
    if (first == "scene") {
      inputs.scene = line.substr(space + 1);
    } else if (first == "output") {
      inputs.output_hash = line.substr(space + 1);
    } else if (first == "volume") {
      inputs.volume_hash = line.substr(space + 1);
    } else {
      inputs.ticks.push_back(before = tick_of(line, before));
    }
  }
  return inputs;
}

}  // namespace

TEST_CASE("recorded inputs end in the recorded bits, on every instruction set") {
  for (const char* name : {"touch", "slide", "groove", "cavity", "fault"}) {
    CAPTURE(std::string(name));
    const Inputs inputs = read_inputs(name);
    REQUIRE(inputs.ticks.size() > 3000);
    const LoadedScene scene = load_scene(std::string(KERF_SCENES) + "/" + inputs.scene + ".toml",
                                         {.torque_scale = std::array{0.05, 0.05, 0.05}});
    for (auto set = sets_to_run(); *set != nullptr; ++set) {
      CAPTURE(std::string((*set)->name));
      LoadedScene own = scene;
      const auto servo = compile(own, **set);
      ReplayStep step(*servo);
      TickRecord last{};
      std::uint32_t contact = 0, faults = 0;
      std::uint64_t removed = 0;
      for (const TickRecord& tick : inputs.ticks) {
        last = step({tick})[0];
        contact += (last.flags & kFlagContact) != 0 ? 1 : 0;
        removed += last.removed;
        faults |= last.fault;
      }
      CHECK(hex64(last.output_hash) == inputs.output_hash);
      CHECK(hex64(last.volume_hash) == inputs.volume_hash);
      // Inputs that no longer meet what they are for would be equal everywhere, and worthless.
      CHECK(contact > 200);
      CHECK((removed > 0) == (std::string(name) == "groove" || std::string(name) == "cavity"));
      CHECK((faults != 0) == (std::string(name) == "fault"));
    }
  }
}
