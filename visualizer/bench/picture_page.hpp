// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "visualizer/bench/picture_bench.hpp"

namespace kerf {

/// What a run of the bench measured, and where.
struct PictureFigures {
  std::vector<PictureRow> rows;
  std::vector<GradientRow> gradients;
  std::string gl_renderer;
  PictureSize size;
  std::size_t cores = 0;
};

/// One line for each renderer and volume, beside the paper's frames per second; Markdown.
[[nodiscard]] std::string picture_table(std::span<const PictureRow> rows);
/// One line for each gradient: its errors, and what it costs `iso` on the paper's padded tooth.
[[nodiscard]] std::string gradient_table(const PictureFigures& figures);

/// docs/pictures.md: what was measured, where and how, and the tables.
[[nodiscard]] std::string picture_page(const PictureFigures& figures);
/// The part of docs/performance.md: what each renderer costs on the paper's padded tooth.
[[nodiscard]] std::string picture_summary(const PictureFigures& figures);
/// {gl_renderer, processor, cores, width, height, rows, gradients}.
[[nodiscard]] std::string picture_report(const PictureFigures& figures);

}  // namespace kerf
