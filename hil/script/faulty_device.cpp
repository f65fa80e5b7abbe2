// SPDX-License-Identifier: Apache-2.0
#include "hil/script/faulty_device.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "hil/device/packet_device.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf {

namespace {

constexpr double kPushN = 0.05;
constexpr int kPotNoiseMask = 31;

/// The part of a device's report that a fault of a sensor can change, the same for all devices. A
/// position of a Cartesian device is in the servo's counts, of `step_um`.
struct Readings {
  std::array<std::int16_t, 3> encoder{};
  /// Docked (Omni), centre button (Falcon), calibration button (WoodenHaptics), parked (Cartesian).
  bool parked = false;
  bool homed = true;                    ///< of the Falcon and of Cartesian devices
  std::array<std::uint16_t, 6> pots{};  ///< of the Omni's gimbal

  friend bool operator==(const Readings&, const Readings&) noexcept = default;
};

Readings read(const OmniReport& report, int /*step_um*/) noexcept {
  Readings readings{.encoder = report.encoder, .parked = report.docked};
  std::ranges::copy(report.pot_a, readings.pots.begin());
  std::ranges::copy(report.pot_b, readings.pots.begin() + 3);
  return readings;
}

Readings read(const FalconReport& report, int /*step_um*/) noexcept {
  return {.encoder = report.encoder,
          .parked = (report.buttons & falcon::kButtonCentre) != 0,
          .homed = std::ranges::all_of(report.homed, [](bool homed) { return homed; })};
}

Readings read(const WoodenReport& report, int /*step_um*/) noexcept {
  Readings readings{.parked = report.calibrate};
  std::copy_n(report.encoder.begin(), 3, readings.encoder.begin());
  return readings;
}

Readings read(const CartesianReport& report, int step_um) noexcept {
  Readings readings{.parked = report.parked, .homed = report.homed};
  for (std::size_t i = 0; i < 3; ++i) {
    // NOLINTNEXTLINE(clang-analyzer-core.DivideZero): each Cartesian device has a step
    readings.encoder[i] = static_cast<std::int16_t>(report.position_um[i] / step_um);
  }
  return readings;
}

/// Adds the change alone, so that the rest of a position is not lost.
void write(const Readings& readings, CartesianReport& report, int step_um) noexcept {
  const Readings before = read(report, step_um);
  for (std::size_t i = 0; i < 3; ++i) {
    report.position_um[i] += (readings.encoder[i] - before.encoder[i]) * step_um;
  }
  report.parked = readings.parked;
  report.homed = readings.homed;
}

void write(const Readings& readings, OmniReport& report, int /*step_um*/) noexcept {
  report.encoder = readings.encoder;
  report.docked = readings.parked;
  std::copy_n(readings.pots.begin(), 3, report.pot_a.begin());
  std::copy_n(readings.pots.begin() + 3, 3, report.pot_b.begin());
}

void write(const Readings& readings, FalconReport& report, int /*step_um*/) noexcept {
  report.encoder = readings.encoder;
  const unsigned others = report.buttons & ~unsigned{falcon::kButtonCentre};
  report.buttons =
      static_cast<std::uint8_t>(others | (readings.parked ? unsigned{falcon::kButtonCentre} : 0U));
  if (!readings.homed) report.homed = {};
}

void write(const Readings& readings, WoodenReport& report, int /*step_um*/) noexcept {
  std::ranges::copy(readings.encoder, report.encoder.begin());
  report.calibrate = readings.parked;
}

/// Calls `use` with the report in `packet`, whatever its device.
template <class Use>
void with_report(std::span<const std::uint8_t> packet, const Use& use) noexcept {
  if (const auto omni = decode_report(packet)) return use(*omni);
  if (const auto cartesian = decode_cartesian_report(packet)) return use(*cartesian);
  if (const auto falcon = falcon::decode_report(packet)) return use(*falcon);
  if (const auto wooden = wooden::decode_report(packet)) return use(*wooden);
}

/// Empty if `packet` is no report of a device; its size shows the device.
std::optional<Readings> readings_of(std::span<const std::uint8_t> packet, int step_um) noexcept {
  std::optional<Readings> readings;
  with_report(packet, [&](const auto& report) { readings = read(report, step_um); });
  return readings;
}

/// Puts `readings` into a packet that `readings_of` has read.
void put_readings(const Readings& readings, std::span<std::uint8_t> packet, int step_um) noexcept {
  with_report(packet, [&](auto report) {
    write(readings, report, step_um);
    const auto bytes = encode(report);
    std::copy_n(bytes.begin(), packet.size(), packet.begin());
  });
}

/// Puts all of a held report of a Cartesian device into `packet` but its number: orientation and
/// the rest of a position stand still too. Nothing for another device.
void hold_cartesian(std::span<const std::uint8_t> held, std::vector<std::uint8_t>& packet) {
  const auto now = decode_cartesian_report(packet);
  auto then = decode_cartesian_report(held);
  if (!now || !then) return;
  then->number = now->number;
  const auto bytes = encode(*then);
  packet.assign(bytes.begin(), bytes.end());
}

/// Puts the position of a held report of a Cartesian device into `packet`, whose orientation turns
/// to and fro by 0.2 rad about z within a second. Nothing for another device.
void hold_position(std::span<const std::uint8_t> held, std::vector<std::uint8_t>& packet,
                   std::int64_t cycle) {
  auto now = decode_cartesian_report(packet);
  const auto then = decode_cartesian_report(held);
  if (!now || !then) return;
  const double half_rad =
      0.1 * std::sin(2 * std::numbers::pi * static_cast<double>(cycle) / kCyclesPerSecond);
  now->position_um = then->position_um;
  now->orientation =
      cartesian::packed_orientation({0, 0, std::sin(half_rad), std::cos(half_rad)}).value();
  const auto bytes = encode(*now);
  packet.assign(bytes.begin(), bytes.end());
}

std::int16_t wrapped(int count) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(count));
}

}  // namespace

FaultyDevice::FaultyDevice(Emulator& device, const FaultScript& script)
    : device_(device), random_(script.seed) {
  if (script.clock == FaultClock::start) clock_ = 0;
  for (const DeviceFault& fault : script.faults) {
    const std::int64_t from = cycles_of(fault.at_s);
    const double seconds = fault.kind == FaultKind::host_late ? fault.ms / 1000 : fault.for_s;
    if (fault.kind == FaultKind::replay) {
      replay_cycles_ = std::max(replay_cycles_, cycles_of(fault.ms / 1000));
    }
    faults_.push_back(
        {.fault = fault, .from = from, .to = from + std::max<std::int64_t>(cycles_of(seconds), 1)});
  }
}

bool FaultyDevice::runs(const Running& running) const noexcept {
  return clock_ && *clock_ >= running.from && *clock_ < running.to;
}

bool FaultyDevice::host_is_late() const noexcept {
  return std::ranges::any_of(faults_, [&](const Running& running) {
    return running.fault.kind == FaultKind::host_late && runs(running);
  });
}

bool FaultyDevice::hung_up() const noexcept {
  return std::ranges::any_of(faults_, [](const Running& running) {
    return running.fault.kind == FaultKind::hang_up && running.begun;
  });
}

std::optional<FaultyDevice::ServiceChange> FaultyDevice::take_service_change() noexcept {
  for (Running& running : faults_) {
    if (!is_of_service(running.fault.kind) || !running.begun) continue;
    if (!std::exchange(running.begin_told, true)) return ServiceChange{running.fault.kind, true};
    if (running.ended || runs(running)) continue;
    running.ended = true;
    return ServiceChange{running.fault.kind, false};
  }
  return std::nullopt;
}

std::uint64_t FaultyDevice::met() const noexcept {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(faults_, [](const Running& running) { return running.changed > 0; }));
}

std::vector<InjectedFault> FaultyDevice::injected() const {
  std::vector<InjectedFault> list;
  for (const Running& running : faults_) {
    if (!running.begun) continue;
    list.push_back(
        {running.fault.kind, running.fault.of_commands, running.begun_at, running.changed});
  }
  return list;
}

bool FaultyDevice::hits(Running& running, bool of_commands) noexcept {
  const DeviceFault& fault = running.fault;
  if (fault.of_commands != of_commands || !runs(running)) return false;
  const bool hit = running.packets++ % fault.every == 0;
  running.changed += hit ? 1 : 0;
  return hit;
}

bool FaultyDevice::send_on(std::span<const std::uint8_t> packet, bool of_commands,
                           std::deque<Due>& in_flight) {
  Due due{cycle_, Bytes(packet.begin(), packet.end())};
  if (!of_commands) {
    break_sensors(due.bytes);
    replace_by_old(due.bytes);
  }
  bool twice = false;
  for (Running& running : faults_) {
    const DeviceFault& fault = running.fault;
    const bool unplugged = fault.kind == FaultKind::unplug && runs(running);
    const bool silent = fault.kind == FaultKind::silence && !of_commands && runs(running);
    const bool hung = fault.kind == FaultKind::hang_up && !of_commands && running.begun;
    if (unplugged || silent || hung) {
      ++running.changed;
      return false;
    }
    if (fault.kind > FaultKind::corrupt || !hits(running, of_commands)) continue;
    switch (fault.kind) {
      case FaultKind::lose:
        return false;
      case FaultKind::delay:
        due.at = cycle_ + cycles_of(fault.ms / 1000);
        break;
      case FaultKind::duplicate:
        twice = true;
        break;
      case FaultKind::reorder:
        due.at = cycle_ + kCyclesPerUsbFrame + 1;  // any successor comes before that
        break;
      case FaultKind::truncate:
        due.bytes.resize(random_() % due.bytes.size());
        break;
      case FaultKind::corrupt:
        if (due.bytes.empty()) break;
        due.bytes[random_() % due.bytes.size()] ^= static_cast<std::uint8_t>(1U << random_() % 8);
        break;
      default:
        break;
    }
    if (due.bytes.empty()) return false;
  }
  if (twice) in_flight.push_back(due);
  in_flight.push_back(std::move(due));
  return true;
}

/// By the one that was sent as long ago as the running replay says.
void FaultyDevice::replace_by_old(Bytes& packet) {
  if (replay_cycles_ == 0) return;
  sent_.push_back({cycle_, packet});
  while (sent_.front().at + replay_cycles_ < cycle_) sent_.pop_front();
  for (Running& running : faults_) {
    if (running.fault.kind != FaultKind::replay || !runs(running)) continue;
    const std::int64_t from = cycle_ - cycles_of(running.fault.ms / 1000);
    packet = std::ranges::find_if(sent_, [&](const Due& old) { return old.at >= from; })->bytes;
    ++running.changed;
  }
}

void FaultyDevice::break_sensors(Bytes& packet) {
  const int step_um = device_.model().step_um();
  auto readings = readings_of(packet, step_um);
  if (!readings) return;
  bool changed = false;
  for (Running& running : faults_) {
    const DeviceFault& fault = running.fault;
    std::int16_t& count = readings->encoder[static_cast<std::size_t>(fault.axis)];
    if (!runs(running)) {
      running.stuck_at = count;
      if (fault.kind == FaultKind::freeze || fault.kind == FaultKind::still) running.held = packet;
      continue;
    }
    changed = true;
    const Readings before = *readings;
    switch (fault.kind) {
      case FaultKind::stick:
        count = running.stuck_at;
        break;
      case FaultKind::freeze:
        hold_cartesian(running.held, packet);
        readings = readings_of(running.held, step_um).value_or(*readings);
        break;
      case FaultKind::still:
        hold_position(running.held, packet, cycle_);
        readings = readings_of(packet, step_um).value_or(*readings);
        break;
      case FaultKind::jump:
        count = wrapped(count + fault.counts);
        break;
      case FaultKind::wander: {
        const auto widest = static_cast<std::uint32_t>(std::abs(fault.counts));
        running.off_by += static_cast<int>(random_() % (2 * widest + 1)) - static_cast<int>(widest);
        count = wrapped(count + running.off_by);
        break;
      }
      case FaultKind::park:
        readings->parked = true;
        break;
      case FaultKind::chatter:
        readings->parked = random_() % 2 == 0;
        break;
      case FaultKind::unhome:
        readings->homed = false;
        break;
      case FaultKind::noise:
        for (std::uint16_t& pot : readings->pots) {
          pot = static_cast<std::uint16_t>(pot ^ (random_() & kPotNoiseMask));
        }
        break;
      default:
        break;
    }
    running.changed += *readings != before ? 1 : 0;
  }
  if (changed) put_readings(*readings, packet, step_um);
}

void FaultyDevice::receive(std::span<const std::uint8_t> packet) noexcept {
  send_on(packet, true, commands_);
}

void FaultyDevice::step_clock() noexcept {
  ++cycle_;
  if (clock_) {
    ++*clock_;
  } else if (norm(device_.model().motor_force_n()) > kPushN) {
    clock_ = 0;
  }
  for (Running& running : faults_) {
    if (running.begun || !runs(running)) continue;
    running.begun = true;
    running.begun_at = cycle_;
    const FaultKind kind = running.fault.kind;
    running.changed = kind == FaultKind::host_late || is_of_service(kind) ? 1 : 0;
    ++begun_;
  }
}

void FaultyDevice::advance(int cycles) noexcept {
  for (int i = 0; i < cycles; ++i) {
    for (auto due = commands_.begin(); due != commands_.end();) {
      if (due->at > cycle_) {
        ++due;
        continue;
      }
      device_.receive(due->bytes);
      due = commands_.erase(due);
    }
    device_.advance(1);
    step_clock();
  }
}

std::span<const std::uint8_t> FaultyDevice::next_packet() noexcept {
  for (auto packet = device_.next_packet(); !packet.empty(); packet = device_.next_packet()) {
    if (!send_on(packet, false, reports_)) ++withheld_;
  }
  const auto due = std::ranges::find_if(reports_, [&](const Due& d) { return d.at <= cycle_; });
  if (due == reports_.end()) return {};
  handed_out_ = std::move(due->bytes);
  reports_.erase(due);
  return handed_out_;
}

}  // namespace kerf
