// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "lab/run/lab_run.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/text.hpp"
#include "tests/studies/bridge/measurements.hpp"
#include "tests/studies/bridge/two_machines.hpp"
#include "tests/studies/study_commands.hpp"

namespace kerf::two_machines {
namespace {

constexpr std::int32_t kAllLayers = 21, kFewLayers = 4;
constexpr int kPublishPairs = 9;  // so that a sign is one: all larger by chance, 1 in 512
const std::vector<std::string> kParts{"all", "links", "kills", "stopped", "publish", "crowd"};

/// A figure beside its goal: "0.14 (0.2)", and an exclamation mark if it is missed.
[[nodiscard]] std::string beside_goal(double value, double goal, const char* pattern) {
  const std::string text = format(pattern, value);
  if (goal == 0) return text;
  return text + " (" + page_number(goal) + ")" + (value > goal ? " !" : "");
}

/// Of a core, a viewer with TLS whose tool is slow.
constexpr double kServeGoalPercent = 3;

[[nodiscard]] std::string line_of(const Case& what, const CaseResult& r) {
  return "| " + what.name + " | " + beside_goal(r.join_s, what.join_goal_s, "%.2f") + " | " +
         format("%.0f", r.age_p50_ms) + " | " +
         beside_goal(r.age_p99_ms, what.age_goal_ms, "%.0f") + " | " +
         format("%.0f | %.0f | %.2f | ", r.age_max_ms, r.near_p99_ms, r.link_mbit) +
         beside_goal(r.serve_cpu_percent, what.load == Load::slow ? kServeGoalPercent : 0, "%.1f") +
         format(" | %.1f | %.0f | %.0f | %s |", r.join_cpu_percent, r.serve_mib, r.join_mib,
                r.equal ? "yes" : "NO");
}

/// All measurements of a run, as on the page; returns false if a volume was not the near one's.
class Table {
 public:
  Table(std::ostream& out, const BridgeFiles& files, double seconds, bool quick, std::uint64_t seed)
      : out_(out), files_(files), seconds_(seconds), quick_(quick), seed_(seed) {}

  /// Those with `part` in their names.
  void links(const std::string& part) {
    tell(
        "| link | join s (goal) | age p50 ms | p99 (goal) | max | near p99 | Mbit/s | serve % of a "
        "core (goal) | join % | serve MiB | join MiB | equal |");
    tell("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---|");
    for (const Case& what : quick_ ? quick_cases() : table_cases()) {
      if (what.name.find(part) == std::string::npos) continue;
      Case seeded = what;
      seeded.link.seed = seed_;
      const CaseResult result = run_case(seeded, files_, seconds_);
      held_ = held_ && result.equal;
      tell(line_of(what, result));
    }
    tell("");
  }

  void kills() {
    struct Kind {
      Killed side;
      const char* words;
      int times, few;
    };
    for (const auto& [side, words, all, few] : {
             Kind{Killed::serve, "serve killed", 20, 2},
             Kind{Killed::join, "join killed", 20, 2},
             Kind{Killed::cable, "cable pulled for 3 s", 5, 1},
             Kind{Killed::interface, "interface down for 3 s, of each machine by turns", 6, 2},
         }) {
      const int times = quick_ ? few : all;
      const KillResult result = run_kills(files_, side, times, layers(), seed_);
      held_ = held_ && result.kills == times && result.equal == times;
      tell(format("* %s: %d of %d times equal by hash within 2 s, the slowest after %.2f s", words,
                  result.equal, result.kills, result.slowest_s));
    }
  }

  void stopped() {
    const double seconds = quick_ ? 2 : 10;
    const StoppedResult result = run_stopped(files_, seconds, layers());
    held_ = held_ && result.equal;
    tell(
        format("* one viewer stopped for %.0f s: age at the other p99 %.0f, max %.0f ms; the "
               "stopped one equal within 2 s: %s",
               seconds, result.other_p99_ms, result.other_max_ms, result.equal ? "yes" : "NO"));
  }

  void publish() {
    const PublishResult r = run_publish(files_, 4 * seconds_, kPublishPairs, layers());
    held_ = held_ && r.pairs == kPublishPairs;
    const auto both = [](const PublishResult::Spread& alone, const PublishResult::Spread& bridged) {
      return format("%.1f (%.1f to %.1f) without and %.1f (%.1f to %.1f) with it", alone.median,
                    alone.least, alone.most, bridged.median, bridged.least, bridged.most);
    };
    tell(format("* publishing a tick, us, %d pairs of turns without and with a bridge and its "
                "viewer, median (least to most): p50 ",
                r.pairs) +
         both(r.alone_p50, r.bridged_p50) + "; p99 " + both(r.alone_p99, r.bridged_p99) +
         format("; p99 larger with it in %d of %d pairs", r.slower, r.pairs));
  }

  void crowd() {
    for (const int viewers : quick_ ? std::vector{3} : std::vector{2, 10}) {
      const CrowdResult r = run_crowd(files_, viewers, seconds_, layers());
      held_ = held_ && r.equal == viewers;
      tell(
          format("* %d viewers: worst age p99 %.0f ms; serve %.1f %% of a core and %.0f MiB in "
                 "all; %d equal",
                 viewers, r.worst_p99_ms, r.serve_cpu_percent, r.serve_mib, r.equal));
    }
  }

  [[nodiscard]] bool held() const { return held_; }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  [[nodiscard]] std::int32_t layers() const { return quick_ ? kFewLayers : kAllLayers; }
  void tell(const std::string& line) {
    out_ << line << std::endl;
    text_ += line + "\n";
  }

  std::ostream& out_;
  const BridgeFiles& files_;
  double seconds_;
  bool quick_;
  std::uint64_t seed_;
  bool held_ = true;
  std::string text_;
};

/// `kerf-studies bridge`, which `./kerf bench bridge` is: how late the picture on a second machine
/// is, over links that lose, delay and throttle packets, and its cost.
class TwoMachinesCommand final : public LabCommand {
 public:
  explicit TwoMachinesCommand(Arguments& program);
  /// 77 if this machine forbids network namespaces.
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  double seconds_ = 15;
  std::uint64_t seed_ = 1;
  bool quick_ = false;
  std::string only_, link_;
  std::string page_;
};

TwoMachinesCommand::TwoMachinesCommand(Arguments& program)
    : LabCommand(program, "bridge", "the picture on a second machine, over good and bad links") {
  app_.option("--seconds", seconds_, "that a link is looked at").within(1, 3600).shows_default();
  app_.option("--seed", seed_, "of the packets that are lost").shows_default();
  app_.option("--only", only_, "links, kills, stopped, publish or crowd")
      .one_of(kParts)
      .shown_as("PART [all]");
  app_.option("--link", link_, "of the links only those with this in their names")
      .shown_as("TEXT [any]");
  app_.flag("--quick", quick_, "few and small, and no publishing times");
  app_.option("--page", page_, "write the table into this page").shown_as("FILE");
  app_.footer(
      "Exit codes: 0 fine, 1 the far volume was not the near one's, 2 bad input or set-up, 77 "
      "this\n"
      "machine forbids network namespaces or TUN devices.");
}

int TwoMachinesCommand::run(std::ostream& out) const {
  const LabOutput page("--page", page_, ".md");
  try {
    enter_user_namespace();
    static_cast<void>(TwoNetworks({}));  // all that is forbidden shows now
  } catch (const NoNamespaces& reason) {
    out << "bridge: skipped: " << reason.what() << '\n';
    return kSkipped;
  }
  catch_stop_signals();
  const WorkFolder folder;
  const BridgeFiles files(folder.path());
  Table table(out, files, quick_ ? 1 : seconds_, quick_, seed_);
  const auto wanted = [this](const char* part) {
    return only_.empty() || only_ == "all" || only_ == part;
  };
  if (wanted("links")) table.links(link_);
  if (wanted("kills")) table.kills();
  if (wanted("stopped")) table.stopped();
  if (wanted("publish") && !quick_) table.publish();
  if (wanted("crowd")) table.crowd();
  page.write_part("bridge", table.text() + "\n" + lab_provenance() + "\n", out);
  return table.held() ? 0 : 1;
}

}  // namespace
}  // namespace kerf::two_machines

std::unique_ptr<kerf::LabCommand> kerf::make_bridge_command(Arguments& program) {
  return std::make_unique<two_machines::TwoMachinesCommand>(program);
}
