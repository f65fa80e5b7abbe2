// SPDX-License-Identifier: Apache-2.0
#include "record/run/flight_notice.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "record/recorder.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {
namespace {

constexpr const char* kSuffix = ".flight";
constexpr const char* kRunFolder = ".run-";

std::filesystem::path notice_of(const std::string& name) {
  return segment_folder() + "/" + name + kSuffix;
}

/// Bytes of the recordings in `out` that are not whole yet: their folders are hidden. They grow
/// while a flight recorder writes; those that a killed one has left do not.
std::uintmax_t unfinished_bytes(const std::filesystem::path& out) {
  std::uintmax_t bytes = 0;
  std::error_code fault;
  for (std::filesystem::directory_iterator folder(out, fault), end; !fault && folder != end;
       folder.increment(fault)) {
    const std::string name = folder->path().filename().string();
    if (!name.starts_with(".") || name.starts_with(kRunFolder)) continue;
    std::error_code gone;
    for (std::filesystem::directory_iterator file(folder->path(), gone); !gone && file != end;
         file.increment(gone)) {
      std::error_code unknown;
      const std::uintmax_t size = file->file_size(unknown);
      if (!unknown) bytes += size;
    }
  }
  return bytes;
}

}  // namespace

FlightNotice::FlightNotice(const std::string& name, const std::filesystem::path& out)
    : lock_(name + kSuffix), path_(notice_of(name)) {
  write_new_file(path_, std::filesystem::absolute(out).string());
}

FlightNotice::~FlightNotice() {
  std::error_code gone;
  std::filesystem::remove(path_, gone);
}

std::string flight_folder(const TickWindow::Event& event) {
  std::array<char, 24> tick{};
  std::snprintf(tick.data(), tick.size(), "%012llu", static_cast<unsigned long long>(event.tick));
  return std::string(tick.data()) + "-" + event.reason;
}

std::string run_folder(const std::string& name) {
  return kRunFolder + name;
}

std::filesystem::path grab(const std::string& name) {
  SegmentConnection connection = connect_segment(name);
  std::ifstream notice(notice_of(name));
  std::string out;
  if (!std::getline(notice, out)) {
    throw SegmentError(
        "--name " + name +
        ": no flight recorder runs; start kerf-recorder --flight 60 --out DIR first");
  }
  const Reply reply = connection.send({.kind = CommandKind::mark});
  if (reply.status != ReplyStatus::accepted) {
    throw SegmentError("--name " + name + ": the controller took no mark; try again");
  }
  // The tick of the mark is in the record in which the command was applied.
  using Clock = std::chrono::steady_clock;
  constexpr auto kPatience = std::chrono::seconds(10);
  auto deadline = Clock::now() + kPatience;
  const SegmentReader& reader = connection.reader();
  std::uint64_t next = reader.state_head();
  next -= std::min<std::uint64_t>(next, reader.info().state_slots / 2);
  std::filesystem::path kept;
  std::uintmax_t written = unfinished_bytes(out);
  while (Clock::now() < deadline) {
    TickRecord record;
    for (; kept.empty() && reader.state_at(next, record) == ReadState::ok; ++next) {
      const bool marked = (record.command & kCommandKind) == kCommandMark;
      if (!marked || record.last_command != reply.index) continue;
      kept = std::filesystem::path(out) / flight_folder({"mark", record.tick});
    }
    if (kept.empty() && reader.state_at(next, record) == ReadState::overrun) ++next;
    if (!kept.empty() && std::filesystem::exists(kept)) return kept;
    // It may still write the recording of an earlier mark.
    const std::uintmax_t before = std::exchange(written, unfinished_bytes(out));
    if (written != before) deadline = Clock::now() + kPatience;
    std::this_thread::sleep_for(kPollPeriod);
  }
  throw SegmentError(out + ": the flight recorder kept nothing within 10 s; see its messages");
}

}  // namespace kerf
