#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A map of two columns of a table:  kb_map.py TABLE.csv PICTURE.png [X Y COLOUR] [COLUMN=VALUE ...]
TABLE.csv is of `./kerf lab zwidth --csv`, whose K-B map is drawn, or of `./kerf sweep`. COLUMN=VALUE keeps its rows."""
import one_line  # first: it tells of a package that lacks
import matplotlib.pyplot as plt
import numpy as np
import table as tables
def draw(table, picture, *words):
    only = [word.split("=", 1) for word in words if "=" in word]
    names = [word for word in words if "=" not in word] or ["damping_ns_per_mm", "stiffness_n_per_mm", "active"]
    data = tables.columns_of(table, only)
    for name in names:
        if name not in data: raise ValueError(f"{table}: {name}: no column; it has {', '.join(data) or 'none'}")
    if len(names) != 3: raise ValueError(f"{' '.join(names)}: not three columns; name X, Y and COLOUR, or none")
    x, y, colour = (data[name] for name in names)
    if not x: raise ValueError(f"{table}: no rows{' of these values' if only else ''}; give others")
    (xs, column), (ys, row) = (np.unique(values, return_inverse=True) for values in (x, y))
    if len(set(zip(row, column))) < len(x): raise ValueError(f"{table}: several rows for one cell; {tables.way(data, row, column)}")
    grid = np.full((len(ys), len(xs)), np.nan)  # a cell that no run filled stays white
    grid[row, column] = colour
    plt.colorbar(plt.pcolormesh(np.arange(len(xs) + 1), np.arange(len(ys) + 1), grid, cmap="cividis"), label=names[2])
    for ticks, values in ((plt.xticks, xs), (plt.yticks, ys)):
        shown = np.unique(np.linspace(0, len(values) - 1, min(len(values), 8)).astype(int))
        ticks(shown + 0.5, [values[i] if values.dtype.kind in "US" else f"{values[i]:.4g}" for i in shown])
    plt.gca().set(xlabel=names[0], ylabel=names[1], title=", ".join(f"{column} {value}" for column, value in only))
    plt.savefig(picture, dpi=120, bbox_inches="tight")

one_line.run(draw, __doc__)
