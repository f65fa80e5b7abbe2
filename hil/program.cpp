// SPDX-License-Identifier: Apache-2.0
#include "hil/program.hpp"

#include <cmath>
#include <optional>
#include <ostream>
#include <string>

#include <CLI/CLI.hpp>

#include "hil/emulator.hpp"
#include "hil/front/real_time.hpp"
#include "hil/front/seqpacket_server.hpp"
#include "hil/front/socket.hpp"
#include "hil/fuse_front.hpp"
#include "hil/hand_script_file.hpp"
#include "hil/hil_error.hpp"
#include "hil/run_report.hpp"

namespace kerf {
namespace {

constexpr double kMaxSeconds = 1e6;
constexpr double kMaxDropEvery = 1e9;

struct Options {
  std::string personality = "omni";
  std::string front = "socket";
  std::string socket;
  FuseFrontOptions fuse;
  std::string hand;
  std::optional<double> unit_mm;
  bool lockstep = false;
  int rate_hz = 1000;
  int packet_cycles = 4;
  int priority = 81;
  int cpu = -1;
  bool stay = false;
  double seconds = 0;
  std::int64_t drop_every = 0;
  double stop_after_s = 0;
  bool pot_noise = false;
  bool drop_torque = false;
  std::uint32_t seed = 1;
  std::string report;
};

/// A finite number from `low` to `high`; unlike CLI::Range it refuses "nan".
CLI::Validator between(double low, double high) {
  const auto refuse = [low, high](const std::string& text) {
    double value = 0;
    const bool inside = CLI::detail::lexical_cast(text, value) && value >= low && value <= high;
    return inside ? std::string()
                  : text + " is not from " + CLI::detail::to_string(low) + " to " +
                        CLI::detail::to_string(high);
  };
  return CLI::Validator(refuse, "", "");
}

void declare(CLI::App& app, Options& o) {
  app.set_version_flag("--version", "kerf-emulator " KERF_VERSION);
  app.add_option("--personality", o.personality, "which device to be: omni");
  app.add_option("--front", o.front, "how it is reached: socket or fuse");
  app.add_option("--socket", o.socket, "front socket: path of the SEQPACKET socket to serve");
  declare_fuse(app, o.fuse);
  app.add_option("--hand", o.hand, "hand script (TOML); none: the stylus stays in the inkwell");
  app.add_option("--unit-mm", o.unit_mm, "device mm per unit of the hand script")
      ->check(between(1e-3, 100.0));
  app.add_flag("--lockstep", o.lockstep, "no clock: one servo period per command received");
  app.add_option("--rate", o.rate_hz, "servo rate for --lockstep, Hz; must divide 8000")
      ->capture_default_str();
  app.add_option("--packet-cycles", o.packet_cycles, "bus cycles of 125 us per packet")
      ->check(between(1, 800))
      ->capture_default_str();
  app.add_option("--priority", o.priority, "SCHED_FIFO priority; 0 = none")
      ->check(between(0, 99))
      ->capture_default_str();
  app.add_option("--cpu", o.cpu, "core to run on (default: the last)")->check(between(0, 1023));
  app.add_flag("--stay", o.stay, "wait for another client when one leaves");
  app.add_option("--seconds", o.seconds, "device time to serve (default: no limit)")
      ->check(between(0.0, kMaxSeconds));
  app.add_option("--drop-every", o.drop_every, "fault: lose each n-th packet")
      ->check(between(0, kMaxDropEvery));
  app.add_option("--stop-after", o.stop_after_s, "fault: fall silent after so many seconds")
      ->check(between(0.0, kMaxSeconds));
  app.add_flag("--drop-torque", o.drop_torque,
               "motors let go when the host is silent for 0.1 s (default: hold)");
  app.add_flag("--pot-noise", o.pot_noise, "noise in the low bits of the gimbal pots");
  app.add_option("--seed", o.seed, "of the noise")->capture_default_str();
  app.add_option("--report", o.report, "write what was seen as JSON");
}

void check(const Options& o) {
  if (o.personality != "omni") {
    throw HilError("--personality: " + o.personality + " is not known; use omni");
  }
  if (o.front != "socket" && o.front != "fuse") {
    throw HilError("--front: " + o.front + " is not known; use socket or fuse");
  }
  if (o.front == "socket" && o.socket.empty()) {
    throw HilError("--socket: missing; give the path of the socket to serve");
  }
  if (o.rate_hz < 1 || omni::kBusCyclesPerSecond % o.rate_hz != 0) {
    throw HilError("--rate: " + std::to_string(o.rate_hz) +
                   " does not divide 8000; use 500, 1000, 2000, 4000 or 8000");
  }
  if (o.lockstep && (o.drop_every > 0 || o.stop_after_s > 0)) {
    throw HilError(
        "--lockstep: a lost packet would stop both sides for ever; use the faults in real time");
  }
}

std::int64_t cycles_of(double seconds) {
  return std::llround(seconds * omni::kBusCyclesPerSecond);
}

Emulator make_emulator(const Options& o) {
  OmniParams params;
  params.pot_noise = o.pot_noise;
  params.seed = o.seed;
  params.on_silence = o.drop_torque ? OnSilence::drop_torque : OnSilence::hold_torque;
  std::optional<HandScript> script;
  if (!o.hand.empty()) {
    script = read_hand_script(o.hand);
    if (o.unit_mm) script->unit_mm = *o.unit_mm;
  }
  return Emulator(params, script, {o.drop_every, cycles_of(o.stop_after_s)});
}

void serve(const Options& o, const std::atomic<bool>& stop, std::ostream& out, std::ostream& err) {
  if (!o.report.empty()) check_report(o.report);
  Emulator emulator = make_emulator(o);
  FrontStats stats;
  if (!o.lockstep) {
    const std::string missing = make_real_time(o.priority, o.cpu);
    if (!missing.empty()) err << "kerf-emulator: warning: " << missing << std::endl;
  }
  const ServeLimits limits{cycles_of(o.seconds), stop};
  if (o.front == "fuse") {
    const FirewireSettings settings = firewire_settings(o.fuse, o.lockstep ? o.rate_hz : 0);
    serve_fuse(o.fuse.mount, settings, emulator, limits, o.stay, stats, out);
  } else {
    SeqpacketServer server(o.socket);
    out << "kerf-emulator: omni at " << o.socket << std::endl;
    do {
      auto client = server.accept(stop);
      if (!client) break;
      if (o.lockstep) {
        serve_lockstep(*client, emulator, omni::kBusCyclesPerSecond / o.rate_hz, limits, stats);
      } else {
        serve_real_time(*client, emulator, o.packet_cycles, limits, stats);
      }
    } while (o.stay && !stop.load(std::memory_order_relaxed) &&
             (limits.cycles == 0 || stats.cycles < limits.cycles));
  }
  if (!o.report.empty()) write_run_report(o.report, emulator, stats);
}

}  // namespace

int run_emulator(int argc, const char* const* argv, const std::atomic<bool>& stop,
                 std::ostream& out, std::ostream& err) {
  Options options;
  CLI::App app("Is the haptic device: wire bytes, mechanics, hand and faults of a PHANTOM Omni.",
               "kerf-emulator");
  declare(app, options);
  try {
    app.parse(argc, argv);
    check(options);
    serve(options, stop, out, err);
    return 0;
  } catch (const CLI::Success& wanted) {  // --help, --version
    return app.exit(wanted, out, err);
  } catch (const CLI::ParseError& error) {
    err << "kerf-emulator: " << error.what() << "; see --help\n";
  } catch (const HilError& error) {
    err << "kerf-emulator: " << error.what() << '\n';
  }
  return 2;
}

}  // namespace kerf
