// SPDX-License-Identifier: Apache-2.0
#include "hil/fault/readings.hpp"

#include <algorithm>

#include "shared/wire/falcon_packet.hpp"
#include "shared/wire/omni_packet.hpp"
#include "shared/wire/wooden_packet.hpp"

namespace kerf {
namespace {

Readings read(const OmniReport& report) noexcept {
  Readings readings{.encoder = report.encoder, .parked = report.docked};
  std::ranges::copy(report.pot_a, readings.pots.begin());
  std::ranges::copy(report.pot_b, readings.pots.begin() + 3);
  return readings;
}

Readings read(const FalconReport& report) noexcept {
  return {.encoder = report.encoder,
          .parked = (report.buttons & falcon::kButtonCentre) != 0,
          .homed = std::ranges::all_of(report.homed, [](bool homed) { return homed; })};
}

Readings read(const WoodenReport& report) noexcept {
  Readings readings{.parked = report.calibrate};
  std::copy_n(report.encoder.begin(), 3, readings.encoder.begin());
  return readings;
}

void write(const Readings& readings, OmniReport& report) noexcept {
  report.encoder = readings.encoder;
  report.docked = readings.parked;
  std::copy_n(readings.pots.begin(), 3, report.pot_a.begin());
  std::copy_n(readings.pots.begin() + 3, 3, report.pot_b.begin());
}

void write(const Readings& readings, FalconReport& report) noexcept {
  report.encoder = readings.encoder;
  const unsigned others = report.buttons & ~unsigned{falcon::kButtonCentre};
  report.buttons =
      static_cast<std::uint8_t>(others | (readings.parked ? unsigned{falcon::kButtonCentre} : 0U));
  if (!readings.homed) report.homed = {};
}

void write(const Readings& readings, WoodenReport& report) noexcept {
  std::ranges::copy(readings.encoder, report.encoder.begin());
  report.calibrate = readings.parked;
}

/// Calls `use` with the report in `packet`, whatever its device.
template <class Use>
void with_report(std::span<const std::uint8_t> packet, const Use& use) noexcept {
  if (const auto omni = decode_report(packet)) return use(*omni);
  if (const auto falcon = falcon::decode_report(packet)) return use(*falcon);
  if (const auto wooden = wooden::decode_report(packet)) return use(*wooden);
}

}  // namespace

std::optional<Readings> readings_of(std::span<const std::uint8_t> packet) noexcept {
  std::optional<Readings> readings;
  with_report(packet, [&](const auto& report) { readings = read(report); });
  return readings;
}

void put_readings(const Readings& readings, std::span<std::uint8_t> packet) noexcept {
  with_report(packet, [&](auto report) {
    write(readings, report);
    const auto bytes = encode(report);
    std::copy_n(bytes.begin(), packet.size(), packet.begin());
  });
}

}  // namespace kerf
