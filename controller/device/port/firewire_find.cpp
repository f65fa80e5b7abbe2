// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/firewire_find.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <system_error>

#include <linux/firewire-cdev.h>

#include "controller/device/port/firewire_file.hpp"
#include "controller/device/port/packet_port.hpp"
#include "shared/posix/failure.hpp"
#include "shared/wire/omni_constants.hpp"

namespace kerf {
namespace {

constexpr SoughtDevice kSought{
    .name = "device of SensAble", .port = "fw", .emulation = "--port fw"};

/// Identity of the node at `path`; nothing when it is no device of the vendor.
std::optional<FirewireDevice> identify(const std::string& path, int* refused) {
  FirewireFile file;
  if (const int error = file.open(path); error != 0) {
    *refused = error;
    return std::nullopt;
  }
  std::array<std::uint32_t, 5> rom{};  // up to the GUID
  fw_cdev_get_info info{};
  info.version = 5;
  info.rom = reinterpret_cast<std::uintptr_t>(rom.data());
  info.rom_length = sizeof rom;
  if (file.call(FW_CDEV_IOC_GET_INFO, &info) < 0 || info.rom_length < sizeof rom) {
    return std::nullopt;
  }
  if (rom[3] >> 8 != omni::kVendorOui) return std::nullopt;
  return FirewireDevice{path, rom[4], firewire_serial(rom[4])};
}

[[noreturn]] void refuse(const std::string& where, const std::string& rest) {
  throw std::runtime_error("--port fw" + (where.empty() ? "" : ":" + where) + ": " + rest);
}

std::string reason_of(int refused) {
  return "a node cannot be opened (" + std::generic_category().message(refused) + "); " +
         way_out_of(refused, "give your user the right to it: docs/devices.md");
}

}  // namespace

FirewireOptions parse_firewire_port(std::string_view text) {
  FirewireOptions options;
  if (!text.empty() && text.front() == ':') text.remove_prefix(1);
  bool first = true;
  while (!text.empty() || first) {
    const std::string_view part = text.substr(0, text.find(','));
    text.remove_prefix(std::min(part.size() + 1, text.size()));
    if (part == "20010") {
      options.write_20010 = true;
    } else if (part == "fill") {
      options.fill = true;
    } else if (first) {
      options.where = part;
    } else {
      refuse("", "'" + std::string(part) + "' is not known; use 20010 or fill");
    }
    first = false;
  }
  return options;
}

// Fields of 3, 4, 5, 3 and 10 bits from bit 25 downwards.
std::string firewire_serial(std::uint32_t packed) {
  const auto field = [packed](int low, int bits) { return packed >> low & ((1U << bits) - 1); };
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%01u%02u%02u%01u%05u", field(23, 3), field(19, 4),
                field(14, 5), field(11, 3), field(1, 10));
  return text.data();
}

std::vector<FirewireDevice> list_firewire(const std::string& folder, int* refused) {
  std::vector<FirewireDevice> devices;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    const bool is_node = name.size() > 2 && name.starts_with("fw") &&
                         name.find_first_not_of("0123456789", 2) == std::string::npos;
    if (!is_node) continue;
    if (auto device = identify(entry.path().string(), refused)) devices.push_back(*device);
  }
  std::ranges::sort(devices, {}, &FirewireDevice::path);
  return devices;
}

FirewireDevice find_firewire(const FirewireOptions& options, const std::string& folder) {
  const std::string& where = options.where;
  int refused = 0;
  const bool is_path = where.find('/') != std::string::npos;
  if (is_path && !std::filesystem::is_directory(where)) {
    const auto device = identify(where, &refused);
    if (device) return *device;
    if (refused == ENOENT) refuse(where, absent_node(kSought));
    if (refused != 0) refuse(where, reason_of(refused));
    refuse(where, "no device of SensAble; its vendor is not 000b99");
  }
  auto devices = list_firewire(is_path ? where : folder, &refused);
  if (!is_path && !where.empty()) {
    std::erase_if(devices, [&](const FirewireDevice& device) { return device.serial != where; });
  }
  if (devices.empty() && refused != 0) refuse(where, reason_of(refused));
  if (devices.empty()) {
    const bool is_serial = !is_path && !where.empty();
    refuse(where, absent_device(kSought, is_serial));
  }
  if (devices.size() > 1) {
    std::string all;
    for (const FirewireDevice& device : devices)
      all += " " + device.path + " (" + device.serial + ")";
    refuse(where, "several devices are there:" + all + "; name one by its node or serial");
  }
  return devices.front();
}

}  // namespace kerf
