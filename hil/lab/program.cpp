// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/program.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <ostream>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <sched.h>

#include "hil/hil_error.hpp"
#include "hil/lab/kernel_bench.hpp"

namespace kerf {
namespace {

constexpr const char* kExitCodes = "Exit codes: 0 fine, 2 bad input or set-up.";

/// Every figure of one run comes from one core.
int pin_to_core(int core) {
  if (core < 0) core = static_cast<int>(std::thread::hardware_concurrency()) - 1;
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(static_cast<unsigned>(core), &cores);
  if (sched_setaffinity(0, sizeof cores, &cores) != 0) {
    throw HilError("--cpu " + std::to_string(core) + ": not a core that this process may use");
  }
  return core;
}

std::string line_of(const KernelRow& row) {
  char text[160];
  std::snprintf(text, sizeof text, "%-24s %-6s %-10s %10.0f %10.0f %8.1f %12zu", row.name.c_str(),
                row.numeric.c_str(), row.isa.c_str(), row.p50_ns, row.p99_ns, row.ratio(),
                row.bytes);
  return text;
}

/// A report that appears under its name only when it is whole. Opened before the measurement, so
/// that a wrong name costs nothing.
class ReportFile {
 public:
  explicit ReportFile(std::string file) : file_(std::move(file)), part_(file_ + ".part") {
    stream_.open(part_);
    if (!stream_) refuse();
  }
  ReportFile(const ReportFile&) = delete;
  ReportFile& operator=(const ReportFile&) = delete;
  ~ReportFile() {
    std::error_code ignored;
    std::filesystem::remove(part_, ignored);
  }

  void write(const std::vector<KernelRow>& rows, int core) {
    nlohmann::ordered_json report;
    report["core"] = core;
    report["rows"] = nlohmann::ordered_json::array();
    for (const KernelRow& row : rows) {
      report["rows"].push_back({{"name", row.name},
                                {"numeric", row.numeric},
                                {"isa", row.isa},
                                {"ns_p50", row.p50_ns},
                                {"ns_p99", row.p99_ns},
                                {"baseline_ns_p50", row.baseline_p50_ns},
                                {"ratio", row.ratio()},
                                {"bytes", row.bytes}});
    }
    stream_ << report.dump(2) << '\n';
    stream_.close();
    std::error_code failed;
    if (stream_) std::filesystem::rename(part_, file_, failed);
    if (!stream_ || failed) refuse();
  }

 private:
  [[noreturn]] void refuse() const {
    throw HilError("--report " + file_ + ": cannot be written; check the folder and its rights");
  }

  std::string file_, part_;
  std::ofstream stream_;
};

}  // namespace

int run_lab(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CLI::App app{"Measures kerf without a device.", "kerf-lab"};
  app.set_version_flag("--version", "kerf-lab " KERF_VERSION);
  app.footer(kExitCodes);
  app.require_subcommand(1);
  std::string report;
  int core = -1;
  CLI::App* bench = app.add_subcommand(
      "bench", "the servo's kernels against the paper's form, for each instruction set");
  bench->add_option("--report", report, "write the figures as JSON")->type_name("FILE");
  bench->add_option("--cpu", core, "core to run on (default: the last)")
      ->check(CLI::NonNegativeNumber);
  bench->footer(kExitCodes);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, err) == 0 ? 0 : 2;
  }
  try {
    std::optional<ReportFile> file;
    if (!report.empty()) file.emplace(report);
    core = pin_to_core(core);
    out << "ns a tick on core " << core << "; 256 x 256 x 161 voxels; ratio to the paper's form\n"
        << "tick                     number way               p50        p99    ratio        "
           "bytes\n";
    const auto rows =
        bench_kernels([&](const KernelRow& row) { out << line_of(row) << std::endl; });
    if (file) file->write(rows, core);
  } catch (const HilError& error) {
    err << "kerf-lab: " << error.what() << '\n';
    return 2;
  }
  return 0;
}

}  // namespace kerf
