// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "controller/loop/real_time.hpp"
#include "controller/run/probe.hpp"
#include "shared/posix/threads.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/inverse3.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

/// First line of a sysfs file; empty if there is none.
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

/// Name below /dev of the node for a folder of sysfs; empty for another device.
using NodeOf = std::optional<std::string> (*)(const fs::path&);

std::optional<std::string> firewire_node(const fs::path& device) {
  if (hex_of(line_of(device / "vendor")) != omni::kVendorOui) return std::nullopt;
  return device.filename().string();
}

/// Of a device on USB.
std::optional<std::string> usb_node(const fs::path& device) {
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

std::optional<std::string> falcon_node(const fs::path& device) {
  if (hex_of(line_of(device / "idVendor")) != falcon::kVendorId ||
      hex_of(line_of(device / "idProduct")) != falcon::kProductId) {
    return std::nullopt;
  }
  return usb_node(device);
}

// Whose bytes only the vendor's library knows: found by their numbers, opened by kerf-arm.
std::optional<std::string> touch_node(const fs::path& device) {
  constexpr std::uint32_t kVendor = 0x2988, kVendorOfOthers = 0x0301, kProductOfOthers = 0x2988;
  const auto vendor = hex_of(line_of(device / "idVendor"));
  const bool is_other =
      vendor == kVendorOfOthers && hex_of(line_of(device / "idProduct")) == kProductOfOthers;
  return vendor == kVendor || is_other ? usb_node(device) : std::nullopt;
}

std::optional<std::string> omega_node(const fs::path& device) {
  constexpr std::uint32_t kVendor = 0x1451, kProduct = 0x0402;
  if (hex_of(line_of(device / "idVendor")) != kVendor ||
      hex_of(line_of(device / "idProduct")) != kProduct) {
    return std::nullopt;
  }
  return usb_node(device);
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

/// The Inverse3 has no node of its own for us: its vendor's service holds the serial port. The id
/// of that port is shared with other devices.
bool has_inverse3_port(const fs::path& root) {
  constexpr std::uint32_t kVendor = 0x16c0, kProduct = 0x0483;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(root / "sys/bus/usb/devices", ignored)) {
    if (hex_of(line_of(entry.path() / "idVendor")) == kVendor &&
        hex_of(line_of(entry.path() / "idProduct")) == kProduct) {
      return true;
    }
  }
  return false;
}

/// Whether a program listens at this TCP port, by the kernel's tables.
bool listens_at(const fs::path& root, std::uint16_t port) {
  for (const char* table : {"proc/net/tcp", "proc/net/tcp6"}) {
    std::ifstream stream(root / table);
    for (std::string line; std::getline(stream, line);) {
      unsigned own_port = 0;
      unsigned state = 0;
      constexpr unsigned kListens = 0x0A;
      if (std::sscanf(line.c_str(), " %*d: %*[0-9A-F]:%x %*[0-9A-F]:%*x %x", &own_port, &state) ==
              2 &&
          own_port == port && state == kListens) {
        return true;
      }
    }
  }
  return false;
}

/// Where the kernel lists a kind of device, and commands to find it by hand.
struct NodeKind {
  Personality personality;
  const char* folder;   ///< of sysfs, with an entry for each device
  NodeOf node_of;       ///< null: its vendor's service holds the node
  const char* bus;      ///< in sysfs, if the kernel has this bus
  const char* missing;  ///< command if it has not
  const char* absent;   ///< command if it has, without the device
};

constexpr const char* kUsbFolder = "sys/bus/usb/devices";
constexpr const char* kUsbBus = "sys/bus/usb";
constexpr const char* kNoUsb = "sudo modprobe xhci-pci (is there a controller? lspci | grep USB)";
constexpr std::array kNodeKinds{
    NodeKind{Personality::omni, "sys/bus/firewire/devices", firewire_node, "sys/bus/firewire",
             "sudo modprobe firewire-ohci (is there a card? lspci | grep 1394)",
             "connect and power it, then: sudo dmesg | grep firewire"},
    NodeKind{Personality::falcon, kUsbFolder, falcon_node, kUsbBus, kNoUsb,
             "connect and power it, then: lsusb -d 0403:cb48"},
    NodeKind{Personality::woodenhaptics, "sys/class/hidraw", wooden_node, "sys/class/hidraw",
             "sudo modprobe usbhid",
             "connect and power it, then: lsusb -d 1234:0006; lsusb -d 16c0:0486"},
    NodeKind{Personality::inverse3, kUsbFolder, nullptr, kUsbBus, kNoUsb,
             "connect and power it, then: lsusb -d 16c0:0483; systemctl status "
             "haply-inverse-service"},
    NodeKind{Personality::touch, kUsbFolder, touch_node, kUsbBus, kNoUsb,
             "connect and power it, then: lsusb -d 2988:; ./kerf arm --device touch"},
    NodeKind{Personality::omega, kUsbFolder, omega_node, kUsbBus, kNoUsb,
             "connect and power it, then: lsusb -d 1451:; ./kerf arm --device omega"}};
static_assert(covers_devices(kNodeKinds));

void list(const fs::path& root, const NodeKind& kind, std::vector<DeviceNode>& nodes) {
  if (kind.node_of == nullptr) {
    if (has_inverse3_port(root) && listens_at(root, inverse3::kServicePort)) {
      nodes.push_back({kind.personality, "127.0.0.1:" + std::to_string(inverse3::kServicePort), 0});
    }
    return;
  }
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(root / kind.folder, ignored)) {
    const auto name = kind.node_of(entry.path());
    if (!name) continue;
    const std::string path = (root / "dev" / *name).string();
    const bool open = faccessat(AT_FDCWD, path.c_str(), R_OK | W_OK, AT_EACCESS) == 0;
    nodes.push_back({kind.personality, path, open ? 0 : errno});
  }
}

}  // namespace

std::vector<DeviceNode> list_device_nodes(const fs::path& root) {
  std::vector<DeviceNode> nodes;
  for (const NodeKind& kind : kNodeKinds) list(root, kind, nodes);
  std::ranges::sort(nodes, {}, &DeviceNode::path);
  return nodes;
}

namespace {

constexpr const char* kRules = "60-kerf.rules";
constexpr std::size_t kServoMemoryBytes = std::size_t{1} << 30;  // of a large scene

bool rules_installed(const fs::path& root) {
  constexpr std::array kFolders{"etc/udev/rules.d", "usr/local/lib/udev/rules.d",
                                "usr/lib/udev/rules.d", "lib/udev/rules.d"};
  return std::ranges::any_of(kFolders, [&](const char* folder) {
    std::error_code ignored;
    return fs::exists(root / folder / kRules, ignored);
  });
}

std::string cure_of_right(const fs::path& root) {
  if (!rules_installed(root)) {
    return std::string("sudo install -m 644 controller/device/") + kRules +
           " /etc/udev/rules.d/ && sudo udevadm control --reload && sudo udevadm trigger";
  }
  return "sudo usermod -aG plugdev $USER, log in again, plug the device in again";
}

std::string limit_line(const char* limit) {
  return std::string("echo '@plugdev - ") + limit +
         "' | sudo tee -a /etc/security/limits.d/kerf.conf, then log in again";
}

/// Tries a priority on a thread of its own, since a trial takes it.
int fifo_error(int priority) {
  int error = 0;
  std::thread([&] { error = set_fifo(priority); }).join();
  return error;
}

/// Whether so much memory may be locked, tried without its pages.
bool may_lock(std::size_t bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur >= bytes) return true;
  // Beyond the limit only a privilege helps: then a page more than the limit can be locked too.
  const std::size_t above = limit.rlim_cur + 65536;
  void* const at = mmap(nullptr, above, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (at == MAP_FAILED) return false;
  const bool locked = mlock2(at, above, MLOCK_ONFAULT) == 0;
  munmap(at, above);
  return locked;
}

}  // namespace

std::vector<SetupProblem> lacks_of_nodes(std::optional<Personality> which,
                                         std::span<const DeviceNode> nodes, const fs::path& root) {
  std::vector<SetupProblem> lacks;
  bool found = false;
  for (const DeviceNode& node : nodes) {
    if (which && node.personality != *which) continue;
    found = true;
    if (node.open_error == 0) continue;
    lacks.push_back(
        {node.path + ": " + std::generic_category().message(node.open_error), cure_of_right(root)});
  }
  if (!which || found) return lacks;
  const NodeKind& kind = row_of(kNodeKinds, *which);
  if (kind.node_of == nullptr && has_inverse3_port(root)) {
    lacks.push_back(
        {"inverse3: no service listens at port " + std::to_string(inverse3::kServicePort),
         "sudo systemctl start haply-inverse-service (version 3.1 or newer)"});
    return lacks;
  }
  std::error_code ignored;
  const bool has_bus = fs::exists(root / kind.bus, ignored);
  const std::string name(word_of(*which));
  lacks.push_back(
      {name + (has_bus ? ": none is connected" : ": the kernel has no /" + std::string(kind.bus)),
       has_bus ? kind.absent : kind.missing});
  return lacks;
}

std::vector<SetupProblem> lacks_of_rights() {
  std::vector<SetupProblem> lacks;
  const int priority = RealTimeOptions{}.priority;
  if (const int error = fifo_error(priority); error != 0) {
    lacks.push_back({"SCHED_FIFO " + std::to_string(priority) + ": " +
                         std::generic_category().message(error) +
                         "; other programs delay ticks by milliseconds",
                     limit_line("rtprio 95")});
  }
  if (!may_lock(kServoMemoryBytes)) {
    lacks.push_back({"locked memory: less than " + std::to_string(kServoMemoryBytes >> 20) +
                         " MiB; a page fault may delay a tick",
                     limit_line("memlock unlimited")});
  }
  return lacks;
}

}  // namespace kerf
