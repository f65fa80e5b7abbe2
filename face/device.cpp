// SPDX-License-Identifier: Apache-2.0
#include "kerf/device.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "include/kerf/external.h"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {

struct Device::Parts {
  ~Parts() { kerf_external_close(&external); }

  kerf_external external{};
  std::array<DeviceState, KERF_EXTERNAL_ARMS> states{};
  std::uint64_t refused = 0;
  bool alive = true;
};

namespace {

DeviceState state_of(const kerf_report& report) noexcept {
  DeviceState state{.tick = report.tick,
                    .answers = report.answers,
                    .phase = static_cast<Phase>(report.phase),
                    .fault = static_cast<Fault>(report.fault),
                    .flags = report.flags};
  std::ranges::copy(report.position_mm, state.position_mm.begin());
  std::ranges::copy(report.orientation, state.orientation.begin());
  std::ranges::copy(report.velocity_mm_per_s, state.velocity_mm_per_s.begin());
  std::ranges::copy(report.force_n, state.force_n.begin());
  return state;
}

}  // namespace

Device::Device(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}
Device::~Device() = default;
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;

Device Device::open(const std::string& name) {
  auto parts = std::make_unique<Parts>();
  if (const char* problem = kerf_external_open(&parts->external, name.c_str())) {
    throw Error(problem);
  }
  Device device(std::move(parts));
  static_cast<void>(device.poll());
  return device;
}

std::size_t Device::arms() const noexcept {
  return parts_->external.arms;
}

double Device::period_s() const noexcept {
  return 1.0 / parts_->external.rate_hz;
}

double Device::workspace_scale() const noexcept {
  return parts_->external.workspace_scale;
}

bool Device::poll() noexcept {
  kerf_external& external = parts_->external;
  std::array<kerf_report, KERF_EXTERNAL_ARMS> reports;
  // The first arm first: the controller writes it after the others.
  for (unsigned arm = 0; arm < external.arms; ++arm) {
    parts_->alive = kerf_external_read(&external, arm, &reports[arm]) != 0;
    if (!parts_->alive) return false;
  }
  const bool is_new = reports[0].tick != parts_->states[0].tick;
  parts_->refused = 0;
  for (unsigned arm = 0; arm < external.arms; ++arm) {
    parts_->states[arm] = state_of(reports[arm]);
    parts_->refused += reports[arm].refused;
  }
  return is_new;
}

bool Device::wait() noexcept {
  const std::int64_t quarter_ns = kNsPerSecond / 4 / parts_->external.rate_hz;
  while (!poll()) {
    if (!parts_->alive) return false;
    sleep_until_ns(monotonic_ns() + quarter_ns);
  }
  return true;
}

bool Device::alive() const noexcept {
  return parts_->alive;
}

const DeviceState& Device::state(std::size_t arm) const noexcept {
  static constexpr DeviceState kNone;
  return arm < arms() ? parts_->states[arm] : kNone;
}

std::uint64_t Device::give(const ProgramForce& force, std::size_t arm) noexcept {
  kerf_force given{};
  given.stiffness_n_per_mm = force.stiffness_n_per_mm;
  given.damping_ns_per_mm = force.damping_ns_per_mm;
  std::ranges::copy(force.force_n, given.force_n);
  std::ranges::copy(force.goal_mm, given.goal_mm);
  return kerf_external_give(&parts_->external, static_cast<unsigned>(arm), &given);
}

std::uint64_t Device::refused() const noexcept {
  return parts_->refused;
}

}  // namespace kerf
