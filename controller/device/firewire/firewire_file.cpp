// SPDX-License-Identifier: Apache-2.0
#include "controller/device/firewire/firewire_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <linux/firewire-cdev.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "controller/device/port/packet_port.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/wire/omni.hpp"

namespace kerf {
namespace {

/// Below 5 the kernel drops packets that overflow an event; above 5 answers change their form.
constexpr std::uint32_t kInterfaceVersion = 5;

constexpr std::uint64_t kReadClosure = ~std::uint64_t{0};
constexpr int kTries = 3;
constexpr std::uint64_t kBroadcastChannel = std::uint64_t{1} << 31;

/// Bandwidth in units of 20.3 ns: the gaps and the arbitration of a packet, and at S100 16 per
/// quadlet, its header and two checksums included.
constexpr std::uint32_t bandwidth_of(std::size_t payload_bytes) {
  return static_cast<std::uint32_t>(512 + 16 * (payload_bytes + 12) / 4);
}

}  // namespace

FirewireFile::~FirewireFile() {
  if (fd_ >= 0) close(fd_);
}

int FirewireFile::open(const std::string& path) noexcept {
  const int fresh = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fresh < 0) return errno;
  gone_ = false;
  if (fd_ < 0) {
    fd_ = fresh;
    return 0;
  }
  const int error = dup3(fresh, fd_, O_CLOEXEC) < 0 ? errno : 0;
  close(fresh);
  return error;
}

std::optional<std::uint32_t> FirewireFile::link() noexcept {
  fw_cdev_event_bus_reset state{};
  fw_cdev_get_info info{};
  info.version = kInterfaceVersion;
  info.bus_reset = reinterpret_cast<std::uintptr_t>(&state);
  if (call(FW_CDEV_IOC_GET_INFO, &info) < 0) return std::nullopt;
  return state.generation;
}

int FirewireFile::call(unsigned long command, void* argument) noexcept {
  int result = -1;
  while ((result = ioctl(fd_, command, argument)) < 0 && errno == EINTR) {
  }
  if (result >= 0) return result;
  const int error = errno;
  note(error);
  return -error;
}

bool FirewireFile::ready(int milliseconds) noexcept {
  pollfd watched{fd_, POLLIN, 0};
  int found = -1;
  while ((found = poll(&watched, 1, milliseconds)) < 0 && errno == EINTR) {
  }
  if (found <= 0) return false;
  if ((watched.revents & POLLIN) != 0) return true;
  if ((watched.revents & (POLLERR | POLLHUP)) != 0) gone_ = true;
  return false;
}

std::span<const std::uint8_t> FirewireFile::read(std::span<std::uint8_t> buffer) noexcept {
  const ssize_t size = ::read(fd_, buffer.data(), buffer.size());
  if (size >= 0) return buffer.first(static_cast<std::size_t>(size));
  note(errno);
  return {};
}

void FirewireFile::note(int error) noexcept {
  if (error == ENODEV || error == ENOTCONN) gone_ = true;
}

bool FirewireRequests::refresh() noexcept {
  const std::uint32_t before = generation_;
  generation_ = file_.link().value_or(before);
  return generation_ != before;
}

void FirewireRequests::write(std::uint64_t offset, std::span<const std::uint8_t> bytes,
                             std::uint64_t closure) noexcept {
  fw_cdev_send_request request{};
  request.tcode = TCODE_WRITE_BLOCK_REQUEST;
  request.length = static_cast<std::uint32_t>(bytes.size());
  request.offset = offset;
  request.closure = closure;
  request.data = reinterpret_cast<std::uintptr_t>(bytes.data());
  request.generation = generation_;
  file_.call(FW_CDEV_IOC_SEND_REQUEST, &request);
}

std::optional<std::uint8_t> FirewireRequests::read_byte(std::uint64_t offset) noexcept {
  for (int tries = 0; tries < kTries && !gone(); ++tries) {
    refresh();  // a bus reset may have come between
    fw_cdev_send_request request{};
    request.tcode = TCODE_READ_BLOCK_REQUEST;
    request.length = 1;
    request.offset = offset;
    request.closure = kReadClosure;
    request.generation = generation_;
    if (file_.call(FW_CDEV_IOC_SEND_REQUEST, &request) < 0) continue;
    while (ready(kFirewireAnswerMs)) {
      const auto answer = event();
      const auto response = event_as<fw_cdev_event_response>(answer);
      if (response.type != FW_CDEV_EVENT_RESPONSE || response.closure != kReadClosure) continue;
      if (response.rcode == RCODE_COMPLETE && answer.size() > kResponseDataAt) {
        return answer[kResponseDataAt];
      }
      break;
    }
  }
  return std::nullopt;
}

std::optional<FirewireClaim> FirewireRequests::claim(std::uint64_t closure,
                                                     std::size_t payload_bytes) noexcept {
  fw_cdev_allocate_iso_resource request{};
  request.closure = closure;
  request.channels = ~kBroadcastChannel;
  request.bandwidth = bandwidth_of(payload_bytes);
  if (file_.call(FW_CDEV_IOC_ALLOCATE_ISO_RESOURCE, &request) < 0) return std::nullopt;
  return FirewireClaim{request.handle, -1};
}

void FirewireRequests::give_back(const FirewireClaim& claim) noexcept {
  fw_cdev_deallocate request{claim.handle};
  file_.call(FW_CDEV_IOC_DEALLOCATE_ISO_RESOURCE, &request);
}

// The search for a device.

namespace {

constexpr SoughtDevice kSought{
    .name = "device of SensAble", .port = "fw", .emulation = "--port fw"};

/// Identity of the node at `path`; empty if it is no device of the vendor.
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
         remedy_for(refused, "give your user the right to it: docs/first-hour.md");
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
