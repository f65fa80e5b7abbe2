// SPDX-License-Identifier: Apache-2.0
// How much of a picture the panels cover, and that they grow with the display's density.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/visualizer/gl/gl_faults.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/panels/overlay.hpp"

namespace kerf::panels_test {
namespace {

constexpr PictureSize kPlain{640, 480};

/// As much as a scene can give to show: tools, volumes, materials, opacities.
OverlayFigures crowded() {
  OverlayFigures figures;
  figures.force_n = 1.23;
  figures.tool = "a fissure bur of some length";
  figures.removed_mm3 = 12.34;
  for (int m = 0; m < 31; ++m) {
    figures.score.push_back({"material " + std::to_string(m), 1.0F, 0.5F, 0.0F, 0.1 * m});
  }
  figures.score_is_partial = true;
  figures.forbidden = "pulp, nerve";
  figures.forbidden_ms = 121.0;
  figures.spindle = {281.0, 0.34};
  figures.pulp_rise_c = -16.3;
  figures.tick_rate_hz = 1000.0;
  figures.frame_rate_hz = 60.0;
  figures.data_age_ms = 1.0;
  figures.filmed_frames = 1234;
  ViewControls& controls = figures.controls.emplace();
  const Silhouette side{{0.0, -0.2, 0.2}, {1.0, -1.0, 1.0}, {4.0, -0.5, 0.5}};
  for (int tool = 0; tool < 16; ++tool) {
    controls.tools.push_back({"1.6 mm tool " + std::to_string(tool), side});
  }
  for (int v = 0; v < 8; ++v) controls.volumes.push_back("volume " + std::to_string(v));
  controls.has_iso = true;
  controls.settings.clip.on = true;
  for (int m = 0; m < 31; ++m) controls.opacities["material " + std::to_string(m)] = 0.5;
  return figures;
}

SliceViews grey_slices(int side) {
  SliceViews slices{.side = side, .tip = {{{0.5, 0.5}, {0.2, 0.1}, {2.0, 0.5}}}};
  slices.rgb.assign(static_cast<std::size_t>(9) * static_cast<std::size_t>(side * side), 128);
  return slices;
}

std::vector<ForcePlot::Point> some_plot() {
  std::vector<ForcePlot::Point> plot(50);
  for (std::size_t i = 0; i < plot.size(); ++i) {
    plot[i].time_ns = 100'000'000 * i;
    plot[i].force_n = 1.0F;
  }
  return plot;
}

/// Share of a white picture's pixels that are none any longer, in its first columns.
double covered_left_of(int column, const std::vector<std::uint8_t>& rgb, PictureSize size) {
  int count = 0;
  for (std::size_t i = 0; i < rgb.size(); i += 3) {
    const bool is_white = rgb[i] == 255 && rgb[i + 1] == 255 && rgb[i + 2] == 255;
    const auto x = static_cast<int>(i / 3 % static_cast<std::size_t>(size.width));
    count += x < column && !is_white ? 1 : 0;
  }
  return static_cast<double>(count) / (size.width * size.height);
}

/// Whether a picture is white beside `panels`.
bool white_beside(const std::vector<PixelRect>& panels, std::vector<std::uint8_t> rgb,
                  PictureSize size) {
  for (const PixelRect& panel : clipped(panels, {0, 0, size.width, size.height})) {
    for (int y = panel.y0; y < panel.y1; ++y) {
      const std::ptrdiff_t row = std::ptrdiff_t{size.height - 1 - y} * size.width;
      std::fill(rgb.begin() + 3 * (row + panel.x0), rgb.begin() + 3 * (row + panel.x1),
                std::uint8_t{255});
    }
  }
  return std::ranges::all_of(rgb, [](std::uint8_t part) { return part == 255; });
}

/// Share of the pixels that `overlay` changes.
double covered(Overlay& overlay, const OverlayFigures& figures, PictureSize size,
               std::vector<std::uint8_t>* picture = nullptr) {
  const RenderTarget target(size);
  target.bind();
  constexpr float kWhite[4] = {1.0F, 1.0F, 1.0F, 1.0F};
  glDisable(GL_SCISSOR_TEST);
  glClearNamedFramebufferfv(target.framebuffer(), GL_COLOR, 0, kWhite);
  const std::vector<PixelRect> panels = overlay.prepare(figures, size);
  overlay.draw(target);
  glDisable(GL_SCISSOR_TEST);
  const std::vector<std::uint8_t> rgb = target.read_rgb();
  CHECK(white_beside(panels, rgb, size));
  if (picture != nullptr) *picture = rgb;
  return covered_left_of(size.width, rgb, size);
}

/// The middle ninth of the picture is as it was.
bool middle_is_free(const std::vector<std::uint8_t>& rgb, PictureSize size) {
  for (int y = size.height / 3; y < size.height * 2 / 3; ++y) {
    for (int x = size.width * 5 / 12; x < size.width * 7 / 12; ++x) {
      if (rgb[static_cast<std::size_t>(3 * (y * size.width + x))] != 255) return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("panels cover at most a quarter of a window, and not its middle, whatever they show") {
  const auto context = make_headless_context();
  Overlay overlay;
  for (const double scale : {1.0, 1.5, 2.0}) {
    const PictureSize size{static_cast<int>(kPlain.width * scale),
                           static_cast<int>(kPlain.height * scale)};
    for (const bool slices : {false, true}) {
      for (const bool plot : {false, true}) {
        CAPTURE(scale);
        CAPTURE(slices);
        CAPTURE(plot);
        OverlayFigures figures = crowded();
        figures.scale = scale;
        const int side = slice_side(size, scale);
        if (slices) figures.slices = grey_slices(side);
        if (plot) figures.plot = some_plot();
        if (slices == plot) {
          figures.second = {.force_n = 2.34,
                            .tool = "a round bur of some length",
                            .state = "velocity_estimator",
                            .alarm = true};
        }
        std::vector<std::uint8_t> picture;
        const double fraction = covered(overlay, figures, size, &picture);
        // The slices with the edges of their panel are at the right.
        const int beside = slices ? side + static_cast<int>(34.0 * scale) : 0;
        CHECK(covered_left_of(size.width - beside, picture, size) < 0.25);
        CHECK(fraction > 0.1);  // it shows them
        CHECK(middle_is_free(picture, size));
      }
    }
  }
}

TEST_CASE("a second arm has lines of its own, and none without one") {
  const auto context = make_headless_context();
  Overlay overlay;
  OverlayFigures figures;
  const double alone = covered(overlay, figures, kPlain);
  figures.second = {.force_n = 1.0, .tool = "pin", .state = "in_hand", .alarm = false};
  std::vector<std::uint8_t> calm, faulty;
  CHECK(covered(overlay, figures, kPlain, &calm) > alone);
  figures.second->alarm = true;
  static_cast<void>(covered(overlay, figures, kPlain, &faulty));
  CHECK(faulty != calm);
  figures.second->alarm = false;
  const SecondArmFigures before = *figures.second;
  for (const auto& other : {SecondArmFigures{2.5, "pin", "in_hand", false},
                            SecondArmFigures{1.0, "ball", "in_hand", false},
                            SecondArmFigures{1.0, "pin", "armed", false}}) {
    figures.second = other;
    std::vector<std::uint8_t> shown;
    static_cast<void>(covered(overlay, figures, kPlain, &shown));
    CHECK(shown != calm);
  }
  figures.second = before;
  static_cast<void>(covered(overlay, figures, kPlain, &faulty));
  CHECK(faulty == calm);
}

TEST_CASE("slices are as large as a third of the window holds, and none are too small to read") {
  CHECK(slice_side({1280, 800}, 1.0) > 220);  // three of them are as high as the window
  CHECK(slice_side({600, 1200}, 1.0) > 160);  // a third of its width
  CHECK(slice_side({640, 480}, 1.0) > 110);
  CHECK(slice_side({1280, 960}, 2.0) > 220);
  for (const PictureSize size : {PictureSize{640, 100}, PictureSize{120, 700}, PictureSize{1, 1}}) {
    CHECK(slice_side(size, 1.0) == 0);
  }
}

TEST_CASE("slices and the letters above them are shown whole at every size and density") {
  const auto context = make_headless_context();
  Overlay overlay;
  for (const PictureSize size : {kPlain, PictureSize{800, 600}, PictureSize{1280, 800},
                                 PictureSize{1280, 960}, PictureSize{1920, 1080}}) {
    for (const double scale : {1.0, 1.25, 1.5, 2.0}) {
      CAPTURE(size.width);
      CAPTURE(scale);
      OverlayFigures figures;
      figures.scale = scale;
      const int side = slice_side(size, scale);
      figures.slices = grey_slices(side);
      std::vector<std::uint8_t> rgb;
      static_cast<void>(covered(overlay, figures, size, &rgb));
      int whole_rows = 0, letters = 0;  // rows of a slice; pixels of letters above, below, between
      for (int y = 0; y < size.height; ++y) {
        int grey = 0, light = 0;
        for (int x = size.width / 2; x < size.width; ++x) {
          const int red = rgb[static_cast<std::size_t>(3 * (y * size.width + x))];
          grey += red == 128 ? 1 : 0;
          light += red > 150 && red < 255 ? 1 : 0;
        }
        whole_rows += grey >= side - 4 ? 1 : 0;
        letters += grey < side / 2 ? light : 0;
      }
      CHECK(whole_rows >= 3 * side - 9);  // but those of the tip's lines
      const double font = 13.0 * std::min(scale, std::min(size.width / 640.0, size.height / 480.0));
      CHECK(letters > 1.5 * font * font);
    }
  }
}

TEST_CASE("beside slices and a spindle the score counts every material") {
  const auto context = make_headless_context();
  Overlay overlay;
  OverlayFigures figures = crowded();
  figures.slices = grey_slices(slice_side(kPlain, 1.0));
  std::vector<std::uint8_t> before, after;
  static_cast<void>(covered(overlay, figures, kPlain, &before));
  for (const std::size_t material : {0U, 1U, 2U, 3U, 4U, 30U}) {
    CAPTURE(material);
    OverlayFigures more = figures;
    more.score[material].removed_mm3 += 1.0;
    static_cast<void>(covered(overlay, more, kPlain, &after));
    CHECK(after != before);
  }
}

TEST_CASE("in a small window no panel lies over another") {
  const auto context = make_headless_context();
  Overlay overlay;
  for (const PictureSize size : {PictureSize{120, 700}, PictureSize{640, 60}, PictureSize{300, 240},
                                 PictureSize{200, 150}}) {
    CAPTURE(size.width);
    OverlayFigures figures = crowded();
    figures.slices = grey_slices(56);
    std::vector<std::uint8_t> rgb;
    CHECK(covered(overlay, figures, size, &rgb) > 0.0);
    int twice = 0;  // a panel alone lets more of the white below it through
    for (std::size_t i = 0; i < rgb.size(); i += 3) {
      twice += std::max({rgb[i], rgb[i + 1], rgb[i + 2]}) < 60 ? 1 : 0;
    }
    CHECK(twice == 0);
  }
}

TEST_CASE("panels are laid out at once as they stay, whatever was laid out before") {
  const auto context = make_headless_context();
  Overlay overlay;
  OverlayFigures few = crowded(), many = crowded(), sliced = crowded();
  few.score.resize(2);
  few.controls->opacities.clear();
  few.controls->volumes.resize(1);
  sliced.score.resize(2);
  sliced.controls->volumes.resize(3);
  sliced.slices = grey_slices(56);
  for (const PictureSize size : {kPlain, PictureSize{400, 600}, PictureSize{1100, 760}}) {
    for (const OverlayFigures& before : {few, many, sliced}) {
      for (const OverlayFigures& after : {few, many, sliced}) {
        std::vector<std::uint8_t> first, second;
        static_cast<void>(covered(overlay, before, kPlain));
        static_cast<void>(covered(overlay, after, size, &first));
        static_cast<void>(covered(overlay, after, size, &second));
        CAPTURE(size.width);
        CHECK(first == second);
      }
    }
  }
}

TEST_CASE("each page of the keys covers at most a quarter, and all keys have their page") {
  const auto context = make_headless_context();
  Overlay overlay;
  for (const bool leads : {false, true}) {
    OverlayFigures figures = crowded();
    figures.leads_hand = leads;
    figures.help = 1;
    static_cast<void>(covered(overlay, figures, kPlain));
    const int pages = overlay.help_pages();
    CHECK(pages == (leads ? 3 : 2));
    std::vector<std::vector<std::uint8_t>> seen;
    for (; figures.help <= pages; ++figures.help) {
      CAPTURE(figures.help);
      const double fraction = covered(overlay, figures, kPlain, &seen.emplace_back());
      CHECK(fraction < 0.25);
      CHECK(fraction > (figures.help < pages ? 0.1 : 0.05));  // the last one has the rest
      if (seen.size() > 1) CHECK(seen[seen.size() - 1] != seen[seen.size() - 2]);
    }
  }
}

TEST_CASE("a display of twice the density has panels of twice the size, where there is room") {
  const auto context = make_headless_context();
  Overlay overlay;
  OverlayFigures figures;
  figures.tool = "ball";
  constexpr PictureSize kTwice{2 * kPlain.width, 2 * kPlain.height};
  const double plain = covered(overlay, figures, kTwice);
  figures.scale = 2.0;
  CHECK(covered(overlay, figures, kTwice) == doctest::Approx(4.0 * plain).epsilon(0.1));
  const double small = covered(overlay, figures, kPlain);
  figures.scale = 1.0;
  CHECK(covered(overlay, figures, kPlain) == small);
}

TEST_CASE("names of tools are shown to their last letter, in the list and the figures") {
  const auto context = make_headless_context();
  Overlay overlay;
  const Silhouette side{{0.0, -0.2, 0.2}, {1.0, -1.0, 1.0}, {4.0, -0.5, 0.5}};
  for (const PictureSize size : {kPlain, PictureSize{2 * kPlain.width, 2 * kPlain.height}}) {
    for (const double scale : {1.0, 2.0}) {
      for (const std::size_t tools : {1U, 2U}) {
        CAPTURE(size.width);
        CAPTURE(scale);
        CAPTURE(tools);
        const auto shown = [&](const std::string& name) {  // O, C: the end alone is another one
          OverlayFigures figures;
          figures.scale = scale;
          figures.tool = name;
          figures.controls.emplace();
          for (std::size_t i = 0; i < tools; ++i) {
            figures.controls->tools.push_back({"1.0 mm " + name, side});
          }
          std::vector<std::uint8_t> picture;
          static_cast<void>(covered(overlay, figures, size, &picture));
          return picture;
        };
        for (const std::string name : {"inverted con", "fissure 01"}) {
          CHECK(shown(name + "O") != shown(name + "C"));
        }
      }
    }
  }
}

TEST_CASE("while the hand is led the panel says how to press") {
  const auto context = make_headless_context();
  Overlay overlay;
  OverlayFigures figures;
  figures.controls.emplace();
  std::vector<std::uint8_t> watches, leads;
  static_cast<void>(covered(overlay, figures, kPlain, &watches));
  figures.leads_hand = true;
  static_cast<void>(covered(overlay, figures, kPlain, &leads));
  CHECK(leads != watches);
}

TEST_CASE("letters are drawn for their size, and are not those of a smaller one enlarged") {
  const auto context = make_headless_context();
  Overlay overlay;
  OverlayFigures figures;
  figures.scale = 2.0;
  constexpr PictureSize kTwice{2 * kPlain.width, 2 * kPlain.height};
  std::vector<std::uint8_t> rgb;
  static_cast<void>(covered(overlay, figures, kTwice, &rgb));
  // On the dark ground of a panel: one of squares has no pixel between ground and letter.
  int whole = 0, partly = 0;
  for (std::size_t i = 0; i < rgb.size(); i += 3) {
    whole += rgb[i] > 160 && rgb[i] < 255 ? 1 : 0;
    partly += rgb[i] > 110 && rgb[i] <= 160 ? 1 : 0;
  }
  CHECK(partly > whole / 10);
}

}  // namespace kerf::panels_test
