// SPDX-License-Identifier: Apache-2.0
// The WoodenHaptics arm at /dev/uhid: the test is the kernel behind that file.
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <linux/uhid.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hil/device/emulator.hpp"
#include "hil/device/wooden.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/serve_for.hpp"

namespace {

using Event = std::unique_ptr<uhid_event>;

/// A kernel, and the arm that it drives.
class Kernel {
 public:
  explicit Kernel(const kerf::WoodenHid::Settings& settings = {})
      : ends_(pair()),
        emulator_(std::make_unique<kerf::WoodenModel>(), {}),
        arm_(ends_[1], settings, emulator_) {}
  ~Kernel() { close(ends_[0]); }

  void say(const uhid_event& event) const {
    REQUIRE(send(ends_[0], &event, sizeof event, 0) == sizeof event);
  }
  void say(std::uint32_t type) const {
    const auto event = std::make_unique<uhid_event>();
    event->type = type;
    say(*event);
  }
  /// An output report as hidraw hands it on.
  void write(std::span<const std::uint8_t> report) const {
    const auto event = std::make_unique<uhid_event>();
    event->type = UHID_OUTPUT;
    event->u.output.size = static_cast<__u16>(report.size());
    std::ranges::copy(report, event->u.output.data);
    say(*event);
  }
  /// Lets the arm serve for so long, and takes what it said.
  std::vector<Event> hear(int milliseconds) {
    kerf::test::serve_for(arm_, milliseconds);
    std::vector<Event> all;
    for (;;) {
      auto event = std::make_unique<uhid_event>();
      if (recv(ends_[0], event.get(), sizeof *event, MSG_DONTWAIT) <= 0) return all;
      all.push_back(std::move(event));
    }
  }
  [[nodiscard]] const kerf::UhidArm& arm() const { return arm_; }
  [[nodiscard]] const kerf::EmulatorStats& seen() const { return emulator_.stats(); }

 private:
  static std::array<int, 2> pair() {
    std::array<int, 2> ends{};
    REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends.data()) == 0);
    return ends;
  }
  std::array<int, 2> ends_;
  kerf::Emulator emulator_;
  kerf::UhidArm arm_;
};

/// Its number, then a command of the short form.
std::vector<std::uint8_t> neutral_report() {
  const auto command = encode(kerf::WoodenCommand{});
  std::vector<std::uint8_t> report(1 + kerf::wooden::kPacketBytes, kerf::wooden::kReportId);
  std::copy_n(command.begin(), kerf::wooden::kPacketBytes, report.begin() + 1);
  return report;
}

/// The fields are packed, so nothing may refer to them.
std::uint32_t type_of(const Event& event) {
  return event->type;
}

/// Whether it is that reply to request `id`, and refuses it.
bool refuses(const Event& event, std::uint32_t type, std::uint32_t id) {
  const auto& reply = event->u.set_report_reply;  // a reply to a get begins in the same way
  return event->type == type && reply.id == id && reply.err == EPIPE;
}

}  // namespace

TEST_CASE("uhid: the kernel is told who the arm is before anything else") {
  Kernel kernel({.packet_bytes = 64, .serial = "S1"});
  const auto events = kernel.hear(2);
  REQUIRE(events.size() == 1);
  CHECK(type_of(events[0]) == UHID_CREATE2);
  const uhid_create2_req& about = events[0]->u.create2;
  CHECK(std::string(reinterpret_cast<const char*>(about.uniq)) == "S1");
  CHECK(about.vendor == 0x16C0);
  CHECK(about.product == 0x0486);
  CHECK(about.rd_data[about.rd_size - 1] == 0xC0);
}

TEST_CASE("uhid: reports go while the node is open, from the first command on") {
  Kernel kernel;
  kernel.hear(2);
  kernel.write(neutral_report());
  CHECK(kernel.hear(20).empty());
  kernel.say(UHID_OPEN);
  kernel.write(neutral_report());
  const auto events = kernel.hear(20);
  CHECK(kernel.seen().commands == 2);
  CHECK(kernel.seen().refused == 0);
  REQUIRE(events.size() > 10);
  for (const Event& event : events) {
    CHECK(type_of(event) == UHID_INPUT2);
    const std::uint8_t* data = event->u.input2.data;
    CHECK(kerf::wooden::decode_report({data, event->u.input2.size}));
  }
  CHECK_FALSE(kernel.arm().left());
  kernel.say(UHID_CLOSE);
  kernel.hear(2);
  CHECK(kernel.arm().left());
}

TEST_CASE("uhid: feature reports are stalled under the number that they were asked with") {
  Kernel kernel;
  kernel.hear(2);
  const auto asks = std::make_unique<uhid_event>();
  asks->type = UHID_GET_REPORT;
  asks->u.get_report.id = 77;
  kernel.say(*asks);
  asks->type = UHID_SET_REPORT;
  asks->u.set_report.id = 78;
  kernel.say(*asks);
  const auto events = kernel.hear(5);
  REQUIRE(events.size() == 2);
  CHECK(refuses(events[0], UHID_GET_REPORT_REPLY, 77));
  CHECK(refuses(events[1], UHID_SET_REPORT_REPLY, 78));
}

TEST_CASE("uhid: unplugged it is destroyed, plugged in again it is created anew") {
  Kernel kernel({.script = {{40, kerf::UsbFault::vanish}, {80, kerf::UsbFault::back}}});
  const auto events = kernel.hear(15);
  REQUIRE(events.size() == 3);
  CHECK(type_of(events[1]) == UHID_DESTROY);
  CHECK(type_of(events[2]) == UHID_CREATE2);
}
