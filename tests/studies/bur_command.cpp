// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <iosfwd>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "tests/studies/study_commands.hpp"

namespace kerf::burs {
namespace {

constexpr std::array kSizes{6, 8, 10, 12, 14, 18, 23, 31};  // tenths of a mm

/// Outlines of every head at its sizes, tip down, as JSON (lab/report/burs.py has its form).
std::string sheet_json() {
  Json heads = Json::List{};
  for (const BurHead& head : kBurHeads) {
    Json sizes = Json::List{};
    for (const int tenths : kSizes) {
      if (tenths > head.largest) continue;
      const double radius_mm = tenths / 20.0;
      const SceneTool tool = make_tool("", std::string(head.shape),
                                       {.pitch_mm = radius_mm / 8, .radius_mm = radius_mm});
      Json outline = Json::List{};
      for (const auto& [y_mm, r_mm] : tool_profile(tool)) {
        outline.push_back(Json::List{r_mm, y_mm + tool.length_mm / 2});
      }
      sizes.push_back({{"tenths", tenths},
                       {"neck_mm", std::min(kShankRadiusMm, kNeckOfHead * radius_mm)},
                       {"length_mm", tool.length_mm},
                       {"outline", std::move(outline)}});
    }
    heads.push_back(
        {{"number", head.number.substr(0, 3)}, {"name", head.name}, {"sizes", std::move(sizes)}});
  }
  return Json{{"out_mm", kShankOutMm}, {"heads", std::move(heads)}}.canonical();
}

/// `kerf-studies burs`: the heads that a scene can name by their ISO number, and a drawing of them.
class BursCommand final : public LabCommand {
 public:
  explicit BursCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string svg_;
};

BursCommand::BursCommand(Arguments& program)
    : LabCommand(program, "burs", "the burs that a scene can name by their ISO number") {
  app_.option("--svg", svg_, "draw them, at their usual sizes").shown_as("FILE");
}

int BursCommand::run(std::ostream& out) const {
  check_outputs({}, {{"--svg", svg_, ".svg"}});
  for (const BurHead& head : kBurHeads) {
    out << format("%.3s  %-14s %-14s %03d to %03d\n", head.number.data(), head.name.data(),
                  head.shape.data(), kSmallestBur, head.largest);
  }
  if (!svg_.empty()) {
    write_new_file(svg_, make_report({"burs", "sheet"}, sheet_json()));
    if (!is_stream(svg_)) out << svg_ << ": written\n";
  }
  return 0;
}

}  // namespace
}  // namespace kerf::burs

std::unique_ptr<kerf::LabCommand> kerf::make_burs_command(Arguments& program) {
  return std::make_unique<burs::BursCommand>(program);
}
