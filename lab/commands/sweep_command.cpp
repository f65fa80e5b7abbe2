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
#include <thread>
#include <vector>

#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "controller/scene/scene_file.hpp"
#include "hil/hil_error.hpp"
#include "lab/commands/cell_run.hpp"
#include "lab/run/child_process.hpp"
#include "lab/run/grid.hpp"
#include "lab/run/lab_command.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::sweep {
namespace {

/// A folder of this process alone; goes with its owner.
class WorkFolder {
 public:
  WorkFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "kerf-sweep-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) {
      throw HilError(pattern + ": cannot be made; set TMPDIR to a folder that can be written");
    }
    path_ = pattern;
  }
  ~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

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
  std::vector<Axis> axes;

  [[nodiscard]] CellJob job(std::size_t run, const std::string& name) const {
    CellJob job{scene, device, seconds, {}, {}, name};
    const std::vector<std::string> values = values_of(axes, run);
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (!axes[i].of_emulator()) {
        job.settings.push_back(axes[i].key + "=" + values[i]);
        continue;
      }
      std::string option = "--" + axes[i].key.substr(axes[i].key.find('.') + 1);
      std::ranges::replace(option, '_', '-');
      if (values[i] == "false") continue;
      job.emulator_options.push_back(option);
      if (values[i] != "true") job.emulator_options.push_back(values[i]);
    }
    return job;
  }

  /// One line: equal for equal bytes of the table. Programs of another build may give others.
  [[nodiscard]] std::string line(const std::string& hand_script) const {
    std::string axes_text;
    for (const Axis& axis : axes) {
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
    for (const Axis& axis : axes) head += axis.key + ",";
    head += "exit,";
    for (const std::string& column : result_columns()) head += column + ",";
    return head + "message";
  }

  [[nodiscard]] std::string row(std::size_t run, const CellResult& result) const {
    std::string row;
    for (const std::string& value : values_of(axes, run)) row += plain(value) + ",";
    row += std::to_string(result.exit) + ",";
    for (const std::string& value : result.values) row += plain(value) + ",";
    row.append(result_columns().size() - result.values.size(), ',');
    return row + plain(result.message);
  }
};

/// The scene of the first run that is one; where none is, the sweep is nothing to begin with. Looks
/// at no more than the first thousand.
Scene first_scene(const SweepRequest& request) {
  std::exception_ptr first_refusal;
  constexpr std::size_t kLooks = 1000;
  for (std::size_t run = 0; run < std::min(runs_of(request.axes), kLooks); ++run) {
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
  if (std::ranges::none_of(request.axes, &Axis::of_emulator)) return;
  const WorkFolder folder;
  const std::string first = emulator_refusal(request.job(0, ""), folder.path(), stop);
  if (first.empty()) return;
  if (!emulator_refusal(request.job(runs_of(request.axes) - 1, ""), folder.path(), stop).empty()) {
    throw HilError("--set emulator: " + first);
  }
}

/// Makes the runs that the table lacks, on `jobs` threads; returns how many failed. Throws what a
/// thread threw, once all have ended.
class Crew {
 public:
  Crew(const SweepRequest& request, Table& table, const std::atomic<bool>& asked_to_stop)
      : request_(request), table_(table), asked_(asked_to_stop), runs_(runs_of(request.axes)) {}

  void work(std::size_t jobs) {
    already_ = table_.size();
    {
      std::vector<std::jthread> threads;
      for (std::size_t i = 0; i < jobs; ++i) {
        threads.emplace_back([this] {
          const BlockStopSignals to_main;
          run_all();
        });
      }
      const ProgressBar bar(true);
      while (working_ends_ < jobs) {
        if (asked_) stop_ = true;
        show(bar);
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
    if (failure_) std::rethrow_exception(failure_);
  }

  [[nodiscard]] bool stopped() const { return stop_; }

 private:
  void run_all() {
    try {
      for (std::size_t run = 0; (run = next_++) < runs_ && !stop_;) {
        if (!table_.has(run)) run_one(run);
      }
    } catch (...) {
      const std::scoped_lock lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      stop_ = true;
    }
    ++working_ends_;
  }

  void run_one(std::size_t run) {
    const WorkFolder folder;
    const std::string name = "sweep-" + std::to_string(getpid()) + "-" + std::to_string(run);
    const auto result = run_cell(request_.job(run, name), folder.path(), stop_);
    if (!result) return;
    const std::scoped_lock lock(mutex_);
    table_.add(run, request_.row(run, *result));
  }

  void show(const ProgressBar& bar) {
    const std::scoped_lock lock(mutex_);
    const std::size_t done = table_.size(), here = done - already_;
    std::string text = std::to_string(done) + "/" + std::to_string(runs_) + " runs";
    if (here > 0) {
      const std::chrono::duration<double> worked = std::chrono::steady_clock::now() - began_;
      const double left_s =
          worked.count() / static_cast<double>(here) * static_cast<double>(runs_ - done);
      text += ", " + number_text(std::ceil(left_s)) + " s left";
    }
    bar.show(static_cast<double>(done) / static_cast<double>(runs_), text);
  }

  const SweepRequest& request_;
  Table& table_;
  const std::atomic<bool>& asked_;
  const std::size_t runs_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::size_t already_ = 0;
  std::atomic<std::size_t> next_{0};
  std::atomic<std::size_t> working_ends_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;  ///< of the table and of the failure
  std::exception_ptr failure_;
};

/// `kerf-lab sweep`, which `./kerf sweep` is: one demo in lock-step for each combination of values,
/// on all cores, into one table. The same sweep gives the same bytes on any number of cores, and
/// continues after an interruption.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string scene_;
  std::vector<std::string> set_;
  std::string device_;
  double seconds_ = 10;
  int jobs_ = 0;
  std::string out_;
};

Command::Command(Arguments& program)
    : LabCommand(program, "sweep",
                 "a demo in lock-step for each combination of values, as one table") {
  app_.option("SCENE", scene_, "scene file (TOML)").required();
  app_.option("--set", set_,
              "an axis: a key of docs/scene-keys.md, or emulator.OPTION; may be given often")
      .required()
      .one_each()
      .shown_as("KEY=LO:HI:N or KEY=A,B,C");
  app_.option("--out", out_, "folder for sweep.csv").required().shown_as("DIR");
  app_.option("--seconds", seconds_, "of servo time in hand, for each run")
      .within(0.01, 1e6)
      .shows_default();
  app_.option("--jobs", jobs_, "runs at once (default: one for each core)").within(1, 1024);
  app_.option("--device", device_, "omni, falcon or woodenhaptics (default: omni)")
      .one_of({kPersonalityWords.begin(), kPersonalityWords.end()})
      .shown_as("NAME");
  app_.footer(
      "The last axis changes fastest. A run that fails is a row with its message. An interrupted\n"
      "sweep goes on when the same command is given again.\n"
      "Exit codes: 0 every run was fine, 1 one failed, 2 bad input or set-up, 130 interrupted.");
}

int Command::run(std::ostream& out) const {
  const std::vector<Axis> axes = parse_axes(set_);
  const bool device_is_axis =
      std::ranges::any_of(axes, [](const Axis& axis) { return axis.key == "device.personality"; });
  if (device_is_axis && !device_.empty()) {
    throw HilError("--device: --set device.personality says it; leave one of the two out");
  }
  const SweepRequest request{std::filesystem::absolute(find_data_file(scene_)).string(),
                             device_is_axis    ? ""
                             : device_.empty() ? "omni"
                                               : device_,
                             seconds_, axes};
  const Scene scene = first_scene(request);
  for (const char* name : {"controller", "emulator"}) {
    if (access(program_beside(name).c_str(), X_OK) != 0) {
      throw HilError(program_beside(name) + ": is not there; build it, or install all of kerf");
    }
  }
  check_emulator(request, catch_stop_signals());
  Table table(out_, request.line(scene.hand_script));
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  Crew crew(request, table, catch_stop_signals());
  crew.work(std::min(jobs_ > 0 ? static_cast<std::size_t>(jobs_) : cores, runs_of(axes)));
  const std::string place = (std::filesystem::path(out_) / kTableName).string();
  if (table.size() < runs_of(axes)) {
    out << "interrupted: " << table.size() << " of " << runs_of(axes)
        << " runs are kept; the same command goes on\n";
    return 130;
  }
  table.finish(request.head());
  const std::size_t failed = table.failed();
  out << place << ": " << runs_of(axes) << " runs, " << failed << " failed\n";
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace kerf::sweep

std::unique_ptr<kerf::LabCommand> kerf::make_sweep_command(Arguments& program) {
  return std::make_unique<sweep::Command>(program);
}
