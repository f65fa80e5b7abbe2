// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lab/extremes/row.hpp"

// The groups of `kerf-lab extremes`. Each measures the servo's own code in fixed point, open loop,
// in voxels of 0.1 mm and at 1 kHz unless said. All but the ticks' times repeat bit for bit.
namespace kerf::extremes {

/// F7 (docs/validation.md): random motions at walls.
void measure_walls(const Effort& effort, const RowSink& add_row);
/// F9: where a ball comes to rest, against the ideal solid, and on sharp edges against the volume's
/// own iso-surface.
void measure_rests(const Effort& effort, const RowSink& add_row);
/// F8: what a sliding ball feels, on edges over two voxels and on those of a noisy CT.
void measure_slides(const Effort& effort, const RowSink& add_row);
/// Tools that are no balls, on flats, in any pose.
void measure_shapes(const Effort& effort, const RowSink& add_row);
/// Their part that slides over a bump of 40 units, and the one that rests on sharp edges.
void measure_shape_slides(const Effort& effort, const RowSink& add_row);
void measure_shape_edges(const Effort& effort, const RowSink& add_row);
/// F11: what force removes in the whole servo, and what the hand feels of it. Few cases at any
/// effort.
void measure_cutting(const Effort& effort, const RowSink& add_row);
/// What a tick costs.
void measure_ticks(const Effort& effort, const RowSink& add_row);

}  // namespace kerf::extremes
