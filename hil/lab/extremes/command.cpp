// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/extremes/command.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ostream>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "hil/lab/extremes/measures.hpp"
#include "hil/lab/lab_run.hpp"

namespace kerf::extremes {
namespace {

struct Group {
  const char* name;
  void (*measure)(const Effort&, const Told&);
};
constexpr std::array<Group, 5> kGroups{{{"walls", measure_walls},
                                        {"rests", measure_rests},
                                        {"slides", measure_slides},
                                        {"shapes", measure_shapes},
                                        {"ticks", measure_ticks}}};

std::string limit_of(const std::optional<double>& limit) {
  char text[32] = "-";
  if (limit) std::snprintf(text, sizeof text, "%.4g", *limit);
  return text;
}

std::string line_of(const Row& row) {
  char text[192];
  std::snprintf(text, sizeof text, "%-8s %-52s %10.4g %-7s %8s %8s  %s", row.group.c_str(),
                row.name.c_str(), row.value, row.unit.c_str(), limit_of(row.must).c_str(),
                limit_of(row.aim).c_str(), !row.must ? "" : row.pass() ? "pass" : "FAIL");
  return text;
}

std::string json_of(const std::vector<Row>& rows) {
  auto list = nlohmann::ordered_json::array();
  const auto number = [](const std::optional<double>& limit) {
    return limit ? nlohmann::ordered_json(*limit) : nlohmann::ordered_json(nullptr);
  };
  for (const Row& row : rows) {
    list.push_back({{"group", row.group},
                    {"name", row.name},
                    {"value", row.value},
                    {"unit", row.unit},
                    {"limit", number(row.must)},
                    {"aim", number(row.aim)},
                    {"pass", row.pass()}});
  }
  return nlohmann::ordered_json{{"rows", list}}.dump(2) + "\n";
}

}  // namespace

Command::Command(CLI::App& program)
    : LabCommand(program, "extremes", "the swept contact against its limits, beside the paper's") {
  std::vector<std::string> names;
  for (const Group& group : kGroups) names.emplace_back(group.name);
  app_->add_option("--only", only_, "only these groups of rows")
      ->check(CLI::IsMember(names))
      ->delimiter(',')
      ->type_name("GROUP,...");
  app_->add_flag("--quick", quick_, "a hundredth of the cases");
  app_->add_option("--report", report_, "write the rows as JSON")->type_name("FILE");
  app_->add_option("--page", page_, "write all as a page (docs/contact.md), its plots beside it")
      ->type_name("FILE");
  app_->add_option("--cpu", core_, "core to run on (default: the last)")
      ->check(CLI::Range(0, 1023));
  app_->footer("Exit codes: 0 every limit is kept, 1 one is not, 2 bad input or set-up.");
}

int Command::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_);
  static_cast<void>(pin_lab(core_));
  const Effort effort = quick_ ? Effort::quick() : Effort{};
  std::vector<Row> rows;
  out << "group    what                                                      value unit        must "
         "     aim\n";
  const auto told = [&](Row row) {
    out << line_of(row) << std::endl;
    rows.push_back(std::move(row));
  };
  for (const Group& group : kGroups) {
    if (only_.empty() || std::ranges::find(only_, group.name) != only_.end()) {
      group.measure(effort, told);
    }
  }
  as_json.write(json_of(rows));
  return std::ranges::all_of(rows, &Row::pass) ? 0 : 1;
}

}  // namespace kerf::extremes
