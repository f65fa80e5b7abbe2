// SPDX-License-Identifier: Apache-2.0
#include "lab/commands/cell_run.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <deque>
#include <map>
#include <sstream>
#include <string_view>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "controller/plan/plan_device.hpp"
#include "controller/stability/limit_cycle.hpp"
#include "hil/hil_error.hpp"
#include "lab/run/child_process.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/program.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/layout.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::sweep {
namespace {

using Lines = std::map<std::string, std::string>;
using Clock = std::chrono::steady_clock;

constexpr auto kLook = std::chrono::milliseconds(2);
constexpr auto kLongestRun = std::chrono::minutes(30);  // a run that is stuck must not stop all
constexpr auto kGrace = std::chrono::seconds(5);        // the emulator ends with its client

/// `name=value` of each line.
Lines lines_of(const std::string& text) {
  Lines lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    const std::size_t equals = line.find('=');
    if (equals != line.npos) lines[line.substr(0, equals)] = line.substr(equals + 1);
  }
  return lines;
}

/// The last value of a key of the scene in the settings of a run, without quotes; empty: none.
std::string setting_of(const CellJob& job, const std::string& key) {
  std::string value;
  for (const std::string& setting : job.settings) {
    if (setting.starts_with(key + "=")) value = setting.substr(key.size() + 1);
  }
  std::erase_if(value, [](char c) { return c == '"' || c == '\'' || c == ' '; });
  return value;
}

/// The device of a run: the job's, or that of its settings.
std::string device_of(const CellJob& job) {
  if (!job.device.empty()) return job.device;
  const std::string set = setting_of(job, "device.personality");
  return set.empty() ? "omni" : set;
}

/// The verdict of `LimitCycleDetector` on the contacts of a run of the whole servo, tick by tick.
///
/// A detector watches for `kSeconds`; one begins every `kApartS` while the tool touches, so that
/// one lies completely in each hold of the hand of 0.6 s or more. Its coordinate is the
/// penetration, 0 in air: a tool that jumps off the solid swings too. Its energy is -1 times the
/// least energy of the port so far: a spring that returns what the hand stored gives none.
class ContactSwing {
 public:
  static constexpr double kSeconds = 0.5, kApartS = 0.1;

  /// `step_mm`: of the encoders, at the tip, in mm of the scene.
  ContactSwing(double rate_hz, double step_mm)
      : ticks_(static_cast<std::int64_t>(kSeconds * rate_hz)),
        apart_(static_cast<std::uint64_t>(kApartS * rate_hz)),
        step_mm_(step_mm) {}

  /// Once per tick, in order.
  void take(const TickRecord& record) {
    constexpr std::uint32_t kTouches = kFlagContact | kFlagStarted;
    if ((record.flags & kTouches) == kTouches && record.tick >= next_tick_) {
      // `settled` is the whole length, so that no watch ends early.
      watches_.emplace_back(LimitCycleDetector::Ticks{ticks_, ticks_, ticks_}, step_mm_, kPushN);
      next_tick_ = record.tick + std::max<std::uint64_t>(1, apart_);
    }
    constexpr double kMjPerJ = 1000;
    const double tip_mm = -double{record.penetration_mm};
    const double given_mj = -record.port_minimum_j * kMjPerJ;
    std::erase_if(watches_, [&](LimitCycleDetector& watch) {
      if (!watch.take(tip_mm, given_mj, false)) return false;
      add(watch.verdict());
      return true;
    });
  }

  /// `swings`, `active`, `rest` or `undecided`, as docs/scenes.md has them; empty without a
  /// verdict.
  [[nodiscard]] const char* word() const {
    if (swings_) return "swings";
    if (active_) return "active";
    if (rests_) return "rest";
    return undecided_ ? "undecided" : "";
  }

 private:
  static constexpr double kPushN = 0.5;  ///< as of a map of stability

  void add(const LimitCycle& verdict) {
    swings_ = swings_ || verdict.swings;
    active_ = active_ || verdict.active;
    undecided_ = undecided_ || verdict.undecided;
    rests_ = rests_ || verdict.rests();
  }

  std::int64_t ticks_;
  std::uint64_t apart_;
  double step_mm_;
  std::uint64_t next_tick_ = 0;
  std::deque<LimitCycleDetector> watches_;
  bool swings_ = false, active_ = false, undecided_ = false, rests_ = false;
};

/// Reads every tick of a run in lock-step: the controller waits at a FIFO until the ring of ticks
/// has room again, so that no run depends on the speed of this process.
class TickFollower {
 public:
  /// Makes the FIFO `--until`. Throws `HilError`.
  TickFollower(std::string name, const std::filesystem::path& fifo, Personality device)
      : name_(std::move(name)), step_mm_(2 * device_parts::tip_noise_mm(device)) {
    if (mkfifo(fifo.c_str(), S_IRUSR | S_IWUSR) == 0) {
      fifo_ = OwnedFd(open(fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    }
    if (fifo_.get() < 0) throw HilError(fifo.string() + ": no FIFO can be made; set TMPDIR");
  }

  /// Reads the ticks that are there, and allows the next ones.
  void poll() {
    if (!run_ && !connect()) return;
    const SegmentReader& reader = run_->reader();
    TickRecord record;
    while (next_ < reader.state_head() && reader.state_at(next_, record) == ReadState::ok) {
      swing_->take(record);
      ++next_;
    }
    const std::uint64_t allowed = next_ + reader.info().state_slots / 2;
    if (allowed < allowed_ + reader.info().state_slots / 8) return;
    allowed_ = allowed;
    static_cast<void>(!write(fifo_.get(), &allowed_, sizeof allowed_));
  }

  [[nodiscard]] std::string swing() const { return swing_ ? swing_->word() : ""; }

 private:
  bool connect() {
    try {
      run_.emplace(connect_segment(name_));
    } catch (const SegmentError&) {
      return false;
    }
    const SegmentInfo& info = run_->reader().info();
    const Json scene = Json::parse(info.scene_json);
    const double scale = scene.at("device").at("workspace_scale").get<double>();
    swing_.emplace(static_cast<double>(kNsPerSecond) / info.tick_ns, step_mm_ * scale);
    return true;
  }

  std::string name_;
  double step_mm_;  ///< of the encoders, at the device
  OwnedFd fifo_;
  std::optional<SegmentConnection> run_;
  std::optional<ContactSwing> swing_;
  std::uint64_t next_ = 0, allowed_ = 0;
};

std::vector<std::string> emulator(const CellJob& job, std::vector<std::string> more) {
  std::vector<std::string> line{program_beside("emulator"), "--personality", device_of(job)};
  line.insert(line.end(), job.emulator_options.begin(), job.emulator_options.end());
  line.insert(line.end(), more.begin(), more.end());
  return line;
}

/// Waits for the end of `child`; its exit code, or empty if `stop` came first.
std::optional<int> end_of(Child& child, const std::atomic<bool>& stop, Clock::duration patience) {
  for (const auto end = Clock::now() + patience; Clock::now() < end;) {
    if (stop) return std::nullopt;
    if (const auto code = child.ended()) return code;
    std::this_thread::sleep_for(kLook);
  }
  child.signal(SIGKILL);
  while (!child.ended()) std::this_thread::sleep_for(kLook);
  return child.ended();
}

/// One value of a report as the table has it.
std::string cell_text(const Json& report, const std::string& name) {
  if (!report.contains(name)) return "";
  const Json& value = report.at(name);
  if (value.is_text()) return value.get<std::string>();
  return value.is_fraction() ? number_text(value.get<double>())
                             : std::to_string(value.get<std::uint64_t>());
}

/// Packets and readings that the emulator's fault script changed.
std::string changed_by_faults(const Json& report, const std::string& name) {
  if (!report.contains(name)) return "";
  std::uint64_t changed = 0;
  for (const Json& fault : report.at(name)) {
    changed += fault.at("changed").get<std::uint64_t>();
  }
  return std::to_string(changed);
}

/// Work at the device port of one source; the name is `SOURCE_j`.
std::string energy_of_source(const Json& report, const std::string& name) {
  constexpr const char* kSources = "energy_by_source_j";
  if (!report.contains(kSources)) return "";
  return cell_text(report.at(kSources), name.substr(0, name.rfind('_')));
}

struct Column {
  std::string name;
  bool of_emulator;
  std::string (*text)(const Json& report, const std::string& name) = cell_text;
};
constexpr const char* kSwingColumn = "swing";

const std::vector<Column>& columns() {
  static const std::vector<Column> kColumns = [] {
    std::vector<Column> all{
        {"ticks", false},       {"contact_ticks", false}, {"shaft_ticks", false},
        {"stale_ticks", false}, {"lost_packets", false},  {"peak_force_n", false},
        {"removed_mm3", false}, {"energy_j", false},      {"port_minimum_j", false},
    };
    for (const std::string_view source : kEnergySourceNames) {
      all.push_back({std::string(source) + "_j", false, energy_of_source});
    }
    const std::vector<Column> rest{
        {kSwingColumn, false},  // not in the report: added by this program
        {"fault_count", false}, {"config_hash", false},       {"volume_hash", false},
        {"output_hash", false}, {"peak_motor_force_n", true}, {"injected", true, changed_by_faults},
    };
    all.insert(all.end(), rest.begin(), rest.end());
    return all;
  }();
  return kColumns;
}

CellResult result_of(int exit, const std::filesystem::path& folder, const std::string& last_line,
                     const std::string& swing = "") {
  CellResult result{exit, {}, exit == 0 ? "" : last_line};
  try {
    const auto report = [&](const char* name) {
      const std::string text = text_in(folder / name);
      return text.empty() ? Json(Json::Members{}) : Json::parse(text);
    };
    Json ours = report("report.json");
    const Json theirs = report("emulator.json");
    ours[kSwingColumn] = swing;
    for (const Column& column : columns()) {
      result.values.push_back(column.text(column.of_emulator ? theirs : ours, column.name));
    }
    if (exit == 1) {
      result.message = cell_text(ours, "end");
      for (const Json& fault : ours.at("faults")) result.message += "; " + cell_text(fault, "name");
    }
  } catch (const JsonError&) {
    result.values.assign(columns().size(), "");
    if (result.message.empty()) result.message = "report.json: cannot be read; look at the disk";
  }
  if (exit != 0 && result.message.empty()) {
    result.message = exit > 128 ? "ended by signal " + std::to_string(exit - 128)
                                : "ended with exit code " + std::to_string(exit);
  }
  return result;
}

/// Command line of the controller of a cell.
std::vector<std::string> controller_command(const CellJob& job,
                                            const std::filesystem::path& folder) {
  const auto at = [&](const char* name) { return (folder / name).string(); };
  std::vector<std::string> words{program_beside("controller"), "--scene", job.scene};
  for (const std::string& setting : job.settings) {
    words.insert(words.end(), {"--set", setting});
  }
  words.insert(words.end(),
               {"--device", device_of(job), "--port", "socket:" + at("device"), "--seconds",
                number_text(job.seconds), "--name", job.name, "--virtual", "--until", at("until"),
                "--emulator-args", at("told"), "--report", at("report.json")});
  if (setting_of(job, "device.torque_scale").empty()) {
    // The emulated motors are known; a scene says nothing of them, because a real device's are not.
    words.insert(words.end(),
                 {"--torque-scale", lines_of(text_in(folder / "describe"))["torque_scale"]});
  }
  return words;
}

/// Command line of the emulator, with the settings that the controller wrote to the file `told`.
std::vector<std::string> emulator_command(const CellJob& job, const std::filesystem::path& folder) {
  Lines told = lines_of(text_in(folder / "told"));
  std::string& hand = told["hand_script"];
  if (hand.empty()) hand = find_data_file("scenes/hands/cut_cavity.toml");  // as the demo
  std::vector<std::string> words{"--front",
                                 "socket",
                                 "--socket",
                                 (folder / "device").string(),
                                 "--hand",
                                 hand,
                                 "--unit-mm",
                                 told["hand_unit_mm"],
                                 "--lockstep",
                                 "--rate",
                                 told["rate_hz"],
                                 "--report",
                                 (folder / "emulator.json").string()};
  if (const std::string identified = told["identified"]; !identified.empty()) {
    words.insert(words.end(), {"--identified", identified});
  }
  return emulator(job, words);
}

}  // namespace

const std::vector<std::string>& result_columns() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> list;
    for (const Column& column : columns()) list.push_back(column.name);
    return list;
  }();
  return kNames;
}

std::string emulator_refusal(const CellJob& job, const std::filesystem::path& folder,
                             const std::atomic<bool>& stop) {
  Child described(emulator(job, {"--describe"}), folder / "describe");
  return end_of(described, stop, kGrace).value_or(0) == 0 ? "" : described.last_line();
}

std::optional<CellResult> run_cell(const CellJob& job, const std::filesystem::path& folder,
                                   const std::atomic<bool>& stop) {
  Child described(emulator(job, {"--describe"}), folder / "describe");
  const auto known = end_of(described, stop, kGrace);
  if (!known) return std::nullopt;
  if (*known != 0) return result_of(*known, folder, described.last_line());

  // A word that is no device's is refused by the programs.
  const Personality personality = personality_of(device_of(job)).value_or(Personality{});
  TickFollower ticks(job.name, folder / "until", personality);
  Child controller(controller_command(job, folder), folder / "controller");
  while (!std::filesystem::exists(folder / "told")) {
    if (stop) return std::nullopt;
    if (const auto code = controller.ended()) {
      return result_of(*code, folder, controller.last_line());
    }
    std::this_thread::sleep_for(kLook);
  }
  Child device(emulator_command(job, folder), folder / "emulator");
  const auto end = Clock::now() + kLongestRun;
  while (!controller.ended() && device.ended().value_or(0) == 0 && Clock::now() < end) {
    if (stop) return std::nullopt;
    ticks.poll();
    std::this_thread::sleep_for(kLook);
  }
  ticks.poll();
  if (!controller.ended()) {
    const auto refused = device.ended();
    controller.signal(SIGKILL);
    return result_of(
        refused.value_or(2), folder,
        refused ? device.last_line() : "kerf-controller: no end after 30 minutes; killed");
  }
  if (!end_of(device, stop, kGrace)) return std::nullopt;
  return result_of(*controller.ended(), folder, controller.last_line(), ticks.swing());
}

}  // namespace kerf::sweep
