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
    Switch{"emulate-button", "accept", "refuse", &Settings::refuses_emulation},
    Switch{"hand", "enabled", "pushed", &Settings::hand_waits},
};

constexpr std::string_view kInUseKey = "in-use";
constexpr std::array<std::string_view, 3> kInUseWords{"timer", "value", "pose"};  // as InUse

/// A switch with a number.
struct NumberSwitch {
  std::string_view key;
  double low, high;
  void (*set)(Settings& settings, double value);
};

constexpr std::array kNumberSwitches{
    NumberSwitch{"ramp", 0, 10, [](Settings& all, double s) { all.ramp_s = s; }},
    NumberSwitch{"stall", 1, 60'000,
                 [](Settings& all, double ms) { all.stall_ms = static_cast<int>(ms); }},
};

[[noreturn]] void refuse(std::string_view part, const std::string& remedy) {
  throw std::invalid_argument(std::string(kVariable) + ": '" + std::string(part) + "'; " + remedy);
}

double number_within(std::string_view part, std::string_view value, double low, double high) {
  const std::optional<double> number = number_in(value);
  if (number && *number >= low && *number <= high) return *number;
  refuse(part, "give a number from " + number_text(low) + " to " + number_text(high));
}

const LibraryKind* library_of(Personality personality) {
  const auto* const found = std::ranges::find(kLibraries, personality, &LibraryKind::personality);
  return found == kLibraries.end() ? nullptr : found;
}

Personality device_of(std::string_view part, std::string_view value) {
  const auto device = personality_of(value);
  if (device && library_of(*device) != nullptr) return *device;
  refuse(part, "take touch or omega");
}

/// `KEY=VALUE`.
struct Part {
  std::string_view whole, key, value;

  explicit Part(std::string_view text) : whole(text), key(text.substr(0, text.find('='))) {
    if (key.size() < text.size()) value = text.substr(key.size() + 1);
  }
};

/// False if it is no switch.
bool read_switch(const Part& part, Settings& settings) {
  const auto* const words = std::ranges::find(kSwitches, part.key, &Switch::key);
  if (words != kSwitches.end()) {
    if (part.value != words->usual && part.value != words->other) {
      refuse(part.whole, "take " + std::string(words->usual) + " or " + std::string(words->other));
    }
    settings.*words->member = part.value == words->other;
    return true;
  }
  if (part.key == kInUseKey) {
    const auto* const word = std::ranges::find(kInUseWords, part.value);
    if (word == kInUseWords.end()) refuse(part.whole, "take timer, value or pose");
    settings.in_use = static_cast<InUse>(word - kInUseWords.begin());
    return true;
  }
  const auto* const number = std::ranges::find(kNumberSwitches, part.key, &NumberSwitch::key);
  if (number == kNumberSwitches.end()) return false;
  number->set(settings, number_within(part.whole, part.value, number->low, number->high));
  return true;
}

std::string all_switches() {
  std::string list;
  for (const Switch& one : kSwitches) {
    list +=
        std::string(one.key) + '=' + std::string(one.usual) + '|' + std::string(one.other) + ", ";
  }
  list += std::string(kInUseKey) + "=timer|value|pose, ";
  for (const NumberSwitch& one : kNumberSwitches) {
    list += std::string(one.key) + '=' + number_text(one.low) + ".." + number_text(one.high) + ", ";
  }
  return list.substr(0, list.size() - 2);
}

constexpr std::string_view kSocket = "socket:";

/// A part that belongs to the device whose socket came last. False if it is none.
bool read_of_device(const Part& part, DeviceSettings& device) {
  const auto& [text, key, value] = part;
  if (key == "device") {
    device.kind = device_of(text, value);
  } else if (key == "rate") {
    device.rate_hz = static_cast<int>(number_within(text, value, 100, 8000));
  } else if (key == "ledger" && !value.empty()) {
    device.ledger = value;
  } else if (key == "name" && !value.empty()) {
    device.name = value;
  } else {
    return false;
  }
  return true;
}

void read(std::string_view whole, Settings& settings) {
  if (whole == "lockstep") {
    settings.lockstep = true;
    return;
  }
  if (whole.starts_with(kSocket) && whole.size() > kSocket.size()) {
    if (settings.devices.size() == kMostDevices) {
      refuse(whole, "a program has at most " + std::to_string(kMostDevices) + " devices");
    }
    settings.devices.emplace_back().socket = whole.substr(kSocket.size());
    return;
  }
  const Part part(whole);
  if (read_switch(part, settings) || read_of_device(part, settings.devices.back())) return;
  const auto& [text, key, value] = part;
  if (key == "priority") {
    settings.priority = static_cast<int>(number_within(text, value, 0, 98));
  } else if (key == "program" && !value.empty()) {
    settings.ledger = value;
  } else {
    refuse(text, "unknown; start the program by ./kerf stand-in -- COMMAND");
  }
}

/// The name of device `number` of its kind, from 1 on, or of the next number whose name no device
/// of the kind has. ./kerf stand-in gives the same ones.
std::string free_name(const Settings& settings, Personality kind, std::size_t number) {
  const auto is_taken = [&](const std::string& name) {
    return std::ranges::any_of(settings.devices, [&](const DeviceSettings& device) {
      return device.kind == kind && device.name == name;
    });
  };
  const std::string first(library_of(kind)->first_name);
  for (;; ++number) {
    std::string name = number == 1 ? first : first + ' ' + std::to_string(number);
    if (!is_taken(name)) return name;
  }
}

/// Gives names to devices without one, and checks what holds between devices of a kind.
void finish(Settings& settings) {
  std::array<std::size_t, kPersonalityWords.size()> numbers{};
  for (DeviceSettings& device : settings.devices) {
    const std::size_t number = ++numbers[static_cast<std::size_t>(device.kind)];
    if (device.name.empty()) device.name = free_name(settings, device.kind, number);
    for (const DeviceSettings& other : settings.devices) {
      if (&other == &device) break;
      if (other.kind != device.kind) continue;
      if (other.name == device.name) {
        refuse("name=" + device.name, "two devices of a kind have it; give each its own");
      }
      if (library_of(device.kind)->has_one_servo && other.rate_hz != device.rate_hz) {
        refuse("rate=" + std::to_string(device.rate_hz),
               "one servo thread serves all of a program");
      }
    }
  }
  if (settings.ledger.empty()) settings.ledger = settings.devices.front().ledger;
}

}  // namespace

Settings parse_settings(std::string_view text) {
  Settings settings;
  std::string_view first = text.substr(0, text.find(','));
  if (!first.starts_with(kSocket) || first.size() == kSocket.size()) {
    refuse(first, "begin with socket:PATH, the socket of kerf-emulator");
  }
  read(first, settings);
  while (first.size() < text.size()) {
    text.remove_prefix(first.size() + 1);
    first = text.substr(0, text.find(','));
    read(first, settings);
  }
  finish(settings);
  return settings;
}

std::string refusal_of_switch(std::string_view word) {
  try {
    Settings unused;
    if (read_switch(Part(word), unused)) return {};
    return "unknown; take one of " + all_switches();
  } catch (const std::invalid_argument& error) {
    const std::string_view line = error.what();  // the option itself is named by the caller
    return std::string(line.substr(line.rfind("'; ") + 3));
  }
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
