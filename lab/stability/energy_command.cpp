// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "lab/stability/energy_measures.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::energy {
namespace {

constexpr const char* kHead = R"(# Energy at the device port

Work at the device port by the servo's own energy ledger (docs/theory.md 5.5), and the cost of the stabilisers
(docs/theory.md 5.6). Positive energy flows from the hand into the loop. `./kerf lab energy --page docs/energy.md` writes this page.

)";

std::string loops_text(const std::vector<LoopWork>& loops) {
  std::string text = R"(## Closed paths on a static ball

A ball of 1 mm radius, at a penetration of 0.6 mm in a ball of 3 mm, moves twice along each of six tilted circles of
0.375 mm. The figures are of the second lap.

* `ratio`: |SUM dW| / SUM |dW| of the contact force without sample and hold, on the worst circle. A force with a potential
  has 0: a closed path gives no energy.
* `friction`: mean work of a lap that friction takes from the hand.
* `leak`: mean work of a lap that sample and hold takes; it is negative, so the loop gives this energy to the hand.

| model | numbers | ratio | at most | friction mJ | leak mJ |
|---|---|---|---|---|---|
)";
  for (const LoopWork& row : loops) {
    text += format("| %s | %s | %.2g | %.2g | %.4f | %.5f |\n", row.model.c_str(),
                   row.numeric.c_str(), row.share, row.most_share, row.friction_mj, row.leak_mj);
  }
  return text;
}

std::string feel_text(const std::vector<Feel>& rows) {
  std::string text = R"(
## The effect of a stabiliser on the hand

A hand pushes with 1 N from 0.1 mm above a wall and releases after 2 s. Fixed point, 1 kHz, encoder steps of 0.055 mm,
the limits of an Omni, no virtual damping.

* `hand`: `bare` is the device alone, 0.045 kg and 0.2 N s/m; `gripped` is with a hand, 0.145 kg and 3.2 N s/m. The
  stabilisers have the device's figures only.
* `delay`: from first contact to half of the push (3000: never).
* `depth`, `swing`: mean penetration and its peak-to-peak value in the last half second of the push.
* `drag`: largest force in air after the release.
* `minimum`: lowest energy of the port. The correction of `passivity` comes one tick late. With a hand that damps the
  device anyway, a stiff wall may give a lower minimum than without a stabiliser.

| hand | K N/mm | stabiliser | peak N | delay ms | depth mm | swing mm | drag N | minimum mJ |
|---|---|---|---|---|---|---|---|---|
)";
  for (const Feel& row : rows) {
    text += format("| %s | %g | %s | %.2f | %.0f | %.2f | %.3f | %.2f | %.3f |\n", row.hand.c_str(),
                   row.stiffness_n_per_mm, row.stabiliser.c_str(), row.peak_n, row.delay_ms,
                   row.depth_mm, row.swing_mm, row.air_n, row.port_minimum_mj);
  }
  return text;
}

std::string cost_text(const std::vector<TickCostRow>& rows) {
  std::string text = R"(
## The time they take

Time added to a tick in contact, in one run. Limit for ledger, observer and split of the spring: 1000 ns.

| what | numbers | ns a tick |
|---|---|---|
)";
  for (const TickCostRow& row : rows) {
    text += format("| %s | %s | %.0f |\n", row.name.c_str(), row.numeric.c_str(), row.ns);
  }
  return text;
}

std::string json_of(const std::vector<LoopWork>& loops, const std::vector<Feel>& feels,
                    const std::vector<TickCostRow>& costs) {
  Json json;
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
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, page_;
  int core_ = -1;
};

Command::Command(Arguments& program)
    : LabCommand(program, "energy", "work at the device port, and what stabilisers cost") {
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.option("--page", page_, "write the figures as a page (docs/energy.md)").shown_as("FILE");
  app_.option("--cpu", core_, "core to run on (default: the last)").within(0, 1023);
  app_.footer("Exit codes: 0 every limit is kept, 1 one is not, 2 bad input or set-up.");
}

int Command::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_, ".json");
  const LabOutput as_page("--page", page_, ".md");
  LabOutput::check_distinct({&as_json, &as_page});
  static_cast<void>(pin_lab(core_));
  const std::vector<LoopWork> loops = closed_loops();
  const std::vector<Feel> feels = stabiliser_feel();
  const std::vector<TickCostRow> costs = ledger_costs();
  const std::string tables = loops_text(loops) + feel_text(feels) + cost_text(costs);
  out << tables;
  as_json.write(json_of(loops, feels, costs));
  as_page.write(kHead + tables + "\n" + lab_provenance() + "\n");
  return std::ranges::all_of(loops, [](const LoopWork& row) { return row.share <= row.most_share; })
             ? 0
             : 1;
}

}  // namespace
}  // namespace kerf::energy

std::unique_ptr<kerf::LabCommand> kerf::make_energy_command(Arguments& program) {
  return std::make_unique<energy::Command>(program);
}
