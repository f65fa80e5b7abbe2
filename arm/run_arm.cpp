// SPDX-License-Identifier: Apache-2.0
#include "arm/run_arm.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <ostream>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "arm/arm_error.hpp"
#include "arm/dhd_arm.hpp"
#include "arm/exchange.hpp"
#include "arm/hd_arm.hpp"
#include "arm/overseer.hpp"
#ifdef KERF_HAS_SERVICE
#include "arm/service_arm.hpp"
#endif
#include "shared/arm/arm_page.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/threads.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr const char* kProgram = "kerf-arm";

void declare(Arguments& app, ArmOptions& o) {
  app.option("--device", o.device,
             "touch: by libHD of OpenHaptics; omega: by libdrd of the SDK of "
             "Force Dimension; inverse3: by the Inverse Service of Haply")
      .one_of({"touch", "omega", "inverse3"})
      .required();
  app.option("--name", o.name,
             "name of the page; the controller's --port arm:NAME (default: the device's word)");
  app.option("--library", o.library,
             "file of the vendor's library (default: libHD.so; libdrd.so.3, else libdrd.so, as the "
             "loader finds them: LD_LIBRARY_PATH, ldconfig, /usr/lib)");
  app.option("--vendor-name", o.vendor_name, "touch: name of the device in the vendor's set-up")
      .shows_default();
  app.flag("--no-vendor-name", o.no_vendor_name, "touch: leave the choice to the library");
  app.option("--index", o.index, "omega: which of several, from 0 (default: the SDK's)")
      .within(0, 15);
  app.option("--rate", o.rate_hz,
             "frames a second; touch: 500, 1000 or as the device takes (default: the library's); "
             "omega: up to 4000 (default: 4000)")
      .within(ArmExchange::kSlowestHz, 4000);
  app.flag("--auto-init", o.auto_init,
           "omega: if it is not initialised, let the SDK do so, which MOVES THE ARM");
  app.option("--peak", o.peak_n,
             "omega: highest force in N; needed for another device of Force Dimension: what it "
             "gives continuously by its data sheet")
      .within(0.1, force_figures(Personality::omega).peak_n);
  app.option("--service", o.service,
             "inverse3: where its service listens, [HOST:]PORT (default: 127.0.0.1:10001)");
  app.option("--events", o.events,
             "inverse3: port of the service's events, 0: none (default: 10020 with the usual port)")
      .within(0, 65535);
  app.option("--park", o.park,
             "inverse3: name of the handle's parking button (default: c, or the only one)");
  app.option("--arm-id", o.arm_id, "inverse3: device_id of the arm, if the service has several");
  app.option("--handle", o.handle, "inverse3: device_id of the handle, if there are several");
  app.option("--priority", o.priority,
             "omega, inverse3: SCHED_FIFO priority of the thread of its frames, 0: none")
      .within(0, 98)
      .shows_default();
  app.option("--cpu", o.cpu, "omega, inverse3: core of that thread (default: the last one)")
      .within(0, 1023);
  app.option("--stall-ms", o.stall_ms, "a library without a frame for so long has failed")
      .within(50, 10'000)
      .shows_default();
  app.option("--opening-s", o.opening_s,
             "longest wait until the device is open (with --auto-init at least 60)")
      .within(0.1, 600)
      .shows_default();
  app.flag("--once", o.once, "end when the first controller has ended");
  app.option("--seconds", o.seconds, "end after so long (default: a signal ends it)");
  app.option("--report", o.report, "write what was seen as JSON");
}

// ---- what differs between the devices ----

std::unique_ptr<VendorArm> load_touch(const ArmOptions& o, ArmExchange& exchange,
                                      const std::atomic<bool>&) {
  return std::make_unique<HdArm>(HdArm::Options{.library = o.library,
                                                .has_name = !o.no_vendor_name,
                                                .device_name = o.vendor_name,
                                                .rate_hz = o.rate_hz},
                                 exchange);
}

constexpr int kUsualOmegaHz = 4000;

std::unique_ptr<VendorArm> load_omega(const ArmOptions& o, ArmExchange& exchange,
                                      const std::atomic<bool>&) {
  return std::make_unique<DhdArm>(
      DhdArm::Options{.library = o.library,
                      .index = o.index,
                      .rate_hz = o.rate_hz > 0 ? o.rate_hz : kUsualOmegaHz,
                      .is_peak_given = o.peak_n.has_value(),
                      .initializes = o.auto_init,
                      .priority = o.priority,
                      .core = o.cpu},
      exchange);
}

#ifdef KERF_HAS_SERVICE
/// An identifier of the service; empty if the option is not given.
inverse3::ShortText id_of(const char* option, const std::string& value) {
  const inverse3::ShortText text(value);
  if (value.empty() || text.is_plain()) return text;
  throw ArmError(std::string(option) + " " + escaped(value) +
                 ": no name of the service; take 1 to 47 letters, digits, '_', '-', '.' or ':'");
}

std::unique_ptr<VendorArm> load_inverse3(const ArmOptions& o, ArmExchange& exchange,
                                         const std::atomic<bool>& stop) {
  ServiceArm::Options options;
  options.service = parse_service(o.service);
  const bool is_usual = options.service.port == inverse3::kServicePort;
  options.event_port = static_cast<std::uint16_t>(o.events >= 0 ? o.events
                                                  : is_usual    ? inverse3::kEventPort
                                                                : 0);
  options.wanted = {.device_id = id_of("--arm-id", o.arm_id),
                    .park = id_of("--park", o.park),
                    .handle_id = id_of("--handle", o.handle)};
  options.patience_ms = static_cast<int>(o.opening_s * 1000);
  options.priority = o.priority;
  options.core = o.cpu;
  return std::make_unique<ServiceArm>(options, exchange, stop);
}
// An attempt to connect has five steps, and may begin when the patience is nearly over.
constexpr int kConnectingMs = 5 * ServiceArm::kConnectMs;
#else
std::unique_ptr<VendorArm> load_inverse3(const ArmOptions&, ArmExchange&,
                                         const std::atomic<bool>&) {
  throw ArmError(
      "--device inverse3: left out of this build; install libboost-dev, then ./kerf setup");
}
constexpr int kConnectingMs = 0;
#endif

struct ArmKind {
  Personality personality;
  int usual_hz;
  bool has_own_thread;  ///< kerf's, with a priority
  int steps_ms;         ///< in which its thread may be busy without a frame
  const char* opening;
  WatchWords words;
  std::unique_ptr<VendorArm> (*load)(const ArmOptions&, ArmExchange&, const std::atomic<bool>&);
};
constexpr ArmKind kArms[] = {
    {Personality::touch, 1000, false, 0, "the vendor's library opens the device", {}, load_touch},
    {Personality::omega,
     kUsualOmegaHz,
     true,
     0,
     "the vendor's library opens the device",
     {},
     load_omega},
    {Personality::inverse3,
     1000,
     true,
     2 * kConnectingMs,
     "the device's service is asked",
     {"the service", "kerf-arm", "; see what else this machine does",
      "; its service is given zero force; please report this"},
     load_inverse3}};

const ArmKind& kind_of(const ArmOptions& o) {
  return *std::ranges::find(kArms, o.personality, &ArmKind::personality);
}

void check_option_of(const ArmOptions& o, Personality device, const char* option, bool is_given) {
  if (!is_given || o.personality == device) return;
  const std::string word(word_of(device));
  const bool is_vowel = std::string_view("aeiou").find(word.front()) != std::string_view::npos;
  throw ArmError(std::string(option) + ": of " + (is_vowel ? "an " : "a ") + word +
                 "; leave it out");
}

void check(ArmOptions& o) {
  o.personality = std::ranges::find(kArms, o.device, [](const ArmKind& kind) {
                    return word_of(kind.personality);
                  })->personality;
  if (o.name.empty()) o.name = o.device;
  static_cast<void>(ArmPage::path_of(o.name));
  if (o.seconds && !(*o.seconds > 0 && *o.seconds < 1e7)) {
    throw ArmError("--seconds " + std::to_string(*o.seconds) + ": not a positive number; take 60");
  }
  check_option_of(o, Personality::touch, "--no-vendor-name", o.no_vendor_name);
  check_option_of(o, Personality::omega, "--auto-init", o.auto_init);
  check_option_of(o, Personality::omega, "--peak", o.peak_n.has_value());
  check_option_of(o, Personality::omega, "--index", o.index >= 0);
  check_option_of(o, Personality::inverse3, "--service", !o.service.empty());
  check_option_of(o, Personality::inverse3, "--events", o.events >= 0);
  check_option_of(o, Personality::inverse3, "--park", !o.park.empty());
  check_option_of(o, Personality::inverse3, "--arm-id", !o.arm_id.empty());
  check_option_of(o, Personality::inverse3, "--handle", !o.handle.empty());
  if (o.personality == Personality::inverse3 && (o.rate_hz > 0 || !o.library.empty())) {
    throw ArmError(std::string(o.rate_hz > 0 ? "--rate" : "--library") +
                   ": not of an inverse3, which has a service; leave it out");
  }
  constexpr double kMotionS = 60;
  if (o.auto_init) o.opening_s = std::max(o.opening_s, kMotionS);
  check_outputs({}, {{"--report", o.report, ".json"}});
}

int rate_of(const ArmOptions& o) {
  return o.rate_hz > 0 ? o.rate_hz : kind_of(o).usual_hz;
}

std::string model_of(const VendorArm& arm) {
  for (const auto& [name, value] : arm.facts()) {
    if (name == "model" && !value.empty()) return escaped(value);
  }
  return "a device without a name";
}

Json times_of(const Histogram& times) {
  return {{"count", times.count()},
          {"p50", times.percentile_us(0.5)},
          {"p99", times.percentile_us(0.99)},
          {"max", times.max_us()}};
}

/// Call after the frames have ended.
Json report_of(const ArmOptions& o, const VendorArm& arm, const ArmExchange& exchange,
               double seconds, const std::string& failure) {
  Json facts = Json::Members{};
  for (const auto& [name, value] : arm.facts()) facts[name] = value;
  Json errors = Json::Members{};
  for (const auto& [name, count] : arm.errors()) errors[name] = count;
  const ArmExchange::Counts& counts = exchange.counts();
  return {{"program", kProgram},
          {"version", KERF_VERSION},
          {"device", o.device},
          {"name", o.name},
          {"facts", facts},
          {"seconds", seconds},
          {"frames", exchange.frames()},
          {"frames_per_s", seconds > 0 ? static_cast<double>(exchange.frames()) / seconds : 0},
          {"reports", exchange.published()},
          {"unreadable", counts.unreadable},
          {"forced_frames", counts.forced},
          {"clamped_frames", counts.clamped},
          {"expired_commands", counts.expired},
          {"turn_us", times_of(counts.turn)},
          {"command_age_us", times_of(counts.command_age)},
          {"errors", errors},
          {"failure", failure.empty() ? Json(nullptr) : Json(failure)}};
}

void nap() {
  constexpr std::int64_t kNapNs = 5'000'000;
  sleep_until_ns(monotonic_ns() + kNapNs);
}

/// The parts of a run.
struct Run {
  const ArmOptions& options;
  const std::atomic<bool>& stop;
  std::ostream& out;
  ArmPageAdapter& page;
  ArmExchange& exchange;
  VendorArm& arm;
};

/// Waits for the first report, a failure or `stop`; after `opening_s` fails the exchange.
void await_first_report(const Run& run) {
  const std::int64_t give_up_ns =
      monotonic_ns() + std::llround(run.options.opening_s * kNsPerSecond);
  while (run.exchange.published() == 0 && run.exchange.failure() == 0 && !run.stop) {
    if (monotonic_ns() > give_up_ns) {
      run.exchange.fail(run.exchange.frames() == 0 ? std::uint32_t{ArmExchange::kSilent}
                                                   : std::uint32_t{ArmExchange::kUnreadable});
    }
    nap();
  }
}

/// Prints what the user has to do while the frames run. Returns on a failure, `stop`, the end of
/// `--seconds` or that of the only controller.
void serve(const Run& run, std::int64_t since_ns) {
  const char* told = "";
  bool had_controller = false;
  const bool is_once = run.options.once || run.exchange.in_lockstep();
  const auto is_over = [&] {
    const auto for_ns = static_cast<double>(monotonic_ns() - since_ns);
    if (run.options.seconds && for_ns > *run.options.seconds * kNsPerSecond) return true;
    if (!is_once) return false;
    const bool has_controller = run.page.has_controller();
    if (std::exchange(had_controller, had_controller || has_controller)) return !has_controller;
    return run.options.once && for_ns > run.options.opening_s * kNsPerSecond;
  };
  while (run.exchange.failure() == 0 && !run.stop && !is_over()) {
    const char* const notice = run.arm.notice();
    if (notice != told) {
      told = notice;
      if (notice[0] != 0) run.out << kProgram << ": " << notice << std::endl;
    }
    nap();
  }
}

/// Sets zero force, then ends the frames and closes the device. Returns the text of a failure, or
/// "".
std::string let_go(const Run& run, Overseer& overseer) {
  run.exchange.let_go();
  const std::uint32_t code = run.exchange.failure();
  const std::string failure = code != 0 ? one_line(run.arm.text_of(code)) : "";
  overseer.set_reason(failure);
  run.page.set_state(failure.empty() ? ArmState::closing : ArmState::failed,
                     failure.empty() ? "kerf-arm is asked to end" : failure);
  constexpr int kNaps = 40;  // ten times as long as the frames of zero force normally take
  for (int i = 0; i < kNaps && !run.exchange.finished(); ++i) nap();
  overseer.enter(Overseer::Phase::closing);
  run.arm.stop();
  run.arm.close();
  overseer.enter(Overseer::Phase::over);
  return failure;
}

/// Tries the priority on a separate thread, because the trial changes it.
void warn_of_priority(const ArmOptions& o, std::ostream& err) {
  if (!kind_of(o).has_own_thread || o.priority == 0) return;
  int error = 0;
  std::thread([&] { error = set_fifo(o.priority); }).join();
  if (error == 0) return;
  err << kProgram << ": warning: no right to SCHED_FIFO " << o.priority << " ("
      << std::generic_category().message(error)
      << "): frames may be milliseconds late; set an rtprio limit (./kerf doctor), or say "
         "--priority 0"
      << std::endl;
}

int serve_arm(const ArmOptions& o, const std::atomic<bool>& stop, std::ostream& out,
              std::ostream& err) {
  ArmPageAdapter page(o.name, o.personality, rate_of(o));
  const double peak_n = force_figures(o.personality).peak_n;
  ArmExchange exchange(page, std::min(peak_n, o.peak_n.value_or(peak_n)), rate_of(o));
  const ArmKind& kind = kind_of(o);
  Overseer overseer(kProgram, page, exchange,
                    {.opening_ms = static_cast<int>(o.opening_s * 1000) + kind.steps_ms,
                     .stall_ms = std::max(o.stall_ms, kind.steps_ms)},
                    kind.words);
  std::unique_ptr<VendorArm> arm;
  page.set_state(ArmState::starting, kind.opening);
  try {
    arm = kind.load(o, exchange, stop);
    arm->open();
    arm->start();
  } catch (const std::exception& error) {
    page.set_state(ArmState::failed, error.what());
    exchange.let_go();
    overseer.set_reason(error.what());
    overseer.enter(Overseer::Phase::closing);
    if (arm) arm->stop();
    if (arm) arm->close();
    throw;
  }
  warn_of_priority(o, err);
  for (const std::string& lack : arm->warnings()) {
    err << kProgram << ": warning: " << lack << std::endl;
  }
  const std::int64_t since_ns = monotonic_ns();
  overseer.enter(Overseer::Phase::frames);
  const Run run{o, stop, out, page, exchange, *arm};
  await_first_report(run);
  if (exchange.published() > 0 && exchange.failure() == 0) {
    page.set_state(ArmState::running, model_of(*arm));
    out << kProgram << ": " << o.device << " (" << model_of(*arm) << ") at arm:" << o.name
        << std::endl;
    serve(run, since_ns);
  }
  const std::string failure = let_go(run, overseer);
  const double seconds = static_cast<double>(monotonic_ns() - since_ns) / kNsPerSecond;
  if (!o.report.empty()) {
    write_new_file(o.report, report_of(o, *arm, exchange, seconds, failure).document());
  }
  if (!failure.empty()) throw ArmError(failure);
  return 0;
}

}  // namespace

int run_arm(int argc, const char* const* argv, const std::atomic<bool>& stop, std::ostream& out,
            std::ostream& err) {
  try {
    ArmOptions options;
    CommandLine app(
        "Connects a device to kerf by its vendor's library or service, which the user has "
        "installed.",
        kProgram, "kerf-arm " KERF_VERSION);
    declare(app, options);
    if (!app.parse(argc, argv, out)) return 0;
    check(options);
    return serve_arm(options, stop, out, err);
  } catch (...) {
    err << kProgram << ": " << failure_text() << std::endl;
    return 2;
  }
}

}  // namespace kerf
