// SPDX-License-Identifier: Apache-2.0
#include "controller/device/open_port.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>

#include "controller/device/arm/arm_port.hpp"
#include "controller/device/firewire/firewire_port.hpp"
#include "controller/device/port/socket_port.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/text.hpp"
#ifdef KERF_HAS_HID
#include "controller/device/port/hid_port.hpp"
#endif
#ifdef KERF_HAS_USB
#include "controller/device/port/usb_port.hpp"
#endif

namespace kerf {
namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kRepeatNs = 200 * kNsPerMs;
constexpr int kLookMs = 50;  // longest delay of a stop request

}  // namespace

void agree(PacketPort& port, const std::string& location, const LinkHello& ours, bool is_lossy,
           int patience_ms, const std::atomic<bool>& stop) {
  const HelloBytes hello = encode(ours);
  const std::int64_t give_up_ns = monotonic_ns() + patience_ms * kNsPerMs;
  std::int64_t say_at_ns = 0;
  std::array<std::uint8_t, kHelloBytes> packet;
  for (std::int64_t now_ns = monotonic_ns(); now_ns < give_up_ns && !stop && !port.closed();
       now_ns = monotonic_ns()) {
    if (now_ns >= say_at_ns && port.send(hello)) {
      say_at_ns = is_lossy ? now_ns + kRepeatNs : std::numeric_limits<std::int64_t>::max();
    }
    if (!port.wait(kLookMs)) continue;
    const std::size_t size = port.receive(packet);
    if (size != packet.size()) continue;  // of the device
    const auto theirs = decode_hello(packet);
    if (!theirs) continue;
    const std::string reason = discord(ours, *theirs);
    if (reason.empty()) return;
    throw std::runtime_error(location + ": " + reason);
  }
  if (port.closed()) {
    throw std::runtime_error(location +
                             ": the emulator closed the link; read its message, and start it with "
                             "--stay where clients come one after another");
  }
  throw std::runtime_error(location + ": no answer to the hello of this controller within " +
                           std::to_string(patience_ms / 1000) +
                           " s; end the client that the emulator serves, or start kerf-emulator "
                           "of this version");
}

namespace {

constexpr std::string_view kSocket = "socket:";
constexpr std::string_view kUdp = "udp:";
struct Request {
  const LinkHello& ours;
  int patience_ms = 0;
  const std::atomic<bool>& stop;
  IoThread io;
  bool starts_kerf_arm = false;
};

/// The text after the name of a bus; empty for another port.
std::optional<std::string_view> after(std::string_view bus, std::string_view text) {
  if (!text.starts_with(bus)) return std::nullopt;
  text.remove_prefix(bus.size());
  if (!text.empty() && text.front() != ':' && text.front() != ',') return std::nullopt;
  return text;
}

// Each opens its port, or only reads the text if there is no request.
std::unique_ptr<PacketPort> firewire(std::string_view rest, const Request* request) {
  FirewireOptions options = parse_firewire_port(rest);
  if (!request) return nullptr;
  options.rate_hz = request->ours.rate_hz;
  return std::make_unique<FirewirePort>(options, request->patience_ms, request->stop);
}

#ifdef KERF_HAS_USB
std::unique_ptr<PacketPort> usb(std::string_view rest, const Request* request) {
  const UsbOptions options = parse_usb_port(rest);
  if (!request) return nullptr;
  return std::make_unique<UsbPort>(options, request->patience_ms, request->stop, request->io);
}
#else
std::unique_ptr<PacketPort> usb(std::string_view, const Request*) {
  throw std::runtime_error(
      "--port usb: left out of this build; install libusb-1.0-0-dev, then ./kerf setup");
}
#endif

#ifdef KERF_HAS_HID
std::unique_ptr<PacketPort> hid(std::string_view rest, const Request* request) {
  const std::string where = parse_hid_port(rest);
  if (!request) return nullptr;
  return std::make_unique<HidPort>(where, request->patience_ms, request->stop, request->io);
}
#else
std::unique_ptr<PacketPort> hid(std::string_view, const Request*) {
  throw std::runtime_error(
      "--port hid: left out of this build; install libhidapi-dev, then ./kerf setup");
}
#endif

std::unique_ptr<PacketPort> arm(std::string_view rest, const Request* request) {
  std::string name = parse_arm_port(rest);
  if (!request) return nullptr;
  if (!is_cartesian(request->ours.personality)) {
    throw std::runtime_error("--port arm: not for --device " +
                             std::string(word_of(request->ours.personality)) +
                             "; take --device inverse3, touch or omega");
  }
  const bool starts = name.empty() && request->starts_kerf_arm;
  if (name.empty()) name = word_of(request->ours.personality);
  return std::make_unique<ArmPort>(name, request->ours, request->patience_ms, request->stop,
                                   starts);
}

std::unique_ptr<PacketPort> emulator(const std::string& text, const Request& request) {
  const bool is_udp = text.starts_with(kUdp);
  const std::string where = text.substr(is_udp ? kUdp.size() : kSocket.size());
  std::unique_ptr<PacketPort> port;
  if (is_udp) {
    port = std::make_unique<UdpPort>(where, request.patience_ms, request.stop);
  } else {
    port = std::make_unique<SocketPort>(where, request.patience_ms, request.stop);
  }
  agree(*port, "--port " + text, request.ours, is_udp, request.patience_ms, request.stop);
  if (request.ours.lockstep) return std::make_unique<LockStepPort>(std::move(port));
  return port;
}

std::unique_ptr<PacketPort> port(const std::string& text, const Request* request) {
  if (const auto rest = after("fw", text)) return firewire(*rest, request);
  if (const auto rest = after("usb", text)) return usb(*rest, request);
  if (const auto rest = after("hid", text)) return hid(*rest, request);
  if (const auto rest = after("arm", text)) return arm(*rest, request);
  if (after("ws", text)) {
    throw std::runtime_error(
        "--port " + escaped(text) +
        ": the Inverse3's service is kerf-arm's; take --port arm, which starts it, or for another "
        "address, button or arm first ./kerf arm --device inverse3 --service [HOST:]PORT");
  }
  if (!text.starts_with(kUdp) && !text.starts_with(kSocket)) {
    throw std::runtime_error("--port '" + text +
                             "' is not known; use auto, fw, usb, hid, arm, or socket:PATH or "
                             "udp:[ADDRESS:]PORT, where kerf-emulator listens");
  }
  return request ? emulator(text, *request) : nullptr;
}

}  // namespace

void check_port(const std::string& text) {
  if (text != "auto") static_cast<void>(port(text, nullptr));
}

std::string resolve_port(const std::string& text, Personality personality) {
  const DeviceKind& device = kind_of(personality);
  if (text == "auto") return std::string(device.port);
  for (const DeviceKind& other : kDeviceKinds) {
    if (other.port == device.port || !after(other.port, text)) continue;
    throw std::runtime_error("--port " + text + ": not for --device " + std::string(device.word) +
                             "; take " + std::string(device.port) + ", or another --device");
  }
  return text;
}

std::unique_ptr<PacketPort> open_port(const std::string& text, const LinkHello& ours,
                                      int patience_ms, const std::atomic<bool>& stop, IoThread io,
                                      bool starts_kerf_arm) {
  const Request request{ours, patience_ms, stop, io, starts_kerf_arm};
  return port(text, &request);
}

}  // namespace kerf
