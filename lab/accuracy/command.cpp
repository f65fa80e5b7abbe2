// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "controller/load/load_scene.hpp"
#include "controller/plan/plan_contact.hpp"
#include "hil/hil_error.hpp"
#include "lab/accuracy/proxy_study.hpp"
#include "lab/accuracy/study.hpp"
#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/text.hpp"

namespace kerf::accuracy {
namespace {

/// A column of the table on the terminal: its title, the metric, and a factor to the title's unit.
struct ShownMetric {
  const char* title;
  const char* metric;
  double factor;
};
constexpr std::array<ShownMetric, 3> kOfPaper{{{"force rms %", "force_vs_theory_rms", 100},
                                               {"direction deg", "force_direction_rms", 1},
                                               {"tool loop %", "loop_tool_rms", 100}}};
constexpr std::array<ShownMetric, 4> kOfProxy{{{"depth max vox", "depth_max", 1},
                                               {"force max %", "force_vs_theory_max", 100},
                                               {"direction max", "force_direction_max", 1},
                                               {"step max %", "step_max", 100}}};

void print(std::ostream& out, const std::vector<Entry>& entries,
           std::span<const ShownMetric> metrics) {
  out << format("%-13s %-17s %8s %7s", "knob", "value", "us p50", "p99");
  for (const ShownMetric& shown : metrics) out << format(" %14s", shown.title);
  out << '\n';
  for (const Entry& entry : entries) {
    out << format("%-13s %-17s", entry.knob.c_str(), entry.value.c_str());
    if (entry.figures.empty()) {
      out << '\n';
      continue;
    }
    out << format(" %8.2f %7.2f", entry.times.p50_ns / 1e3, entry.times.p99_ns / 1e3);
    for (const ShownMetric& shown : metrics) {
      const double* figure = entry.find(shown.metric);
      out << (figure == nullptr ? format(" %14s", "-") : format(" %14.3g", *figure * shown.factor));
    }
    out << '\n';
  }
}

/// What a scene of the default contact has: the tool of its first arm and its finest voxel, which
/// `out` gets as a line.
ProxySubject subject_of(const std::string& path, std::ostream& out) {
  const LoadedScene scene = load_scene(path);
  if (scene.force.model == ForceModel::paper) {
    throw HilError("--scene: " + path +
                   " has the paper's force; its errors are those without --scene");
  }
  if (scene.force.model == ForceModel::external || scene.volumes.empty() || scene.tools.empty()) {
    throw HilError("--scene: " + path + " has no contact of a tool with a volume; name another");
  }
  const ProxySubject subject{scene.tools[scene.active_tool], contact_unit_mm(scene)};
  out << format("tool %s%s, voxels of %.4g mm\n", subject.tool.name.c_str(),
                scene.second ? " of the first arm (the second arm's is not measured)" : "",
                subject.voxel_mm);
  return subject;
}

/// `kerf-lab accuracy`: each knob of the contact against analytic shapes.
class AccuracyCommand final : public LabCommand {
 public:
  explicit AccuracyCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string scene_, report_, csv_, plot_, page_;
  int core_ = -1;
};

AccuracyCommand::AccuracyCommand(Arguments& program)
    : LabCommand(program, "accuracy", "each knob of the contact against analytic shapes") {
  app_.option("--scene", scene_,
              "measure the tool that this scene begins with, of two arms the first one's, in its "
              "voxels, "
              "twice and half of them: the default contact alone")
      .shown_as("FILE");
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.option("--csv", csv_, "write the figures as a table").shown_as("FILE");
  app_.option("--plot", plot_, "draw error against time as SVG").shown_as("FILE");
  app_.option("--page", page_,
              "write the figures as their part of a page (docs/contact.md), and the plot in plots/ "
              "beside it unless --plot says where")
      .shown_as("FILE");
  app_.option("--cpu", core_, "core to run on (default: the last)").within(0, 1023);
}

int AccuracyCommand::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_, ".json");
  const LabOutput as_csv("--csv", csv_, ".csv");
  const LabOutput as_page("--page", page_, ".md");
  const std::string plot = plot_.empty() ? page_plot("--page", page_, ".accuracy.svg") : plot_;
  const LabOutput as_plot("--plot", plot, ".svg");
  LabOutput::check_distinct({&as_json, &as_csv, &as_page, &as_plot});
  if (!scene_.empty() && !(page_.empty() && plot.empty())) {
    throw HilError("--scene: page and plot are those of the standard; use --csv or --report");
  }
  const ProxySubject subject = scene_.empty() ? ProxySubject::standard() : subject_of(scene_, out);
  if (!plot.empty()) check_can_plot();
  const int core = pin_lab(core_);
  std::vector<Entry> entries, of_proxy;
  {
    const ProgressBar bar(true);
    const auto show = [&](double share, const std::string& what) { bar.show(share, what); };
    of_proxy = proxy_study({}, subject, show);
    if (scene_.empty()) entries = study({}, show);
  }
  print(out, of_proxy, kOfProxy);
  if (!entries.empty()) print(out << '\n', entries, kOfPaper);
  entries.insert(entries.begin(), of_proxy.begin(), of_proxy.end());
  const std::string report = json(entries, core);
  as_json.write(report);
  as_csv.write(csv(entries));
  as_plot.write_report({"accuracy", "plot"}, report, out);
  if (!page_.empty()) {
    as_page.write_part("accuracy",
                       make_report({"accuracy", "page", page_link(page_, plot)}, report), out);
  }
  return 0;
}

}  // namespace
}  // namespace kerf::accuracy

std::unique_ptr<kerf::LabCommand> kerf::make_accuracy_command(Arguments& program) {
  return std::make_unique<accuracy::AccuracyCommand>(program);
}
