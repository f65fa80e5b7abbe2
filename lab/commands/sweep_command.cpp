// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <filesystem>
#include <iosfwd>
#include <memory>
#include <mutex>
#include <ostream>
#include <string>
#include <vector>

#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "controller/scene/scene_file.hpp"
#include "hil/hil_error.hpp"
#include "lab/commands/cell_run.hpp"
#include "lab/run/child_process.hpp"
#include "lab/run/grid_run.hpp"
#include "lab/run/lab_command.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::sweep {
namespace {

/// A value as a cell of the table: no comma and no quote, so that any reader splits at commas.
std::string plain(std::string text) {
  std::ranges::replace(text, ',', ';');
  std::erase(text, '"');
  return text;
}

/// A sweep as it was asked for.
struct SweepRequest {
  std::string scene;
  std::string device;  ///< empty: an axis has it
  double seconds;
  std::vector<grid::Axis> axes;

  [[nodiscard]] CellJob job(std::size_t run, const std::string& name) const {
    CellJob job{scene, device, seconds, {}, {}, name};
    const std::vector<std::string> values = grid::values_of(axes, run);
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (!axes[i].of_emulator()) {
        job.settings.push_back(axes[i].key + "=" + values[i]);
        continue;
      }
      std::string option = "--" + axes[i].key.substr(axes[i].key.find('.') + 1);
      std::ranges::replace(option, '_', '-');
      if (values[i] == "false") continue;
      if (values[i] != "true") option += "=" + values[i];  // one word: -1 is no option
      job.emulator_options.push_back(option);
    }
    return job;
  }

  /// One line: equal for equal bytes of the table. Programs of another build may give others.
  [[nodiscard]] std::string line(const std::string& hand_script) const {
    std::string axes_text;
    for (const grid::Axis& axis : axes) {
      axes_text += " " + axis.key + "=";
      for (const std::string& value : axis.values) axes_text += value + ",";
    }
    std::uint64_t files = kFnv1aBasis;
    for (const std::string& path :
         {scene, hand_script, program_beside("controller"), program_beside("emulator")}) {
      files = fnv1a(text_in(path), files);
    }
    return "kerf-sweep " + hex64(files) + " " + device + " " + number_text(seconds) + axes_text;
  }

  [[nodiscard]] std::string head() const {
    std::string head;
    for (const grid::Axis& axis : axes) head += axis.key + ",";
    head += "exit,";
    for (const std::string& column : result_columns()) head += column + ",";
    return head + "message";
  }

  [[nodiscard]] std::string row(std::size_t run, const CellResult& result) const {
    std::string row;
    for (const std::string& value : grid::values_of(axes, run)) row += plain(value) + ",";
    row += std::to_string(result.exit) + ",";
    for (const std::string& value : result.values) row += plain(value) + ",";
    row.append(result_columns().size() - result.values.size(), ',');
    return row + plain(result.message);
  }
};

/// The scene of the first run that is one; where none is, the sweep is nothing to begin with. Looks
/// at no more than the first thousand.
SceneSpec first_scene(const SweepRequest& request) {
  std::exception_ptr first_refusal;
  constexpr std::size_t kLooks = 1000;
  for (std::size_t run = 0; run < std::min(grid::cells_of(request.axes), kLooks); ++run) {
    std::vector<KeyOverride> settings;
    for (const std::string& text : request.job(run, "").settings) {
      settings.push_back(parse_setting(text));
    }
    try {
      return parse_scene_file(request.scene, settings);
    } catch (const LoadError&) {
      if (!first_refusal) first_refusal = std::current_exception();
    }
  }
  std::rethrow_exception(first_refusal);
}

/// Refuses options of the emulator that neither the first nor the last run can start with: the ends
/// of each axis.
void check_emulator(const SweepRequest& request, const std::atomic<bool>& stop) {
  if (std::ranges::none_of(request.axes, &grid::Axis::of_emulator)) return;
  const PrivateFolder folder("kerf-sweep");
  const std::string first = emulator_refusal(request.job(0, ""), folder.path(), stop);
  if (first.empty()) return;
  if (!emulator_refusal(request.job(grid::cells_of(request.axes) - 1, ""), folder.path(), stop)
           .empty()) {
    throw HilError("--set emulator: " + first);
  }
}

/// Makes the runs that the table lacks, until all are done or `asked_to_stop` is set.
void make_runs(const SweepRequest& request, std::size_t jobs,
               const std::atomic<bool>& asked_to_stop, grid::Table& table) {
  const std::size_t runs = grid::cells_of(request.axes), already = table.size();
  std::vector<std::size_t> wanted;
  for (std::size_t run = 0; run < runs; ++run) {
    if (!table.has(run)) wanted.push_back(run);
  }
  grid::Run all(jobs, &asked_to_stop);
  const auto work = [&](std::size_t i, std::size_t) {
    const std::size_t run = wanted[i];
    const PrivateFolder folder("kerf-sweep");
    const std::string name = "sweep-" + std::to_string(getpid()) + "-" + std::to_string(run);
    const auto result = run_cell(request.job(run, name), folder.path(), all.stop());
    if (!result) return;
    const std::scoped_lock hold(all.results());
    table.add(run, request.row(run, *result));
  };
  const auto began = std::chrono::steady_clock::now();
  const ProgressBar bar(true);
  const auto show = [&] {
    const std::size_t done = table.size(), here = done - already;
    std::string text = std::to_string(done) + "/" + std::to_string(runs) + " runs";
    if (here > 0) {
      const std::chrono::duration<double> worked = std::chrono::steady_clock::now() - began;
      const double left_s =
          worked.count() / static_cast<double>(here) * static_cast<double>(runs - done);
      text += ", " + number_text(std::ceil(left_s)) + " s left";
    }
    bar.show(static_cast<double>(done) / static_cast<double>(runs), text);
  };
  all.all(wanted.size(), work, show);
}

/// `kerf-lab sweep`, which `./kerf sweep` is: one demo in lock-step for each combination of values,
/// on all cores, into one table. The same sweep gives the same bytes on any number of cores, and
/// continues after an interruption.
class SweepCommand final : public LabCommand {
 public:
  explicit SweepCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string scene_;
  std::vector<std::string> set_;
  std::string device_;
  double seconds_ = 10;
  int jobs_ = 0;
  std::string out_;
};

SweepCommand::SweepCommand(Arguments& program)
    : LabCommand(program, "sweep",
                 "a demo in lock-step for each combination of values, as one table") {
  app_.option("SCENE", scene_, "scene file (TOML)").required();
  app_.option("--set", set_,
              "an axis: a key of docs/scene-keys.md, or emulator.OPTION; may be repeated")
      .required()
      .one_each()
      .shown_as("KEY=LO:HI:N or KEY=A,B,C");
  app_.option("--out", out_, "folder for sweep.csv").required().shown_as("DIR");
  app_.option("--seconds", seconds_, "of servo time in hand, for each run")
      .within(0.01, 1e6)
      .shows_default();
  app_.option("--jobs", jobs_, "runs at once (default: one for each core)").within(1, 1024);
  app_.option("--device", device_, "the device (default: omni)")
      .one_of({kPersonalityWords.begin(), kPersonalityWords.end()})
      .shown_as("NAME");
  app_.footer(
      "The last axis changes fastest. A run that fails is a row with its message. An interrupted\n"
      "sweep goes on when the same command is given again.\n"
      "Exit codes: 0 every run was fine, 1 one failed, 2 bad input or set-up, 130 interrupted.");
}

int SweepCommand::run(std::ostream& out) const {
  const std::vector<grid::Axis> axes = grid::parse_axes(set_);
  const bool device_is_axis = std::ranges::any_of(
      axes, [](const grid::Axis& axis) { return axis.key == "device.personality"; });
  if (device_is_axis && !device_.empty()) {
    throw HilError("--device: --set device.personality says it; leave one of the two out");
  }
  const SweepRequest request{std::filesystem::absolute(find_scene_file(scene_)).string(),
                             device_is_axis    ? ""
                             : device_.empty() ? "omni"
                                               : device_,
                             seconds_, axes};
  const SceneSpec scene = first_scene(request);
  for (const char* name : {"controller", "emulator"}) {
    if (access(program_beside(name).c_str(), X_OK) != 0) {
      throw HilError(program_beside(name) + ": is not there; build it, or install all of kerf");
    }
  }
  check_emulator(request, catch_stop_signals());
  grid::Table table(out_, request.line(scene.hand_script));
  make_runs(request, grid::threads_for(jobs_), catch_stop_signals(), table);
  const std::string place = (std::filesystem::path(out_) / grid::kTableName).string();
  if (table.size() < grid::cells_of(axes)) {
    out << "interrupted: " << table.size() << " of " << grid::cells_of(axes)
        << " runs are kept; the same command goes on\n";
    return 130;
  }
  table.finish(request.head());
  const std::size_t failed = table.failed();
  out << place << ": " << grid::cells_of(axes) << " runs, " << failed << " failed\n";
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace kerf::sweep

std::unique_ptr<kerf::LabCommand> kerf::make_sweep_command(Arguments& program) {
  return std::make_unique<sweep::SweepCommand>(program);
}
