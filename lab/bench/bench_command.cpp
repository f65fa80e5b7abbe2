// SPDX-License-Identifier: Apache-2.0
#include "lab/bench/bench_command.hpp"

#include <cstdio>
#include <ostream>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "lab/bench/kernel_bench.hpp"
#include "lab/bench/layout_bench.hpp"
#include "lab/bench/performance_page.hpp"
#include "lab/bench/query_bench.hpp"
#include "lab/rig/lab_run.hpp"

namespace kerf {
namespace {

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

std::string json_of(const std::vector<KernelRow>& rows, const std::vector<KernelRow>& queries,
                    const std::vector<KernelRow>& layout, int core) {
  nlohmann::ordered_json report;
  report["core"] = core;
  report["rows"] = json_of(rows);
  report["probes"] = json_of(queries);
  report["layout"] = json_of(layout);
  return report.dump(2) + "\n";
}

}  // namespace

BenchCommand::BenchCommand(CLI::App& program)
    : LabCommand(program, "bench",
                 "the servo's kernels against the paper's form, for each instruction set") {
  app_->add_option("--report", report_, "write the figures as JSON")->type_name("FILE");
  app_->add_option("--page", page_,
                   "write the figures as their part of a page (docs/performance.md)")
      ->type_name("FILE");
  app_->add_option("--cpu", core_, "core to run on (default: the last)")
      ->check(CLI::Range(0, 1023));
}

int BenchCommand::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_);
  const LabOutput as_page("--page", page_);
  LabOutput::check_distinct({&as_json, &as_page});
  const int core = pin_lab(core_);
  out << "ns a tick on core " << core << "; 256 x 256 x 161 voxels; ratio to the paper's form\n"
      << "tick                     number way               p50        p99    ratio        "
         "bytes\n";
  const auto add_row = [&](const KernelRow& row) { out << line_of(row) << std::endl; };
  const auto rows = bench_kernels(add_row);
  const auto queries = bench_queries(add_row);
  const auto layout = bench_layout(add_row);
  as_json.write(json_of(rows, queries, layout, core));
  as_page.write_part("kernels", performance_page(rows, queries, layout));
  return 0;
}

}  // namespace kerf
