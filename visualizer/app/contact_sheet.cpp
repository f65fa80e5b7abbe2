// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/contact_sheet.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <vector>

#include <imgui.h>

#include "visualizer/compose/scene_painter.hpp"
#include "visualizer/view/file_out.hpp"

namespace kerf {

namespace {

constexpr PictureSize kTile{320, 320};
constexpr int kColumns = 3;
constexpr int kFiner = 2;  // drawn so many times larger, so that edges are smooth
constexpr std::uint8_t kBackdrop = 46;
constexpr std::uint8_t kInk = 240;

/// 8-bit RGB, first row at the top.
struct Sheet {
  PictureSize size;
  std::vector<std::uint8_t> rgb;

  [[nodiscard]] std::uint8_t* pixel(int x, int y) {
    return &rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) +
                     static_cast<std::size_t>(x))];
  }
};

/// The mean of each square of `kFiner` pixels.
std::vector<std::uint8_t> reduced(const std::vector<std::uint8_t>& fine) {
  std::vector<std::uint8_t> tile;
  for (int y = 0; y < kTile.height; ++y) {
    for (int x = 0; x < 3 * kTile.width; ++x) {
      int sum = 0;
      for (int i = 0; i < kFiner * kFiner; ++i) {
        const int column = 3 * (x / 3 * kFiner + i % kFiner) + x % 3;
        const int row = y * kFiner + i / kFiner;
        sum += fine[static_cast<std::size_t>(row * 3 * kFiner * kTile.width + column)];
      }
      tile.push_back(static_cast<std::uint8_t>(sum / (kFiner * kFiner)));
    }
  }
  return tile;
}

/// Writes with the overlay's font, twice its size.
class Pen {
 public:
  static constexpr int kScale = 2;
  static constexpr int kHeightPx = kScale * 13;  ///< of a line

  Pen() : font_(atlas_.AddFontDefault()) {
    int height = 0;
    atlas_.GetTexDataAsAlpha8(&coverage_, &width_, &height);
    height_ = height;
  }
  void write(std::string_view text, int x, int y, Sheet& sheet) const {
    for (const char letter : text) {
      const ImFontGlyph& glyph = *font_->FindGlyph(static_cast<ImWchar>(letter));
      const int left = static_cast<int>(glyph.U0 * static_cast<float>(width_) + 0.5F);
      const int top = static_cast<int>(glyph.V0 * static_cast<float>(height_) + 0.5F);
      const int wide = kScale * static_cast<int>(glyph.X1 - glyph.X0 + 0.5F);
      const int high = kScale * static_cast<int>(glyph.Y1 - glyph.Y0 + 0.5F);
      for (int j = 0; j < high; ++j) {
        for (int i = 0; i < wide; ++i) {
          if (coverage_[(top + j / kScale) * width_ + left + i / kScale] == 0) continue;
          std::fill_n(sheet.pixel(x + kScale * static_cast<int>(glyph.X0) + i,
                                  y + kScale * static_cast<int>(glyph.Y0) + j),
                      3, kInk);
        }
      }
      x += kScale * static_cast<int>(glyph.AdvanceX);
    }
  }

 private:
  ImFontAtlas atlas_;
  ImFont* font_;
  unsigned char* coverage_ = nullptr;
  int width_ = 0, height_ = 0;
};

}  // namespace

void write_contact_sheet(const std::filesystem::path& file, const SceneView& scene,
                         std::span<const VolumeContent> contents, const std::optional<Hand>& hand) {
  constexpr int kMarginPx = 10;
  constexpr double kAspect = static_cast<double>(kTile.width) / kTile.height;
  constexpr double kNearer = 1.5;  // one tooth does not fill its box
  constexpr double kLower = 0.07;  // of the tile's height: as seen from above it stands high
  constexpr double kReach = 3.0;   // radii of what is framed: room for the tool
  OrbitCamera camera;
  camera.frame(scene.corners(), kAspect);
  if (scene.volumes.size() == 1) camera.zoom(kNearer);
  camera.pan(0.0, -kLower);
  const View view = camera.view(kAspect, kReach * camera.radius_mm());
  const RenderTarget target({kFiner * kTile.width, kFiner * kTile.height});
  std::optional<Hand> tool = hand;
  if (tool) tool->force_n = glm::dvec3(0.0);  // an arrow would hide what is to be compared

  const auto kinds = renderer_kinds();
  const int rows = (static_cast<int>(kinds.size()) + kColumns - 1) / kColumns;
  Sheet sheet{{kColumns * kTile.width, rows * kTile.height}, {}};
  sheet.rgb.resize(static_cast<std::size_t>(sheet.size.width * sheet.size.height) * 3);
  const Pen pen;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    ScenePainter painter(std::string(kinds[i]), scene, contents);
    constexpr float kGrey = kBackdrop / 255.0F;
    target.bind();
    glClearColor(kGrey, kGrey, kGrey, 1.0F);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (tool) painter.hold(*tool);
    painter.draw_volumes(ScenePainter::Layer::opaque, view, target);
    if (tool) painter.draw_tool(*tool, view, target);
    painter.draw_volumes(ScenePainter::Layer::translucent, view, target);
    const std::vector<std::uint8_t> tile = reduced(target.read_rgb());
    const int left = static_cast<int>(i) % kColumns * kTile.width;
    const int top = static_cast<int>(i) / kColumns * kTile.height;
    for (int y = 0; y < kTile.height; ++y) {
      std::copy_n(tile.begin() + static_cast<std::ptrdiff_t>(3 * y * kTile.width), 3 * kTile.width,
                  sheet.pixel(left, top + y));
    }
    pen.write(kinds[i], left + kMarginPx, top + kTile.height - kMarginPx - Pen::kHeightPx, sheet);
  }
  write_png(file, sheet.size, sheet.rgb);
}

}  // namespace kerf
