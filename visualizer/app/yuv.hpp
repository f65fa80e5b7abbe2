// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "visualizer/gl/target.hpp"

namespace kerf {

/// A picture as video has it: brightness for each pixel, then two planes of colour differences with
/// one value for each square of two by two pixels (fewer at an odd side), their mean.
///
/// ITU-R BT.709, limited range, 8 bits, each value rounded once: with R, G, B in 0..1,
///
///     Y' = 0.2126 R + 0.7152 G + 0.0722 B                      16 + 219 Y'
///     Cb = (B - Y') / 1.8556,  Cr = (R - Y') / 1.5748          128 + 224 C
///
/// `rgb` as from RenderTarget::read_rgb; `yuv` becomes Y, Cb, Cr.
void fill_yuv420(PictureSize size, std::span<const std::uint8_t> rgb,
                 std::vector<std::uint8_t>& yuv);

}  // namespace kerf
