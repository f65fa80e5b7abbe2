// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/usbip_falcon.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include "hil/hil_error.hpp"

namespace kerf {
namespace usbip {
namespace {

constexpr std::size_t kSetupAt = 40;

std::uint32_t word(std::span<const std::uint8_t> in, std::size_t at) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | in[at + i];
  return value;
}
void put_word(Header& out, std::size_t at, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < 4; ++i)
    out[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}
/// An answer has neither device, direction nor endpoint, and begins its own part at byte 20.
Header answer(UsbipCommand command, std::uint32_t sequence, int status) noexcept {
  Header out{};
  put_word(out, 0, static_cast<std::uint32_t>(command));
  put_word(out, 4, sequence);
  put_word(out, 20, static_cast<std::uint32_t>(status));
  return out;
}

Request decode(std::span<const std::uint8_t, kHeaderBytes> in) noexcept {
  Request request;
  request.command = static_cast<UsbipCommand>(word(in, 0));
  request.sequence = word(in, 4);
  request.to_host = word(in, 12) != 0;
  request.endpoint = word(in, 16);
  if (request.command == UsbipCommand::unlink) {
    request.unlinks = word(in, 20);
  } else {
    request.bytes = word(in, 24);
    for (std::size_t i = 0; i < request.setup.size(); ++i) request.setup[i] = in[kSetupAt + i];
  }
  return request;
}

/// The end of a transfer: `status` 0 or a negative errno; to the host, its bytes follow.
Header submitted(std::uint32_t sequence, int status, std::uint32_t bytes) noexcept {
  Header out = answer(UsbipCommand::submitted, sequence, status);
  put_word(out, 24, bytes);
  return out;
}
/// The answer to an unlink: -ECONNRESET if the transfer was given up, 0 if it was over.
Header unlinked(std::uint32_t sequence, int status) noexcept {
  return answer(UsbipCommand::unlinked, sequence, status);
}

}  // namespace
}  // namespace usbip

namespace {

constexpr std::uint32_t kLongestUsbipTransfer = 4096;
constexpr std::size_t kMostReads = 1024;
constexpr std::uint32_t kEndpointNumber = 0x0F;  // of an endpoint's address

const std::string kHub = "/sys/devices/platform/vhci_hcd.0";
constexpr int kFreePort = 4;       // VDEV_ST_NULL
constexpr int kVhciFullSpeed = 2;  // enum usb_device_speed
constexpr int kDeviceId = 1;       // names it in every message; it is alone on this cable

[[noreturn]] void refuse(const std::string& rest) {
  throw HilError("--front usbip: " + kHub + rest);
}

/// A line of `status` after its heading has hub, port, state, and more that a free port does not
/// need.
int free_port() {
  std::ifstream status(kHub + "/status");
  if (!status) refuse(": is not there; as root: modprobe vhci-hcd");
  std::string line, hub;
  std::getline(status, line);
  while (std::getline(status, line)) {
    std::istringstream words(line);
    int port = 0, state = 0;
    if (words >> hub >> port >> state && hub == "hs" && state == kFreePort) return port;
  }
  refuse(": has no free port; end another emulator");
}

}  // namespace

void UsbipFalcon::answer() {
  std::array<std::uint8_t, 4096> buffer;
  const ssize_t size = recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (size <= 0) return lose_host();
  received_.insert(received_.end(), buffer.begin(), buffer.begin() + size);
  falcon_.catch_up(*this);
  while (take_message()) {
  }
}

/// Serves the first of the received messages; returns false if it is not whole yet.
bool UsbipFalcon::take_message() {
  if (received_.size() < usbip::kHeaderBytes) return false;
  const auto request = usbip::decode(std::span(received_).first<usbip::kHeaderBytes>());
  if (request.bytes > kLongestUsbipTransfer) {
    lose_host();
    return false;
  }
  const std::size_t payload = request.to_host ? 0 : request.bytes;
  if (received_.size() < usbip::kHeaderBytes + payload) return false;
  serve(request, std::span(received_).subspan(usbip::kHeaderBytes, payload));
  if (fd_ < 0) return false;
  received_.erase(received_.begin(),
                  received_.begin() + static_cast<std::ptrdiff_t>(usbip::kHeaderBytes + payload));
  return true;
}

void UsbipFalcon::serve(const usbip::Request& request, std::span<const std::uint8_t> bytes) {
  using usbip::UsbipCommand;
  if (request.command == UsbipCommand::unlink) return unlink(request);
  if (request.command != UsbipCommand::submit) return lose_host();
  if (request.endpoint == 0) return submit_control(request);
  if (request.to_host && request.endpoint == (falcon::kEndpointIn & kEndpointNumber)) {
    if (reads_.size() == kMostReads) return say(usbip::submitted(request.sequence, -ENOMEM, 0));
    reads_.push_back({request.sequence, request.bytes});
  } else if (!request.to_host && request.endpoint == (falcon::kEndpointOut & kEndpointNumber)) {
    falcon_.out(bytes);
    say(usbip::submitted(request.sequence, 0, request.bytes));
  } else {
    say(usbip::submitted(request.sequence, -EPIPE, 0));
  }
}

void UsbipFalcon::submit_control(const usbip::Request& request) {
  const auto said = falcon_.control(setup_of(request.setup));
  if (!said) return say(usbip::submitted(request.sequence, -EPIPE, 0));
  const auto bytes = std::span(*said).first(std::min<std::size_t>(said->size(), request.bytes));
  say(usbip::submitted(request.sequence, 0, static_cast<std::uint32_t>(bytes.size())), bytes);
}

void UsbipFalcon::unlink(const usbip::Request& request) {
  const auto found = std::ranges::find(reads_, request.unlinks, &Read::sequence);
  const bool waited = found != reads_.end();
  if (waited) reads_.erase(found);
  say(usbip::unlinked(request.sequence, waited ? -ECONNRESET : 0));
}

std::optional<std::size_t> UsbipFalcon::room() {
  if (reads_.empty()) return std::nullopt;
  return reads_.front().room;
}

void UsbipFalcon::complete_read(int status, std::span<const std::uint8_t> bytes) {
  const Read read = reads_.front();
  reads_.pop_front();
  say(usbip::submitted(read.sequence, status, static_cast<std::uint32_t>(bytes.size())), bytes);
}

/// Waits if the socket is full: the kernel reads all the time.
void UsbipFalcon::say(const usbip::Header& header, std::span<const std::uint8_t> bytes) {
  std::array<std::uint8_t, usbip::kHeaderBytes + kLongestUsbipTransfer> message;
  const auto end = std::ranges::copy(bytes, std::ranges::copy(header, message.begin()).out).out;
  const auto size = static_cast<std::size_t>(end - message.begin());
  for (std::size_t done = 0; done < size;) {
    const ssize_t sent = send(fd_, &message[done], size - done, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return lose_host();
    done += static_cast<std::size_t>(sent);
  }
}

void UsbipFalcon::plugged(bool in) {
  if (!in) return unplug();
  if (fd_ < 0) fd_ = plug_in_();
}

void UsbipFalcon::lose_host() noexcept {
  unplug();
  left_ = true;
}

void UsbipFalcon::unplug() noexcept {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
  received_.clear();
  reads_.clear();
}

int plug_into_vhci() {
  const std::string line = std::to_string(free_port());
  const int attach = open((kHub + "/attach").c_str(), O_WRONLY | O_CLOEXEC);
  if (attach < 0) {
    refuse("/attach: " + std::generic_category().message(errno) + "; run as root");
  }
  std::array<int, 2> cable{};
  int error = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, cable.data()) == 0 ? 0 : errno;
  if (error == 0) {
    const std::string wanted = line + ' ' + std::to_string(cable[1]) + ' ' +
                               std::to_string(kDeviceId) + ' ' + std::to_string(kVhciFullSpeed);
    if (write(attach, wanted.data(), wanted.size()) < 0) error = errno;
    close(cable[1]);  // the kernel has its own hold of it
    if (error != 0) close(cable[0]);
  }
  close(attach);
  if (error != 0) {
    refuse("/attach: " + std::generic_category().message(error) +
           "; is another emulator starting?");
  }
  return cable[0];
}

}  // namespace kerf
