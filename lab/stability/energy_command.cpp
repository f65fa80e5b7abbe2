// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "lab/stability/energy_measures.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/json.hpp"

namespace kerf::energy {
namespace {

/// lab/report/energy.py has its form.
std::string json_of(const std::vector<LoopWork>& loops, const std::vector<Feel>& feels,
                    const std::vector<TickCostRow>& costs) {
  Json json;
  json["provenance"] = lab_provenance();
  for (const LoopWork& row : loops) {
    json["loops"].push_back({{"model", row.model},
                             {"numeric", row.numeric},
                             {"share", row.share},
                             {"most_share", row.most_share},
                             {"friction_mj", row.friction_mj},
                             {"leak_mj", row.leak_mj}});
  }
  for (const Feel& row : feels) {
    json["feel"].push_back({{"hand", row.hand},
                            {"stiffness_n_per_mm", row.stiffness_n_per_mm},
                            {"stabiliser", row.stabiliser},
                            {"peak_n", row.peak_n},
                            {"delay_ms", row.delay_ms},
                            {"depth_mm", row.depth_mm},
                            {"swing_mm", row.swing_mm},
                            {"drag_n", row.air_n},
                            {"port_minimum_mj", row.port_minimum_mj}});
  }
  for (const TickCostRow& row : costs) {
    json["cost"].push_back({{"name", row.name}, {"numeric", row.numeric}, {"ns", row.ns}});
  }
  return json.document();
}

/// `kerf-lab energy`: work of closed paths, and the cost of stabilisers to the hand and to the
/// processor.
class EnergyCommand final : public LabCommand {
 public:
  explicit EnergyCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, page_;
  int core_ = -1;
};

EnergyCommand::EnergyCommand(Arguments& program)
    : LabCommand(program, "energy", "work at the device port, and the cost of stabilisers") {
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.option("--page", page_, "write the figures as their part of a page (docs/stability.md)")
      .shown_as("FILE");
  app_.option("--cpu", core_, "core to run on (default: the last)").within(0, 1023);
  app_.footer("Exit codes: 0 every limit is kept, 1 one is not, 2 bad input or set-up.");
}

int EnergyCommand::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_, ".json");
  const LabOutput as_page("--page", page_, ".md");
  LabOutput::check_distinct({&as_json, &as_page});
  static_cast<void>(pin_lab(core_));
  const std::vector<LoopWork> loops = closed_loops();
  const std::vector<Feel> feels = stabiliser_feel();
  const std::vector<TickCostRow> costs = ledger_costs();
  const std::string report = json_of(loops, feels, costs);
  out << make_report({"energy", "tables"}, report);
  as_json.write(report);
  if (!page_.empty()) as_page.write_part("energy", make_report({"energy", "page"}, report), out);
  return std::ranges::all_of(loops, [](const LoopWork& row) { return row.share <= row.most_share; })
             ? 0
             : 1;
}

}  // namespace
}  // namespace kerf::energy

std::unique_ptr<kerf::LabCommand> kerf::make_energy_command(Arguments& program) {
  return std::make_unique<energy::EnergyCommand>(program);
}
