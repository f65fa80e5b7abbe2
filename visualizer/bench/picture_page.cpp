// SPDX-License-Identifier: Apache-2.0
#include "visualizer/bench/picture_page.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "shared/posix/program.hpp"
#include "shared/text/json.hpp"

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

constexpr const char* kAboutGradients = R"(
## Gradients

What `--gradient` does to `iso` on the padded 256x256x161 volume, and the angle, root mean square,
between its normals and the true ones on a ball of 28 voxels radius whose border is antialiased over
two, without noise and with 1.5 % of full density. `central` and `corners` are worked out for each
pixel from 6 and 8 samples; `farid5`, 5x5x5 voxels, is stored for each voxel in 8 bytes and worked out
again around a cut. The partial picture of `iso` is the least with `corners`: with the others every
pixel within 13 voxels of a cut is drawn again. `surface`, `blend` and `slices` take the same gradients
at their voxels; `cast` and `cast-blend` always `corners`.

)";

constexpr const char* kAboutSummary = R"(## Pictures

Of `docs/pictures.md`, which has all volumes and tools and says how: the padded tooth of 256x256x161
voxels, at rest and after a ball of 16 voxels was cut, by
`./kerf bench pictures --page docs/pictures.md --summary docs/performance.md`.

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
  return a.renderer == b.renderer && a.gradient == b.gradient && a.volume == b.volume &&
         a.cropped == b.cropped;
}

/// Of the paper's padded tooth, by what changes in it; none if that was not measured.
const PictureRow* row_of(std::span<const PictureRow> rows, std::string_view renderer,
                         GradientFilter gradient, int tool, bool partial) {
  constexpr int kLargeEdge = 256;
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const PictureRow& row) {
    return row.renderer == renderer && row.gradient == gradient && row.volume.nx == kLargeEdge &&
           !row.cropped && row.tool == tool && row.partial == partial;
  });
  return found == rows.end() ? nullptr : &*found;
}

std::string where(const PictureFigures& figures) {
  return today() + ", " + processor_name() + ", " + std::to_string(figures.cores) +
         " core(s) used, " + std::to_string(figures.size.width) + "x" +
         std::to_string(figures.size.height) + " pixels, gl: " + figures.gl_renderer + ".\n\n";
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
    if (first->gradient != GradientFilter::corners) {  // for the other table
      ++first;
      continue;
    }
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

std::string gradient_table(const PictureFigures& figures) {
  std::string table =
      "| gradient | angle, degrees | with noise | cpu ms: static | 16^3 | 16^3 partial |\n"
      "|---|---:|---:|---:|---:|---:|\n";
  for (const GradientRow& gradient : figures.gradients) {
    const auto cpu = [&](int tool, bool partial) {
      const auto* row = row_of(figures.rows, "iso", gradient.gradient, tool, partial);
      return row != nullptr ? figure(row->cpu_ms) : "-";
    };
    std::array<char, 96> angles{};
    std::snprintf(angles.data(), angles.size(), " | %.2f | %.2f | ", gradient.angle_deg,
                  gradient.noisy_angle_deg);
    table += "| " + std::string(name_of(gradient.gradient)) + angles.data() + cpu(0, false) +
             " | " + cpu(16, false) + " | " + cpu(16, true) + " |\n";
  }
  return table;
}

std::string picture_page(const PictureFigures& figures) {
  return kAbout + where(figures) + picture_table(figures.rows) + kAboutGradients +
         gradient_table(figures);
}

std::string picture_summary(const PictureFigures& figures) {
  std::string summary = kAboutSummary + where(figures) +
                        "| renderer | fps: static | 16^3 partial | cpu ms: static | 16^3 partial | "
                        "partial / full | paper fps |\n|---|---:|---:|---:|---:|---:|---|\n";
  for (const PictureRow& row : figures.rows) {
    if (row_of(figures.rows, row.renderer, GradientFilter::corners, 0, false) != &row) continue;
    const auto* partial = row_of(figures.rows, row.renderer, GradientFilter::corners, 16, true);
    const auto* whole = row_of(figures.rows, row.renderer, GradientFilter::corners, 16, false);
    if (partial == nullptr || whole == nullptr) continue;
    summary += "| " + row.renderer + " | " + figure(row.fps()) + " | " + figure(partial->fps()) +
               " | " + figure(row.cpu_ms) + " | " + figure(partial->cpu_ms) + " | 1/" +
               figure(whole->cpu_ms / partial->cpu_ms) + " | " + paper_rate(row) + " |\n";
  }
  return summary;
}

std::string picture_report(const PictureFigures& figures) {
  Json rows = Json::List{};
  for (const PictureRow& row : figures.rows) {
    rows.push_back({{"renderer", row.renderer},
                    {"gradient", name_of(row.gradient)},
                    {"volume", name_of(row.volume)},
                    {"tool", row.tool},
                    {"modifying", row.tool > 0},
                    {"cropped", row.cropped},
                    {"partial", row.partial},
                    {"fps", row.fps()},
                    {"cpu_ms", row.cpu_ms},
                    {"wall_ms_p50", row.wall_ms_p50},
                    {"wall_ms_p99", row.wall_ms_p99}});
  }
  Json gradients = Json::List{};
  for (const GradientRow& row : figures.gradients) {
    gradients.push_back({{"gradient", name_of(row.gradient)},
                         {"angle_deg", row.angle_deg},
                         {"noisy_angle_deg", row.noisy_angle_deg}});
  }
  const Json report{{"gl_renderer", figures.gl_renderer},
                    {"processor", processor_name()},
                    {"cores", figures.cores},
                    {"width", figures.size.width},
                    {"height", figures.size.height},
                    {"rows", std::move(rows)},
                    {"gradients", std::move(gradients)}};
  return report.document();
}

}  // namespace kerf
