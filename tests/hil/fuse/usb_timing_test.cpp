// SPDX-License-Identifier: Apache-2.0
// 1 kHz through FUSE with libusb and hidapi, emulator, I/O thread and servo on one core: the time
// of a command from the servo to the device plus that of the answer back, without the time that the
// answer waits for its frame. Only the median and the bytes are checked: a busy machine may take
// the core from all threads. KERF_TIMING_SECONDS makes it longer than 2 s.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/open_port.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/usb/hidraw_node.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/hil/fuse/spread.hpp"

namespace kerf::usb_timing_test {

using kerf::test::Spread;
using kerf::test::spread_of;

namespace {

using Numbers = std::array<std::int16_t, 3>;

// What travels: the number of the tick in two digits, and a third that follows from them.
constexpr int kBase = 2000;
Numbers numbers_of(int tick) {
  const auto digit = [](int value) { return static_cast<std::int16_t>(value % kBase); };
  return {digit(tick), digit(tick / kBase), digit(tick % 7919 * 31)};
}
/// Empty if a byte was wrong.
std::optional<int> tick_of(const Numbers& numbers) {
  const int tick = numbers[0] + numbers[1] * kBase;
  if (numbers != numbers_of(tick)) return std::nullopt;
  return tick;
}

struct FalconWire {
  static auto command(const Numbers& n) { return encode(kerf::FalconCommand{.motor = n}); }
  static auto answer(const Numbers& n) {
    return encode(kerf::FalconReport{.encoder = n, .homed = {}});
  }
  static std::optional<Numbers> asked(std::span<const std::uint8_t> bytes) {
    const auto command = kerf::falcon::decode_command(bytes);
    return command ? std::optional(command->motor) : std::nullopt;
  }
  static std::optional<Numbers> answered(std::span<const std::uint8_t> bytes) {
    const auto report = kerf::falcon::decode_report(bytes);
    return report ? std::optional(report->encoder) : std::nullopt;
  }
};
struct WoodenWire {
  static auto short_of(const kerf::wooden::PacketBytes& bytes) {
    std::array<std::uint8_t, kerf::wooden::kPacketBytes> part{};
    std::copy_n(bytes.begin(), part.size(), part.begin());
    return part;
  }
  static auto command(const Numbers& n) {
    return short_of(encode(kerf::WoodenCommand{.milliamps = n, .set_encoders = {}}));
  }
  static auto answer(const Numbers& n) {
    return short_of(encode(kerf::WoodenReport{.encoder = {n[0], n[1], n[2]}}));
  }
  static std::optional<Numbers> asked(std::span<const std::uint8_t> bytes) {
    const auto command = kerf::wooden::decode_command(bytes);
    return command ? std::optional(command->milliamps) : std::nullopt;
  }
  static std::optional<Numbers> answered(std::span<const std::uint8_t> bytes) {
    const auto report = kerf::wooden::decode_report(bytes);
    if (!report) return std::nullopt;
    return Numbers{report->encoder[0], report->encoder[1], report->encoder[2]};
  }
};

/// Answers each command at the begin of the next frame with its own numbers, and records when.
template <class Wire>
class EchoDevice final : public kerf::PacketDevice {
 public:
  explicit EchoDevice(int ticks) : received_ns(at(ticks)), answered_ns(at(ticks)) {}

  void receive(std::span<const std::uint8_t> packet) noexcept override {
    numbers_ = Wire::asked(packet);
    const auto tick = numbers_ ? tick_of(*numbers_) : std::nullopt;
    if (!tick) {
      ++bad;
    } else if (std::size_t(*tick) < received_ns.size()) {
      received_ns[std::size_t(*tick)] = kerf::monotonic_ns();
    }
  }
  void advance(int cycles) noexcept override { cycle_ += cycles; }
  std::span<const std::uint8_t> next_packet() noexcept override {
    if (cycle_ % kerf::kCyclesPerUsbFrame != 0 || !numbers_) return {};
    if (const auto tick = tick_of(*numbers_); tick && std::size_t(*tick) < answered_ns.size()) {
      answered_ns[std::size_t(*tick)] = kerf::monotonic_ns();
    }
    packet_ = Wire::answer(*numbers_);
    numbers_.reset();
    return packet_;
  }

  std::vector<std::int64_t> received_ns, answered_ns;  ///< by tick
  int bad = 0;

 private:
  static std::vector<std::int64_t> at(int ticks) {
    return std::vector<std::int64_t>(static_cast<std::size_t>(ticks));
  }
  std::int64_t cycle_ = 0;
  std::optional<Numbers> numbers_;
  decltype(Wire::answer({})) packet_{};
};

constexpr std::int64_t kGiveUpNs = 20'000'000;  // of an answer: then it counts as late

/// By tick; 0: never.
using Times = std::vector<std::int64_t>;

/// `device` is the one behind the served node.
template <class Wire, class Served>
void measure(const std::string& bus, EchoDevice<Wire>& device, Served& served, int ticks) {
  Times sent_ns(std::size_t(ticks), 0), got_ns(std::size_t(ticks), 0);
  int bad = 0, lost = 0;
  std::thread([&] {
    static_cast<void>(kerf::make_real_time(80, -1));
    const auto port = kerf::open_port(bus + served.path(), {}, 0, kerf::test::kGoOn);
    std::array<std::uint8_t, 65> packet{};
    std::int64_t deadline_ns = kerf::monotonic_ns();
    for (int tick = 0; tick < ticks; ++tick) {
      kerf::sleep_until_ns(deadline_ns);
      const auto i = std::size_t(tick);
      sent_ns[i] = kerf::monotonic_ns();
      port->send(Wire::command(numbers_of(tick)));
      const std::int64_t give_up_ns = sent_ns[i] + kGiveUpNs;
      std::int64_t now_ns = sent_ns[i];
      while (got_ns[i] == 0) {
        if (const std::size_t size = port->receive(packet); size > 0) {
          const auto numbers =
              Wire::answered(std::span(packet).first(std::min(size, packet.size())));
          const auto answered = numbers ? tick_of(*numbers) : std::nullopt;
          if (!answered) ++bad;
          if (answered == tick) got_ns[i] = kerf::monotonic_ns();
          continue;
        }
        if (now_ns >= give_up_ns) break;  // after a last read: the machine itself may stand still
        kerf::sleep_until_ns(now_ns + 10'000);
        now_ns = kerf::monotonic_ns();
      }
      if (got_ns[i] == 0) ++lost;
      // 0.4 ms after the frame: a phase as good as any that leaves time before the next one.
      deadline_ns = tick < 10 ? kerf::monotonic_ns() + 400'000 : deadline_ns + 1'000'000;
      deadline_ns = std::max(deadline_ns, kerf::monotonic_ns());
    }
  }).join();
  served.stop();
  std::vector<std::int64_t> out_us, in_us, round_us;
  for (std::size_t i = 100; i < sent_ns.size(); ++i) {
    if (got_ns[i] == 0 || device.received_ns[i] == 0) continue;
    out_us.push_back((device.received_ns[i] - sent_ns[i]) / 1000);
    in_us.push_back((got_ns[i] - device.answered_ns[i]) / 1000);
    round_us.push_back(out_us.back() + in_us.back());
  }
  const Spread round = spread_of(round_us);
  MESSAGE(bus, " us, p50 / p99 / p99.9 (max): to the device ", text(spread_of(out_us)), ", back ",
          text(spread_of(in_us)), ", both ", text(round), "; ", ticks, " ticks, ", lost, " lost, ",
          bad + device.bad, " bad");
  CHECK(bad + device.bad == 0);
  CHECK(lost <= ticks / 50);  // by a machine that takes the core
  CHECK(round.p50 > 0);
  CHECK(round.p50 < 300);
}

}  // namespace

TEST_CASE("libusb and hidapi through FUSE: a command and its answer cost far less than a frame") {
  const int ticks = kerf::test::timing_ticks();
  const auto real_time = [] { static_cast<void>(kerf::make_real_time(82, -1)); };
  EchoDevice<FalconWire> falcon(ticks);
  kerf::test::ServedNode<kerf::UsbfsNode> usb("usb", real_time,
                                              kerf::FtdiFalcon::Settings{.firmware_runs = true},
                                              std::vector<kerf::ScriptedUsbFault>{}, falcon);
  measure("usb:", falcon, usb, ticks);
  EchoDevice<WoodenWire> arm(ticks);
  kerf::test::ServedNode<kerf::HidrawNode> hid("hidraw0", real_time, kerf::WoodenHid::Settings{},
                                               arm);
  measure("hid:", arm, hid, ticks);
}

}  // namespace kerf::usb_timing_test
