// SPDX-License-Identifier: Apache-2.0
// What the servo was given in five runs (inputs/, made by make_inputs.py) ends in the bits of these
// runs, with the kernels of every instruction set of this machine.
#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "replay/replay_step.hpp"
#include "shared/text/text.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::recorded_inputs_test {

using namespace kerf::test;

namespace {

/// A run: its scene, and the hashes that it ended in.
struct Run {
  const char *name, *scene, *output_hash, *volume_hash;
};
constexpr Run kRuns[] = {
    {"touch", "touch", "158a5bc1b01c68b9", "cbf29ce484222325"},
    {"slide", "wall", "3cdcb2327816dc85", "cbf29ce484222325"},
    {"groove", "phantom", "902d0537eaf9d5dc", "aafe57cee4f97307"},
    {"cavity", "paper_small", "2e1f8e27e78b3153", "c81f9bd02897f02d"},
    {"fault", "touch", "10201c4908b7a620", "cbf29ce484222325"},
};

/// A file of inputs, as make_inputs.py writes it.
class Inputs {
 public:
  explicit Inputs(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
  }

  /// Makes of a tick the one after it (`raw`, stale and command alone); false at the end.
  bool next(TickRecord& tick) {
    if (at_ == bytes_.size()) return false;
    ++tick.tick;
    const std::uint32_t head = byte();
    tick.stale = (head & 64U) != 0 ? 1 : 0;
    tick.command = (head & 128U) != 0 ? byte() : 0;
    tick.command_argument = (head & 128U) != 0 ? byte() : 0;
    for (std::uint32_t changes = head & 63U; changes != 0; --changes) {
      const std::uint32_t index = byte();
      REQUIRE(index < std::size(tick.raw));
      tick.raw[index] += step();
    }
    return true;
  }

 private:
  std::uint32_t byte() { return static_cast<unsigned char>(bytes_.at(at_++)); }

  /// Seven bits in each byte, the lowest first, with a further byte after each one of 128 or more;
  /// the sign is the lowest bit.
  std::int32_t step() {
    std::uint32_t value = 0;
    for (std::uint32_t shift = 0; shift < 32; shift += 7) {
      const std::uint32_t part = byte();
      value |= (part & 127U) << shift;
      if (part < 128) break;
    }
    return static_cast<std::int32_t>((value >> 1U) ^ (0U - (value & 1U)));
  }

  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace

TEST_CASE("recorded inputs end in the recorded bits, on every instruction set") {
  for (const Run& run : kRuns) {
    const std::string name = run.name;
    CAPTURE(name);
    Inputs inputs(std::string(KERF_INPUTS) + "/" + name + ".bin");
    std::vector<TickRecord> ticks;
    for (TickRecord tick{}; inputs.next(tick);) ticks.push_back(tick);
    REQUIRE(ticks.size() > 3000);
    const LoadedScene scene = load_scene(std::string(KERF_SCENES) + "/" + run.scene + ".toml",
                                         {.torque_scale = std::array{0.05, 0.05, 0.05}});
    for (auto set = sets_to_run(); *set != nullptr; ++set) {
      CAPTURE(std::string((*set)->name));
      LoadedScene own = scene;
      const auto servo = compile(own, **set);
      ReplayStep step(*servo);
      TickRecord last{};
      std::uint32_t contact = 0, faults = 0;
      std::uint64_t removed = 0;
      for (const TickRecord& tick : ticks) {
        last = step({tick})[0];
        contact += (last.flags & kFlagContact) != 0 ? 1 : 0;
        removed += last.removed;
        faults |= last.fault;
      }
      CHECK(hex64(last.output_hash) == std::string(run.output_hash));
      CHECK(hex64(last.volume_hash) == std::string(run.volume_hash));
      // Inputs that no longer meet what they are for would be equal everywhere, and worthless.
      CHECK(contact > 200);
      CHECK((removed > 0) == (name == "groove" || name == "cavity"));
      CHECK((faults != 0) == (name == "fault"));
    }
  }
}

}  // namespace kerf::recorded_inputs_test
