#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A map of two columns of a table:  kb_map.py TABLE.csv PICTURE.png [X Y COLOUR] [COLUMN=VALUE ...]
TABLE.csv is of `./kerf lab zwidth --csv`, whose K-B map is drawn, or of `./kerf sweep`. COLUMN=VALUE keeps its rows."""
import matplotlib.pyplot as plt
import numpy as np
import one_line

def draw(table, picture, *words):
    only = [word.split("=", 1) for word in words if "=" in word]
    names = [word for word in words if "=" not in word] or ["damping_ns_per_mm", "stiffness_n_per_mm", "active"]
    data = np.atleast_1d(np.genfromtxt(table, delimiter=",", names=True, dtype=None, encoding="utf-8", deletechars=""))
    for word in names + [column for column, _ in only]:
        if word not in (data.dtype.names or ()): raise ValueError(f"{table}: {word}: no column; it has {data.dtype.names}")
    if len(names) != 3: raise ValueError(f"{' '.join(names)}: not three columns; name X, Y and COLOUR, or none")
    for column, value in only: data = data[data[column].astype(str) == value]
    if not data.size: raise ValueError(f"{table}: no rows{' of these values' if only else ''}; give others")
    (xs, column), (ys, row) = (np.unique(data[name], return_inverse=True) for name in names[:2])
    if len(set(zip(row, column))) < len(data): raise ValueError(f"{table}: several rows for one cell; keep COLUMN=VALUE")
    grid = np.full((len(ys), len(xs)), np.nan)  # a cell that no run filled stays white
    grid[row, column] = data[names[2]]
    plt.colorbar(plt.pcolormesh(np.arange(len(xs) + 1), np.arange(len(ys) + 1), grid, cmap="cividis"), label=names[2])
    for ticks, values in ((plt.xticks, xs), (plt.yticks, ys)):
        shown = np.unique(np.linspace(0, len(values) - 1, min(len(values), 8)).astype(int))
        ticks(shown + 0.5, [str(values[i])[:8] for i in shown])
    plt.gca().set(xlabel=names[0], ylabel=names[1], title=", ".join(f"{column} {value}" for column, value in only))
    plt.savefig(picture, dpi=120, bbox_inches="tight")

one_line.run(draw, __doc__)
