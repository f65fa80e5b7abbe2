// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/program.hpp"

#include <cstdio>
#include <ostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "hil/hil_error.hpp"
#include "hil/lab/accuracy/command.hpp"
#include "hil/lab/faults/command.hpp"
#include "hil/lab/kernel_bench.hpp"
#include "hil/lab/lab_run.hpp"
#include "hil/lab/layout_bench.hpp"
#include "hil/lab/performance_page.hpp"

namespace kerf {
namespace {

constexpr const char* kExitCodes = "Exit codes: 0 fine, 1 a check failed, 2 bad input or set-up.";

std::string line_of(const KernelRow& row) {
  char text[160];
  std::snprintf(text, sizeof text, "%-24s %-6s %-10s %10.0f %10.0f %8.3g %12zu", row.name.c_str(),
                row.numeric.c_str(), row.isa.c_str(), row.p50_ns, row.p99_ns, row.ratio(),
                row.bytes);
  return text;
}

nlohmann::ordered_json json_of(const std::vector<KernelRow>& rows) {
  auto list = nlohmann::ordered_json::array();
  for (const KernelRow& row : rows) {
    list.push_back({{"name", row.name},
                    {"numeric", row.numeric},
                    {"isa", row.isa},
                    {"ns_p50", row.p50_ns},
                    {"ns_p99", row.p99_ns},
                    {"baseline_ns_p50", row.baseline_p50_ns},
                    {"ratio", row.ratio()},
                    {"bytes", row.bytes}});
  }
  return list;
}

std::string json_of(const std::vector<KernelRow>& rows, const std::vector<KernelRow>& layout,
                    int core) {
  nlohmann::ordered_json report;
  report["core"] = core;
  report["rows"] = json_of(rows);
  report["layout"] = json_of(layout);
  return report.dump(2) + "\n";
}

}  // namespace

int run_lab(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CLI::App app{"Measures kerf without a device.", "kerf-lab"};
  app.set_version_flag("--version", "kerf-lab " KERF_VERSION);
  app.footer(kExitCodes);
  app.require_subcommand(1);
  std::string report, page;
  int core = -1;
  CLI::App* bench = app.add_subcommand(
      "bench", "the servo's kernels against the paper's form, for each instruction set");
  bench->add_option("--report", report, "write the figures as JSON")->type_name("FILE");
  bench->add_option("--page", page, "write the figures as a page (docs/performance.md)")
      ->type_name("FILE");
  bench->add_option("--cpu", core, "core to run on (default: the last)")
      ->check(CLI::Range(0, 1023));
  bench->footer(kExitCodes);
  accuracy::Command accuracy(app);
  const faults::Command faults(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, err) == 0 ? 0 : 2;
  }
  try {
    if (accuracy.chosen()) {
      accuracy.run(out);
      return 0;
    }
    if (faults.chosen()) return faults.run(out);
    const LabOutput as_json("--report", report);
    const LabOutput as_page("--page", page);
    LabOutput::check_distinct({&as_json, &as_page});
    core = pin_lab(core);
    out << "ns a tick on core " << core << "; 256 x 256 x 161 voxels; ratio to the paper's form\n"
        << "tick                     number way               p50        p99    ratio        "
           "bytes\n";
    const auto told = [&](const KernelRow& row) { out << line_of(row) << std::endl; };
    const auto rows = bench_kernels(told);
    const auto layout = bench_layout(told);
    as_json.write(json_of(rows, layout, core));
    as_page.write(performance_page(rows, layout));
  } catch (const HilError& error) {
    err << "kerf-lab: " << error.what() << '\n';
    return 2;
  }
  return 0;
}

}  // namespace kerf
