// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/hid_port.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <hidapi/hidapi.h>
#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf {
namespace {

constexpr int kReadMs = 20;  // then the thread checks whether it must end
constexpr SoughtDevice kSought{.name = "WoodenHaptics arm (1234:0006 or 16c0:0486)",
                               .port = "hid",
                               .emulation = "--device woodenhaptics --port hid"};
constexpr const char* kGiveRight =
    "; give your user the right: a udev rule with KERNEL==\"hidraw*\", "
    "ATTRS{idVendor}==\"1234\", TAG+=\"uaccess\" (docs/first-hour.md)";

[[noreturn]] void refuse(const std::string& where, const std::string& rest) {
  throw std::runtime_error("--port hid" + (where.empty() ? "" : ":" + where) + ": " + rest);
}

/// Bytes of a packet of the firmware that has these numbers; nothing for another device.
std::optional<std::size_t> packet_bytes_of(unsigned vendor, unsigned product) noexcept {
  if (vendor == wooden::kMbedVendorId && product == wooden::kMbedProductId) {
    return wooden::kPacketBytes;
  }
  if (vendor == wooden::kTeensyVendorId && product == wooden::kTeensyProductId) {
    return wooden::kLongPacketBytes;
  }
  return std::nullopt;
}

struct Found {
  std::string node, serial;
};

std::string narrow(const wchar_t* text) {
  std::string out;
  for (; text && *text; ++text) out += *text < 128 ? static_cast<char>(*text) : '?';
  return out;
}

std::vector<Found> list_arms() {
  std::vector<Found> all;
  hid_device_info* const list = hid_enumerate(0, 0);
  for (const hid_device_info* about = list; about; about = about->next) {
    if (!about->path || !packet_bytes_of(about->vendor_id, about->product_id)) continue;
    all.push_back({about->path, narrow(about->serial_number)});
  }
  hid_free_enumeration(list);
  std::ranges::sort(all, {}, &Found::node);
  return all;
}

/// The node's firmware by the ids that the kernel reports. Empty if there is no node.
std::optional<std::size_t> identify(const std::string& where, const std::string& node) {
  const int fd = ::open(node.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) return std::nullopt;
  if (fd < 0) {
    refuse(where, node + " cannot be opened (" + std::generic_category().message(errno) + ")" +
                      (errno == EACCES
                           ? kGiveRight
                           : std::string("; ") + remedy_for(errno, "name the node of the arm")));
  }
  hidraw_devinfo about{};
  const bool known = ioctl(fd, HIDIOCGRAWINFO, &about) >= 0;
  close(fd);
  const auto bytes = known ? packet_bytes_of(static_cast<std::uint16_t>(about.vendor),
                                             static_cast<std::uint16_t>(about.product))
                           : std::nullopt;
  if (!bytes) {
    refuse(where, node + " is another device than the arm (1234:0006 or 16c0:0486); see lsusb");
  }
  return bytes;
}

}  // namespace

std::string parse_hid_port(std::string_view text) {
  if (!text.empty() && text.front() == ':') text.remove_prefix(1);
  if (text.find(',') != std::string_view::npos) {
    refuse("", "'" + std::string(text) + "' is not known; give a node or a serial number alone");
  }
  return std::string(text);
}

HidPort::HidPort(const std::string& where, int patience_ms, const std::atomic<bool>& stop,
                 IoThread io)
    : io_(io) {
  if (hid_init() != 0) refuse(where, "hidapi cannot start; is /dev there?");
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
  while (!open(where)) {
    if (stop || std::chrono::steady_clock::now() >= give_up) {
      refuse(where, absent_text(kSought, where));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  sem_init(&raised_, 0, 0);
  try {
    reader_ = std::thread([this] { read_reports(); });
    writer_ = std::thread([this] { write_commands(); });
  } catch (const std::system_error&) {
    close();
    throw;
  }
}

HidPort::~HidPort() {
  close();
}

void HidPort::close() noexcept {
  stop_ = true;
  sem_post(&raised_);
  if (writer_.joinable()) writer_.join();
  if (reader_.joinable()) reader_.join();
  sem_destroy(&raised_);
  hid_close(device_);
}

bool HidPort::open(const std::string& where) {
  std::string node = where;
  if (where.find('/') == std::string::npos) {
    std::vector<Found> all = list_arms();
    if (!where.empty()) std::erase_if(all, [&](const Found& f) { return f.serial != where; });
    if (all.empty()) return false;
    if (all.size() > 1) {
      std::string list;
      for (const Found& found : all) list += " " + found.node + " (" + found.serial + ")";
      refuse(where, "several arms are there:" + list + "; name one by its node or serial");
    }
    node = all.front().node;
  }
  const auto bytes = identify(where, node);
  if (!bytes) return false;
  packet_bytes_ = *bytes;
  device_ = hid_open_path(node.c_str());
  if (!device_) refuse(where, node + " cannot be used (" + narrow(hid_error(nullptr)) + ")");
  return true;
}

bool HidPort::send(std::span<const std::uint8_t> packet) noexcept {
  if (gone_ || !outbox_.put(packet)) return false;
  sem_post(&raised_);
  return true;
}

void HidPort::read_reports() noexcept {
  block_signals();  // an interrupted call would look like a device that is gone
  become(io_);
  std::array<std::uint8_t, MailboxPacket::kMaxBytes> report{};
  while (!stop_ && !closed()) {
    const int size = hid_read_timeout(device_, report.data(), report.size(), kReadMs);
    if (size < 0) closed_ = true;
    if (size <= 0) continue;
    ++(inbox_.put(std::span(report).first(static_cast<std::size_t>(size))) ? packets_ : overflow_);
  }
}

void HidPort::write_commands() noexcept {
  block_signals();
  sender_id_ = gettid();
  become(io_);
  while (!stop_ || !outbox_.empty()) {
    while (sem_wait(&raised_) != 0) {
    }
    std::array<std::uint8_t, 1 + wooden::kLongPacketBytes> report{wooden::kReportId};
    const std::size_t size = outbox_.take(std::span(report).subspan(1));
    if (size > 0) {
      std::fill(report.begin() + 1 + static_cast<std::ptrdiff_t>(size), report.end(), 0);
      if (hid_write(device_, report.data(), 1 + packet_bytes_) < 0) {
        gone_ = closed_.exchange(true);
      } else {
        ++commands_;
      }
    }
    outbox_.set_on_its_way(false);
  }
}

std::vector<LinkCounter> HidPort::counters() const {
  return {{"packets", packets_}, {"overflow", overflow_}, {"commands", commands_}};
}

}  // namespace kerf
