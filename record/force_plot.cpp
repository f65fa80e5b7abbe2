// SPDX-License-Identifier: Apache-2.0
#include "record/force_plot.hpp"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "record/recording.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/layout.hpp"

extern char** environ;  // NOLINT(readability-identifier-naming): POSIX

namespace kerf {
namespace {

/// A file in memory, which ends with the process at the latest.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("kerf-plot", MFD_CLOEXEC)) {
    if (fd_ < 0) fail();
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] int fd() const noexcept { return fd_; }
  void write(const std::string& text) const {
    std::size_t done = 0;
    while (done < text.size()) {
      const ssize_t bytes =
          pwrite(fd_, text.data() + done, text.size() - done, static_cast<off_t>(done));
      if (bytes <= 0) fail();
      done += static_cast<std::size_t>(bytes);
    }
  }
  [[nodiscard]] std::string text() const {
    std::string text;
    std::array<char, 65536> part;
    for (ssize_t bytes = 0;
         (bytes = pread(fd_, part.data(), part.size(), static_cast<off_t>(text.size()))) > 0;) {
      text.append(part.data(), static_cast<std::size_t>(bytes));
    }
    return text;
  }

 private:
  [[noreturn]] static void fail() {
    throw RecordError("gnuplot: no file in memory (" + std::generic_category().message(errno) +
                      "); make room");
  }
  int fd_;
};

/// Exit code of gnuplot with `script`, its picture in `drawn` and its messages in `log`; throws
/// without gnuplot.
[[nodiscard]] int run_gnuplot(const MemoryFile& script, const MemoryFile& drawn,
                              const MemoryFile& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, script.fd(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, drawn.fd(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, log.fd(), STDERR_FILENO);
  std::string program = "gnuplot";
  std::string argument = "/dev/stdin";
  std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw RecordError("gnuplot: " + std::generic_category().message(error) +
                      "; apt-get install gnuplot-nox");
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

std::string gnuplot_svg(const std::string& script) {
  const MemoryFile commands;
  const MemoryFile drawn;
  const MemoryFile log;
  commands.write(script);
  const int code = run_gnuplot(commands, drawn, log);
  std::string picture = drawn.text();
  if (code != 0 || picture.find("</svg>") == std::string::npos) {
    std::string message = log.text();
    for (char& c : message) c = c == '\n' ? ' ' : c;
    throw RecordError("gnuplot: exit " + std::to_string(code) + " " + message +
                      "; try another version");
  }
  return picture;
}

namespace {

constexpr std::size_t kMaxPoints = 4000;  // twice the pixels across a wide screen

// Colours of Okabe and Ito, which differ for every kind of colour vision. The commanded force lies
// broad under the contact force that it mostly follows.
constexpr std::string_view kStyle = R"(
set encoding utf8
set terminal svg size 960,920 dynamic font 'Helvetica,13' background rgb 'white' linewidth 1.2
set grid back linecolor rgb '#dddddd' linetype 1 linewidth 0.5
set border 3 linecolor rgb '#555555'
set tics nomirror out textcolor rgb '#333333'
set lmargin at screen 0.10
set rmargin at screen 0.91
set multiplot
)";
constexpr std::string_view kPanels = R"(
set tmargin at screen 0.95
set bmargin at screen 0.70
set key at screen 0.09, 0.98 left horizontal Left reverse samplen 2 textcolor rgb '#333333'
set format x ''
set yrange [0:0.01<*]
set ylabel 'force (N)'
plot $commanded with lines linecolor rgb '#E69F00' linewidth 3 title 'commanded', \
     $contact with lines linecolor rgb '#0072B2' title 'contact', \
     $modification with lines linecolor rgb '#009E73' title 'modification'
set tmargin at screen 0.64
set bmargin at screen 0.39
set key at screen 0.09, 0.67
set ylabel 'penetration (mm)'
set y2label 'removed (mm³)'
set y2range [0:0.01<*]
set border 11
set y2tics nomirror out textcolor rgb '#333333'
plot $penetration with lines linecolor rgb '#0072B2' title 'penetration', \
     $removed axes x1y2 with lines linecolor rgb '#D55E00' linewidth 1.6 title 'removed volume'
unset y2tics
unset y2label
set border 3
set tmargin at screen 0.33
set bmargin at screen 0.07
set key at screen 0.09, 0.36
set format x '%g'
set xlabel 'time (s)'
set ylabel 'work of the hand (mJ)'
set autoscale y
set xzeroaxis linecolor rgb '#555555'
)";
// For the sources in their order.
constexpr std::array<std::string_view, kEnergySources> kSourceColours = {
    "#0072B2", "#009E73", "#D55E00", "#CC79A7", "#F0E442", "#999999", "#56B4E9", "#7B3F00"};

struct Curve {
  std::string_view name;
  Envelope envelope;
  bool is_zero = true;

  /// A value that is not finite would stop the plot; it becomes 0 there, and stays in the log.
  void add(double x, double y) {
    is_zero = is_zero && !(std::abs(y) > 0);
    envelope.add(x, std::isfinite(y) ? y : 0);
  }
};

/// The work at the port over all, and by each source that did any.
[[nodiscard]] std::string energy_panel(std::span<const Curve> sources) {
  std::string plot = "plot $port with lines linecolor rgb '#E69F00' linewidth 3 title 'all'";
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (sources[i].is_zero) continue;
    const std::string name(sources[i].name);
    plot += ", $" + name + " with lines linecolor rgb '" + std::string(kSourceColours[i]) +
            "' title '" + name + "'";
  }
  return plot + "\nunset multiplot\n";
}

[[nodiscard]] std::string gnuplot_script(const std::filesystem::path& folder) {
  const Manifest manifest = read_manifest(folder);
  TickLogReader log(folder / kTickLogName);
  if (log.rows() == 0) {
    throw RecordError((folder / kTickLogName).string() + ": 0 rows; nothing to plot");
  }
  const Envelope empty(log.rows(), kMaxPoints);
  std::vector<Curve> curves;
  for (const std::string_view name :
       {"contact", "modification", "commanded", "penetration", "removed", "port"}) {
    curves.push_back({name, empty});
  }
  const std::size_t first_source = curves.size();
  for (const std::string_view name : kEnergySourceNames) curves.push_back({name, empty});
  double removed = 0;
  double end_s = 0;
  std::uint64_t first_tick = 0;
  log.for_each([&](const TickRecord& record) {
    if (first_tick == 0) first_tick = record.tick;
    end_s = static_cast<double>(record.tick - first_tick) * manifest.tick_ns * 1e-9;
    if ((record.flags & kFlagReset) != 0) removed = 0;
    removed += removed_mm3(record, manifest.voxel_mm3);
    if (record.stale != 0) return;  // without contact; the curves continue at the next tick
    const std::array values{magnitude(record.contact_force_n),
                            magnitude(record.modification_force_n),
                            magnitude(record.commanded_force_n),
                            double{record.penetration_mm},
                            removed,
                            record.port_energy_j * 1000};
    for (std::size_t i = 0; i < values.size(); ++i) curves[i].add(end_s, values[i]);
    for (std::size_t i = 0; i < kEnergySources; ++i) {
      curves[first_source + i].add(end_s, energy_mj_of_steps(record.*kEnergyColumns[i]));
    }
  });
  std::ostringstream script;
  script.precision(9);
  script << kStyle << "set xrange [0:" << end_s + manifest.tick_ns * 1e-9 << "]\n";
  for (Curve& curve : curves) {
    script << '$' << curve.name << " << EOD\n";
    for (const Envelope::Point& p : curve.envelope.points()) script << p.x << ' ' << p.y << '\n';
    script << "EOD\n";
  }
  script << kPanels << energy_panel(std::span(curves).subspan(first_source));
  return script.str();
}

}  // namespace

void plot_forces(const std::filesystem::path& folder, const std::filesystem::path& svg) {
  check_outputs(recording_files(folder), {{"--out", svg, ".svg"}});
  write_new_file(svg, gnuplot_svg(gnuplot_script(folder)));
}

}  // namespace kerf
