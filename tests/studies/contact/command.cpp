// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "lab/run/lab_run.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/json.hpp"
#include "tests/rig/geometry.hpp"
#include "tests/studies/contact/hands.hpp"
#include "tests/studies/contact/rows.hpp"
#include "tests/studies/study_commands.hpp"

namespace kerf::extremes {
namespace {

/// The findings of a run: its rows, and the data of the page's pictures.
struct Findings {
  std::vector<Row> rows;
  Comparison comparison;
  std::vector<HandRun> hands;
};

struct Group {
  const char* name;
  void (*measure)(const Effort&, const RowSink&, Findings&);
};
template <void (*kMeasure)(const Effort&, const RowSink&)>
void rows_only(const Effort& effort, const RowSink& add_row, Findings&) {
  kMeasure(effort, add_row);
}
constexpr std::array<Group, 12> kGroups{{
    {"walls", rows_only<measure_walls>},
    {"air", rows_only<measure_air>},
    {"rests", rows_only<measure_rests>},
    {"slides", rows_only<measure_slides>},
    {"shapes", rows_only<measure_shapes>},
    {"edges", rows_only<measure_edge_slides>},
    {"isos", rows_only<measure_isos>},
    {"cutting", rows_only<measure_cutting>},
    {"traps", rows_only<measure_traps>},
    {"ticks", rows_only<measure_ticks>},
    {"paper", [](const Effort& effort, const RowSink& add_row,
                 Findings& findings) { findings.comparison = compare(effort, add_row); }},
    {"hands", [](const Effort& effort, const RowSink& add_row,
                 Findings& findings) { findings.hands = try_hands(effort, add_row); }},
}};

std::string limit_of(const std::optional<double>& limit) {
  char text[32] = "-";
  if (limit) std::snprintf(text, sizeof text, "%.4g", *limit);
  return text;
}

std::string line_of(const Row& row) {
  char text[192];
  if (!row.skipped.empty()) {
    std::snprintf(text, sizeof text, "%-8s %-52s skipped: %s", row.group.c_str(), row.name.c_str(),
                  row.skipped.c_str());
    return text;
  }
  std::snprintf(text, sizeof text, "%-8s %-52s %10.4g %-7s %8s %8s  %s", row.group.c_str(),
                row.name.c_str(), row.value, row.unit.c_str(), limit_of(row.must).c_str(),
                limit_of(row.aim).c_str(),
                !row.must    ? ""
                : row.pass() ? "pass"
                             : "FAIL");
  return text;
}

Json json_of(const std::vector<Row>& rows) {
  Json list = Json::List{};
  for (const Row& row : rows) {
    list.push_back({{"group", row.group},
                    {"name", row.name},
                    {"value", row.skipped.empty() ? Json(row.value) : nullptr},
                    {"unit", row.unit},
                    {"limit", row.must},
                    {"aim", row.aim},
                    {"pass", row.pass()},
                    {"skipped", row.skipped}});
  }
  return list;
}

/// One list for each of these values of the rows.
template <class Rows, class... Values>
Json lists_of(const Rows& rows, const std::pair<const char*, Values>&... values) {
  Json lists = Json::Members{};
  const auto add = [&](const char* name, const auto& value) {
    Json list = Json::List{};
    for (const auto& row : rows) list.push_back(value(row));
    lists[name] = std::move(list);
  };
  (add(values.first, values.second), ...);
  return lists;
}

Json json_of(const Comparison& comparison) {
  Json walls = Json::List{};
  for (const Wall& wall : comparison.walls) {
    walls.push_back(
        {{"name", wall.name},
         {"paper_most_n", wall.paper_most_n},
         {"paper_unfelt_mm", wall.paper_unfelt_mm},
         {"presses", lists_of(wall.presses, std::pair("depth_mm", std::mem_fn(&Press::depth_mm)),
                              std::pair("paper_n", std::mem_fn(&Press::paper_n)),
                              std::pair("proxy_n", std::mem_fn(&Press::proxy_n)))},
         {"losses", lists_of(wall.losses, std::pair("rate_hz", std::mem_fn(&Loss::rate_hz)),
                             std::pair("paper_mm_per_s", std::mem_fn(&Loss::paper_mm_per_s)),
                             std::pair("proxy_mm_per_s", std::mem_fn(&Loss::proxy_mm_per_s)))}});
  }
  const Slide& slide = comparison.slide;
  return {
      {"walls", std::move(walls)},
      {"slide",
       {{"paper_step", slide.paper_step},
        {"proxy_step", slide.proxy_step},
        {"paper_degrees", slide.paper_degrees},
        {"proxy_degrees", slide.proxy_degrees},
        {"ticks", lists_of(slide.ticks, std::pair("travel_mm", std::mem_fn(&SlideTick::travel_mm)),
                           std::pair("paper", std::mem_fn(&SlideTick::paper)),
                           std::pair("proxy", std::mem_fn(&SlideTick::proxy)))}}}};
}

/// From shortly before the first contact on.
Json json_of(const HandRun& run) {
  constexpr std::size_t kEvery = 32;  // ticks: finer is not visible
  constexpr double kBeforeS = 0.3;
  const auto first = std::ranges::find_if(run.ticks, &HandTick::contact) - run.ticks.begin();
  const double begin = std::max(0.0, static_cast<double>(first) - kBeforeS * run.rate_hz);
  std::vector<std::size_t> shown;
  for (auto i = static_cast<std::size_t>(begin); i < run.ticks.size(); i += kEvery) {
    shown.push_back(i);
  }
  const auto of = [&](const auto& value) {
    return [&run, value](std::size_t i) { return value(run.ticks[i]); };
  };
  Json lists = lists_of(
      shown, std::pair("s", [&](std::size_t i) { return static_cast<double>(i) / run.rate_hz; }),
      std::pair("height_mm", of(std::mem_fn(&HandTick::height_mm))),
      std::pair("proxy_height_mm", of(std::mem_fn(&HandTick::proxy_height_mm))),
      std::pair("force_n", of([](const HandTick& tick) { return length(tick.force_n); })),
      std::pair("removed_mm3", of(std::mem_fn(&HandTick::removed_mm3))));
  return {{"name", run.name}, {"ticks", std::move(lists)}};
}

/// lab/report/contact.py has its form.
std::string json_of(const Findings& findings) {
  Json hands = Json::List{};
  for (const HandRun& run : findings.hands) hands.push_back(json_of(run));
  return Json{
      {"provenance", lab_provenance()},
      {"rows", json_of(findings.rows)},
      {"comparison",
       findings.comparison.slide.ticks.empty() ? Json(nullptr) : json_of(findings.comparison)},
      {"hands", std::move(hands)}}
      .document();
}

/// `kerf-studies extremes`: the swept contact against its limits, and beside the paper's force.
class ContactCommand final : public LabCommand {
 public:
  explicit ContactCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, page_, data_;
  std::vector<std::string> only_;
  bool quick_ = false;
  int core_ = -1, presses_ = 0, seed_ = 0;
};

ContactCommand::ContactCommand(Arguments& program)
    : LabCommand(program, "extremes",
                 "the swept contact against its limits, beside the paper's force") {
  std::vector<std::string> names;
  for (const Group& group : kGroups) names.emplace_back(group.name);
  Option only = app_.option("--only", only_, "only these groups of rows");
  only.one_of(names).split_at_commas().shown_as("GROUP,...");
  app_.flag("--quick", quick_, "a hundredth of the cases");
  app_.option("--report", report_, "write the rows as JSON").shown_as("FILE");
  app_.option("--page", page_,
              "write all as its part of a page (docs/contact.md), the plots in plots/ beside it")
      .excludes(only)
      .shown_as("FILE");
  app_.option("--data", data_, "folder of real volumes (default: $KERF_DATA)")
      .from_environment("KERF_DATA")
      .shown_as("DIR");
  app_.option("--presses", presses_, "of the search for traps (default: 24, 240 or 10,000)")
      .within(1, 1000000);
  app_.option("--seed", seed_, "first scene of the search for traps").within(0, 1000000);
  app_.option("--cpu", core_, "core to run on (default: the last)").within(0, 1023);
  app_.footer("Exit codes: 0 every limit is kept, 1 one is not, 2 bad input or set-up.");
}

int ContactCommand::run(std::ostream& out) const {
  const LabOutput as_json("--report", report_, ".json");
  const LabOutput as_page("--page", page_, ".md");
  const std::string plot = page_plot("--page", page_, ".svg"),
                    hands_plot = page_plot("--page", page_, ".hands.svg");
  const LabOutput as_plot("--page", plot, ".svg");
  const LabOutput as_hands_plot("--page", hands_plot, ".svg");
  LabOutput::check_distinct({&as_json, &as_page, &as_plot, &as_hands_plot});
  if (!page_.empty()) check_can_plot();
  static_cast<void>(pin_lab(core_));
  Effort effort = quick_ ? Effort::quick() : Effort{};
  effort.data = data_;
  if (!quick_ && only_ == std::vector<std::string>{"traps"}) effort.presses = 10000;
  if (presses_ > 0) effort.presses = presses_;
  effort.first_scene = static_cast<std::uint64_t>(seed_);
  Findings findings;
  out << "group    what                                                      value unit        "
         "must "
         "     aim\n";
  const auto add_row = [&](Row row) {
    out << line_of(row) << std::endl;
    findings.rows.push_back(std::move(row));
  };
  for (const Group& group : kGroups) {
    if (only_.empty() || std::ranges::find(only_, group.name) != only_.end()) {
      group.measure(effort, add_row, findings);
    }
  }
  const std::string report = json_of(findings);
  as_json.write(report);
  if (!page_.empty()) {
    as_plot.write_report({"contact", "plot"}, report, out);
    as_hands_plot.write_report({"contact", "hands"}, report, out);
    const std::string part = make_report(
        {"contact", "page", page_link(page_, plot), page_link(page_, hands_plot)}, report);
    as_page.write_part("contact", part, out);
  }
  return std::ranges::all_of(findings.rows, &Row::pass) ? 0 : 1;
}

}  // namespace
}  // namespace kerf::extremes

std::unique_ptr<kerf::LabCommand> kerf::make_extremes_command(Arguments& program) {
  return std::make_unique<extremes::ContactCommand>(program);
}
