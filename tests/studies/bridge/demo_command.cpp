// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iosfwd>
#include <iterator>
#include <memory>
#include <ostream>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hil/hil_error.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "tests/studies/bridge/two_machines.hpp"
#include "tests/studies/study_commands.hpp"

namespace kerf::two_machines {
namespace {

using Side = TwoNetworks::Side;
using std::chrono::seconds;
using sweep::Child;
using sweep::program_beside;

constexpr int kPictures = 12;
constexpr const char* kFarName = "far";

/// The value of `name=value`, a line of `text`; empty if there is none.
[[nodiscard]] std::string value_in(const std::string& text, const std::string& name) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(name + "=")) return line.substr(name.size() + 1);
  }
  return "";
}

/// Waits until `there` holds, `child` has ended, or it took too long; true: it holds.
template <class Condition>
bool wait_for(Child& child, seconds patience, Condition there) {
  for (const auto end = std::chrono::steady_clock::now() + patience;
       std::chrono::steady_clock::now() < end;) {
    if (there()) return true;
    if (child.ended()) return there();
    pause(std::chrono::milliseconds(5));
  }
  return false;
}

/// Waits until `child` has ended or it took too long, also after a signal.
void let_end(Child& child, seconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!child.ended() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

[[nodiscard]] bool has_display() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread writes the environment
  return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
}

/// What a demo shows, and where its results stay.
struct DemoOptions {
  std::string scene = "scenes/phantom.toml";
  std::string device = "omni";
  std::string hand;  ///< script of the hand; empty: the scene's
  double seconds = 10;
  std::string size;       ///< of the pictures; empty: 640x480, or what suits a window's screen
  std::string out;        ///< folder of the results; empty: none are kept
  bool headless = false;  ///< no window, though there is a display
  std::vector<std::string> controller_words, visualizer_words;  ///< more options of the programs
};

/// What runs on both machines, with its files in one folder.
class Demo {
 public:
  Demo(const LinkSettings& link, std::filesystem::path folder, const DemoOptions& options)
      : folder_(std::move(folder)),
        results_(options.out.empty() ? folder_ / "results" : std::filesystem::path(options.out)),
        options_(options),
        link_(link),
        networks_(link),
        files_(folder_) {
    std::filesystem::create_directories(results_);
  }

  void start_controller() {
    Child describe({program_beside("emulator"), "--personality", options_.device, "--describe"},
                   at("describe"));
    wait_for(describe, seconds(10), [&] { return describe.ended().has_value(); });
    std::vector<std::string> words{program_beside("controller"),
                                   "--scene",
                                   find_scene_file(options_.scene),
                                   "--device",
                                   options_.device,
                                   "--port",
                                   "socket:" + at("device"),
                                   "--torque-scale",
                                   value_in(text_in(at("describe")), "torque_scale"),
                                   "--seconds",
                                   number_text(options_.seconds),
                                   "--name",
                                   BridgePair::kNearName,
                                   "--emulator-args",
                                   at("told"),
                                   "--report",
                                   results_ / "report.json",
                                   "--final",
                                   results_ / "final.nrrd"};
    std::ranges::copy(options_.controller_words, std::back_inserter(words));
    controller_ = networks_.start(Side::near, words, at("controller.log"));
    const bool told =
        wait_for(*controller_, seconds(60), [&] { return std::filesystem::exists(at("told")); });
    if (!told) throw HilError(controller_->last_line());
    told_ = text_in(at("told"));
    if (options_.out.empty()) return;
    recorder_ = networks_.start(
        Side::near,
        {program_beside("recorder"), "--name", BridgePair::kNearName, "--out", results_ / "log"},
        at("recorder.log"));
  }

  void start_picture() {
    pair_ = std::make_unique<BridgePair>(networks_, files_, false);
    join_ = pair_->join(kFarName);
    std::vector<std::string> words{program_beside("visualizer"),
                                   "--name",
                                   kFarName,
                                   "--wait",
                                   "30",
                                   "--attached",
                                   at("attached"),
                                   "--out",
                                   results_};
    std::ranges::copy(options_.visualizer_words, std::back_inserter(words));
    window_ = has_display() && !options_.headless;
    if (!window_ || !options_.size.empty()) {
      words.insert(words.end(), {"--size", options_.size.empty() ? "640x480" : options_.size});
    }
    if (!window_) {
      const auto every = static_cast<long>(options_.seconds * rate_hz() / kPictures);
      for (const std::string& word :
           {std::string("--headless"), std::string("--frames"), std::to_string(kPictures),
            std::string("--every-ticks"), std::to_string(std::max(every, 1L)),
            std::string("--report"), (results_ / "visualizer.json").string()}) {
        words.push_back(word);
      }
    }
    visualizer_ = networks_.start(Side::far, words, at("visualizer.log"));
    // The controller waits 10 s for its device; a busy machine may need as long for a picture.
    constexpr auto kPatience = seconds(5);
    wait_for(*visualizer_, kPatience, [&] { return std::filesystem::exists(at("attached")); });
    if (visualizer_->ended()) {
      const std::string words = visualizer_->last_line();
      throw HilError(words.empty() ? join_->last_line() : words);
    }
  }

  void start_hand() {
    std::string hand = options_.hand.empty() ? value_in(told_, "hand_script") : options_.hand;
    if (hand.empty()) hand = find_data_file("scenes/hands/cut_cavity.toml");
    std::vector<std::string> words{program_beside("emulator"),
                                   "--personality",
                                   options_.device,
                                   "--front",
                                   "socket",
                                   "--socket",
                                   at("device"),
                                   "--hand",
                                   hand,
                                   "--unit-mm",
                                   value_in(told_, "hand_unit_mm"),
                                   "--report",
                                   results_ / "emulator.json"};
    constexpr int kBusCyclesHz = 8000, kUsualHz = 2000;  // as often as it looks for the host
    if (rate_hz() > kUsualHz) {
      words.emplace_back("--packet-cycles");
      words.push_back(std::to_string(static_cast<int>(kBusCyclesHz / rate_hz())));
    }
    emulator_ = networks_.start(Side::near, words, at("emulator.log"));
  }

  /// The controller's exit code; 1 if a part of the demo ended before its time, which is reported.
  /// A signal ends the hand's work, and all parts write their results.
  int wait_for_end() {
    while (!controller_->ended()) {
      for (const auto& [name, part] :
           {std::pair<const char*, Child*>{"kerf-bridge serve", &pair_->serve()},
            {"kerf-bridge join", join_.get()},
            {"kerf-visualizer", visualizer_.get()},
            {"kerf-recorder", recorder_.get()},
            {"kerf-emulator", emulator_.get()}}) {
        if (part == nullptr || !broken_.empty()) continue;
        if (part->ended().value_or(0) != 0) broken_ = end_of(name, *part);
      }
      if (!broken_.empty() || stop_requested()) controller_->signal(SIGTERM);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    const int code = *controller_->ended();
    if (broken_.empty() && code > 128) broken_ = end_of("kerf-controller", *controller_);
    if (!broken_.empty()) return 1;
    if (window_ || !has_joined()) visualizer_->signal(SIGTERM);
    let_end(*visualizer_, seconds(20));
    join_->signal(SIGTERM);
    let_end(*join_, seconds(5));
    let_end(*emulator_, seconds(5));
    if (recorder_) let_end(*recorder_, seconds(10));
    return code;
  }

  void tell(std::ostream& out) {
    out << text_in(at("controller.log"));
    out << "on the second machine:\n" << text_in(at("far.log"));
    if (!broken_.empty()) {
      out << "two machines: " << broken_ << '\n';
      return;
    }
    if (!has_joined()) {
      out << format(
          "two machines: no picture came over the link of --loss %g --delay-ms %g --mbit %g in the "
          "%g s of the run; give it a longer one (--seconds) or a better link\n",
          100 * link_.loss, link_.delay_ms, link_.mbit, options_.seconds);
      return;
    }
    if (visualizer_->ended() != 0) out << visualizer_->last_line() << '\n';
    if (window_) return;
    const std::string text = text_in(results_ / "visualizer.json");
    if (text.empty()) return;
    const Json report = Json::parse(text);
    const double wall_ms = report.at("wall_ms").at("p50").get<double>();
    out << format("%d pictures; the second machine could draw %.0f a second, all of each anew\n",
                  report.at("frames").get<int>(), wall_ms > 0 ? 1e3 / wall_ms : 0.0);
  }

  [[nodiscard]] bool has_picture() { return has_joined() && visualizer_->ended() == 0; }

 private:
  [[nodiscard]] bool has_joined() const {
    return text_in(at("far.log")).find("joined") != std::string::npos;
  }
  [[nodiscard]] std::string at(const char* name) const { return folder_ / name; }
  [[nodiscard]] double rate_hz() const {
    const double told_hz = std::strtod(value_in(told_, "rate_hz").c_str(), nullptr);
    return told_hz > 0 ? told_hz : 1000;
  }
  static std::string end_of(const char* name, Child& part) {
    const int code = part.ended().value_or(0);
    const std::string how = code > 128 ? " ended by signal " + std::to_string(code - 128)
                                       : " ended with exit code " + std::to_string(code);
    const std::string last = part.last_line();
    return name + how + (code > 128 || last.empty() ? "" : ": " + last);
  }

  std::filesystem::path folder_, results_;
  const DemoOptions& options_;
  LinkSettings link_;
  TwoNetworks networks_;
  BridgeFiles files_;
  std::string told_;
  bool window_ = false;
  std::string broken_;  ///< the part that ended before its time, and how; empty if none
  std::unique_ptr<BridgePair> pair_;
  std::unique_ptr<Child> controller_, recorder_, join_, visualizer_, emulator_;
};

/// `kerf-studies two-machines`, which `./kerf demo --two-machines` runs: controller, emulated
/// device and `kerf-bridge serve` on one machine, `join` and the visualizer on another, both of
/// them network namespaces of this one.
class DemoCommand final : public LabCommand {
 public:
  explicit DemoCommand(Arguments& program);
  /// The controller's exit code, 1 if the picture never came, 77 if this machine forbids
  /// network namespaces.
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  DemoOptions demo_;
  double loss_percent_ = 0, delay_ms_ = 0, mbit_ = 0;
};

DemoCommand::DemoCommand(Arguments& program)
    : LabCommand(program, "two-machines", "a demo whose picture is on a second machine") {
  app_.option("--scene", demo_.scene, "what is touched").shows_default();
  app_.option("--device", demo_.device, "that is emulated")
      .one_of({"omni", "falcon", "woodenhaptics"})
      .shows_default();
  app_.option("--hand", demo_.hand, "the script of the hand, in place of the scene's")
      .shown_as("FILE");
  app_.option("--seconds", demo_.seconds, "that the hand works").within(0.001, 1e6).shows_default();
  app_.option("--loss", loss_percent_, "of packets on the link, in %")
      .within(0, 50)
      .shows_default();
  app_.option("--delay-ms", delay_ms_, "of the link, each way").within(0, 2000).shows_default();
  app_.option("--mbit", mbit_, "rate of the link, Mbit/s; 0: no bound")
      .within(0, 100'000)
      .shows_default();
  app_.option("--size", demo_.size,
              "of the pictures (default: 640x480; a window: what suits its screen)")
      .shown_as("WxH");
  app_.option("--out", demo_.out, "keep pictures, report, log and final volume in this folder")
      .shown_as("DIR");
  app_.flag("--headless", demo_.headless, "no window, though there is a display");
  app_.option("--controller-word", demo_.controller_words, "one more word for kerf-controller")
      .one_each()
      .shown_as("WORD");
  app_.option("--visualizer-word", demo_.visualizer_words, "one more word for kerf-visualizer")
      .one_each()
      .shown_as("WORD");
  app_.footer(
      "Exit codes: 0 fine, 1 a check failed, 2 bad input or set-up, 77 this machine forbids "
      "network\n"
      "namespaces or TUN devices.");
}

int DemoCommand::run(std::ostream& out) const {
  try {
    enter_user_namespace();
    static_cast<void>(TwoNetworks({}));
  } catch (const NoNamespaces& reason) {
    out << "two machines: skipped: " << reason.what() << '\n';
    return kSkipped;
  }
  catch_stop_signals();
  const WorkFolder folder;
  Demo demo({.loss = loss_percent_ / 100, .delay_ms = delay_ms_, .mbit = mbit_}, folder.path(),
            demo_);
  demo.start_controller();
  demo.start_picture();
  demo.start_hand();
  const int code = demo.wait_for_end();
  demo.tell(out);
  return code != 0 ? code : demo.has_picture() ? 0 : 1;
}

}  // namespace
}  // namespace kerf::two_machines

std::unique_ptr<kerf::LabCommand> kerf::make_two_machines_command(Arguments& program) {
  return std::make_unique<two_machines::DemoCommand>(program);
}
