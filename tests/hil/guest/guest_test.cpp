// SPDX-License-Identifier: Apache-2.0
// Two runs of the guest (hil/guest): emulator below, a real kernel's USB and HID stack between, the
// controller with libusb and hidapi above. Time is virtual there, so bounds on time are exact.
#define DOCTEST_CONFIG_IMPLEMENT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "tests/json.hpp"
#include "tests/support/process.hpp"

namespace {

/// What a guest printed (hil/guest/init): a line begins with the device that it is about.
class GuestLog {
 public:
  explicit GuestLog(std::string text) : text_(std::move(text)) {
    std::istringstream in(text_);
    for (std::string line; std::getline(in, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();  // the terminal's
      lines_.push_back(line);
    }
  }

  [[nodiscard]] const std::string& text() const noexcept { return text_; }
  [[nodiscard]] const std::vector<std::string>& lines() const noexcept { return lines_; }

  /// The rests of the lines that begin with `words`.
  [[nodiscard]] std::vector<std::string> after(const std::string& words) const {
    std::vector<std::string> rests;
    for (const std::string& line : lines_) {
      if (line.starts_with(words + ' ')) rests.push_back(line.substr(words.size() + 1));
    }
    return rests;
  }
  /// The only such rest; empty if there is none or more than one.
  [[nodiscard]] std::string only(const std::string& words) const {
    const auto rests = after(words);
    return rests.size() == 1 ? rests.front() : std::string();
  }
  /// The JSON report of a program; null if it is not there or is no JSON.
  [[nodiscard]] kerf::test::ReadJson report(const std::string& device,
                                            const std::string& program) const {
    std::string text;
    for (const std::string& line : after(device + ' ' + program + " report")) text += line;
    try {
      return kerf::test::read_json(text);
    } catch (const kerf::JsonError&) {
      return {};
    }
  }

 private:
  std::string text_;
  std::vector<std::string> lines_;
};

constexpr int kSkipped = 77;
const std::filesystem::path kFolder = KERF_GUEST_FOLDER;

std::array<std::optional<GuestLog>, 2> logs;

/// One run of hil/guest/guest.sh with its own output.
struct Guest {
  explicit Guest(const std::string& name, std::vector<std::string> words)
      : output(kFolder / (name + ".txt")), process(arguments(std::move(words)), output) {}

  static std::vector<std::string> arguments(std::vector<std::string> words) {
    words.insert(words.begin(), KERF_GUEST);
    return words;
  }
  /// Its exit code; if not 0, its output is printed: "guest: REASON" if something is missing.
  int wait() {
    const int code = process.wait();
    const std::string text = process.output();
    const std::string_view from = "guest: ";
    if (code == kSkipped && text.starts_with(from)) {
      std::printf("skipped: %s", text.c_str() + from.size());
    } else if (code != 0) {
      std::printf("%s", text.c_str());
    }
    return code;
  }

  std::filesystem::path output;
  kerf::test::Process process;
};

/// Makes the image and boots it twice, side by side.
int run_guests() {
  std::filesystem::create_directories(kFolder);
  if (const int code = Guest("image", {"image", KERF_GUEST_BIN, kFolder}).wait(); code != 0) {
    return code;
  }
  const std::array<std::filesystem::path, 2> files{kFolder / "first.log", kFolder / "second.log"};
  std::array<std::unique_ptr<Guest>, 2> guests;
  for (std::size_t i = 0; i < guests.size(); ++i) {
    guests[i] =
        std::make_unique<Guest>("boot", std::vector<std::string>{"boot", kFolder, files[i]});
  }
  for (const auto& guest : guests) {
    if (const int code = guest->wait(); code != 0) return code;
  }
  for (std::size_t i = 0; i < files.size(); ++i) logs[i].emplace(kerf::test::text_of(files[i]));
  return 0;
}

/// The logs of two runs of the same guest.
const GuestLog& first_run() {
  return *logs[0];
}
const GuestLog& second_run() {
  return *logs[1];
}

constexpr const char* kDevices[] = {"falcon", "woodenhaptics"};

kerf::test::ReadJson controller_report(const std::string& device) {
  return first_run().report(device, "controller");
}
kerf::test::ReadJson emulator_report(const std::string& device) {
  return first_run().report(device, "emulator");
}

}  // namespace

TEST_CASE("guest: two runs print the same bytes: forces, latencies and the sums of all ticks") {
  const auto& first = first_run().lines();
  const auto& second = second_run().lines();
  const auto [a, b] = std::ranges::mismatch(first, second);
  CHECK_MESSAGE((a == first.end() && b == second.end()),
                "line " << a - first.begin() + 1 << ": " << (a == first.end() ? "(none)" : *a)
                        << " | " << (b == second.end() ? "(none)" : *b));
  CHECK(first_run().text() == second_run().text());
  for (const std::string device : kDevices) {
    CHECK(first_run().only(device + " ticks sha256").size() > 64);
  }
}

TEST_CASE("guest: every program ends well; no byte is bad, no packet lost, none a tick late") {
  for (const std::string device : kDevices) {
    CAPTURE(device);
    for (const char* program : {"controller", "emulator", "recorder"}) {
      CAPTURE(program);
      CHECK(first_run().only(device + ' ' + program + " exit") == "0");
    }
    const auto controller = controller_report(device);
    const auto emulator = emulator_report(device);
    CHECK(controller.value<std::string>("end", "") == "finished");
    CHECK(first_run().after(device + " tick").size() > 170);  // each tenth of 1700 and more
    for (const char* key : {"refused_packets", "lost_packets", "fault_count", "overruns",
                            "allocations", "minor_faults", "major_faults"}) {
      CAPTURE(key);
      CHECK(controller.value(key, -1) == 0);
    }
    CHECK(controller.value("guarded", false));
    CHECK(controller.value<std::string>("unexpected_call", "no report").empty());
    CHECK(emulator.value("commands_refused", -1) == 0);
    CHECK(emulator.value("packets_dropped", -1) == 0);
    CHECK(emulator.value("commands_received", 0) > 1700);
    // A device's steps of 1 ms lie to the ticks as they began. If both fall together a report comes
    // now before, now behind a tick, and host and Falcon take turns: at worst every other tick is
    // without an answer, never two in a row.
    const std::string gap = first_run().only(device + " longest gap");
    CHECK_MESSAGE((gap == "0 ticks" || gap == "1 ticks"), device << ": " << gap);
  }
}

TEST_CASE("guest: its log replays to the last bit") {
  for (const std::string device : kDevices) {
    CAPTURE(device);
    const std::string found = first_run().only(device + " replay exit");
    CHECK_MESSAGE(
        (found.starts_with("0 ") && found.ends_with(" ticks, each equal to the last bit")), found);
  }
}

TEST_CASE("guest: in virtual time a tick is over long before the next, on one core with the rest") {
  for (const std::string device : kDevices) {
    CAPTURE(device);
    const auto report = controller_report(device);
    REQUIRE(!report.is_null());
    const auto late_us = report["wake_us"]["max"].get<double>();
    const auto compute_us = report["compute_us"]["max"].get<double>();
    const auto publish_us = report["publish_us"]["max"].get<double>();
    CHECK(late_us > 0);
    CHECK(late_us < 200);
    // 220 to 280 us if no step of the emulator, 180 us and ahead of the servo on their one core,
    // falls into a tick; up to 540 if some fall into each of the three.
    CHECK(late_us + compute_us + publish_us < 750);
  }
}

TEST_CASE(
    "guest: the hand touches the tooth, and the motors give the force that the controller "
    "commanded") {
  for (const std::string device : kDevices) {
    CAPTURE(device);
    const auto controller = controller_report(device);
    const double commanded_n = controller.value("peak_force_n", 0.0);
    CHECK(controller.value("contact_ticks", 0) > 100);
    CHECK(commanded_n > 0.1);
    CHECK(commanded_n < 1);
    CHECK(controller.value("removed_mm3", 0.0) > 0);
    // By the emulator's own kinematics, from motor counts; a count of the coarser one is 3 mN.
    CHECK(std::abs(emulator_report(device).value("peak_motor_force_n", 0.0) - commanded_n) < 0.005);

    // tick, period error, execution, missed deadlines, stale, fault, counts of encoders and motors,
    // force, hash: in free air the motors are off, in the tooth at least one is on.
    bool pushed = false;
    for (const std::string& line : first_run().after(device + " tick")) {
      std::istringstream words(line);
      double tick = 0, late_ns = 0, execution_ns = 0, missed = 0, stale = 0, fault = 0;
      double encoder[3] = {}, motor[3] = {}, force_n[3] = {};
      words >> tick >> late_ns >> execution_ns >> missed >> stale >> fault;
      for (auto* counts : {encoder, motor, force_n}) {
        for (int i = 0; i < 3; ++i) words >> counts[i];
      }
      REQUIRE(words);
      CHECK(missed == 0);
      const double total_n = std::hypot(force_n[0], force_n[1], force_n[2]);
      const bool moves = motor[0] != 0 || motor[1] != 0 || motor[2] != 0;
      if (total_n == 0) CHECK_FALSE(moves);
      if (total_n > 0.1) CHECK(moves);
      pushed = pushed || (total_n > 0.1 && moves);
    }
    CHECK(pushed);
  }
}

TEST_CASE(
    "guest: hosts that ask as libnifalcon and libraw1394 do load firmware and share the bus") {
  const std::pair<const char*, const char*> lines[] = {
      {"nifalcon client exit", "0"},
      {"nifalcon before", "0"},
      {"nifalcon reads", "1"},
      {"nifalcon load", "ok"},
      {"nifalcon after", "1"},
      {"nifalcon exchanges", "500"},
      {"nifalcon closes with a read", "1"},
      {"nifalcon again", "1"},
      {"nifalcon emulator exit", "0"},
      {"raw1394 client exit", "0"},
      {"raw1394 local", "/fw0"},
      {"raw1394 nodes", "2"},
      {"raw1394 bus manager", "1"},
      {"raw1394 takes", "1 1"},
      {"raw1394 again takes", "0"},
      {"raw1394 left", "4000 7fffffff"},
      {"raw1394 resets", "1"},
      {"raw1394 after reset left", "4915 ffffffff"},
      {"raw1394 emulator exit", "0"},
  };
  for (const auto& [words, value] : lines) {
    CAPTURE(words);
    CHECK(first_run().only(words) == value);
  }
}

/// Skips with its reason, exit code 77, if QEMU, busybox or the kernel's package is missing.
int main(int argc, char** argv) {
  if (const int code = run_guests(); code != 0) {
    if (code != kSkipped) std::printf("hil/guest/guest.sh: exit code %d\n", code);
    return code;
  }
  doctest::Context context(argc, argv);
  return context.run();
}
