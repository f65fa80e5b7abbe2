// SPDX-License-Identifier: Apache-2.0
#include "visualizer/bench/picture_page.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include <nlohmann/json.hpp>

#include "shared/posix/provenance.hpp"

namespace kerf {

namespace {

constexpr const char* kAbout = R"(# Pictures

Made by `./kerf bench pictures --page docs/pictures.md`; every figure comes from one run, nothing is
typed by hand but the paper's. Machines are noisy: compare figures of the same run.

What a frame costs: the renderer's update and the volumes, without tool and panel; the camera rests.
The volume is a made-up molar (`visualizer/bench/bench_tooth.cpp`) that fills of its grid about what the
paper's padded tooth does, and fills the picture; `cropped` leaves out the air around it, the picture
is the same. `static` draws all of the picture, `10^3` and `16^3` all of it after a ball of so many
voxels was cut, `partial` only what that cut can have changed, as the visualizer does while the camera
rests. Frames per second (fps) divide the median wall time; cpu ms are the median, summed over the
threads. Each figure has 3 to 10 frames.

`paper` is the frame rate that the paper gives for its technique of the same kind, static / while
milling, on its own hardware and graphics card: it says what was usual then, not what this machine
would reach. Where `gl` below is a software GL, `iso`, `blend`, `surface` and `slices` say nothing of a
graphics card.

)";

struct PaperRate {
  std::string_view renderer;
  std::string_view technique;
  // 128 and 256, each padded and cropped: frames per second, static / while milling.
  std::array<std::string_view, 2> small, large;
};
// The paper's table of frame rates at 512x512.
constexpr auto kPaper = std::to_array<PaperRate>({
    {"iso", "GPU iso", {"13 / 13", "40 / 39"}, {"6 / 6", "21 / 21"}},
    {"blend", "GPU volume", {"4 / 4", "10 / 10"}, {"1 / 1", "5 / 5"}},
    {"surface", "CPU iso", {"133", "-"}, {"35 / 29, 22 (10^3, 16^3)", "-"}},
    {"slices", "CPU volume", {"6 / 6", "21 / 21"}, {"2 / 2", "8 / 5"}},
});

std::string paper_rate(const PictureRow& row) {
  const auto found = std::find_if(kPaper.begin(), kPaper.end(), [&](const PaperRate& rate) {
    return rate.renderer == row.renderer;
  });
  if (found == kPaper.end()) return "-";
  constexpr int kSmallEdge = 128;
  const auto& rates = row.volume.nx == kSmallEdge ? found->small : found->large;
  return std::string(found->technique) + " " + std::string(rates[row.cropped ? 1 : 0]);
}

std::string name_of(const VoxelGrid& grid) {
  return std::to_string(grid.nx) + "x" + std::to_string(grid.ny) + "x" + std::to_string(grid.nz);
}

bool same_subject(const PictureRow& a, const PictureRow& b) {
  return a.renderer == b.renderer && a.volume == b.volume && a.cropped == b.cropped;
}

std::string figure(double value) {
  std::array<char, 32> text{};
  constexpr double kWhole = 100.0;
  std::snprintf(text.data(), text.size(), value < kWhole ? "%.1f" : "%.0f", value);
  return text.data();
}

}  // namespace

std::string picture_table(std::span<const PictureRow> rows) {
  std::string table =
      "| renderer | volume | fps: static | 10^3 | 16^3 | 10^3 partial | 16^3 partial "
      "| cpu ms: static | 16^3 | 16^3 partial | paper fps |\n"
      "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---|\n";
  for (auto first = rows.begin(); first != rows.end();) {
    const auto end = std::find_if_not(
        first, rows.end(), [&](const PictureRow& row) { return same_subject(row, *first); });
    const auto cell = [&](int tool, bool partial, auto value) {
      const auto row = std::find_if(first, end, [&](const PictureRow& one) {
        return one.tool == tool && one.partial == partial;
      });
      return (row == end ? std::string("-") : figure(value(*row))) + " | ";
    };
    const auto fps = [](const PictureRow& row) { return row.fps(); };
    const auto cpu = [](const PictureRow& row) { return row.cpu_ms; };
    table += "| " + first->renderer + " | " + name_of(first->volume) +
             (first->cropped ? " cropped | " : " | ");
    table += cell(0, false, fps) + cell(10, false, fps) + cell(16, false, fps);
    table += cell(10, true, fps) + cell(16, true, fps);
    table += cell(0, false, cpu) + cell(16, false, cpu) + cell(16, true, cpu);
    table += paper_rate(*first) + " |\n";
    first = end;
  }
  return table;
}

std::string picture_page(std::span<const PictureRow> rows, const GlDriver& driver, PictureSize size,
                         std::size_t cores) {
  return kAbout + today() + ", " + processor_name() + ", " + std::to_string(cores) +
         " core(s) used, " + std::to_string(size.width) + "x" + std::to_string(size.height) +
         " pixels, gl: " + driver.renderer + ".\n\n" + picture_table(rows);
}

std::string picture_report(std::span<const PictureRow> rows, const GlDriver& driver,
                           PictureSize size, std::size_t cores) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const PictureRow& row : rows) {
    list.push_back({{"renderer", row.renderer},
                    {"volume", name_of(row.volume)},
                    {"tool", row.tool},
                    {"modifying", row.modifying},
                    {"cropped", row.cropped},
                    {"partial", row.partial},
                    {"fps", row.fps()},
                    {"cpu_ms", row.cpu_ms},
                    {"wall_ms_p50", row.wall_ms_p50},
                    {"wall_ms_p99", row.wall_ms_p99}});
  }
  const nlohmann::ordered_json report{{"gl_renderer", driver.renderer},
                                      {"processor", processor_name()},
                                      {"cores", cores},
                                      {"width", size.width},
                                      {"height", size.height},
                                      {"rows", std::move(list)}};
  return report.dump(2) + "\n";
}

}  // namespace kerf
