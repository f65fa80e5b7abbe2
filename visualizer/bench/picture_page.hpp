// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "visualizer/bench/picture_rows.hpp"
#include "visualizer/gl/context.hpp"

namespace kerf {

/// One line for each renderer and volume, beside the paper's frames per second; Markdown.
[[nodiscard]] std::string picture_table(std::span<const PictureRow> rows);

/// docs/pictures.md: what was measured, where and how, and the table.
[[nodiscard]] std::string picture_page(std::span<const PictureRow> rows, const GlDriver& driver,
                                       PictureSize size, std::size_t cores);

/// {gl_renderer, processor, cores, width, height, rows}.
[[nodiscard]] std::string picture_report(std::span<const PictureRow> rows, const GlDriver& driver,
                                         PictureSize size, std::size_t cores);

}  // namespace kerf
