// SPDX-License-Identifier: Apache-2.0
#include "record/earlier_inputs.hpp"

#include <algorithm>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::earlier_inputs_test {

using namespace kerf::test;

namespace {

constexpr Tick kFile = kInputsAFile;

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
  for_each_input(folder, last, 1, [&](std::span<const TickRecord> inputs) {
    if (same_inputs(inputs.front(), given_in(read + 1))) ++read;
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
      CHECK(inputs.keep(recording, last).empty());
      CAPTURE(until);
      CHECK(ticks_read(recording, last) == last);
    }
  }
  // Full files are not copied here, and are for another recording.
  const std::filesystem::path first = folder / "kept-15/inputs/000000000001.npy.gz";
  CHECK(std::filesystem::hard_link_count(first) > 2);
  std::filesystem::create_directory(folder / "copy");
  copy_inputs(folder / "kept-15", folder / "copy", 2 * kFile + 1000);
  CHECK(ticks_read(folder / "copy", 2 * kFile + 1000) == 2 * kFile + 1000);
  CHECK(std::filesystem::hard_link_count(folder / "copy/inputs/000000000001.npy.gz") == 1);
  CHECK_THROWS_AS(copy_inputs(folder / "kept-15", folder / "copy", 1),
                  FileError);  // there are some
  std::filesystem::create_directory(folder / "short");
  CHECK_THROWS_AS(copy_inputs(folder / "kept-15", folder / "short", 4 * kFile), FileError);
  CHECK(std::filesystem::is_empty(folder / "short"));
  CHECK_THROWS_AS(for_each_input(folder / "kept-15", 3 * kFile, 1, [](auto) {}), RecordError);
}

TEST_CASE("after a missing tick the inputs are not complete, and stay so") {
  for (const Tick missing : {Tick{1}, Tick{2}, Tick{9}}) {
    const TemporaryFolder folder;
    EarlierInputs inputs(folder.path());
    for (Tick tick = 1; tick <= 20; ++tick) {
      if (tick != missing) inputs.add(given_in(tick));
    }
    std::filesystem::create_directory(folder / "kept");
    CHECK(inputs.keep(folder / "kept", 5).starts_with("tick " + std::to_string(missing) + " was"));
    CHECK(std::filesystem::is_empty(folder / "kept"));
  }
}

TEST_CASE("inputs that cannot be written are a problem of the recordings, not an end") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "run");
  EarlierInputs inputs(folder / "run");
  std::filesystem::remove(folder / "run/inputs");
  for (Tick tick = 1; tick <= 2 * kFile + 2; ++tick) inputs.add(given_in(tick));
  std::filesystem::create_directory(folder / "kept");
  CHECK(inputs.keep(folder / "kept", kFile).find("run/inputs") != std::string::npos);
}

}  // namespace kerf::earlier_inputs_test
