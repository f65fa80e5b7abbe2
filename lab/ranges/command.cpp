// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/command.hpp"

#include <algorithm>
#include <cstdio>
#include <ostream>
#include <thread>

#include "lab/ranges/key_study.hpp"
#include "lab/rig/lab_run.hpp"
#include "shared/posix/progress_bar.hpp"
#include "shared/text/json.hpp"

namespace kerf::ranges {
namespace {

std::string keys_of(const KeyTexts& texts) {
  std::string line;
  for (const auto& [key, text] : texts) line += (line.empty() ? "" : ", ") + key + " = " + text;
  return line.empty() ? "no key" : line;
}

void tell(const Broken& broken, std::ostream& out) {
  out << "  broken: " << broken.violation.rule << ": " << broken.violation.what << "\n    "
      << word_of(broken.numeric) << ": " << keys_of(broken.texts) << '\n';
}

}  // namespace

Command::Command(Arguments& program)
    : LabCommand(program, "ranges", "the servo at the ends of all that can be set, by rule") {
  app_.option("--combinations", combinations_, "of keys at their ends, at least")
      .within(0, 1e8)
      .shows_default();
  app_.option("--seed", seed_, "of the covering arrays").within(0, 1e9).shows_default();
  app_.option("--jobs", jobs_, "threads (default: all cores)").within(1, 1024);
  app_.option("--numeric", numerics_, "only these numbers of the loop")
      .one_of({kNumericWords.begin(), kNumericWords.end()})
      .split_at_commas();
  app_.option("--report", report_, "write the rows as JSON").shown_as("FILE");
  app_.footer("Exit codes: 0 no rule is broken, 1 one is, 2 bad input or set-up.");
}

int Command::run(std::ostream& out) const {
  Effort effort;
  for (std::size_t i = 0; i < kNumericWords.size(); ++i) {
    const bool wanted =
        numerics_.empty() || std::ranges::find(numerics_, kNumericWords.at(i)) != numerics_.end();
    if (wanted) effort.numerics.push_back(static_cast<NumericKind>(i));
  }
  effort.combinations = static_cast<std::size_t>(combinations_);
  effort.seed = static_cast<std::uint64_t>(seed_);
  effort.jobs = jobs_ > 0 ? static_cast<std::size_t>(jobs_)
                          : std::max(1U, std::thread::hardware_concurrency());
  const LabOutput report("--report", report_);
  const ProgressBar bar(true);
  const auto progress = [&](double share, const std::string& what) { bar.show(share, what); };
  std::vector<Broken> broken;
  const auto keys = study_keys(effort, progress);
  bar.hide();
  Tally all;
  for (const KeyRow& row : keys) {
    char text[160];
    std::snprintf(text, sizeof text, "%-34s %3zu ran %3zu refused   beyond %zu of %zu refused   %s",
                  std::string(row.levels.key->name).c_str(), row.ends.ran, row.ends.refused,
                  row.beyond_refused, row.levels.beyond.size(),
                  row.ends.broken.empty() ? "pass" : "FAIL");
    out << text << std::endl;
    for (const Broken& one : row.ends.broken) tell(one, out);
    all.add(row.ends);
  }
  out << "ends alone: " << all.ran << " ran, " << all.refused << " refused, " << all.felt
      << " felt, " << all.cut << " cut, " << all.faulted << " met a fault; " << all.ticks
      << " ticks\n";
  const PairRows pairs = study_pairs(keys, effort, progress);
  bar.hide();
  out << "pairs: " << pairs.arrays << " arrays, " << pairs.together << " of " << pairs.pairs
      << " pairs together, " << pairs.never << " cannot; " << pairs.tally.ran << " ran, "
      << pairs.tally.refused << " refused, " << pairs.tally.felt << " felt, " << pairs.tally.cut
      << " cut, " << pairs.tally.faulted << " met a fault; " << pairs.tally.ticks << " ticks\n";
  std::size_t told = 0;
  for (const Broken& one : pairs.tally.broken) {
    if (told++ < 12) tell(shrunk(one), out);
  }
  out << "violations: " << all.broken.size() + pairs.tally.broken.size() << std::endl;
  return all.broken.empty() && pairs.tally.broken.empty() ? 0 : 1;
}

}  // namespace kerf::ranges
