// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/temporary_folder.hpp"

namespace kerf::test {

/// A program of kerf running beside the test; ends with its owner.
class Process {
 public:
  Process(const std::vector<std::string>& arguments, std::filesystem::path output)
      : output_(std::move(output)) {
    std::vector<char*> argv;
    for (const auto& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, 1, output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     0600);
    posix_spawn_file_actions_adddup2(&files, 1, 2);
    // As from a terminal: a shell in the background has some ignored.
    posix_spawnattr_t signals;
    posix_spawnattr_init(&signals);
    sigset_t all;
    sigfillset(&all);
    posix_spawnattr_setsigdefault(&signals, &all);
    posix_spawnattr_setflags(&signals, POSIX_SPAWN_SETSIGDEF);
    const int error = posix_spawn(&pid_, argv[0], &files, &signals, argv.data(), environ);
    posix_spawnattr_destroy(&signals);
    posix_spawn_file_actions_destroy(&files);
    if (error != 0) throw std::runtime_error("cannot start " + arguments[0]);
  }
  /// Asked to end first, so that programs leave no sockets behind.
  ~Process() {
    if (code_) return;
    ::kill(pid_, SIGTERM);
    if (ends_within(std::chrono::seconds(2))) return;
    ::kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number) const {
    if (!code_) ::kill(pid_, number);
  }

  /// Whether it has a handler for that signal by now.
  [[nodiscard]] bool catches(int number) const {
    const std::string status = text_of("/proc/" + std::to_string(pid_) + "/status");
    const auto at = status.find("SigCgt:");
    if (at == std::string::npos) return false;
    constexpr int kHex = 16;
    return (std::stoull(status.substr(at + 7), nullptr, kHex) >> (number - 1) & 1) != 0;
  }

  /// What an open descriptor of it leads to.
  [[nodiscard]] std::string descriptor(int number) const {
    const auto link = "/proc/" + std::to_string(pid_) + "/fd/" + std::to_string(number);
    std::error_code gone;
    return std::filesystem::read_symlink(link, gone).string();
  }

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// The first process that it has started, or -1.
  [[nodiscard]] pid_t child() const {
    const std::string id = std::to_string(pid_);
    const std::string children = text_of("/proc/" + id + "/task/" + id + "/children");
    return children.empty() ? -1 : std::stoi(children);
  }

  /// Exit code, or 128 + signal.
  int wait() {
    if (!code_) take_end(0);
    return *code_;
  }
  /// Returns true if it has ended by then; `wait` returns how.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds patience) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!code_ && !take_end(WNOHANG) && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return code_.has_value();
  }
  /// Everything it printed so far.
  [[nodiscard]] std::string output() const { return text_of(output_); }

 private:
  bool take_end(int options) {
    int status = 0;
    if (waitpid(pid_, &status, options) != pid_) return false;
    code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return true;
  }

  pid_t pid_ = -1;
  std::optional<int> code_;
  std::filesystem::path output_;
};

/// Waits until `condition` holds, at most `patience`.
template <class Condition>
bool eventually(Condition condition, std::chrono::milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

}  // namespace kerf::test
