// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "lab/accuracy/study.hpp"
#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/report_tool.hpp"

namespace kerf::accuracy {
namespace {

constexpr const char* kHead =
    "knob          value              us p50    p99  force rms %  direction deg  tool loop\n";

std::string line_of(const Entry& entry) {
  char text[160];
  std::snprintf(text, sizeof text, "%-13s %-16s %8.2f %6.2f %12.2f %14.3f %10.1e",
                entry.knob.c_str(), entry.value.c_str(), entry.times.p50_ns / 1e3,
                entry.times.p99_ns / 1e3, *entry.find("force_vs_theory_rms") * 100,
                *entry.find("force_direction_rms"), *entry.find("loop_tool_rms"));
  return text;
}

/// `kerf-lab accuracy`: each knob of the contact force against analytic shapes.
class AccuracyCommand final : public LabCommand {
 public:
  explicit AccuracyCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, csv_, plot_, page_;
  int core_ = -1;
};

AccuracyCommand::AccuracyCommand(Arguments& program)
    : LabCommand(program, "accuracy", "each knob of the contact force against analytic shapes") {
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.option("--csv", csv_, "write the figures as a table").shown_as("FILE");
  app_.option("--plot", plot_, "draw error against time as SVG").shown_as("FILE");
  app_.option("--page", page_,
              "write the figures as a page (docs/accuracy.md), and the plot in plots/ beside it "
              "unless --plot says where")
      .shown_as("FILE");
  app_.option("--cpu", core_, "core to run on (default: the last)").within(0, 1023);
}

int AccuracyCommand::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_, ".json");
  const LabOutput as_csv("--csv", csv_, ".csv");
  const LabOutput as_page("--page", page_, ".md");
  const std::string plot = plot_.empty() ? page_plot("--page", page_, ".svg") : plot_;
  const LabOutput as_plot("--plot", plot, ".svg");
  LabOutput::check_distinct({&as_json, &as_csv, &as_page, &as_plot});
  if (!plot.empty()) check_can_plot();
  const int core = pin_lab(core_);
  std::vector<Entry> entries;
  {
    const ProgressBar bar(true);
    entries = study({}, [&](double share, const std::string& what) { bar.show(share, what); });
  }
  out << kHead;
  for (const Entry& entry : entries) out << line_of(entry) << '\n';
  const std::string report = json(entries, core);
  as_json.write(report);
  as_csv.write(csv(entries));
  as_plot.write_report({"accuracy", "plot"}, report, out);
  if (!page_.empty()) {
    as_page.write_report({"accuracy", "page", page_link(page_, plot)}, report, out);
  }
  return 0;
}

}  // namespace
}  // namespace kerf::accuracy

std::unique_ptr<kerf::LabCommand> kerf::make_accuracy_command(Arguments& program) {
  return std::make_unique<accuracy::AccuracyCommand>(program);
}
