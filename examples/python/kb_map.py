#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A map of two columns of a table:  kb_map.py TABLE.csv PICTURE.png [X Y COLOUR] [COLUMN=VALUE ...]

TABLE.csv is of `./kerf lab zwidth --csv`, whose K-B map is drawn, or of `./kerf sweep`. COLUMN=VALUE keeps its rows."""
import sys

import matplotlib.pyplot as plt
import numpy as np

table, picture = sys.argv[1:3]
only = [word.split("=", 1) for word in sys.argv[3:] if "=" in word]
names = [word for word in sys.argv[3:] if "=" not in word]
x, y, colour = names or ("damping_ns_per_mm", "stiffness_n_per_mm", "active")
data = np.genfromtxt(table, delimiter=",", names=True, dtype=None, encoding="utf-8", deletechars="")
for column, value in only:
    data = data[data[column].astype(str) == value]
xs, ys = np.unique(data[x]), np.unique(data[y])
grid = np.full((len(ys), len(xs)), np.nan)  # a cell that no run filled stays white
grid[np.searchsorted(ys, data[y]), np.searchsorted(xs, data[x])] = data[colour]
mesh = plt.pcolormesh(np.arange(len(xs) + 1), np.arange(len(ys) + 1), grid, cmap="cividis")
plt.colorbar(mesh, label=colour)
for ticks, values in ((plt.xticks, xs), (plt.yticks, ys)):
    shown = np.unique(np.linspace(0, len(values) - 1, min(len(values), 8)).astype(int))
    ticks(shown + 0.5, [f"{values[i]:.4g}" for i in shown])
plt.gca().set(xlabel=x, ylabel=y)
plt.title(", ".join(f"{column} {value}" for column, value in only))
plt.tight_layout()
plt.savefig(picture, dpi=120)
