// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <string>

#include "lab/extremes/measures.hpp"
#include "lab/rig/bump_slide.hpp"
#include "lab/rig/points.hpp"

namespace kerf::extremes {
void measure_slides(const Effort& effort, const RowSink& add_row) {
  struct Limits {
    double must, aim;
  };
  struct Subject {
    std::string name;
    BumpSlide slide;
    Limits step, degrees, sd;
  };
  CtEdge ct;
  const Limits two{0.02, 0.014}, half{0.5, 0.3}, fine{0.005, 0.002};
  for (const Subject& subject :
       {Subject{"R 40, 2 deep, 50 mm/s", {}, two, half, fine},
        Subject{"R 40, 1 deep, 50 mm/s", {.depth = 1}, two, half, fine},
        // F8 asks for 0.08 N at 0.4 N/mm, two units; more than that the direction turns.
        Subject{"R 14, 1 deep, 100 mm/s", {.bump = 14, .step = 1, .depth = 1}, {2, 2}, half, fine},
        Subject{"CT with noise, R 40, 2 deep, 50 mm/s",
                {.share = std::ref(ct)},
                {0.03, 0.018},
                {1.2, 0.9},
                {0.02, 0.015}}}) {
    SlideFigures figures;
    Dice dice(5);
    for (int k = 0; k < effort.slides; ++k) {
      slide_over<FixedNumbers>(subject.slide, dice, figures);
    }
    const auto row = [&](const char* what, double value, const char* unit, double scale,
                         const Limits& limits) {
      add_row({"slides", subject.name + what, value * scale, unit, limits.must * scale,
               limits.aim * scale});
    };
    row(": force step over the mean", figures.force_step, "%", 100, subject.step);
    row(": angle", figures.degrees, "deg", 1, subject.degrees);
    row(": surface sd", figures.height_sd, "voxels", 1, subject.sd);
  }
}

}  // namespace kerf::extremes
