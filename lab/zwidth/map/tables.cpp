// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/map/tables.hpp"

#include <utility>

#include "controller/stability/passive_limits.hpp"
#include "controller/stability/stable_gains.hpp"
#include "shared/text/json.hpp"
#include "shared/text/number.hpp"

namespace kerf::zwidth {
namespace {

Json crossing_json(const Crossing& crossing) {
  const bool all = crossing.first_n_per_mm == Crossing::kNever;
  return Json{{"first_n_per_mm", crossing.first_n_per_mm},  // null where all cells are fine
              {"all_fine", all},
              {"re_entry_from_n_per_mm", crossing.re_entry_from_n_per_mm},
              {"re_entry_to_n_per_mm", crossing.re_entry_to_n_per_mm}};
}

template <class Each>
void each_axis(const Each& each) {
  for (std::size_t i = 0; i < kAxisCount; ++i) each(static_cast<AxisId>(i), axis_kinds()[i]);
}

/// "damping_ns_per_mm" and the like: a name of its own for a unit.
std::string column_name(const AxisKind& kind) {
  const std::string unit = kind.unit;
  if (unit == "N s/mm") return std::string(kind.name) + "_ns_per_mm";
  if (unit.empty()) return kind.name;
  std::string name = std::string(kind.name) + "_" + unit;
  for (char& letter : name) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return name;
}

}  // namespace

Analytic analytic_of(const Subject& subject) {
  const bool is_bare = subject.loop.delay_s <= 0 && subject.damping_ns_per_mm <= 0;
  return {highest_stiffness(subject.loop, subject.damping_ns_per_mm),
          passive_stiffness(subject.loop, subject.damping_ns_per_mm),
          is_bare ? quantum_stiffness(subject.loop) : 0};
}

std::string csv_of(const Part& part) {
  std::string text;
  each_axis([&](AxisId, const AxisKind& kind) { text += column_name(kind) + ","; });
  text += "stiffness_n_per_mm,swings,active,travel_mm,given_mj,port_minimum_mj\n";
  const std::vector<Assignment> columns = part.spec.columns();
  for (const auto& [index, column] : part.columns) {
    std::string head;
    each_axis([&](AxisId axis, const AxisKind&) { head += value_of(columns[index], axis) + ","; });
    for (std::size_t i = 0; i < column.cells.size(); ++i) {
      const Swing& cell = column.cells[i];
      text += head + number_text(part.spec.stiffness_n_per_mm[i]) + (cell.swings ? ",1" : ",0") +
              (cell.active ? ",1," : ",0,") + number_text(cell.travel_mm) + "," +
              number_text(cell.given_mj) + "," + number_text(cell.port_minimum_mj) + "\n";
    }
  }
  return text;
}

std::string json_of(const Part& part) {
  const std::vector<Assignment> assignments = part.spec.columns();
  Json columns = Json::List{};
  for (const auto& [index, column] : part.columns) {
    const Assignment& values = assignments[index];
    const Subject subject = subject_of(values);
    const Analytic analytic = analytic_of(subject);
    const std::string why = impossible(part.spec, subject);
    Json axes = Json::Members{};
    each_axis([&](AxisId axis, const AxisKind& kind) {
      axes[column_name(kind)] = value_of(values, axis);
    });
    Json cells = Json::List{};
    for (const Swing& cell : column.cells) {
      cells.push_back({{"swings", cell.swings},
                       {"active", cell.active},
                       {"travel_mm", cell.travel_mm},
                       {"given_mj", cell.given_mj},
                       {"port_minimum_mj", cell.port_minimum_mj}});
    }
    columns.push_back({{"axes", std::move(axes)},
                       {"impossible", why.empty() ? Json(nullptr) : Json(why)},
                       {"by_travel", crossing_json(column.swing)},
                       {"by_energy", crossing_json(column.energy)},
                       {"analytic",
                        {{"exact_n_per_mm", analytic.exact},
                         {"passive_n_per_mm", analytic.passive},
                         {"quantum_n_per_mm", analytic.quantum}}},
                       {"cells", std::move(cells)}});
  }
  Json mapped = Json::List{};
  for (const std::size_t axis : part.spec.mapped) {
    mapped.push_back(axis == kAxisCount ? "stiffness" : axis_kinds()[axis].name);
  }
  return Json{{"version", KERF_VERSION},      {"seed", part.spec.seed},
              {"seconds", part.spec.seconds}, {"whole_arm", part.spec.arm},
              {"mapped", std::move(mapped)},  {"stiffness_n_per_mm", part.spec.stiffness_n_per_mm},
              {"columns", std::move(columns)}}
      .document();
}

}  // namespace kerf::zwidth
