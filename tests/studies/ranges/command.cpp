// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <iosfwd>
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "controller/scene/scene_file.hpp"
#include "hil/hil_error.hpp"
#include "lab/run/grid_run.hpp"
#include "lab/run/lab_run.hpp"
#include "shared/posix/program.hpp"
#include "shared/text/json.hpp"
#include "tests/studies/ranges/extreme_rows.hpp"
#include "tests/studies/ranges/key_study.hpp"
#include "tests/studies/study_commands.hpp"

namespace kerf::ranges {
namespace {

/// The command that plays just this scene.
std::string command_of(const Broken& broken) {
  std::string line = "./kerf studies ranges --numeric " + std::string(word_of(broken.numeric));
  for (const auto& [key, text] : broken.texts) line += " --set '" + key + "=" + text + "'";
  return line;
}

std::string key_line(const KeyRow& row) {
  char text[160];
  std::snprintf(text, sizeof text, "%-34s %3zu ran %3zu refused   beyond %zu of %zu refused   %s",
                std::string(row.levels.key->name).c_str(), row.ends.ran, row.ends.refused,
                row.beyond_refused, row.levels.beyond.size(),
                row.ends.broken.empty() ? "pass" : "FAIL");
  return text;
}

std::string tally_text(const Tally& tally) {
  return std::to_string(tally.ran) + " ran, " + std::to_string(tally.refused) + " refused; " +
         std::to_string(tally.felt) + " felt, " + std::to_string(tally.cut) + " cut, " +
         std::to_string(tally.faulted) + " met a fault; " + std::to_string(tally.ticks) + " ticks";
}

std::string long_line(NumericKind numeric, const LongRun& run) {
  char text[400];
  std::snprintf(
      text, sizeof text,
      "long run  %-6s %.3g h, %llu ticks: carry %.3g voxels, ledger off by %.2g of %.6g mJ, a "
      "round takes %.6g and then %.6g mJ, %llu ramps of %llu to %llu ticks, %llu steps "
      "removed; %.0f ticks/s   %s",
      std::string(word_of(numeric)).c_str(), static_cast<double>(run.ticks) / 3.6e6,
      static_cast<unsigned long long>(run.ticks), run.largest_carry, run.ledger_off_mj,
      run.absorbed_mj, run.first_cycle_mj, run.last_cycle_mj,
      static_cast<unsigned long long>(run.ramps),
      static_cast<unsigned long long>(run.shortest_ramp),
      static_cast<unsigned long long>(run.longest_ramp),
      static_cast<unsigned long long>(run.removed), run.ticks_per_s,
      run.violations.empty() ? "pass" : "FAIL");
  return text;
}

/// The printed and written output of a run.
class RowPrinter {
 public:
  explicit RowPrinter(std::ostream& out) : out_(out) {}

  void row(const std::string& group, const std::string& name, const std::string& rule,
           const std::string& line, std::size_t broken) {
    out_ << line << std::endl;
    violations_ += broken;
    rows_.push_back({{"group", group},
                     {"name", name},
                     {"rule", rule},
                     {"told", line},
                     {"violations", static_cast<std::int64_t>(broken)}});
  }
  void broken(const Violation& violation) {
    out_ << "  broken: " << violation.rule << ": " << violation.what << std::endl;
  }
  void broken(const Broken& one) {
    broken(one.violation);
    out_ << "    " << command_of(one) << std::endl;
  }
  /// A line for each part of the pairs.
  void so_far(const Tally& tally) {
    out_ << "  " << tally.ran << " combinations, " << tally.broken.size() << " violations"
         << std::endl;
  }
  [[nodiscard]] std::size_t violations() const { return violations_; }
  [[nodiscard]] const Json& rows() const { return rows_; }

 private:
  std::ostream& out_;
  std::size_t violations_ = 0;
  Json rows_ = Json::List{};
};

constexpr const char* kTickRules = "rules of every tick and scene (tests/studies/ranges/rules.hpp)";

void print_keys(const std::vector<KeyRow>& keys, RowPrinter& printer) {
  Tally all;
  for (const KeyRow& row : keys) {
    printer.row("key", std::string(row.levels.key->name), kTickRules, key_line(row),
                row.ends.broken.size());
    all.add(row.ends);
  }
  printer.row("keys", "ends alone", kTickRules, "ends alone: " + tally_text(all), 0);
}

void print_extremes(const StudySize& effort, const std::vector<KeyRow>& keys, RowPrinter& printer) {
  for (const ExtremeRow& row : extreme_rows()) {
    std::vector<Violation> broken;
    std::string told = row.measure != nullptr ? row.measure(effort, keys, broken) : "";
    for (const ShownBy& test : row.shown_by) {
      told += (told.empty() ? "" : "; ") + ("tests/" + std::string(test.file)) + " \"" + test.name +
              '"';
    }
    printer.row(
        "extreme", row.name, row.rule,
        std::string(row.name) + ": " + row.rule + "\n    " + told + "   " +
            (broken.empty() ? (row.measure != nullptr ? "pass" : "shown by the tests") : "FAIL"),
        broken.size());
    for (const Violation& violation : broken) printer.broken(violation);
  }
}

void print_pairs(const PairRows& pairs, RowPrinter& printer) {
  printer.row("pairs", "ends of two keys", kTickRules,
              "pairs: " + std::to_string(pairs.arrays) + " arrays, " +
                  std::to_string(pairs.together) + " of " + std::to_string(pairs.pairs) +
                  " pairs stood together; " + tally_text(pairs.tally),
              pairs.tally.broken.size());
  constexpr std::size_t kTold = 8;
  for (std::size_t i = 0; i < std::min(kTold, pairs.tally.broken.size()); ++i) {
    printer.broken(shrunk(pairs.tally.broken[i]));
  }
}

/// `table.key=VALUE`, the value as a scene file writes it.
KeyTexts texts_of(const std::vector<std::string>& settings) {
  KeyTexts texts;
  for (const std::string& text : settings) {
    KeyOverride setting = parse_setting(text);
    texts[setting.key] = setting.value;
  }
  return texts;
}

void print_one(const KeyTexts& texts, const StudySize& effort, RowPrinter& printer) {
  const SceneFolder folder;
  for (const NumericKind numeric : effort.numerics) {
    const auto file = folder.path() / "scene.toml";
    const SceneOutcome outcome = run_combination(texts, numeric, file);
    if (outcome.refused) {  // it names a file that is gone by then
      const std::size_t place = outcome.refusal.find(": ");
      throw HilError("--set: " +
                     outcome.refusal.substr(place == outcome.refusal.npos ? 0 : place + 2));
    }
    Tally tally;
    tally.add(texts, numeric, outcome);
    printer.row("one", std::string(word_of(numeric)), kTickRules,
                std::string(word_of(numeric)) + ": " + tally_text(tally), tally.broken.size());
    for (const Broken& broken : tally.broken) printer.broken(shrunk(broken));
  }
}

/// `kerf-studies ranges`: the servo at the ends of all settings, judged by rule.
class RangesCommand final : public LabCommand {
 public:
  explicit RangesCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  [[nodiscard]] int study(std::ostream& out) const;

  std::vector<std::string> numerics_, set_;
  std::string report_;
  int combinations_ = 5000, seed_ = 1, jobs_ = 0;
  double hours_ = 0;
};

RangesCommand::RangesCommand(Arguments& program)
    : LabCommand(program, "ranges", "the servo at the ends of all that can be set, by rule") {
  app_.option("--combinations", combinations_,
              "of keys at their ends, at least; 0: no key and no pair")
      .within(0, 1e8)
      .shows_default();
  app_.option("--hours", hours_,
              "of a run at 1 kHz in virtual time, in all numbers (default: none)")
      .within(0, 1000);
  app_.option("--seed", seed_, "of the covering arrays").within(0, 1e9).shows_default();
  app_.option("--jobs", jobs_, "threads (default: all cores)").within(1, 1024);
  app_.option("--numeric", numerics_, "only these numbers of the loop")
      .one_of({kNumericWords.begin(), kNumericWords.end()})
      .split_at_commas();
  app_.option("--set", set_, "only the scene with this value of a key; may be repeated")
      .shown_as("TABLE.KEY=VALUE")
      .one_each();
  app_.option("--report", report_, "write the rows as JSON").shown_as("FILE");
  app_.footer("Exit codes: 0 no rule is broken, 1 one is, 2 bad input or set-up, 130 interrupted.");
}

int RangesCommand::run(std::ostream& out) const {
  catch_stop_signals();
  try {
    return study(out);
  } catch (const Interrupted&) {
  } catch (const std::runtime_error&) {  // a signal also stops a volume's reading
    if (!stop_requested()) throw;
  }
  out << "interrupted: what stands above was found\n";
  return 130;
}

int RangesCommand::study(std::ostream& out) const {
  StudySize effort;
  for (std::size_t i = 0; i < kNumericWords.size(); ++i) {
    const bool wanted =
        numerics_.empty() || std::ranges::find(numerics_, kNumericWords.at(i)) != numerics_.end();
    if (wanted) effort.numerics.push_back(static_cast<NumericKind>(i));
  }
  effort.combinations = static_cast<std::size_t>(combinations_);
  effort.seed = static_cast<std::uint64_t>(seed_);
  effort.jobs = grid::threads_for(jobs_);
  const LabOutput report("--report", report_, ".json");
  const ProgressBar bar(true);
  RowPrinter printer(out);
  const StudyEvents events{
      .progress = [&](double share, const std::string& what) { bar.show(share, what); },
      .broken = [&](const Broken& broken) { bar.hide(), printer.broken(broken); },
      .part = [&](const PairRows& so_far) { bar.hide(), printer.so_far(so_far.tally); }};
  if (!set_.empty()) {
    print_one(texts_of(set_), effort, printer);
  } else if (combinations_ > 0) {
    const std::vector<KeyRow> keys = study_keys(effort, events);
    bar.hide();
    print_keys(keys, printer);
    print_extremes(effort, keys, printer);
    const PairRows pairs = study_pairs(keys, effort, events);
    bar.hide();
    print_pairs(pairs, printer);
  }
  for (const NumericKind numeric : effort.numerics) {
    const auto ticks = static_cast<std::uint64_t>(hours_ * 3.6e6);
    if (ticks == 0) break;
    const LongRun run = run_long(numeric, ticks, [&](double share) {
      end_if_asked();
      bar.show(share, "long run");
    });
    bar.hide();
    printer.row("long", std::string(word_of(numeric)), "as tests/studies/ranges/long_run.cpp says",
                long_line(numeric, run), run.violations.size());
    for (const Violation& violation : run.violations) printer.broken(violation);
  }
  out << "violations: " << printer.violations() << std::endl;
  report.write(Json{{"rows", printer.rows()},
                    {"violations", static_cast<std::int64_t>(printer.violations())}}
                   .document());
  return printer.violations() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace kerf::ranges

std::unique_ptr<kerf::LabCommand> kerf::make_ranges_command(Arguments& program) {
  return std::make_unique<ranges::RangesCommand>(program);
}
