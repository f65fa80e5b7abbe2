// SPDX-License-Identifier: Apache-2.0
#include "controller/device/arm/arm_port.hpp"

#include <algorithm>
#include <stdexcept>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kMillisecondNs = 1'000'000;
constexpr std::int64_t kRetryNs = 10 * kMillisecondNs;
constexpr std::int64_t kPollNs = 50'000;

std::string absent_text(const std::string& name, Personality device,
                        ArmPageController::Absence absence, const std::string& said) {
  const std::string word(word_of(device));
  const std::string arm = name == word ? "kerf-arm for " + word : "kerf-arm named " + name;
  const std::string start =
      "start ./kerf arm --device " + word + (name == word ? "" : " --name " + name);
  const std::string reason = said.empty() ? "" : " (" + one_line(said) + ")";
  switch (absence) {
    case ArmPageController::Absence::no_adapter:
      return "no " + arm + "; " + start;
    case ArmPageController::Absence::starting:
      return "the " + arm + " is not ready" + reason + "; see what it waits for";
    case ArmPageController::Absence::over:
      break;
  }
  return "the " + arm + " has ended" + reason + "; " + start;
}

}  // namespace

ArmPort::ArmPort(const std::string& name, Personality device, int patience_ms,
                 const std::atomic<bool>& stop) {
  const std::int64_t give_up_ns = monotonic_ns() + patience_ms * kMillisecondNs;
  for (;;) {
    ArmPageController::Absence absence{};
    std::string said;
    page_ = ArmPageController::open(name, device, absence, said);
    if (page_) break;
    if (stop || monotonic_ns() >= give_up_ns) {
      throw std::runtime_error("--port arm:" + name + ": " +
                               absent_text(name, device, absence, said));
    }
    sleep_until_ns(monotonic_ns() + kRetryNs);
  }
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
  if (monotonic_ns() - heard_ns_ > kSilenceNs) silent_.store(true, std::memory_order_relaxed);
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
