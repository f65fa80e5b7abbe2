// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "hil/hil_error.hpp"
#include "lab/bench/kernel_bench.hpp"
#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

#ifdef KERF_SANITIZED
constexpr bool kSanitized = true;  // and without the files that measure
#else
constexpr bool kSanitized = false;
#endif

std::string line_of(const KernelRow& row) {
  char text[160];
  std::snprintf(text, sizeof text, "%-24s %-6s %-10s %10.0f %10.0f %8.3g %12zu", row.name.c_str(),
                row.numeric.c_str(), row.isa.c_str(), row.p50_ns, row.p99_ns, row.ratio(),
                row.bytes);
  return text;
}

Json json_of(const std::vector<KernelRow>& rows) {
  Json list = Json::List{};
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

[[maybe_unused]] std::string json_of(const std::vector<KernelRow>& rows,
                                     const std::vector<KernelRow>& queries,
                                     const std::vector<KernelRow>& layout, int core) {
  Json report;
  report["core"] = core;
  report["provenance"] = lab_provenance();
  report["rows"] = json_of(rows);
  report["queries"] = json_of(queries);
  report["layout"] = json_of(layout);
  return report.document();
}

/// `kerf-lab bench`: the servo's kernels against the paper's form.
class BenchCommand final : public LabCommand {
 public:
  explicit BenchCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, page_;
  int core_ = -1;
};

BenchCommand::BenchCommand(Arguments& program)
    : LabCommand(program, "bench",
                 "the servo's kernels against the paper's form, for each instruction set") {
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.option("--page", page_, "write the figures as their part of a page (docs/performance.md)")
      .shown_as("FILE");
  app_.option("--cpu", core_, "core to run on (default: the last)").within(0, 1023);
}

int BenchCommand::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_, ".json");
  const LabOutput as_page("--page", page_, ".md");
  LabOutput::check_distinct({&as_json, &as_page});
  const int core = pin_lab(core_);
  if constexpr (kSanitized) {
    throw HilError("bench: a sanitized build's times mean nothing; use the release preset");
  } else {
    out << "ns a tick on core " << core << "; 256 x 256 x 161 voxels; ratio to the paper's form\n"
        << "tick                     number kernel            p50        p99    ratio        "
           "bytes\n";
    const auto add_row = [&](const KernelRow& row) { out << line_of(row) << std::endl; };
    const auto rows = bench_kernels(add_row);
    const auto queries = bench_queries(add_row);
    const auto layout = bench_layout(add_row);
    const std::string report = json_of(rows, queries, layout, core);
    as_json.write(report);
    if (!page_.empty()) {
      as_page.write_part("kernels", make_report({"kernels", "page", page_}, report), out);
    }
    return 0;
  }
}

}  // namespace
}  // namespace kerf

std::unique_ptr<kerf::LabCommand> kerf::make_bench_command(Arguments& program) {
  return std::make_unique<BenchCommand>(program);
}
