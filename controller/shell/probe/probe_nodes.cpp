// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/probe/probe_nodes.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "shared/wire/falcon_usb.hpp"
#include "shared/wire/omni_constants.hpp"
#include "shared/wire/wooden_constants.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

/// First line of a sysfs file; empty where there is none.
std::string line_of(const fs::path& file) {
  std::string line;
  std::ifstream stream(file);
  std::getline(stream, line);
  return line;
}

/// A hexadecimal number, with or without 0x.
std::optional<std::uint32_t> hex_of(std::string_view text) {
  if (text.starts_with("0x")) text.remove_prefix(2);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_wooden(std::uint32_t vendor, std::uint32_t product) {
  return (vendor == wooden::kMbedVendorId && product == wooden::kMbedProductId) ||
         (vendor == wooden::kTeensyVendorId && product == wooden::kTeensyProductId);
}

/// The node's name below /dev of what lies in a folder of sysfs; nothing for another device.
using NodeOf = std::optional<std::string> (*)(const fs::path&);

std::optional<std::string> firewire_node(const fs::path& device) {
  if (hex_of(line_of(device / "vendor")) != omni::kVendorOui) return std::nullopt;
  return device.filename().string();
}

std::optional<std::string> falcon_node(const fs::path& device) {
  if (hex_of(line_of(device / "idVendor")) != falcon::kVendorId ||
      hex_of(line_of(device / "idProduct")) != falcon::kProductId) {
    return std::nullopt;
  }
  int bus = 0;
  int number = 0;
  if (std::sscanf(line_of(device / "busnum").c_str(), "%d", &bus) != 1 ||
      std::sscanf(line_of(device / "devnum").c_str(), "%d", &number) != 1) {
    return std::nullopt;
  }
  char name[32];
  std::snprintf(name, sizeof name, "bus/usb/%03d/%03d", bus, number);
  return name;
}

std::optional<std::string> wooden_node(const fs::path& device) {
  std::ifstream uevent(device / "device/uevent");
  for (std::string line; std::getline(uevent, line);) {
    unsigned bus = 0;
    unsigned vendor = 0;
    unsigned product = 0;
    if (std::sscanf(line.c_str(), "HID_ID=%x:%x:%x", &bus, &vendor, &product) == 3 &&
        is_wooden(vendor, product)) {
      return device.filename().string();
    }
  }
  return std::nullopt;
}

void list(const fs::path& root, const char* folder, Personality personality, NodeOf node_of,
          std::vector<DeviceNode>& nodes) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(root / folder, ignored)) {
    const auto name = node_of(entry.path());
    if (!name) continue;
    const std::string path = (root / "dev" / *name).string();
    const bool open = faccessat(AT_FDCWD, path.c_str(), R_OK | W_OK, AT_EACCESS) == 0;
    nodes.push_back({personality, path, open ? 0 : errno});
  }
}

}  // namespace

std::vector<DeviceNode> list_device_nodes(const fs::path& root) {
  std::vector<DeviceNode> nodes;
  list(root, "sys/bus/firewire/devices", Personality::omni, firewire_node, nodes);
  list(root, "sys/bus/usb/devices", Personality::falcon, falcon_node, nodes);
  list(root, "sys/class/hidraw", Personality::woodenhaptics, wooden_node, nodes);
  std::ranges::sort(nodes, {}, &DeviceNode::path);
  return nodes;
}

}  // namespace kerf
