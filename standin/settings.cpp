// SPDX-License-Identifier: Apache-2.0
#include "standin/settings.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include "shared/text/text.hpp"

namespace kerf::standin {
namespace {

/// A switch with two words: the first is the default.
struct Switch {
  std::string_view key, usual, other;
  bool Settings::*member;
};

constexpr std::array kSwitches{
    Switch{"missed", "hold", "drop", &Settings::drop_without_frame},
    Switch{"stop", "hold", "drop", &Settings::drop_on_stop},
    Switch{"excess", "clamp", "cut", &Settings::cut_excess},
    Switch{"before-enable", "apply", "ignore", &Settings::force_needs_enable},
    Switch{"calibration", "kept", "lost", &Settings::uncalibrated},
    Switch{"handles", "seen", "documented", &Settings::documented_handles},
    Switch{"button0", "parked", "hand", &Settings::hand_buttons},
    Switch{"status", "17", "16", &Settings::short_status},
    Switch{"hand", "enabled", "pushed", &Settings::hand_waits},
};

[[noreturn]] void refuse(std::string_view part, const std::string& remedy) {
  throw std::invalid_argument(std::string(kVariable) + ": '" + std::string(part) + "'; " + remedy);
}

double number_within(std::string_view part, std::string_view value, double low, double high) {
  const std::optional<double> number = number_in(value);
  if (number && *number >= low && *number <= high) return *number;
  refuse(part, "give a number from " + number_text(low) + " to " + number_text(high));
}

Personality device_of(std::string_view part, std::string_view value) {
  for (const Personality device : {Personality::touch, Personality::omega}) {
    if (word_of(device) == value) return device;
  }
  refuse(part, "take touch or omega");
}

void read(std::string_view part, Settings& settings) {
  if (part == "lockstep") {
    settings.lockstep = true;
    return;
  }
  const std::size_t equals = part.find('=');
  const std::string_view key = part.substr(0, equals);
  const std::string_view value =
      equals == std::string_view::npos ? std::string_view{} : part.substr(equals + 1);
  const auto* found = std::find_if(kSwitches.begin(), kSwitches.end(),
                                   [&](const Switch& one) { return one.key == key; });
  if (found != kSwitches.end()) {
    if (value != found->usual && value != found->other) {
      refuse(part, "take " + std::string(found->usual) + " or " + std::string(found->other));
    }
    settings.*found->member = value == found->other;
  } else if (key == "device") {
    settings.device = device_of(part, value);
  } else if (key == "rate") {
    settings.rate_hz = static_cast<int>(number_within(part, value, 100, 8000));
  } else if (key == "priority") {
    settings.priority = static_cast<int>(number_within(part, value, 0, 98));
  } else if (key == "ledger" && !value.empty()) {
    settings.ledger = value;
  } else if (key == "ramp") {
    settings.ramp_s = number_within(part, value, 0, 10);
  } else if (key == "stall") {
    settings.stall_ms = static_cast<int>(number_within(part, value, 1, 60'000));
  } else {
    refuse(part, "unknown; start the program by ./kerf stand-in -- COMMAND");
  }
}

}  // namespace

Settings parse_settings(std::string_view text) {
  constexpr std::string_view kSocket = "socket:";
  Settings settings;
  std::string_view first = text.substr(0, text.find(','));
  if (!first.starts_with(kSocket) || first.size() == kSocket.size()) {
    refuse(first, "begin with socket:PATH, the socket of kerf-emulator");
  }
  settings.socket = first.substr(kSocket.size());
  while (first.size() < text.size()) {
    text.remove_prefix(first.size() + 1);
    first = text.substr(0, text.find(','));
    read(first, settings);
  }
  return settings;
}

Settings settings_of_environment() {
  const char* text = std::getenv(kVariable);  // NOLINT(concurrency-mt-unsafe): read, never set
  if (text == nullptr) {
    throw std::invalid_argument(std::string(kVariable) +
                                ": not set; start the program by ./kerf stand-in -- COMMAND");
  }
  return parse_settings(text);
}

}  // namespace kerf::standin
