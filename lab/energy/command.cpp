// SPDX-License-Identifier: Apache-2.0
#include "lab/energy/command.hpp"

#include <algorithm>
#include <ostream>
#include <vector>

#include "lab/energy/closed_loops.hpp"
#include "lab/energy/ledger_cost.hpp"
#include "lab/energy/stabiliser_feel.hpp"
#include "lab/rig/lab_run.hpp"
#include "shared/text/format.hpp"
#include "shared/text/json.hpp"

namespace kerf::energy {
namespace {

constexpr const char* kHead = R"(# Energy at the device port

What the loop takes from the hand and gives it, by the servo's own ledger (docs/theory.md 5.5), and what the
stabilisers cost (docs/theory.md 5.6). `./kerf lab energy --page docs/energy.md` writes this page.

)";

std::string loops_text(const std::vector<LoopWork>& loops) {
  std::string text = R"(## Closed ways on a static ball

A ball of 1 mm, 0.6 mm deep in a ball of 3 mm, is led twice around six tilted circles of 0.375 mm; of the second lap.
`share` is |SUM dW| / SUM |dW| of the contact force as if it was never sampled, the worst circle: 0 for a force with a
potential, which gives no energy from nothing. `friction` and `leak` are the means of a lap, taken from the hand: the
leak of the sample and hold is what a real loop gives beyond that.

| model | numbers | share | at most | friction mJ | leak mJ |
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
## What a stabiliser costs the hand

A hand pushes by 1 N from 0.1 mm above a wall and lets go after 2 s. Fixed point, 1 kHz, encoder steps of 0.055 mm, the
limits of an Omni, no virtual damping. `bare` is the device alone, 0.045 kg and 0.2 N s/m, `gripped` with a hand,
0.145 kg and 3.2 N s/m; the stabilisers only know the device. `delay` is from the touch to half of the push (3000:
never), `depth` and `swing` are mean and peak to peak of the last half second under the push, `drag` the largest force
in the air afterwards, `minimum` the lowest energy of the port. `passivity` pays a tick late: behind a hand that brings
the device to rest anyway, a stiff wall may leave the port with less than no stabiliser does.

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
## What they cost the processor

Added to a tick in contact, in one run; the ledger with its observer and the split of the spring, at most 1000 ns.

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

}  // namespace

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

}  // namespace kerf::energy
