// SPDX-License-Identifier: Apache-2.0
#include "record/earlier_inputs.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <unistd.h>

#include "record/tick_log.hpp"
#include "tests/record/record_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr Tick kFile = EarlierInputs::kTicksAFile;

TickRecord given_in(Tick tick) {
  TickRecord record = made_up_tick(tick, 10'000);
  for (std::size_t i = 0; i < std::size(record.raw); ++i) {
    record.raw[i] = static_cast<std::int32_t>(tick * (i + 1) * 2654435761U);
  }
  record.stale = static_cast<std::uint32_t>(tick % 3);
  record.command = static_cast<std::uint32_t>(tick % 7);
  record.command_argument = static_cast<std::uint32_t>(tick % 5);
  record.last_command = static_cast<std::uint32_t>(tick / 7);
  return record;
}

bool same_inputs(const TickRecord& a, const TickRecord& b) {
  return a.tick == b.tick && std::ranges::equal(a.raw, b.raw) && a.stale == b.stale &&
         a.command == b.command && a.command_argument == b.command_argument &&
         a.last_command == b.last_command;
}

/// How many ticks of the recording are read, each as it was given.
Tick ticks_read(const std::filesystem::path& folder, Tick last) {
  Tick read = 0;
  for_each_input(folder, last, [&](const TickRecord& inputs) {
    if (same_inputs(inputs, given_in(read + 1))) ++read;
  });
  return read;
}

}  // namespace

TEST_CASE("inputs are read back as they were given, up to any tick") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "run");
  EarlierInputs inputs(folder / "run");
  Tick given = 0;
  int kept = 0;
  for (const Tick until : {Tick{1}, kFile, kFile + 1, 2 * kFile, 2 * kFile + 1000}) {
    while (given < until) inputs.add(given_in(++given));
    // A window of 500 ticks, or of all, or of none.
    for (const Tick last : {until - std::min<Tick>(until, 500), Tick{0}, until}) {
      const std::filesystem::path recording = folder / ("kept-" + std::to_string(++kept));
      std::filesystem::create_directory(recording);
      inputs.keep(recording, last);
      CAPTURE(until);
      CHECK(ticks_read(recording, last) == last);
    }
  }
  CHECK(inputs.problem().empty());
  // Full files are not copied.
  const std::filesystem::path first = folder / "kept-15/inputs/000000000001.npy.gz";
  CHECK(std::filesystem::hard_link_count(first) > 2);
  CHECK_THROWS_AS(for_each_input(folder / "kept-15", 3 * kFile, [](const TickRecord&) {}),
                  RecordError);
}

TEST_CASE("after a missing tick the inputs are not complete, and stay so") {
  const TemporaryFolder folder;
  for (const Tick missing : {Tick{1}, Tick{2}, Tick{9}}) {
    EarlierInputs inputs(folder.path());
    for (Tick tick = 1; tick <= 20; ++tick) {
      CHECK(inputs.problem().empty() == (tick <= missing + 1));
      if (tick != missing) inputs.add(given_in(tick));
    }
    CHECK(inputs.problem().starts_with("tick " + std::to_string(missing) + " was not seen"));
  }
}

TEST_CASE("inputs that cannot be written are a problem, not an end") {
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "not a folder";
  EarlierInputs inputs(folder / "file");
  for (Tick tick = 1; tick <= kFile + 2; ++tick) inputs.add(given_in(tick));
  CHECK(inputs.problem().find("file/inputs") != std::string::npos);
}
