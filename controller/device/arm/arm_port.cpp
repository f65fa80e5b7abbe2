// SPDX-License-Identifier: Apache-2.0
#include "controller/device/arm/arm_port.hpp"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/program.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kMillisecondNs = 1'000'000;
constexpr std::int64_t kRetryNs = 10 * kMillisecondNs;
constexpr std::int64_t kPollNs = 50'000;

std::string absent_text(const std::string& name, Personality device,
                        ArmPageController::Absence absence, const std::string& said) {
  const std::string word(word_of(device));
  const std::string adapter = name == word ? "kerf-arm for " + word : "kerf-arm named " + name;
  const std::string start =
      "start ./kerf arm --device " + word + (name == word ? "" : " --name " + name);
  const std::string reason = said.empty() ? "" : " (" + one_line(said) + ")";
  switch (absence) {
    case ArmPageController::Absence::no_adapter:
      return "no " + adapter + "; " + start;
    case ArmPageController::Absence::starting:
      return "the " + adapter + " is not ready" + reason + "; see what it waits for";
    case ArmPageController::Absence::over:
      break;
  }
  return "the " + adapter + " has ended" + reason + "; " + start;
}

/// The kerf-arm beside this program, in a process group of its own: a terminal's signals reach the
/// controller alone, with which it ends. What it prints goes to the error stream. Returns its
/// process; 0 if there is no such program.
pid_t start_arm(Personality device) {
  const std::string program = find_beside_program("kerf-arm");
  if (program.empty()) return 0;
  std::string word(word_of(device));
  std::vector<std::string> words{program, "--device", word, "--once"};
  std::vector<char*> arguments;
  for (std::string& one : words) arguments.push_back(one.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t child = 0;
  const int error =
      posix_spawn(&child, program.c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error == 0 ? child : 0;
}

}  // namespace

ArmPort::ArmPort(const std::string& name, const LinkHello& ours, int patience_ms,
                 const std::atomic<bool>& stop, bool starts)
    : in_lockstep_(ours.lockstep) {
  const Personality device = ours.personality;
  const std::int64_t give_up_ns = monotonic_ns() + patience_ms * kMillisecondNs;
  pid_t child = 0;
  for (;;) {
    ArmPageController::Absence absence{};
    std::string said;
    page_ = ArmPageController::open(name, device, absence, said);
    if (page_) break;
    if (starts && absence == ArmPageController::Absence::no_adapter) {
      child = start_arm(device);
      starts = false;
    }
    if (child > 0 && waitpid(child, nullptr, WNOHANG) == child) {
      throw AlreadySaid("--port arm:" + name + ": kerf-arm has ended");
    }
    if (child > 0 && !stop) {
      sleep_until_ns(monotonic_ns() + kRetryNs);
      continue;
    }
    if (stop || monotonic_ns() >= give_up_ns) {
      throw std::runtime_error("--port arm:" + name + ": " +
                               absent_text(name, device, absence, said));
    }
    sleep_until_ns(monotonic_ns() + kRetryNs);
  }
  const std::string reason = discord(ours, page_->hello());
  if (!reason.empty()) throw std::runtime_error("--port arm:" + name + ": " + reason);
  heard_ns_ = monotonic_ns();
}

std::size_t ArmPort::receive(std::span<std::uint8_t> out) noexcept {
  cartesian::ReportBytes packet;
  if (page_->take(packet)) {
    heard_ns_ = monotonic_ns();
    ++packets_;
    std::copy_n(packet.begin(), std::min(packet.size(), out.size()), out.begin());
    return packet.size();
  }
  if (!in_lockstep_ && monotonic_ns() - heard_ns_ > kSilenceNs)
    silent_.store(true, std::memory_order_relaxed);
  return 0;
}

bool ArmPort::send(std::span<const std::uint8_t> packet) noexcept {
  cartesian::CommandBytes command;
  if (packet.size() != command.size()) return false;
  std::copy_n(packet.begin(), command.size(), command.begin());
  if (!page_->send(command, monotonic_ns())) return false;
  commands_.fetch_add(1, std::memory_order_relaxed);
  return true;
}

bool ArmPort::wait(int milliseconds) noexcept {
  const std::int64_t until_ns = monotonic_ns() + milliseconds * kMillisecondNs;
  while (!page_->waits() && !closed()) {
    const std::int64_t now_ns = monotonic_ns();
    if (now_ns >= until_ns) return false;
    sleep_until_ns(std::min(until_ns, now_ns + kPollNs));
  }
  return page_->waits();
}

std::vector<LinkCounter> ArmPort::counters() const {
  return {{"packets", packets_}, {"commands", commands_.load()}, {"overflow", page_->overrun()}};
}

std::string parse_arm_port(std::string_view text) {
  if (text.empty()) return {};
  const auto is_name = [](std::string_view name) {
    try {
      static_cast<void>(ArmPage::path_of(name));
      return true;
    } catch (const ArmPageError&) {
      return false;
    }
  };
  if (text.front() == ':' && is_name(text.substr(1))) return std::string(text.substr(1));
  throw std::runtime_error("--port arm" + escaped(text) +
                           ": not the name of a kerf-arm; use arm, or arm:NAME with its --name");
}

}  // namespace kerf
