// SPDX-License-Identifier: Apache-2.0
// The arm at /dev/uhid and the Falcon on USB/IP: the test is the kernel at the other end.
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <linux/uhid.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/wooden.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/usb/usbip_falcon.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "shared/numeric/statistics.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf::kernel_fronts_test {
namespace {

/// Lets the device serve for so long, and then until nothing is due of that time: if the
/// machine stood still meanwhile, it has not served at all yet.
void serve_for(kerf::KernelDevice& device, int milliseconds) {
  const std::int64_t until_ns = kerf::monotonic_ns() + std::int64_t{milliseconds} * 1'000'000;
  const auto owes = [&] {
    pollfd asked{device.descriptor(), POLLIN, 0};
    return device.next_wake_ns() <= until_ns || poll(&asked, 1, 0) > 0;
  };
  kerf::Histogram lateness;
  kerf::serve_kernel(
      device, [&] { return kerf::monotonic_ns() < until_ns || owes(); }, lateness);
}

std::array<int, 2> pair_of(int type) {
  std::array<int, 2> ends{};
  REQUIRE(socketpair(AF_UNIX, type, 0, ends.data()) == 0);
  return ends;
}

using Event = std::unique_ptr<uhid_event>;

/// A kernel, and the arm that it drives.
class Kernel {
 public:
  explicit Kernel(const kerf::WoodenHid::Settings& settings = {})
      : ends_(pair_of(SOCK_SEQPACKET)),
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
  /// Lets the arm serve for so long, and takes its events.
  std::vector<Event> hear(int milliseconds) {
    serve_for(arm_, milliseconds);
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

/// Returns true if it is that reply to request `id`, and refuses it.
bool refuses(const Event& event, std::uint32_t type, std::uint32_t id) {
  const auto& reply = event->u.set_report_reply;  // a reply to a get begins in the same way
  return event->type == type && reply.id == id && reply.err == EPIPE;
}

}  // namespace

TEST_CASE("uhid: the arm is created with its ids before any other event") {
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

TEST_CASE("uhid: feature reports are stalled under the number of their request") {
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

namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint32_t kIn = 1;  // numbers of the endpoints
constexpr std::uint32_t kOut = 2;

struct Answer {
  std::uint32_t command = 0, sequence = 0;
  int status = 0;
  Bytes data;
};

std::uint32_t word_at(std::span<const std::uint8_t> in, std::size_t at) {
  return std::uint32_t{in[at]} << 24 | std::uint32_t{in[at + 1]} << 16 |
         std::uint32_t{in[at + 2]} << 8 | in[at + 3];
}

/// A kernel, and the device whose cable it holds.
class Host {
 public:
  explicit Host(std::vector<kerf::ScriptedUsbFault> script = {})
      : emulator_(std::make_unique<kerf::FalconModel>(), {}),
        device_({.firmware_runs = true}, std::move(script), emulator_, [this] { return plug(); }) {}
  ~Host() { close(fd_); }

  void send(const Bytes& bytes) const {
    REQUIRE(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(bytes.size()));
  }
  static Bytes message(std::uint32_t command, std::uint32_t sequence, bool to_host,
                       std::uint32_t endpoint, std::uint32_t at_20, std::uint32_t at_24,
                       std::array<std::uint8_t, 8> setup = {}) {
    Bytes out;
    for (const std::uint32_t word :
         {command, sequence, 1u, to_host ? 1u : 0u, endpoint, at_20, at_24, 0u, 0u, 0u}) {
      for (int shift = 24; shift >= 0; shift -= 8) {
        out.push_back(static_cast<std::uint8_t>(word >> shift));
      }
    }
    out.insert(out.end(), setup.begin(), setup.end());
    return out;
  }
  void submit_read(std::uint32_t sequence, std::uint32_t bytes = 64) const {
    send(message(1, sequence, true, kIn, 0, bytes));
  }
  void submit_write(std::uint32_t sequence, std::span<const std::uint8_t> data) const {
    Bytes out = message(1, sequence, false, kOut, 0, static_cast<std::uint32_t>(data.size()));
    out.insert(out.end(), data.begin(), data.end());
    send(out);
  }
  void control(std::uint32_t sequence, std::array<std::uint8_t, 8> setup) const {
    send(message(1, sequence, (setup[0] & 0x80) != 0, 0, 0, setup[6], setup));
  }
  void unlink(std::uint32_t sequence, std::uint32_t other) const {
    send(message(2, sequence, false, 0, other, 0));
  }

  /// Lets the device serve for so long, and takes the answers.
  std::vector<Answer> hear(int milliseconds) {
    serve_for(device_, milliseconds);
    return take();
  }

  [[nodiscard]] kerf::UsbipFalcon& device() { return device_; }
  [[nodiscard]] const kerf::EmulatorStats& seen() const { return emulator_.stats(); }
  /// Times that the device was plugged in.
  [[nodiscard]] int plugs() const { return plugs_; }

 private:
  int plug() {
    const std::array<int, 2> cable = pair_of(SOCK_STREAM);
    if (fd_ >= 0) close(fd_);
    fd_ = cable[0];
    ++plugs_;
    return cable[1];
  }
  std::vector<Answer> take() const {
    Bytes heard(65536);
    const ssize_t size = recv(fd_, heard.data(), heard.size(), MSG_DONTWAIT);
    heard.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    std::vector<Answer> answers;
    for (std::size_t at = 0; at + 48 <= heard.size();) {
      const auto head = std::span(heard).subspan(at, 48);
      Answer& answer = answers.emplace_back();
      answer.command = word_at(head, 0);
      answer.sequence = word_at(head, 4);
      answer.status = static_cast<int>(word_at(head, 20));
      at += 48;
      const bool has_data = answer.command == 3 && !is_write(answer.sequence);
      const std::size_t bytes = has_data ? word_at(head, 24) : 0;
      answer.data.assign(heard.begin() + static_cast<std::ptrdiff_t>(at),
                         heard.begin() + static_cast<std::ptrdiff_t>(at + bytes));
      at += bytes;
    }
    return answers;
  }
  static bool is_write(std::uint32_t sequence) { return sequence >= 1000; }

  int fd_ = -1;
  int plugs_ = 0;
  kerf::Emulator emulator_;
  kerf::UsbipFalcon device_;
};

const Answer* find(const std::vector<Answer>& answers, std::uint32_t sequence) {
  const auto found = std::ranges::find(answers, sequence, &Answer::sequence);
  return found == answers.end() ? nullptr : &*found;
}

}  // namespace

TEST_CASE("usbip: the kernel's questions at plug-in are answered, unknown ones stalled") {
  Host host;
  host.control(1, {0x80, 6, 0, 1, 0, 0, 18, 0});    // device descriptor
  host.control(2, {0x80, 6, 0, 2, 0, 0, 9, 0});     // begin of the configuration
  host.control(3, {0x00, 9, 1, 0, 0, 0, 0, 0});     // set the configuration
  host.control(4, {0x80, 6, 0, 0x0F, 0, 0, 5, 0});  // a descriptor that is not there
  const auto answers = host.hear(20);
  REQUIRE(answers.size() == 4);
  CHECK(answers[0].data.size() == 18);
  CHECK(answers[0].data[8] == 0x03);
  CHECK(answers[0].data[9] == 0x04);
  CHECK(answers[1].data.size() == 9);
  CHECK(answers[2].status == 0);
  CHECK(answers[3].status == -EPIPE);
  for (const Answer& answer : answers) CHECK(answer.command == 3);
}

TEST_CASE("usbip: a command in pieces is one command, and its answer fills a read") {
  Host host;
  host.control(1, {0x40, 9, 1, 0, 0, 0, 0, 0});  // latency timer: one frame
  const auto command = encode(kerf::FalconCommand{});
  Bytes written = Host::message(1, 1000, false, kOut, 0, command.size());
  written.insert(written.end(), command.begin(), command.end());
  host.submit_read(2);
  for (const std::uint8_t byte : written) host.send({byte});
  std::vector<Answer> all;
  for (std::uint32_t next = 3; next < 50; ++next) {
    const auto answers = host.hear(2);
    all.insert(all.end(), answers.begin(), answers.end());
    if (!all.empty() && all.back().data.size() > 2) break;
    host.submit_read(next);
  }
  REQUIRE(find(all, 1000) != nullptr);
  CHECK(find(all, 1000)->status == 0);
  CHECK(host.seen().commands == 1);
  CHECK(host.seen().refused == 0);
  REQUIRE(all.back().data.size() == 2 + 16);
  CHECK(kerf::falcon::decode_report(std::span(all.back().data).subspan(2, 16)));
}

TEST_CASE("usbip: a read that waits can be given up, one that is over cannot") {
  Host host;
  host.control(1, {0x40, 9, 255, 0, 0, 0, 0, 0});  // latency timer: 255 frames, so reads wait
  host.submit_read(2);
  host.unlink(3, 2);
  host.unlink(4, 2);
  host.submit_write(1000, Bytes{0});
  host.send(Host::message(1, 1001, false, 5, 0, 0));  // no such endpoint
  const auto answers = host.hear(5);
  REQUIRE(answers.size() == 5);
  CHECK(answers[1].command == 4);
  CHECK(answers[1].status == -ECONNRESET);
  CHECK(answers[2].status == 0);
  CHECK(answers[3].status == 0);
  CHECK(answers[4].status == -EPIPE);
}

TEST_CASE("usbip: a stalled endpoint fails one read, then waits, and is freed by its clear") {
  Host host({{8, kerf::UsbFault::stall}});
  host.control(1, {0x40, 9, 1, 0, 0, 0, 0, 0});
  for (std::uint32_t i = 2; i < 40; ++i) host.submit_read(i);
  auto answers = host.hear(20);
  CHECK(std::ranges::count(answers, -EPIPE, &Answer::status) == 1);
  CHECK(host.hear(20).empty());
  host.control(50, {0x02, 1, 0, 0, 0x81, 0, 0, 0});
  answers = host.hear(20);
  REQUIRE(answers.size() > 2);
  CHECK(answers[0].sequence == 50);
  CHECK(answers[1].status == 0);
  host.control(51, {0x02, 1, 0, 0, 0x85, 0, 0, 0});  // no such endpoint
  answers = host.hear(5);
  REQUIRE(find(answers, 51) != nullptr);
  CHECK(find(answers, 51)->status == -EPIPE);
}

TEST_CASE("usbip: an endpoint that stalls without a read fails the first read that comes") {
  Host host({{8, kerf::UsbFault::stall}});
  host.hear(5);
  for (std::uint32_t i = 2; i < 10; ++i) host.submit_read(i);
  const auto answers = host.hear(20);
  REQUIRE(answers.size() == 1);
  CHECK(answers[0].sequence == 2);
  CHECK(answers[0].status == -EPIPE);
}

TEST_CASE("usbip: unplugged the cable is dead, plugged in again there is another one") {
  std::atomic<bool> again{false};
  Host host({{40, kerf::UsbFault::vanish}, {80, kerf::UsbFault::back, &again}});
  host.submit_read(2);
  host.hear(8);
  CHECK(host.device().descriptor() < 0);
  CHECK_FALSE(host.device().left());
  again = true;
  host.hear(5);
  CHECK(host.plugs() == 2);
  host.control(1, {0x80, 6, 0, 1, 0, 0, 18, 0});
  CHECK(find(host.hear(5), 1) != nullptr);
}

TEST_CASE("usbip: a host that breaks the protocol is disconnected") {
  Host too_long;
  too_long.submit_read(1, 5000);
  too_long.hear(5);
  CHECK(too_long.device().left());
  Host unknown;
  unknown.send(Host::message(7, 1, false, 0, 0, 0));
  unknown.hear(5);
  CHECK(unknown.device().left());
}

}  // namespace kerf::kernel_fronts_test
