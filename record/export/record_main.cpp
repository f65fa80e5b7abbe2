// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <iostream>
#include <string>

#include "record/check/recording_check.hpp"
#include "record/check/repair.hpp"
#include "record/export/hdf5_export.hpp"
#include "record/export/live_json.hpp"
#include "record/export/log_page.hpp"
#include "record/export/mcap_export.hpp"
#include "record/force_plot.hpp"
#include "record/log_clock.hpp"
#include "record/recording.hpp"
#include "record/run/flight_notice.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/segment/ros_messages.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// Prints notes and problems of a recording, a line each. The exit code: 1 with problems, else 0.
int report_problems(const CheckedRecording& checked) {
  for (const std::string& note : checked.notes) std::cerr << "kerf-record: " << note << '\n';
  for (const std::string& problem : checked.problems) {
    std::cerr << "kerf-record: " << problem << '\n';
  }
  return checked.problems.empty() ? 0 : 1;
}

/// `check DIR`: with `repair` first makes the manifest anew if that is lost or wrong.
int run_check(const std::filesystem::path& folder, bool repair) {
  static_cast<void>(TickLogReader(folder / kTickLogName));  // else there is nothing to check
  if (repair && has_wrong_manifest(folder)) {
    repair_manifest(folder);
    std::cout << (folder / kManifestName).string() << ": made anew\n";
  }
  const CheckedRecording checked = check_recording(folder, {}, CheckDepth::files);
  if (checked.problems.empty()) {
    std::cout << folder.string() << ": all files agree, and all checksums are right";
    const char* before = "; manifest.json has none of ";
    for (const std::string& name : checked.without_checksum) {
      std::cout << before << name;
      before = ", ";
    }
    std::cout << '\n';
  }
  return report_problems(checked);
}

/// A command that reads a recording, or a part of one.
class ReadingCommand {
 public:
  [[nodiscard]] bool chosen() const { return arguments_.chosen(); }

 protected:
  ReadingCommand(CommandLine& app, const char* name, const char* what, const char* of_arm)
      : arguments_(app.command(name, what)) {
    arguments_.option("DIR", folder_, "folder of a recording").required();
    arguments_.option("--from", range_.from, "the first tick").shown_as("TICK");
    arguments_.option("--until", range_.until, "the last tick").shown_as("TICK");
    arguments_.option("--arm", arm_, of_arm)
        .within(1, static_cast<double>(kMaxArms))
        .shows_default();
  }

  void check_range() const {
    if (range_.from <= range_.until) return;
    throw UsageError("--from " + std::to_string(range_.from) + " lies behind --until " +
                     std::to_string(range_.until) + "; no tick lies between them");
  }
  /// Throws if the recording cannot be read, or has no such arm.
  [[nodiscard]] CheckedRecording checked(CheckDepth depth = CheckDepth::rows) const {
    CheckedRecording checked = check_recording(folder_, range_, depth);
    require_arm(folder_, checked.manifest, arm());
    return checked;
  }
  [[nodiscard]] std::size_t arm() const noexcept { return arm_ - 1; }

  Arguments arguments_;
  std::filesystem::path folder_;
  TickRange range_;

 private:
  std::size_t arm_ = 1;
};

/// Prints what is to be said of sound dates.
void report_clock(const std::filesystem::path& folder, const LogClock& clock) {
  if (const std::string set = clock.set_in_the_run(); !set.empty()) {
    std::cerr << "kerf-record: " << (folder / kClockName).string() << ": " << set << '\n';
  }
}

class InfoCommand : public ReadingCommand {
 public:
  explicit InfoCommand(CommandLine& app)
      : ReadingCommand(app, "info", "length, losses, forces, removed volume",
                       "of a run with two devices, the figures of this one") {
    arguments_.option("--report", report_, "write the figures as JSON");
    arguments_.flag("--scan", scan_,
                    "read all rows of a log above 256 MB, too: else the recorder's figures");
  }

  [[nodiscard]] int run() const {
    check_range();
    check_outputs(recording_files(folder_), {{"--report", report_, ".json"}});
    const CheckDepth depth = this->depth();
    const CheckedRecording checked = this->checked(depth);
    if (!checked.rows_readable) return report_problems(checked);
    const ArmSummaries& figures =
        checked.summaries.empty() ? checked.manifest.summaries : checked.summaries;
    const RecordSummary& summary = figures[arm()];
    const LogClock clock = read_clock(folder_, checked.manifest.has_clock);
    const std::string date = first_date(clock);
    if (const std::string& by = checked.manifest.repaired_by; !by.empty()) {
      std::cout << "manifest            made anew by kerf " << one_line(by) << '\n';
    }
    if (depth == CheckDepth::facts) {
      std::cout
          << "figures             as the recorder counted; no row was read, --scan reads all\n";
    }
    if (checked.manifest.arms > 1) std::cout << "arm                 " << arm() + 1 << " of 2\n";
    std::cout << "date                " << shown(date, clock) << '\n' << to_text(summary);
    report_clock(folder_, clock);
    if (!report_.empty()) write_new_file(report_, to_json(summary, date));
    return report_problems(checked);
  }

 private:
  /// How much of the recording is read before it is shown. A small log is read whole, with its
  /// checksums. Of a large one the recorder's own figures are shown, at once.
  [[nodiscard]] CheckDepth depth() const {
    constexpr std::uintmax_t kLarge = std::uintmax_t{256} << 20;
    const std::filesystem::path path = folder_ / tick_log_name(arm());
    const auto is_large = [&] { return TickLogReader(path).rows() * sizeof(TickRecord) > kLarge; };
    const bool has_figures = !scan_ && range_.is_whole() &&
                             std::filesystem::is_regular_file(path) && is_large() &&
                             kept_summary(folder_, arm());
    return has_figures ? CheckDepth::facts : CheckDepth::rows;
  }

  /// The date of the first row of the range; empty if there is none.
  [[nodiscard]] std::string first_date(const LogClock& clock) const {
    TickLogReader log(folder_ / tick_log_name(0));
    TickRecord first;
    if (!clock.has_date() || log.read(log.row_of(range_.from), std::span(&first, 1)) == 0) {
      return {};
    }
    return date_text(static_cast<std::int64_t>(first.start_ns) + clock.offset_ns());
  }

  static std::string shown(const std::string& date, const LogClock& clock) {
    if (!clock.has_date()) return "none";
    if (date.empty()) return "none: no tick";
    return date + (clock.is_virtual() ? ", of ticks in virtual time" : "");
  }

  std::filesystem::path report_;
  bool scan_ = false;
};

class PlotCommand : public ReadingCommand {
 public:
  explicit PlotCommand(CommandLine& app)
      : ReadingCommand(app, "plot", "forces and penetration over time, as SVG",
                       "of a run with two devices, this one; 1 also draws the force of the other") {
    arguments_.option("--out", svg_, "the SVG file").required();
  }

  [[nodiscard]] int run() const {
    check_range();
    const CheckedRecording checked = this->checked();
    if (!checked.rows_readable) return report_problems(checked);
    plot_forces(folder_, svg_, range_, arm());
    if (!is_stream(svg_)) std::cout << svg_.string() << ": written\n";
    return report_problems(checked);
  }

 private:
  std::filesystem::path svg_;
};

class ExportCommand : public ReadingCommand {
 public:
  explicit ExportCommand(CommandLine& app)
      : ReadingCommand(app, "export",
                       "every tick for other programs: a line of text, MCAP, or HDF5",
                       "of a run with two devices, the one of the CSV; MCAP and HDF5 have both") {
    arguments_.option("--csv", csv_, "as CSV").shown_as("FILE");
    arguments_.option("--mcap", mcap_, "as MCAP, for Foxglove, PlotJuggler and ROS 2")
        .shown_as("FILE");
    arguments_.option("--hdf5", hdf5_, "as HDF5, for MATLAB, Octave, Julia and h5py")
        .shown_as("FILE");
    arguments_
        .option("--time", time_,
                "of MCAP and HDF5: epoch is UTC since 1970, monotonic the time since the machine "
                "started")
        .one_of({"epoch", "monotonic"})
        .shows_default();
    arguments_.flag("--unpacked", unpacked_, "the MCAP without LZ4, for readers that have none");
  }

  [[nodiscard]] int run() const {
    check_range();
    if (csv_.empty() && mcap_.empty() && hdf5_.empty()) {
      throw UsageError("export: as what? give --csv FILE, --mcap FILE or --hdf5 FILE");
    }
    check_distinct({{"--csv", csv_, ".csv"}, {"--mcap", mcap_, ".mcap"}, {"--hdf5", hdf5_, ".h5"}});
    const CheckedRecording checked = this->checked();
    if (!checked.rows_readable) return report_problems(checked);
    const LogClock clock = clock_for(checked.manifest);
    if (!hdf5_.empty()) {
      static_cast<void>(catch_stop_signals());  // leaves no half file
      export_hdf5(folder_, hdf5_, range_, clock);
    }
    if (!csv_.empty()) export_csv(folder_, csv_, range_, arm());
    const bool is_whole = mcap_.empty() || write_mcap(clock);
    return report_problems(checked) != 0 || !is_whole ? 1 : 0;
  }

 private:
  /// Of the times of an MCAP or HDF5 file; without a date: they are monotonic.
  [[nodiscard]] LogClock clock_for(const Manifest& manifest) const {
    if (time_ != "epoch" || (hdf5_.empty() && mcap_.empty())) return {};
    const LogClock clock = read_clock(folder_, manifest.has_clock);
    if (!clock.has_date()) {
      std::cerr << "kerf-record: " << folder_.string() << ": no date: monotonic"
                << (manifest.has_clock ? "" : "; recordings of this version have one") << '\n';
    }
    report_clock(folder_, clock);
    return clock;
  }

  /// Whether it has all files of the recording.
  [[nodiscard]] bool write_mcap(const LogClock& clock) const {
    const auto packing = unpacked_ ? McapWriter::Packing::none : McapWriter::Packing::lz4;
    const auto lines = export_mcap(folder_, mcap_, packing, range_, clock);
    for (const std::string& line : lines) std::cerr << "kerf-record: " << line << '\n';
    return lines.empty();
  }

  std::filesystem::path csv_, mcap_, hdf5_;
  std::string time_ = "epoch";
  bool unpacked_ = false;
};

/// The commands that read no rows of a recording.
class OtherCommands {
 public:
  explicit OtherCommands(CommandLine& app)
      : check_(app.command("check", "compare all that a recording says twice, and its checksums")),
        grab_(app.command("grab", "a running flight recorder keeps the ticks until now")),
        live_(app.command("live",
                          "send each tick of a running controller as JSON, as PlotJuggler takes "
                          "it")),
        columns_(app.command("columns", "what each column of a log says, as a page")) {
    check_.option("DIR", folder_, "folder of a recording").required();
    check_.flag("--repair", repair_,
                "rebuild manifest.json from scene and ticks if it is lost or wrong");
    grab_.option("--name", name_, "name of the controller").shows_default();
    live_.option("--name", to_.name, "name of the controller").shows_default();
    live_.option("--udp", to_.udp, "where to: [ADDRESS:]PORT").shows_default();
    live_.option("--every", to_.every, "one datagram for so many ticks")
        .within(1, 100'000)
        .shows_default();
    columns_.flag("--msg", as_msg_, "as the message kerf_msgs/msg/Tick of ROS 2");
  }

  [[nodiscard]] int run() const {
    if (check_.chosen()) return run_check(folder_, repair_);
    if (live_.chosen()) return send_live(to_, catch_stop_signals());
    if (grab_.chosen()) std::cout << grab(name_).string() << ": kept\n";
    if (columns_.chosen()) {
      std::cout << (as_msg_ ? ros_channels()[ros_tick].definition : log_page());
    }
    return 0;
  }

 private:
  Arguments check_, grab_, live_, columns_;
  std::filesystem::path folder_;
  bool repair_ = false, as_msg_ = false;
  std::string name_ = kDefaultName;
  LiveOptions to_{.name = kDefaultName};
};

/// Bad input throws.
int run_record(int argc, char** argv) {
  CommandLine app("Looks at what kerf-recorder wrote.", "kerf-record", KERF_VERSION);
  app.footer(
      "\nExit codes: 0 fine, 1 the recording is damaged, contradicts itself or is not whole, 2 bad "
      "input or set-up.");
  const InfoCommand info(app);
  const PlotCommand plot(app);
  const ExportCommand table(app);
  const OtherCommands others(app);
  if (!app.parse(argc, argv, std::cout)) return 0;
  if (info.chosen()) return info.run();
  if (plot.chosen()) return plot.run();
  if (table.chosen()) return table.run();
  return others.run();
}

}  // namespace
}  // namespace kerf

int main(int argc, char** argv) {
  kerf::make_signals_of_writes_errors();
  return kerf::run_on_recordings("kerf-record", [&] { return kerf::run_record(argc, argv); });
}
