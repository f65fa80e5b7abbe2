// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <iostream>
#include <string>

#include "record/check/check_command.hpp"
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

namespace kerf {
namespace {

/// How much of a recording is read before it is shown. A small log is read whole, with its
/// checksums. Of a large one the recorder's own figures are shown, at once.
CheckDepth depth_for_info(const std::filesystem::path& folder, TickRange range, std::size_t arm,
                          bool scan) {
  constexpr std::uintmax_t kLarge = std::uintmax_t{256} << 20;
  const std::filesystem::path path = folder / tick_log_name(arm);
  const auto is_large = [&] { return TickLogReader(path).rows() * sizeof(TickRecord) > kLarge; };
  const bool has_figures = !scan && range.is_whole() && std::filesystem::is_regular_file(path) &&
                           is_large() && kept_summary(folder, arm);
  return has_figures ? CheckDepth::facts : CheckDepth::rows;
}

/// The date of the first row of `range`; empty if there is none.
std::string date_of(const std::filesystem::path& folder, TickRange range, const LogClock& clock) {
  TickLogReader log(folder / tick_log_name(0));
  TickRecord first;
  if (!clock.has_date() || log.read(log.row_of(range.from), std::span(&first, 1)) == 0) return {};
  return date_text(static_cast<std::int64_t>(first.start_ns) + clock.offset_ns());
}

std::string shown(const std::string& date, const LogClock& clock) {
  if (!clock.has_date()) return "none";
  if (date.empty()) return "none: no tick";
  return date + (clock.is_virtual() ? ", of ticks in virtual time" : "");
}

/// Prints what is to be said of sound dates.
void report_clock(const std::filesystem::path& folder, const LogClock& clock) {
  if (const std::string set = clock.set_in_the_run(); !set.empty()) {
    std::cerr << "kerf-record: " << (folder / kClockName).string() << ": " << set << '\n';
  }
}

/// `info DIR`, `plot DIR --out FILE.svg`, `export DIR --csv FILE`, `--mcap FILE` or `--hdf5 FILE`,
/// `check DIR`, `grab`, `live`, `columns`. Bad input throws.
int run_record(int argc, char** argv) {
  CommandLine app("Looks at what kerf-recorder wrote.", "kerf-record", KERF_VERSION);
  app.footer(
      "\nExit codes: 0 fine, 1 the recording contradicts itself or is not whole, 2 bad input or "
      "set-up.");
  std::filesystem::path folder;
  std::filesystem::path report;
  std::filesystem::path svg;
  std::filesystem::path csv, mcap, hdf5;
  bool unpacked = false, scan = false;
  std::string time = "epoch";
  TickRange range;
  std::size_t arm = 1;
  std::string name = kDefaultName;
  const auto add_command = [&](const char* name, const char* what) {
    Arguments command = app.command(name, what);
    command.option("DIR", folder, "folder of a recording").required();
    command.option("--from", range.from, "the first tick").shown_as("TICK");
    command.option("--until", range.until, "the last tick").shown_as("TICK");
    return command;
  };
  const auto add_arm = [&](Arguments& command, const char* what) {
    command.option("--arm", arm, what).within(1, static_cast<double>(kMaxArms)).shows_default();
  };
  Arguments info = add_command("info", "length, losses, forces, removed volume");
  add_arm(info, "of a run with two devices, the figures of this one");
  info.option("--report", report, "write the figures as JSON");
  info.flag("--scan", scan,
            "read all rows of a log above 256 MB, too: else the recorder's figures");
  Arguments plot = add_command("plot", "forces and penetration over time, as SVG");
  add_arm(plot, "of a run with two devices, this one; 1 also draws the force of the other");
  plot.option("--out", svg, "the SVG file").required();
  Arguments table =
      add_command("export", "every tick for other programs: a line of text, MCAP, or HDF5");
  add_arm(table, "of a run with two devices, the one of the CSV; MCAP and HDF5 have both");
  table.option("--csv", csv, "as CSV").shown_as("FILE");
  table.option("--mcap", mcap, "as MCAP, for Foxglove, PlotJuggler and ROS 2").shown_as("FILE");
  table.option("--hdf5", hdf5, "as HDF5, for MATLAB, Octave, Julia and h5py").shown_as("FILE");
  table
      .option(
          "--time", time,
          "of MCAP and HDF5: epoch is UTC since 1970, monotonic the time since the machine started")
      .one_of({"epoch", "monotonic"})
      .shows_default();
  table.flag("--unpacked", unpacked, "the MCAP without LZ4, for readers that have none");
  Arguments all =
      app.command("check", "compare all that a recording says twice, and its checksums");
  bool repair = false;
  all.option("DIR", folder, "folder of a recording").required();
  all.flag("--repair", repair,
           "make manifest.json anew from scene and ticks if it is lost or wrong");
  Arguments keep = app.command("grab", "a running flight recorder keeps the ticks until now");
  keep.option("--name", name, "name of the controller").shows_default();
  LiveOptions live_to{.name = kDefaultName};
  Arguments live = app.command(
      "live", "send each tick of a running controller as JSON, as PlotJuggler takes it");
  live.option("--name", live_to.name, "name of the controller").shows_default();
  live.option("--udp", live_to.udp, "where to: [ADDRESS:]PORT").shows_default();
  live.option("--every", live_to.every, "one datagram for so many ticks")
      .within(1, 100'000)
      .shows_default();
  Arguments columns = app.command("columns", "what each column of a log says, as a page");
  bool as_msg = false;
  columns.flag("--msg", as_msg, "as the message kerf_msgs/msg/Tick of ROS 2");
  if (!app.parse(argc, argv, std::cout)) return 0;
  if (range.from > range.until) {
    throw UsageError("--from " + std::to_string(range.from) + " lies behind --until " +
                     std::to_string(range.until) + "; no tick lies between them");
  }
  --arm;  // from here on an index
  if (all.chosen()) return run_check(folder, repair);
  if (table.chosen() && csv.empty() && mcap.empty() && hdf5.empty()) {
    throw UsageError("export: as what? give --csv FILE, --mcap FILE or --hdf5 FILE");
  }
  if (table.chosen()) {
    check_distinct({{"--csv", csv, ".csv"}, {"--mcap", mcap, ".mcap"}, {"--hdf5", hdf5, ".h5"}});
  }
  CheckedRecording checked;
  if (info.chosen() || plot.chosen() || table.chosen()) {
    check_outputs(recording_files(folder), {{"--report", report, ".json"}});
    const CheckDepth depth =
        info.chosen() ? depth_for_info(folder, range, arm, scan) : CheckDepth::rows;
    checked = check_recording(folder, range, depth);
    require_arm(folder, checked.manifest, arm);
    if (!checked.rows_readable) return report_problems(checked);
  }
  bool is_whole = true;
  if (columns.chosen()) std::cout << (as_msg ? ros_channels()[ros_tick].definition : log_page());
  if (info.chosen()) {
    const ArmSummaries& figures =
        checked.summaries.empty() ? checked.manifest.summaries : checked.summaries;
    const RecordSummary& summary = figures[arm];
    const LogClock clock = read_clock(folder, checked.manifest.has_clock);
    const std::string date = date_of(folder, range, clock);
    if (checked.manifest.arms > 1) std::cout << "arm                 " << arm + 1 << " of 2\n";
    std::cout << "date                " << shown(date, clock) << '\n' << to_text(summary);
    report_clock(folder, clock);
    if (!report.empty()) write_new_file(report, to_json(summary, date));
  }
  if (plot.chosen()) {
    plot_forces(folder, svg, range, arm);
    if (!is_stream(svg)) std::cout << svg.string() << ": written\n";
  }
  LogClock clock;
  if (time == "epoch" && !(hdf5.empty() && mcap.empty())) {
    clock = read_clock(folder, checked.manifest.has_clock);
    if (!clock.has_date()) {
      std::cerr << "kerf-record: " << folder.string() << ": no date: monotonic"
                << (checked.manifest.has_clock ? "" : "; recordings of this version have one")
                << '\n';
    }
    report_clock(folder, clock);
  }
  if (!hdf5.empty()) {
    static_cast<void>(catch_stop_signals());  // leaves no half file
    export_hdf5(folder, hdf5, range, clock);
  }
  if (!csv.empty()) export_csv(folder, csv, range, arm);
  if (!mcap.empty()) {
    const auto packing = unpacked ? McapWriter::Packing::none : McapWriter::Packing::lz4;
    for (const std::string& line : export_mcap(folder, mcap, packing, range, clock)) {
      std::cerr << "kerf-record: " << line << '\n';
      is_whole = false;
    }
  }
  if (keep.chosen()) std::cout << grab(name).string() << ": kept\n";
  if (report_problems(checked) != 0 || !is_whole) return 1;
  return live.chosen() ? send_live(live_to, catch_stop_signals()) : 0;
}

}  // namespace
}  // namespace kerf

int main(int argc, char** argv) {
  kerf::make_signals_of_writes_errors();
  return kerf::run_program("kerf-record", [&] { return kerf::run_record(argc, argv); });
}
