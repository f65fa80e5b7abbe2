// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "shared/posix/monotonic_clock.hpp"

// What the vendor libraries of the tests have in common: how they misbehave, where the arm is, and
// the record of what was called. Written from the vendors' documentation alone, before the adapter.

namespace kerf::mock {

/// KERF_MOCK: words with commas between them, as `hang_open,error=302@50`.
///
/// Read when the library is loaded.
class Behaviour {
 public:
  Behaviour() {
    const char* const text = std::getenv("KERF_MOCK");
    std::istringstream words(text != nullptr ? text : "");
    for (std::string word; std::getline(words, word, ',');) words_.push_back(word);
  }

  [[nodiscard]] bool has(std::string_view name) const { return value_of(name).has_value(); }
  /// The number after `name=`; `other` without it.
  [[nodiscard]] long number(std::string_view name, long other) const {
    const auto text = value_of(name);
    return text && !text->empty() ? std::strtol(text->c_str(), nullptr, 10) : other;
  }
  /// The number after `name=NUMBER@`: when; -1 without it.
  [[nodiscard]] long moment(std::string_view name) const {
    const auto text = value_of(name);
    const auto at = text ? text->find('@') : std::string::npos;
    return at == std::string::npos ? -1 : std::strtol(text->c_str() + at + 1, nullptr, 10);
  }

 private:
  [[nodiscard]] std::optional<std::string> value_of(std::string_view name) const {
    for (const std::string& word : words_) {
      if (word == name) return "";
      if (word.starts_with(name) && word[name.size()] == '=') return word.substr(name.size() + 1);
    }
    return std::nullopt;
  }

  std::vector<std::string> words_;
};

/// Where the arm is from a tick on, in the vendor's own axes and units.
struct Pose {
  long tick = 0;
  std::array<double, 3> position{};
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< by rows
  int buttons = 0;
  bool docked = true;
};

/// KERF_MOCK_POSES: a file with a line for each change: tick, x y z, nine numbers of the rotation
/// by rows, buttons, docked. Without it the arm stays at `rest`.
inline std::vector<Pose> read_poses(const std::array<double, 3>& rest) {
  std::vector<Pose> poses{{.tick = 0, .position = rest}};
  const char* const file = std::getenv("KERF_MOCK_POSES");
  std::ifstream lines(file != nullptr ? file : "/dev/null");
  Pose pose;
  while (lines >> pose.tick) {
    for (double& value : pose.position) lines >> value;
    for (double& value : pose.rotation) lines >> value;
    lines >> pose.buttons >> pose.docked;
    poses.push_back(pose);
  }
  return poses;
}

/// The pose of a tick: the last one that began.
inline const Pose& pose_at(const std::vector<Pose>& poses, long tick) {
  const Pose* now = &poses.front();
  for (const Pose& pose : poses) {
    if (pose.tick <= tick) now = &pose;
  }
  return *now;
}

/// KERF_MOCK_RECORD: a file of lines, each with its CLOCK_MONOTONIC time in ns first. Written at
/// once, so they survive a SIGKILL.
class Record {
 public:
  Record() {
    const char* const file = std::getenv("KERF_MOCK_RECORD");
    if (file != nullptr) fd_ = open(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  }

  [[gnu::format(printf, 2, 3)]] void add(const char* format, ...) {
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    const int size = std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (size < 0) return;
    const std::lock_guard guard(mutex_);
    lines_.emplace_back(text);
    const std::string line = std::to_string(monotonic_ns()) + ' ' + text + '\n';
    if (fd_ >= 0 && write(fd_, line.data(), line.size()) < 0) std::abort();
  }
  /// All lines so far, without their times: at most `room` into `out`, valid until the next call.
  /// Returns their number.
  int give_lines(const char** out, int room) {
    const std::lock_guard guard(mutex_);
    given_ = lines_;
    const std::size_t most = std::min(given_.size(), static_cast<std::size_t>(std::max(room, 0)));
    for (std::size_t i = 0; i < most; ++i) out[i] = given_[i].c_str();
    return static_cast<int>(given_.size());
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> lines_, given_;
  int fd_ = -1;
};

[[noreturn]] inline void hang() {
  for (;;) pause();
}

[[noreturn]] inline void crash() {
  *static_cast<volatile int*>(nullptr) = 0;
  std::abort();
}

/// Uses up the stack of its thread, which a compiler must not see.
// NOLINTNEXTLINE(misc-no-recursion): it is to overflow
[[gnu::noinline]] inline int overflow(const volatile int* above = nullptr) {
  volatile int room[1024];
  room[0] = above != nullptr ? *above + 1 : 1;
  return room[0] > 0 ? overflow(room) + room[0] : 0;
}

/// Acts by the words about signals, in the calling thread: sets_signals, ignores_signals (whole
/// process), blocks_signals, unblocks_signals (this thread), resets_crash.
inline void take_signals(const Behaviour& behaviour) {
  constexpr std::array kEnds{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP};
  sigset_t ends;
  sigemptyset(&ends);
  for (const int number : kEnds) {
    sigaddset(&ends, number);
    if (behaviour.has("sets_signals")) std::signal(number, [](int) {});
    if (behaviour.has("ignores_signals")) std::signal(number, SIG_IGN);
  }
  if (behaviour.has("blocks_signals")) pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  if (behaviour.has("unblocks_signals")) pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);
  if (!behaviour.has("resets_crash")) return;
  for (const int number : {SIGSEGV, SIGABRT}) std::signal(number, SIG_DFL);
}

/// Acts by the words that end this process: at `number`, in words such as crash=50.
inline void end_process(const Behaviour& behaviour, long number) {
  if (number == behaviour.number("crash", -1)) crash();
  if (number == behaviour.number("overflow", -1)) overflow();
  if (number == behaviour.number("exit", -1)) std::exit(7);
  if (number == behaviour.number("quick_exit", -1)) std::quick_exit(7);
  if (number == behaviour.number("leave", -1)) _exit(7);
  // In a thread that kerf-arm does not know.
  if (number == behaviour.number("overflow_elsewhere", -1)) {
    std::thread([] { overflow(); }).join();
  }
}

}  // namespace kerf::mock
