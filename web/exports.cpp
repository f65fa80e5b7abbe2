// SPDX-License-Identifier: Apache-2.0
// The functions of kerf.wasm. One run at a time; one thread. Text and messages go through a buffer
// of the module: `room` makes it so large, then the caller writes there. What a function returns as
// a length lies at `room(0)`.
//
// If one of them fails, an exception ends the instance (absent/exceptions.cpp): the worker then
// makes a new one.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "web/exchange.hpp"
#include "web/tab_replay.hpp"
#include "web/tab_run.hpp"

namespace {

using kerf::web::leave;
using kerf::web::TabInputs;
using kerf::web::TabReplay;
using kerf::web::TabRun;

auto& buffer = kerf::web::exchange;
std::unique_ptr<TabRun> run;
std::unique_ptr<TabReplay> replay;  // one of both is open

/// What both have.
template <class Use>
auto with_open(const Use& use) {
  return replay ? use(*replay) : use(*run);
}

}  // namespace

#define KERF_EXPORT(name) extern "C" [[clang::export_name(#name)]]

KERF_EXPORT(room) std::byte* room(std::size_t bytes) {
  if (bytes > buffer.size()) buffer.resize(bytes);
  return buffer.data();
}

/// The buffer has texts with a zero behind each: name and text of the scene, text of the hand's
/// script, device, "pedal" or nothing, then settings. Replaces the run.
KERF_EXPORT(open_run) void open_run(std::size_t bytes) {
  std::vector<std::string> texts;
  const std::string_view all(reinterpret_cast<const char*>(buffer.data()), bytes);
  for (std::size_t at = 0, end = 0; (end = all.find('\0', at)) != all.npos; at = end + 1) {
    texts.emplace_back(all.substr(at, end - at));
  }
  constexpr std::size_t kFirst = 5;
  texts.resize(std::max(texts.size(), kFirst));
  run.reset();
  replay.reset();
  run = std::make_unique<TabRun>(TabInputs{
      .scene_name = texts[0],
      .scene = texts[1],
      .hand = texts[2],
      .device = texts[3],
      .settings = {texts.begin() + kFirst, texts.end()},
      .pedal = texts[4] == "pedal",
  });
}

/// Up to `ticks` steps, not beyond `most_armed` armed ticks (0: no bound). Returns how many.
KERF_EXPORT(step) int step(int ticks, double most_armed) {
  return run->step(ticks, most_armed > 0 ? static_cast<std::uint64_t>(most_armed)
                                         : std::numeric_limits<std::uint64_t>::max());
}
KERF_EXPORT(rate_hz) int rate_hz() {
  return with_open([](auto& one) { return one.rate_hz(); });
}

KERF_EXPORT(join_viewer) void join_viewer() {
  with_open([](auto& one) { one.viewer().join(); });
}
KERF_EXPORT(slot) void slot(int ended) {
  replay ? replay->slot(ended != 0) : run->viewer().slot(ended != 0);
}
/// Length of the next message; 0 if none is due.
KERF_EXPORT(next_message) std::size_t next_message() {
  return with_open([](auto& one) { return one.viewer().next(buffer); }) ? buffer.size() : 0;
}
/// The buffer has a message of the viewer. Returns whether it is one.
KERF_EXPORT(take_message) int take_message(std::size_t bytes) {
  return with_open([=](auto& one) { return one.viewer().take(std::span(buffer).first(bytes)); })
             ? 1
             : 0;
}

KERF_EXPORT(lead) void lead(double x, double y, double z, double yaw, double pitch, int button) {
  if (run) run->lead({x, y, z}, {yaw, pitch, 0}, button != 0);
}
KERF_EXPORT(release) void release() {
  if (run) run->release();
}

KERF_EXPORT(facts) std::size_t facts() {
  return leave(with_open([](auto& one) { return one.facts(); }));
}
KERF_EXPORT(volume_hash) std::size_t volume_hash() {
  return leave(with_open([](auto& one) { return one.volume_hash(); }));
}

/// The buffer has the name of a folder of the worker, with a recording. Replaces the run.
KERF_EXPORT(open_replay) void open_replay(std::size_t bytes) {
  const std::string folder(reinterpret_cast<const char*>(buffer.data()), bytes);
  run.reset();
  replay.reset();
  replay = std::make_unique<TabReplay>(folder);
}
/// See TabReplay.
KERF_EXPORT(replay_prepare) int replay_prepare(int ticks) {
  return replay->prepare(ticks) ? 1 : 0;
}
KERF_EXPORT(replay_step) int replay_step(int ticks) {
  return replay->step(ticks);
}
KERF_EXPORT(replay_stopped) int replay_stopped() {
  return replay->stopped() ? 1 : 0;
}
KERF_EXPORT(replay_go) void replay_go(double tick) {
  replay->go(tick >= 1 ? static_cast<kerf::Tick>(tick) : 1);
}
