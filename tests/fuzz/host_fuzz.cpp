// SPDX-License-Identifier: Apache-2.0
// What a kernel may say to the emulated devices: USB/IP as one stream of bytes, and uhid events,
// each after one byte that says its length. The first byte of the input tells which.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include <linux/uhid.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hil/front/usb/usbip_falcon.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "shared/wire/falcon.hpp"

namespace {

using Bytes = std::span<const std::uint8_t>;

void require(bool holds) {
  if (!holds) std::abort();
}

std::array<int, 2> cable(int type) {
  std::array<int, 2> ends{};
  require(socketpair(AF_UNIX, type, 0, ends.data()) == 0);
  return ends;
}

/// Takes whatever comes, of a length that a front may hand on.
class AnyDevice final : public kerf::PacketDevice {
 public:
  explicit AnyDevice(std::size_t longest) : longest_(longest) {}
  void receive(Bytes packet) noexcept override { require(packet.size() <= longest_); }
  void advance(int /*cycles*/) noexcept override {}
  std::span<const std::uint8_t> next_packet() noexcept override { return {}; }

 private:
  std::size_t longest_;
};

/// Whole answers begin with a command that answers have.
void check_answer(Bytes heard) {
  if (heard.size() < kerf::usbip::kHeaderBytes) return;
  const std::array<std::uint8_t, 3> high{};
  require(std::ranges::equal(heard.first(3), high) && (heard[3] == 3 || heard[3] == 4));
}

void speak_usbip(Bytes input, bool firmware_runs) {
  AnyDevice falcon(kerf::falcon::kPacketBytes);
  const auto ends = cable(SOCK_STREAM);
  kerf::UsbipFalcon device({.firmware_runs = firmware_runs}, {}, falcon, [&] { return ends[1]; });
  std::vector<std::uint8_t> heard(1 << 16);
  while (!input.empty() && !device.left()) {
    const auto piece = input.first(std::min<std::size_t>(input.size(), 1000));
    input = input.subspan(piece.size());
    require(send(ends[0], piece.data(), piece.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(piece.size()));
    device.answer();
    const ssize_t size = recv(ends[0], heard.data(), heard.size(), MSG_DONTWAIT);
    if (size > 0) check_answer(std::span(heard).first(static_cast<std::size_t>(size)));
  }
  close(ends[0]);
}

void speak_uhid(Bytes input) {
  AnyDevice arm(UHID_DATA_MAX);
  const auto ends = cable(SOCK_SEQPACKET);
  kerf::UhidArm device(ends[1], {}, arm);
  std::vector<std::uint8_t> heard(sizeof(uhid_event));
  while (!input.empty()) {
    const std::size_t size = std::min<std::size_t>(input[0], input.size() - 1);
    const auto event = input.subspan(1, size);
    input = input.subspan(1 + size);
    if (event.empty()) continue;
    require(send(ends[0], event.data(), event.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(event.size()));
    device.answer();
    while (recv(ends[0], heard.data(), heard.size(), MSG_DONTWAIT) > 0) {
    }
  }
  close(ends[0]);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input{data, size};
  if (input.empty()) return 0;
  if (input[0] % 4 == 0) {
    speak_uhid(input.subspan(1));
  } else {
    speak_usbip(input.subspan(1), input[0] % 4 != 1);
  }
  return 0;
}
