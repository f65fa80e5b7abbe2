// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <memory>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "controller/run/law_trial.hpp"
#include "hil/hil_error.hpp"
#include "lab/run/grid_run.hpp"
#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/axis_options.hpp"
#include "lab/stability/device_file.hpp"
#include "lab/stability/map.hpp"
#include "lab/stability/map_file.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

/// The files that a map is written to.
struct OutputPaths {
  std::string csv, json, plot;
  void declare(Arguments& app);
};

/// The output files, checked before the map is measured: none is one of the parts that are read.
/// Throws HilError, or FileError.
class Outputs {
 public:
  Outputs(const OutputPaths& paths, const std::vector<std::string>& parts);
  void write(const Part& part, std::ostream& out) const;

 private:
  LabOutput csv_, json_, plot_;
};

void OutputPaths::declare(Arguments& app) {
  app.option("--csv", csv, "write one row for each cell").shown_as("FILE");
  app.option("--json", json, "write axes, boundaries and cells").shown_as("FILE");
  app.option("--plot", plot, "draw the map beside the analytic limits (SVG)").shown_as("FILE");
}

Outputs::Outputs(const OutputPaths& paths, const std::vector<std::string>& parts)
    : csv_("--csv", paths.csv, ".csv"),
      json_("--json", paths.json, ".json"),
      plot_("--plot", paths.plot, ".svg") {
  check_outputs({parts.begin(), parts.end()}, {{"--csv", paths.csv, ".csv"},
                                               {"--json", paths.json, ".json"},
                                               {"--plot", paths.plot, ".svg"}});
  if (!paths.plot.empty()) check_can_plot();
}

void Outputs::write(const Part& part, std::ostream& out) const {
  csv_.write(csv_of(part));
  const std::string json = json_of(part);
  json_.write(json);
  plot_.write_report({"stability_map", "map"}, json, out);
}

/// The first crossings of the seeds, from the lowest to the highest.
std::string crossing_text(const Column& column, const StabilityBoundary& crossing) {
  const auto text = [&](double n_per_mm) {
    const std::string none = no_crossing(column, n_per_mm);
    return none.empty() ? format("%.4g", n_per_mm) : none;
  };
  const std::string first = text(crossing.first_n_per_mm), last = text(crossing.last_n_per_mm);
  return first == last ? first : first + " to " + last;
}

/// One line for each column: its values, and the stiffness at which it stops.
void tell(const Part& part, std::ostream& out) {
  const std::vector<Assignment> columns = part.spec.columns();
  std::set<std::string> reasons;
  std::size_t empty_count = 0;
  const auto name_of = [&](std::size_t index) {
    std::string name;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      if (part.spec.table[axis].size() < 2) continue;
      name += std::string(name.empty() ? "" : " ") + axis_kinds()[axis].name + " " +
              columns[index][axis];
    }
    return name;
  };
  std::size_t width = 40;
  for (const auto& [index, column] : part.columns) {
    width = std::max(width, name_of(index).size());
  }
  out << format("%-*s %18s %18s %10s %10s  re-entry\n", int(width), "column (N/mm)", "swings",
                "energy", "linear", "passive");
  for (const auto& [index, column] : part.columns) {
    const LoopCase subject = subject_of(columns[index]);
    if (column.cells.empty()) {
      const std::string why = impossible(part.spec, subject);
      ++empty_count;
      reasons.insert(why.empty() ? NotMet().what() : why);
      continue;
    }
    const Analytic analytic = analytic_of(subject);
    out << format("%-*s %18s %18s %10.4g %10.4g", int(width), name_of(index).c_str(),
                  crossing_text(column, column.swing).c_str(),
                  crossing_text(column, column.energy).c_str(), analytic.exact, analytic.passive);
    if (column.swing.re_entry_from_n_per_mm > 0) {
      out << format("  %.4g to %.4g", column.swing.re_entry_from_n_per_mm,
                    column.swing.re_entry_to_n_per_mm);
    }
    out << '\n';
  }
  if (empty_count > 0) {
    out << empty_count << " of " << part.columns.size()
        << " columns are left empty: " << *reasons.begin() << '\n';
  }
}

constexpr const char* kMapped = "damping,stiffness";

/// `kerf-lab zwidth`: which stiffness and damping a device can render, measured, beside the theory.
class ZwidthCommand final : public LabCommand {
 public:
  explicit ZwidthCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  [[nodiscard]] MapSpec spec(std::ostream& out) const;
  static void try_laws(const MapSpec& map, std::ostream& out);
  [[nodiscard]] Shard shard() const;
  /// The columns of the shard that `kept` has not; false: interrupted.
  [[nodiscard]] bool measure(const MapSpec& map, const Shard& shard, PartWriter& kept,
                             std::ostream& out) const;
  void write_page(std::ostream& out) const;
  /// Any option of a map that is measured: none of them has a meaning for the page, or for parts.
  [[nodiscard]] bool chooses_map() const;
  int merge(std::ostream& out) const;

  AxisOptions axes_;
  std::string stiffness_, map_ = kMapped, shard_ = "1/1", part_, portraits_, page_;
  std::vector<std::string> cells_, merge_;
  OutputPaths paths_;
  bool quick_ = false, arm_ = false;
  double seconds_ = 0;
  std::uint32_t seed_ = 1;
  int jobs_ = 0, seeds_ = 0;
};

ZwidthCommand::ZwidthCommand(Arguments& program)
    : LabCommand(program, "zwidth",
                 "which stiffness and damping a device can render, beside the theory") {
  std::array<AxisId, kAxisCount> all{};
  for (std::size_t i = 0; i < kAxisCount; ++i) all[i] = static_cast<AxisId>(i);
  axes_.declare(app_, all);
  app_.option("--stiffness", stiffness_,
              "of the wall, K: from:to:count, even in their ratio [0.05:50:40]")
      .shown_as("N/mm");
  app_.option("--map", map_,
              "the two axes of the picture; damping on it is 0:0.03:40 unless it is given")
      .shown_as("X,Y")
      .shows_default();
  app_.flag("--quick", quick_, "a small map of both loops, in seconds");
  app_.flag("--arm", arm_, "the whole servo step with an emulated device in place of one axis");
  app_.option("--seconds", seconds_,
              "longest time of a run, at least 60 [60]; for --portraits, "
              "of each curve [3]")
      .within(0.1, kLongestLimitS);
  app_.option("--seed", seed_, "shifts the encoders' steps against the wall; 0: an edge lies on it")
      .shows_default();
  app_.option("--seeds", seeds_,
              "number of seeds, from --seed on; a cell has the worst verdict [5; 2 with "
              "--quick]")
      .within(1, static_cast<int>(kMostSeeds));
  app_.option("--jobs", jobs_, "threads [all cores]").within(1, 1024);
  app_.option("--shard", shard_, "only part i of n, into --part").shown_as("i/n");
  app_.option("--part", part_, "keep finished columns in this file, and continue from it")
      .shown_as("FILE");
  app_.option("--merge", merge_,
              "measure nothing: the map of these parts, one of each shard, to the files below")
      .all_behind()
      .shown_as("FILE");
  paths_.declare(app_);
  app_.option("--portraits", portraits_,
              "draw position against speed of --cells, one curve for each hit (SVG)")
      .shown_as("FILE");
  app_.option("--cells", cells_, "for --portraits: stiffness:damping, as many as 12")
      .split_at_commas()
      .shown_as("K:B,...");
  app_.option("--page", page_,
              "measure and write its part of docs/stability.md, its pictures in plots/ beside it; "
              "takes "
              "minutes")
      .shown_as("FILE");
  app_.footer(
      "An axis takes one value, a list (0,1,2) or a range (0:3:4: from, to, count), in any order. "
      "Two are "
      "mapped;\n"
      "each combination of the others is a panel of the picture. docs/stability.md has examples.\n"
      "Exit codes: 0 fine, 2 bad input or set-up; 130 interrupted, and --part has the finished "
      "columns.");
}

/// The program's own laws have a trial at both ends of the stiffness before a map runs them: one
/// that loops would never end it. A law that gives no number, or allocates, is reported; the map
/// bears both.
void ZwidthCommand::try_laws(const MapSpec& map, std::ostream& out) {
  std::set<std::string> tried, told;
  for (const Assignment& values : map.columns()) {
    std::string laws;
    for (const AxisId axis :
         {AxisId::law, AxisId::estimator, AxisId::stabiliser, AxisId::numeric}) {
      laws += value_of(values, axis) + ' ';
    }
    if (!tried.insert(laws).second) continue;
    const LoopCase subject = subject_of(values);
    for (const double stiffness : {map.stiffness_n_per_mm.front(), map.stiffness_n_per_mm.back()}) {
      LoadedScene scene;
      scene.path = "zwidth";
      scene.force.law = force_law_at(subject, stiffness);
      scene.force.stabiliser = subject.stabiliser;
      scene.servo.velocity = subject.estimator;
      scene.servo.numeric = subject.numeric;
      try {
        for (const std::string& flaw : try_own_laws(scene)) {
          if (told.insert(flaw).second) out << flaw << '\n';
        }
      } catch (const std::runtime_error& error) {
        throw HilError(error.what());
      }
      if (subject.force_law.name.empty()) break;  // the others know no stiffness
    }
  }
}

/// Throws HilError for a map of more panels than a plot holds.
void check_panels(const MapSpec& spec) {
  constexpr std::size_t kMostPanels = 12;
  std::size_t panels = 1;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (std::ranges::find(spec.mapped, axis) != spec.mapped.end()) continue;
    panels *= std::max<std::size_t>(1, spec.table[axis].size());
  }
  if (panels <= kMostPanels) return;
  throw HilError("--plot: " + std::to_string(panels) + " panels, and a picture holds " +
                 std::to_string(kMostPanels) +
                 "; give the axes that are not mapped fewer values, or leave --plot out");
}

/// A map has one column at least that can exist; those that cannot are left empty.
void check_columns(const MapSpec& map) {
  std::string why;
  for (const Assignment& values : map.columns()) {
    why = impossible(map, subject_of(values));
    if (why.empty()) return;
  }
  throw HilError("no column of this map can exist: " + why);
}

/// The axes of a picture by the text of --map. Throws HilError.
std::array<std::size_t, 2> mapped_axes(const std::string& map) {
  const std::size_t comma = map.find(',');
  if (comma == std::string::npos) {
    throw HilError("--map: " + map + ": two axes make a map; give such as damping,stiffness");
  }
  const std::array<std::size_t, 2> mapped{axis_named("--map", map.substr(0, comma)),
                                          axis_named("--map", map.substr(comma + 1))};
  if (mapped[0] == mapped[1]) throw HilError("--map: " + map + ": the same axis twice; give two");
  return mapped;
}

/// Throws HilError for a law that cannot run in the loop of the map, one axis or the whole arm.
void check_laws(const MapSpec& spec) {
  for (const std::string& law : spec.table[index_of(AxisId::law)]) {
    if (!spec.arm && law == "paper") {
      throw HilError("--law: paper is a force of the whole arm; add --arm, or leave it out");
    }
    if (law == "paper" && spec.table[index_of(AxisId::damping)] != AxisValues{"0"}) {
      throw HilError("--law: paper has no damping; add --damping 0");
    }
    if (!spec.arm || (law != "linear" && law != "two_sided")) continue;
    throw HilError("--law: " + law + " is a wall of one axis alone; leave it or --arm out");
  }
}

MapSpec ZwidthCommand::spec(std::ostream& out) const {
  MapSpec spec;
  spec.mapped = mapped_axes(map_);
  spec.arm = arm_;
  std::array<std::string, kAxisCount> texts = axes_.texts;
  take_device_option(axes_.direction, arm_, texts, out);
  for (const AxisId axis : {AxisId::loop, AxisId::quantum, AxisId::limits}) {
    if (!arm_ || texts[index_of(axis)].empty()) continue;
    throw HilError(std::string("--") + axis_kinds()[index_of(axis)].name +
                   ": device and servo have their own with --arm; leave one of the two out");
  }
  for (const AxisId axis : {AxisId::hit, AxisId::start}) {
    if (!arm_ || texts[index_of(axis)].empty()) continue;
    throw HilError(std::string("--") + axis_kinds()[index_of(axis)].name +
                   ": the whole arm has its own hits; leave one of the two out");
  }
  if (!arm_ && !axes_.texts[index_of(AxisId::mode)].empty()) {
    throw HilError("--mode: one axis is rigid; add --arm, or leave it out");
  }
  const auto standard = [&](AxisId axis, const char* text) {
    std::string& value = texts[index_of(axis)];
    if (value.empty()) value = text;
  };
  if (quick_ && !arm_) standard(AxisId::loop, "ideal,kerf");
  if (std::ranges::find(spec.mapped, index_of(AxisId::damping)) != spec.mapped.end()) {
    standard(AxisId::damping, quick_ ? "0:0.03:21" : "0:0.03:40");
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!texts[i].empty()) spec.table[i] = axis_values(static_cast<AxisId>(i), texts[i]);
  }
  check_laws(spec);
  for (const std::size_t axis : spec.mapped) {
    if (axis == kAxisCount || !spec.table[axis].empty()) continue;
    throw HilError(std::string("--map: the axis ") + axis_kinds()[axis].name +
                   " has no range; give --" + axis_kinds()[axis].name + " from:to:count or a list");
  }
  spec.stiffness_n_per_mm = stiffness_values(!stiffness_.empty() ? stiffness_
                                             : quick_            ? "0.05:50:25"
                                                                 : "0.05:50:40");
  for (const Assignment& values : spec.columns()) check_filter(values);
  // No verdict depends on a shorter limit: the run that decides it is always followed.
  constexpr double kCurveS = 3;
  spec.seconds = portraits_.empty() ? std::max(seconds_, kLimitS)
                 : seconds_ > 0     ? seconds_
                                    : kCurveS;
  spec.seed = seed_;
  if (quick_) spec.seeds = 2;
  if (seeds_ > 0) spec.seeds = static_cast<std::size_t>(seeds_);
  constexpr std::size_t kMostColumns = 100000;
  std::size_t count = 1;
  for (const AxisValues& values : spec.table) {
    count *= std::max<std::size_t>(1, values.size());
    if (count > kMostColumns)
      throw HilError("--map: more than 100000 columns; give the axes fewer values");
  }
  return spec;
}

Shard ZwidthCommand::shard() const {
  const std::size_t slash = shard_.find('/');
  const auto index = number_in(shard_.substr(0, slash));
  const auto count =
      slash == std::string::npos ? std::nullopt : number_in(shard_.substr(slash + 1));
  constexpr double kMost = 10000;
  const auto whole = [](double value) {
    return value == static_cast<double>(static_cast<int>(value));
  };
  if (!index || !count || !(*count >= 1) || *count > kMost || !(*index >= 1) || *index > *count ||
      !whole(*index) || !whole(*count)) {
    throw HilError("--shard: " + shard_ + " is no part of a whole; give such as 2/8");
  }
  if (*count > 1 && part_.empty()) {
    throw HilError("--shard: " + shard_ + " needs a file for its part; give --part FILE");
  }
  return {static_cast<std::size_t>(*index), static_cast<std::size_t>(*count)};
}

void ZwidthCommand::write_page(std::ostream& out) const {
  check_can_plot();
  const LabOutput as_page("--page", page_, ".md");
  const std::string devices = page_plot("--page", page_, ".devices.svg"),
                    rates = page_plot("--page", page_, ".rates.svg");
  const LabOutput as_devices("--page", devices, ".svg"), as_rates("--page", rates, ".svg");
  const Json order{{"program", std::filesystem::read_symlink("/proc/self/exe").string()},
                   {"quick", quick_},
                   {"jobs", jobs_},
                   {"provenance", lab_provenance()}};
  const std::string measured =
      make_report({"stability", "measure"}, order.canonical(), ReportErrors::shown);
  as_devices.write_report({"stability", "devices"}, measured, out);
  as_rates.write_report({"stability", "rates"}, measured, out);
  const std::string part = make_report(
      {"stability", "page", page_link(page_, devices), page_link(page_, rates)}, measured);
  as_page.write_part("stability", part, out);
}

bool ZwidthCommand::measure(const MapSpec& map, const Shard& shard, PartWriter& kept,
                            std::ostream& out) const {
  using Clock = std::chrono::steady_clock;
  std::vector<std::size_t> wanted;
  const std::size_t count = map.columns().size();
  for (std::size_t i = 0; i < count; ++i) {
    if (shard.has(i) && !kept.columns().contains(i)) wanted.push_back(i);
  }
  const std::size_t jobs = std::clamp<std::size_t>(wanted.size(), 1, grid::threads_for(jobs_));
  const std::atomic<bool>& stop = catch_stop_signals();
  const ProgressBar bar(true);
  const auto begun = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begun).count(); };
  std::uint64_t ticks = 0;
  std::size_t done = 0;
  bar.show(0, format("0 of %zu columns", wanted.size()));
  const auto keep = [&](std::size_t index, Column column, std::uint64_t took) {
    ticks += took;
    kept.add(index, std::move(column));
    ++done;
    const auto of = static_cast<double>(wanted.size()), have = static_cast<double>(done);
    bar.show(have / of, format("%zu of %zu columns, %.0f s left", done, wanted.size(),
                               seconds() / have * (of - have)));
  };
  measure_columns(map, wanted, jobs, stop, keep);
  bar.hide();
  if (done < wanted.size()) {
    out << "interrupted: " << done << " of " << wanted.size() << " columns measured"
        << (part_.empty() ? "; nothing is kept without --part\n" : "; run it again to go on\n");
    return false;
  }
  if (done > 0) {
    out << format(
        "%zu columns, %.3g servo steps in %.1f s on %zu threads: %.3g steps per second and core\n",
        done, static_cast<double>(ticks), seconds(), jobs,
        static_cast<double>(ticks) / seconds() / static_cast<double>(jobs));
  }
  return true;
}

bool ZwidthCommand::chooses_map() const {
  return std::ranges::any_of(axes_.texts, [](const std::string& a) { return !a.empty(); }) ||
         map_ != kMapped || arm_ || !stiffness_.empty() || !portraits_.empty() || seconds_ > 0 ||
         seed_ != 1 || seeds_ > 0 || !cells_.empty() || shard_ != "1/1" || !axes_.direction.empty();
}

int ZwidthCommand::merge(std::ostream& out) const {
  if (chooses_map() || quick_ || jobs_ > 0 || !page_.empty() || !part_.empty()) {
    throw HilError("--merge: its parts have the map; leave all but --csv, --json and --plot out");
  }
  const Outputs outputs(paths_, merge_);
  const Part whole = merge_parts(merge_);
  if (!paths_.plot.empty()) check_panels(whole.spec);
  tell(whole, out);
  outputs.write(whole, out);
  return 0;
}

int ZwidthCommand::run(std::ostream& out) const {
  const bool has_outputs =
      !paths_.csv.empty() || !paths_.json.empty() || !paths_.plot.empty() || !part_.empty();
  if ((!page_.empty() || !portraits_.empty()) && has_outputs) {
    throw HilError(std::string(page_.empty() ? "--portraits" : "--page") +
                   ": makes no map; leave --csv, --json, --plot and --part out, or run twice");
  }
  if (!merge_.empty()) return merge(out);
  if (!page_.empty()) {
    if (chooses_map()) {
      throw HilError("--page: its maps are its own; leave all but --quick and --jobs out");
    }
    write_page(out);
    return 0;
  }
  if (!cells_.empty() && portraits_.empty()) {
    throw HilError("--cells: are those of portraits; add --portraits FILE, or leave them out");
  }
  const MapSpec map = spec(out);
  const Shard part = shard();
  check_columns(map);
  std::vector<std::string> kept_in;
  if (!part_.empty()) kept_in.push_back(part_);
  const Outputs outputs(paths_, kept_in);
  try_laws(map, out);
  if (!paths_.plot.empty()) check_panels(map);
  if (!portraits_.empty()) {
    if (!axes_.texts[index_of(AxisId::damping)].empty() || !stiffness_.empty() || seeds_ > 0 ||
        shard_ != "1/1") {
      throw HilError(
          "--portraits: --cells have the stiffness and the damping, --seed the one seed; leave "
          "--stiffness, --damping, --seeds and --shard out");
    }
    check_can_plot();
    const LabOutput output("--portraits", portraits_, ".svg");
    output.write_report({"stability_map", "portraits"}, portraits_of(map, cells_), out);
    return 0;
  }
  PartWriter kept(part_, map, part);
  if (!measure(map, part, kept, out)) return 130;
  kept.finish();
  const Part whole{map, part, kept.columns()};
  tell(whole, out);
  outputs.write(whole, out);
  return 0;
}

}  // namespace
}  // namespace kerf::zwidth

std::unique_ptr<kerf::LabCommand> kerf::make_zwidth_command(Arguments& program) {
  return std::make_unique<zwidth::ZwidthCommand>(program);
}
