// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <thread>

#include "controller/device/devices.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/loop/real_time.hpp"
#include "controller/loop/tick_source.hpp"
#include "controller/loop/wait_state.hpp"
#include "controller/servo/servo.hpp"
#include "shared/external/external_page.hpp"
#include "shared/numeric/statistics.hpp"
#include "shared/segment/pulp_heat.hpp"
#include "shared/segment/server.hpp"

// The loop around the servo step, its record of a run, and the watchdog that switches the motors
// off if the loop stops.

namespace kerf {

/// The first events of a run, in order, and the count of all. Fixed memory.
struct EventList {
  struct Event {
    std::uint64_t tick = 0;  ///< as in the segment and in the log
    const char* name = "";
  };

  void add(std::uint64_t tick, const char* name) noexcept {
    if (count < kMax) first[count] = {tick, name};
    ++count;
  }
  [[nodiscard]] std::span<const Event> kept() const noexcept {
    return std::span(first).first(std::min(count, kMax));
  }

  static constexpr std::size_t kMax = 64;
  std::array<Event, kMax> first{};
  std::size_t count = 0;  ///< may exceed kMax
};

/// Bits of `ServoOutput::forbidden_materials`.
inline constexpr std::size_t kMostForbidden = 64;

/// Statistics of one arm, from its own arming on.
struct ArmRecord {
  bool in_use = false;  ///< was armed and picked up
  std::uint64_t stale_ticks = 0;
  std::uint64_t contact_ticks = 0;
  std::uint64_t shaft_ticks = 0;  ///< shaft or handpiece touched
  double peak_force_n = 0;
  double sharpness = 1;        ///< of the bur that it holds at the end
  double absorbed_mj = 0;      ///< at the device port, + is taken from the hand
  double port_minimum_mj = 0;  ///< lowest value of it: below 0 the loop gave more than it took
  std::array<double, kEnergySources> energy_mj{};  ///< it by source
  std::uint64_t output_hash = 0;
  EventList faults;  ///< as they latched; one makes the run a failure
};

/// Statistics of a run. Fixed memory: the servo thread writes it, others read it after the end.
/// Inherits those of the first arm.
struct RunRecord : ArmRecord {
  ArmRecord second;                 ///< of the second arm, if there is one
  std::uint64_t ticks = 0;          ///< since an arm was armed; the counters below count these
  std::uint64_t armed_at_tick = 0;  ///< tick of the segment and of the log that was the first
  std::uint64_t overruns = 0;
  Histogram wake, compute, publish;
  std::int64_t first_force_ns = 0;  ///< time of the first sent force, CLOCK_MONOTONIC; 0: none
  std::array<std::uint64_t, kMaxVolumes> removed_steps{};       ///< by volume, since the last reset
  std::array<std::uint64_t, kMostForbidden> forbidden_ticks{};  ///< by material, since then too
  std::optional<PulpHeat> pulp;  ///< since then too; empty: the scene does not ask for it
  std::uint64_t resets = 0;      ///< of the volumes; before arming too
  std::uint64_t undos = 0;       ///< each restored the volumes before the last stroke
  std::uint64_t redos = 0;       ///< each repeated a stroke that was undone
  std::uint64_t allocations = 0;
  ThreadFaults faults_of_pages;

  EventList events;  ///< of the loop; the run went on after each

  void add_event(std::uint64_t tick, const char* name) noexcept { events.add(tick, name); }
  void add_fault(std::uint64_t tick, const char* name) noexcept { faults.add(tick, name); }
  [[nodiscard]] ArmRecord& arm(std::size_t index) noexcept { return index == 0 ? *this : second; }
  [[nodiscard]] const ArmRecord& arm(std::size_t index) const noexcept {
    return index == 0 ? *this : second;
  }
  [[nodiscard]] bool has_faults() const noexcept { return faults.count + second.faults.count > 0; }
};

/// Why the loop ended; `unexpected_call` is a stop by `--guard`.
enum class EndReason : std::uint8_t {
  ticks_done,
  stopped,
  device_gone,
  never_armed,
  unexpected_call
};

struct LoopLimits {
  std::uint64_t armed_ticks = UINT64_MAX;   ///< servo steps after arming
  std::uint64_t gone_ticks = 2000;          ///< without a report of any device: 2 s
  std::uint64_t arming_ticks = UINT64_MAX;  ///< patience for the first docking
};

/// State that the loop shares with other threads.
struct LoopSignals {
  std::atomic<bool>& stop;                    ///< set by a signal
  std::atomic<bool> stalled{false};           ///< the watchdog switched the motors off
  std::atomic<std::uint64_t> heartbeat{0};    ///< ticks so far, for the watchdog
  std::atomic<std::uint64_t> armed_ticks{0};  ///< for the progress bar
  /// Of each device, after the last tick.
  std::array<std::atomic<Waiting>, kMaxArms> waiting{Waiting::report, Waiting::report};
};

/// Before the step of a tick: who found that the servo has stood still, its watchdog, or the clock
/// if the watchdog stood still too; nullptr if it has not. The force then fades in again from 0
/// (`TickCommands::fade_in`).
inline const char* stall_before(LoopSignals& signals, bool stood_still) noexcept {
  if (signals.stalled.exchange(false, std::memory_order_relaxed)) return "watchdog";
  return stood_still ? "stood_still" : nullptr;
}

/// Sends the outputs of a tick, by arm. If the tick itself was the stall, they are dropped, and the
/// next one fades in.
inline void send_tick(std::span<const ServoOutput> outputs, const LoopSignals& signals,
                      const Devices& devices) noexcept {
  if (signals.stalled.load(std::memory_order_relaxed)) {
    devices.release();
    return;
  }
  for (std::size_t a = 0; a < outputs.size(); ++a) devices[a].command(outputs[a]);
}

/// The loop around the servo step: time, devices, step, devices, publication, statistics. Runs on
/// the calling thread until a limit is met or a stop is requested; the motors are off when it
/// returns. A device that goes away is a fault of its arm alone, and ends the run if no other is
/// left. `devices` has one for each arm of the servo. `external`: where a program gives the force,
/// in a scene of such a force.
EndReason run_servo(TickSource& clock, const Devices& devices, AnyServo& servo,
                    Publisher& publisher, SegmentServer& server, const LoopLimits& limits,
                    LoopSignals& signals, RunRecord& record,
                    ExternalPage* external = nullptr) noexcept;

inline constexpr std::chrono::milliseconds kWatchdogPeriod{5};

/// Checks from another thread that the servo still ticks. After a standstill of 20 ms the motors go
/// off, once per stall; the loop fades the force in again when it continues.
class Watchdog {
 public:
  Watchdog(const Devices& devices, LoopSignals& signals) noexcept
      : devices_(devices), signals_(signals) {}

  /// Call once per `kWatchdogPeriod`.
  void look(std::int64_t now_ns) noexcept {
    const std::uint64_t heartbeat = signals_.heartbeat.load(std::memory_order_relaxed);
    if (heartbeat != last_heartbeat_ || heartbeat == 0) {
      last_heartbeat_ = heartbeat;
      last_change_ns_ = now_ns;
      tripped_ = false;
      return;
    }
    if (tripped_ || now_ns - last_change_ns_ < kStandstillNs) return;
    static_cast<void>(devices_.release());
    tripped_ = true;
    ++trips_;
    signals_.stalled.store(true, std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t trips() const noexcept { return trips_; }

 private:
  Devices devices_;
  LoopSignals& signals_;
  std::uint64_t last_heartbeat_ = 0;
  std::int64_t last_change_ns_ = 0;
  bool tripped_ = false;
  std::uint64_t trips_ = 0;
};

/// Starts the thread that checks once per `kWatchdogPeriod`, until the jthread ends: above the
/// servo, so that the servo cannot block it, and on any core but the servo's, so that a load on
/// that core does not stop the watchdog too. With one core, or without the rights, as well as
/// possible.
[[nodiscard]] std::jthread start_watchdog(Watchdog& watchdog, const RealTimeOptions& servo);

}  // namespace kerf
