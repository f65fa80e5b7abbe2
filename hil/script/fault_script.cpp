// SPDX-License-Identifier: Apache-2.0
#include "hil/script/fault_script.hpp"

#include <algorithm>
#include <cstddef>
#include <random>

#include "hil/script/script_table.hpp"

namespace kerf {
namespace {

constexpr std::size_t kMaxFaults = 1000;
constexpr double kMaxCounts = 32767;
constexpr double kMaxDelayMs = 1000;
constexpr double kMaxEvery = 1e6;

bool is_of_packets(FaultKind kind) {
  return kind <= FaultKind::corrupt;
}
bool is_of_axis(FaultKind kind) {
  return kind == FaultKind::stick || kind == FaultKind::jump || kind == FaultKind::wander;
}
bool has_counts(FaultKind kind) {
  return kind == FaultKind::jump || kind == FaultKind::wander;
}
bool has_ms(FaultKind kind) {
  return kind == FaultKind::delay || kind == FaultKind::host_late || kind == FaultKind::replay;
}

bool lasts(FaultKind kind) {
  return kind != FaultKind::host_late && kind != FaultKind::hang_up && kind != FaultKind::closing &&
         kind != FaultKind::half_close && kind != FaultKind::both_closed;
}

DeviceFault fault_of(const ScriptTable& table) {
  table.allow_only({"kind", "packets", "at_s", "for_s", "every", "axis", "counts", "ms"});
  if (!table.has("kind")) table.fail(": no kind; add one, for example kind = \"lose\"");
  const std::string word = table.word("kind", "", kFaultWords);
  DeviceFault fault;
  fault.kind = static_cast<FaultKind>(std::ranges::find(kFaultWords, word) - kFaultWords.begin());
  const auto only_if = [&](bool known, std::string_view key) {
    if (known || !table.has(key)) return;
    table.fail(": " + word + " has no " + std::string(key) + "; leave it out");
  };
  only_if(is_of_packets(fault.kind), "packets");
  only_if(is_of_packets(fault.kind), "every");
  only_if(is_of_axis(fault.kind), "axis");
  only_if(has_counts(fault.kind), "counts");
  only_if(has_ms(fault.kind), "ms");
  only_if(lasts(fault.kind), "for_s");
  fault.of_commands =
      table.word("packets", "reports", std::array<std::string_view, 2>{"reports", "commands"}) ==
      "commands";
  fault.at_s = table.number("at_s", 0, {0, kMaxScriptSeconds});
  fault.for_s = table.number("for_s", 0, {0, kMaxScriptSeconds});
  fault.every = table.whole("every", 1, {1, kMaxEvery});
  fault.axis = table.whole("axis", 0, {0, 2});
  fault.counts = table.whole("counts", 0, {-kMaxCounts, kMaxCounts});
  fault.ms = table.number("ms", 0, {0, kMaxDelayMs});
  if (has_ms(fault.kind) && fault.ms <= 0) table.fail(": " + word + " without ms; add ms = 10");
  if (has_counts(fault.kind) && fault.counts == 0) {
    table.fail(": " + word + " without counts; add counts = 200");
  }
  return fault;
}

}  // namespace

FaultScript parse_fault_script(std::string_view text, const std::string& location) {
  const TomlNode file = parse_script(text, location);
  const ScriptTable top(file, location, "");
  top.allow_only({"seed", "clock", "latches", "seconds", "fault"});
  FaultScript script;
  constexpr double kMaxSeed = 4294967295.0;
  script.seed = static_cast<std::uint32_t>(top.number("seed", script.seed, {0, kMaxSeed}));
  const std::string clock = top.word("clock", "push", kFaultClockWords);
  script.clock = clock == "start" ? FaultClock::start : FaultClock::push;
  script.latches = top.word("latches", "", kLatchWords);
  script.seconds = top.number("seconds", script.seconds, {0.1, kMaxScriptSeconds});
  if (top.has("seconds") && !top.has("fault")) return script;  // all goes well, for so long
  for (const TomlNode& fault : top.tables("fault", kMaxFaults)) {
    script.faults.push_back(fault_of(ScriptTable(fault, location, "fault")));
  }
  return script;
}

FaultScript read_fault_script(const std::filesystem::path& file) {
  return parse_fault_script(read_script(file, "hil/faults/lost_reports.toml"), file.string());
}

FaultScript random_faults(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto below = [&](std::uint32_t end) { return static_cast<int>(random() % end); };
  FaultScript script;
  script.seed = seed;
  script.hides = true;
  const int count = 3 + below(4);
  for (int i = 0; i < count; ++i) {
    DeviceFault fault;
    fault.kind = static_cast<FaultKind>(below(static_cast<std::uint32_t>(FaultKind::replay)));
    fault.of_commands = is_of_packets(fault.kind) && below(2) == 1;
    fault.at_s = below(1600) / 1000.0;
    fault.for_s = fault.kind == FaultKind::host_late ? 0 : (20 + below(300)) / 1000.0;
    fault.every = 1 + below(5);
    fault.axis = below(3);
    fault.counts = (1 + below(2000)) * (below(2) == 1 ? 1 : -1);
    fault.ms = 1 + below(100);
    script.faults.push_back(fault);
  }
  return script;
}

}  // namespace kerf
