# SPDX-License-Identifier: Apache-2.0
"""Style and output of all plots. The same figure gives the same bytes."""
import io
import re

import matplotlib
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

# Colours of Okabe and Ito, which differ for every kind of colour vision.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, RED, PINK, BROWN = "#F0E442", "#0072B2", "#D55E00", "#CC79A7", "#7B3F00"
GREY, TEXT, FRAME, GRID = "#999999", "#333333", "#555555", "#DDDDDD"

matplotlib.rcdefaults()  # nothing of the user's own settings
matplotlib.rcParams.update({
    "svg.hashsalt": "kerf", "svg.fonttype": "none",
    "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "Helvetica", "sans-serif"],
    "font.size": 9.5, "axes.titlesize": 10, "axes.labelsize": 9.5, "legend.fontsize": 9,
    "axes.titlepad": 8, "axes.edgecolor": FRAME, "axes.labelcolor": TEXT, "axes.titlecolor": BLACK, "text.color": TEXT,
    "axes.spines.top": False, "axes.spines.right": False, "axes.axisbelow": True, "axes.linewidth": 0.8,
    "xtick.color": FRAME, "ytick.color": FRAME, "xtick.labelcolor": TEXT, "ytick.labelcolor": TEXT,
    "xtick.labelsize": 9, "ytick.labelsize": 9,
    "grid.color": GRID, "grid.linewidth": 0.6, "lines.linewidth": 1.5, "lines.solid_joinstyle": "round",
    "legend.frameon": False, "legend.handlelength": 2, "path.simplify": True, "path.simplify_threshold": 0.1,
})


def new_figure(width, height, rows=1, columns=1, **spacing):
    """A figure in pixels of the screen, and its axes as a table of rows and columns. `spacing` in pixels: left, right,
    top and bottom beside the axes, across and down between them."""
    figure = Figure(figsize=(width / 96, height / 96))
    left, right = spacing.get("left", 70), spacing.get("right", 25)
    top, bottom = spacing.get("top", 45), spacing.get("bottom", 50)
    across, down = spacing.get("across", 80), spacing.get("down", 70)
    wide = (width - left - right - across * (columns - 1)) / columns
    tall = (height - top - bottom - down * (rows - 1)) / rows
    axes = [[figure.add_axes(((left + i * (wide + across)) / width, 1 - (top + tall + k * (tall + down)) / height,
                              wide / width, tall / height)) for i in range(columns)] for k in range(rows)]
    return figure, axes


def log_axis(axes, axis, low, high, digits=(1,)):
    """A logarithmic axis "x" or "y" with plain numbers at these digits of each decade."""
    getattr(axes, f"set_{axis}scale")("log")
    ticks(getattr(axes, f"{axis}axis"), digits)
    getattr(axes, f"set_{axis}lim")(low, high)


def ticks(axis, digits):
    axis.set_major_locator(LogLocator(subs=digits, numticks=30))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    if len(digits) > 1:
        axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())


def svg(figure):
    out = io.StringIO()
    figure.savefig(out, format="svg", facecolor="white", metadata={"Date": None, "Creator": None})
    return shorter(out.getvalue())


def shorter(text):
    """The same picture in fewer bytes: a hundredth of a point is enough, and nothing is rotated by 0."""
    def rounded(tag):
        tag = re.sub(r' transform="rotate\(-0 [^)]*\)"', "", tag[0])
        return re.sub(r"\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), tag)
    return re.sub(r"<[^>]*>", rounded, text)
