// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/wait_state.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>

#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kPatienceNs = 1'000'000'000;
// A user who has parked the device knows what comes next; an emulated hand behind a vendor's
// library or service, which do not show when the servo is ready, takes it 2 s after the first
// packet.
constexpr std::int64_t kHandPatienceNs = 2'500'000'000;
constexpr std::size_t kKinds = 6;

constexpr std::array<const char*, kKinds> kWaits{"",
                                                 "waiting for the first report",
                                                 "waiting until homed",
                                                 "waiting until parked",
                                                 "waiting until at rest",
                                                 "waiting to be picked up"};

/// What the user does about each kind of waiting; an Omni needs no homing.
struct Deeds {
  Personality personality;
  std::array<const char*, kKinds> of_waiting;
};
constexpr std::array kDeeds{
    Deeds{Personality::omni,
          {"", "unplug it and plug it in again", "", "rest the stylus in the inkwell",
           "let go of the stylus in the inkwell", "take the stylus out of the inkwell"}},
    Deeds{
        Personality::falcon,
        {"", "load its firmware (docs/devices.md), or unplug it and plug it in again",
         "pull the grip all the way out, then push it in", "hold the grip's centre button, at rest",
         "hold the grip still, its centre button held", "let go of the grip's centre button"}},
    Deeds{Personality::woodenhaptics,
          {"", "unplug it and plug it in again", "hold the home pose, press its calibration button",
           "hold the home pose, press its calibration button", "hold the home pose still",
           "move the arm away from its home pose"}},
    Deeds{Personality::inverse3,
          {"", "start the vendor's service, and wake the handle",
           "hold the handle's parking button; if a line above names what is missing, see to that "
           "first",
           "hold the handle's parking button", "hold the handle still, its parking button held",
           "let go of the handle's parking button"}},
    Deeds{Personality::touch,
          {"", "start ./kerf arm, or unplug the device and plug it in again",
           "rest the stylus in the inkwell", "rest the stylus in the inkwell",
           "let go of the stylus in the inkwell", "take the stylus out of the inkwell"}},
    Deeds{Personality::omega,
          {"", "start ./kerf arm, or switch the device on", "initialise it with the vendor's tool",
           "hold its button, at rest", "hold the grip still, its button held",
           "let go of its button"}}};
static_assert(covers_devices(kDeeds));

}  // namespace

Waiting waiting_for(const DeviceReport& report, const ServoOutput& output) noexcept {
  switch (output.phase) {
    case Phase::off:
      return Waiting::report;
    case Phase::calibrating:
    case Phase::fault:
      if (!report.homed) return Waiting::homing;
      return report.parked ? Waiting::rest : Waiting::parked;
    case Phase::armed:
      return Waiting::hand;
    case Phase::ramping:
    case Phase::active:
      break;
  }
  return Waiting::nothing;
}

const char* action_for(Personality personality, Waiting waiting) noexcept {
  if (waiting == Waiting::gone) return "connect it again; the other one continues";
  return row_of(kDeeds, personality).of_waiting[static_cast<std::size_t>(waiting)];
}

std::string text_of(Personality personality, Waiting waiting) {
  if (waiting == Waiting::nothing) return "";
  const char* const what =
      waiting == Waiting::gone ? "the device went away" : kWaits[static_cast<std::size_t>(waiting)];
  return std::string(what) + ": " + action_for(personality, waiting);
}

std::string text_before_device(const std::string& port) {
  return "waiting for a device that answers at --port " + port;
}

void tell_stopped_early(const std::string& work) {
  std::printf("kerf: stopped before there was a device; %s\n", escaped(work).c_str());
}

bool WaitNotice::look(Waiting now, std::int64_t now_ns, std::int64_t servo_ns) noexcept {
  if (now == Waiting::nothing) told_ = 0;
  if (now != last_) {
    last_ = now;
    since_ns_ = now_ns;
    since_servo_ns_ = servo_ns;
  }
  const std::uint32_t bit = 1U << static_cast<unsigned>(now);
  const std::int64_t waited_ns = std::min(now_ns - since_ns_, servo_ns - since_servo_ns_);
  const std::int64_t patience_ns = now == Waiting::hand ? kHandPatienceNs : kPatienceNs;
  if (now == Waiting::nothing || waited_ns < patience_ns || (told_ & bit) != 0) return false;
  told_ |= bit;
  return true;
}

}  // namespace kerf
