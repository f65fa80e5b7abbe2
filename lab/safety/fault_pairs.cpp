// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/fault_pairs.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace kerf::faults {
namespace {

constexpr std::string_view kAskedToEnd = "asked_to_end";
constexpr double kStopS = 0.21;       // of a script without faults, or by another clock
constexpr double kStopAfterS = 0.01;  // a fault has begun: held, on its way, or not yet seen

/// When the signal comes, from the first push on: soon after the first fault.
double stop_of(const FaultScript& script) {
  if (script.faults.empty() || script.clock != FaultClock::push) return kStopS;
  const auto first = std::ranges::min_element(script.faults, {}, &DeviceFault::at_s);
  return first->at_s + kStopAfterS;
}

NamedScript pair_of(const NamedScript& first, const NamedScript& second) {
  NamedScript pair = first;
  pair.name += "+" + second.name;
  pair.second_from = first.script->faults.size();
  FaultScript& script = *pair.script;
  script.faults.insert(script.faults.end(), second.script->faults.begin(),
                       second.script->faults.end());
  script.seconds = std::max(script.seconds, second.script->seconds);
  script.hides = true;
  const bool is_harmless = first.script->latches == "none" && second.script->latches == "none";
  script.latches = is_harmless ? "none" : "";
  return pair;
}

NamedScript with_signal(const NamedScript& named) {
  NamedScript pair = named;
  pair.name += "+" + std::string(kAskedToEnd);
  pair.stop_s = stop_of(*named.script);
  pair.script->hides = true;
  pair.script->latches.clear();
  return pair;
}

}  // namespace

std::optional<PairShare> pair_share_of(std::string_view text) noexcept {
  PairShare share;
  const char* const end = text.data() + text.size();
  const auto part = std::from_chars(text.data(), end, share.part);
  if (part.ec != std::errc() || part.ptr == end || *part.ptr != '/') return std::nullopt;
  const auto parts = std::from_chars(part.ptr + 1, end, share.parts);
  const bool is_read = parts.ec == std::errc() && parts.ptr == end;
  if (!is_read || share.part < 1 || share.part > share.parts) return std::nullopt;
  return share;
}

std::vector<NamedScript> pairs_of(const std::vector<NamedScript>& scripts, PairShare share) {
  std::vector<NamedScript> pairs;
  std::size_t count = 0;
  const auto is_mine = [&] { return count++ % share.parts == share.part - 1; };
  for (std::size_t a = 0; a < scripts.size(); ++a) {
    const auto& first = scripts[a];
    if (!first.script) continue;
    if (is_mine()) pairs.push_back(with_signal(first));
    for (std::size_t b = a + 1; b < scripts.size() && !first.script->faults.empty(); ++b) {
      const auto& second = scripts[b];
      if (!second.script || second.script->faults.empty()) continue;
      if (second.script->clock != first.script->clock) continue;
      if (is_mine()) pairs.push_back(pair_of(first, second));
    }
  }
  return pairs;
}

FaultScript played(const NamedScript& named, std::uint32_t seed) {
  FaultScript script = named.script ? *named.script : random_faults(seed);
  script.seed = seed;
  constexpr std::array<double, 5> kLaterS{0, 0.003, 0.015, 0.04, -0.02};
  for (std::size_t i = named.second_from; i < script.faults.size(); ++i) {
    double& at_s = script.faults[i].at_s;
    at_s = std::max(0.0, at_s + kLaterS[seed % kLaterS.size()]);
  }
  return script;
}

}  // namespace kerf::faults
