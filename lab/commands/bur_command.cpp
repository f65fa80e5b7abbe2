// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <iosfwd>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/run/lab_command.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/text.hpp"

namespace kerf::burs {
namespace {

constexpr std::array kSizes{6, 8, 10, 12, 14, 18, 23, 31};  // tenths of a mm
constexpr double kPerMm = 14;                               // pixels
constexpr double kColumn = 62, kRow = 176, kLeft = 150, kTop = 40;

/// The head's outline and the neck behind it, tip down; `x` is its axis, `tip` its lowest point.
std::string drawn(const BurHead& head, int tenths, double x, double tip) {
  const double radius_mm = tenths / 20.0;
  const SceneTool tool =
      make_tool("", std::string(head.shape), {.pitch_mm = radius_mm / 8, .radius_mm = radius_mm});
  const double half_mm = tool.length_mm / 2;
  const auto at = [&](double across_mm, double y_mm) {
    return format("%.1f,%.1f ", x + kPerMm * across_mm, tip - kPerMm * (y_mm + half_mm));
  };
  std::string right, left;
  for (const auto& [y_mm, r_mm] : tool_profile(tool)) {
    right += at(r_mm, y_mm);
    left = at(-r_mm, y_mm) + left;
  }
  const double neck_mm = std::min(kShankRadiusMm, kNeckOfHead * radius_mm);
  std::string text =
      format("<rect class=\"neck\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n",
             x - kPerMm * neck_mm, tip - kPerMm * kShankOutMm, 2 * kPerMm * neck_mm,
             kPerMm * (kShankOutMm - half_mm));
  text += "<polygon class=\"head\" points=\"" + right + left + "\"/>\n";
  return text +
         format("<text x=\"%.1f\" y=\"%.1f\" class=\"size\">%03d</text>\n", x, tip + 18, tenths);
}

/// An SVG drawing of every head of kBurHeads from the side, a row each, at the sizes that are sold
/// most, all at one scale, with their necks.
std::string sheet_svg() {
  const double width = kLeft + kColumn * kSizes.size(), height = kTop + kRow * kBurHeads.size();
  std::string text = format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f "
      "%.0f\" font-family=\"sans-serif\">\n",
      width, height, width, height);
  text +=
      "<style>.neck{fill:#b9bec4}.head{fill:#5f6b78;stroke:#2b333b;stroke-width:1}"
      "text{fill:#222;font-size:14px}.size{text-anchor:middle;font-size:12px}</style>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
      "<text x=\"12\" y=\"24\">Head and diameter in 0.1 mm, as bur = \"001 014\"</text>\n";
  for (std::size_t row = 0; row < kBurHeads.size(); ++row) {
    const BurHead& head = kBurHeads[row];
    const double tip = kTop + kRow * (static_cast<double>(row) + 1) - 40;
    text += format("<text x=\"12\" y=\"%.1f\" font-weight=\"bold\">%.3s</text>\n", tip - 50,
                   head.number.data());
    text += format("<text x=\"12\" y=\"%.1f\">%s</text>\n", tip - 30, head.name.data());
    for (std::size_t column = 0; column < kSizes.size(); ++column) {
      if (kSizes[column] > head.largest) continue;
      text +=
          drawn(head, kSizes[column], kLeft + kColumn * (static_cast<double>(column) + 0.5), tip);
    }
  }
  return text + "</svg>\n";
}

/// `kerf-lab burs`: the heads that a scene can name by their ISO number, and a drawing of them.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string svg_;
};

Command::Command(Arguments& program)
    : LabCommand(program, "burs", "the burs that a scene can name by their ISO number") {
  app_.option("--svg", svg_, "draw them, at their usual sizes").shown_as("FILE");
}

int Command::run(std::ostream& out) const {
  check_outputs({}, {{"--svg", svg_, ".svg"}});
  for (const BurHead& head : kBurHeads) {
    out << format("%.3s  %-14s %-14s %03d to %03d\n", head.number.data(), head.name.data(),
                  head.shape.data(), kSmallestBur, head.largest);
  }
  if (!svg_.empty()) write_new_file(svg_, sheet_svg());
  return 0;
}

}  // namespace
}  // namespace kerf::burs

std::unique_ptr<kerf::LabCommand> kerf::make_burs_command(Arguments& program) {
  return std::make_unique<burs::Command>(program);
}
