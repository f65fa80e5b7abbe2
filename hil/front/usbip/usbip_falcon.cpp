// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usbip/usbip_falcon.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

namespace kerf {
namespace {

constexpr std::uint32_t kLongestTransfer = 4096;
constexpr std::size_t kMostReads = 1024;
constexpr std::uint32_t kEndpointNumber = 0x0F;  // of an endpoint's address

}  // namespace

void UsbipFalcon::answer() {
  std::array<std::uint8_t, 4096> buffer;
  const ssize_t size = recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (size <= 0) return lose_host();
  heard_.insert(heard_.end(), buffer.begin(), buffer.begin() + size);
  plug_.catch_up(*this);
  while (take_message()) {
  }
}

/// Serves the first message of what was heard; false when it is not whole yet.
bool UsbipFalcon::take_message() {
  if (heard_.size() < usbip::kHeaderBytes) return false;
  const auto request = usbip::decode(std::span(heard_).first<usbip::kHeaderBytes>());
  if (request.bytes > kLongestTransfer) {
    lose_host();
    return false;
  }
  const std::size_t payload = request.to_host ? 0 : request.bytes;
  if (heard_.size() < usbip::kHeaderBytes + payload) return false;
  serve(request, std::span(heard_).subspan(usbip::kHeaderBytes, payload));
  if (fd_ < 0) return false;
  heard_.erase(heard_.begin(),
               heard_.begin() + static_cast<std::ptrdiff_t>(usbip::kHeaderBytes + payload));
  return true;
}

void UsbipFalcon::serve(const usbip::Request& request, std::span<const std::uint8_t> bytes) {
  using usbip::Command;
  if (request.command == Command::unlink) return unlink(request);
  if (request.command != Command::submit) return lose_host();
  if (request.endpoint == 0) return submit_control(request);
  if (request.to_host && request.endpoint == (falcon::kEndpointIn & kEndpointNumber)) {
    if (reads_.size() == kMostReads) return say(usbip::submitted(request.sequence, -ENOMEM, 0));
    reads_.push_back({request.sequence, request.bytes});
  } else if (!request.to_host && request.endpoint == (falcon::kEndpointOut & kEndpointNumber)) {
    plug_.out(bytes);
    say(usbip::submitted(request.sequence, 0, request.bytes));
  } else {
    say(usbip::submitted(request.sequence, -EPIPE, 0));
  }
}

void UsbipFalcon::submit_control(const usbip::Request& request) {
  const auto said = plug_.control(setup_of(request.setup));
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

/// Waits where the socket is full: the kernel reads all the time.
void UsbipFalcon::say(const usbip::Header& header, std::span<const std::uint8_t> bytes) {
  std::array<std::uint8_t, usbip::kHeaderBytes + kLongestTransfer> message;
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
  heard_.clear();
  reads_.clear();
}

}  // namespace kerf
