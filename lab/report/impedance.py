# SPDX-License-Identifier: Apache-2.0
"""The plot of a wall over frequency (`kerf lab impedance --plot`). JSON of `--json`:

    axes, stiffness_n_per_mm    of the wall and its device, the value of each axis as a text
    theory_holds                whether the measured law is that of the theory
    least_damping               {wall, port}: {hz, damping_ns_per_mm}
    passive_viscous_ns_per_mm   damping of a device with which the wall is passive
    rows                        {hz, amplitude_mm, wall, port}, each {theory, measured}: {stiffness_n_per_mm, damping_ns_per_mm};
                                measured null: the limits of the force leave no such motion"""
import math

import text


def stiffness_of(felt, _):
    return felt["stiffness_n_per_mm"]


def damping_of(felt, _):
    return felt["damping_ns_per_mm"]


def size_of(felt, hz):
    """|Z|, N s/mm."""
    return math.hypot(damping_of(felt, hz), stiffness_of(felt, hz) / (2 * math.pi * hz))


def column(rows, of, how, value_of):
    return [math.nan if row[of][how] is None else value_of(row[of][how], row["hz"]) for row in rows]


def plot(data):
    import figure as fig
    rows = text.rows_of(data)
    hz = [row["hz"] for row in rows]
    figure, axes = fig.new_figure(1180, 420, 1, 3, left=70, right=20, top=75, bottom=95, across=85)
    size, stiffness, damping = axes[0]
    alone = len(rows) == 1
    for panel in axes[0]:
        fig.log_axis(panel, "x", hz[0] / 2 if alone else hz[0], hz[-1] * 2 if alone else hz[-1], (1, 3))
        panel.set_xlabel("frequency of the motion (Hz)")
        panel.grid(True)
    theory, dots = {"wall": fig.BLUE, "port": fig.ORANGE}, {"wall": fig.BLACK, "port": fig.RED}
    names = {"wall": "wall", "port": "device and wall"}
    dash = "-" if data["theory_holds"] else "--"
    for of in ("wall", "port"):
        for panel, value_of in ((size, size_of), (stiffness, stiffness_of), (damping, damping_of)):
            if panel is stiffness and of == "port":
                continue  # the mass takes it far below all others: the first panel shows it
            panel.plot(hz, column(rows, of, "theory", value_of), dash, color=theory[of], label=f"{names[of]}, theory")
            panel.plot(hz, column(rows, of, "measured", value_of), "o", color=dots[of], markersize=3.5,
                       label=f"{names[of]}, measured")
    size.set_yscale("log")
    size.set_title("force over velocity, |Z| (N s/mm)", loc="left")
    stiffness.set_title("stiffness of the wall as felt (N/mm)", loc="left")
    stiffness.axhline(data["stiffness_n_per_mm"], color=fig.GREY, linewidth=0.8)
    stiffness.margins(y=0.08)
    damping.set_title("damping as felt (N s/mm)", loc="left")
    damping.axhline(0, color=fig.GREY, linewidth=0.8)
    # Friction of a slow motion is beyond all others: the panel shows what crosses 0.
    shown = [value for how in ("theory", "measured") for value in column(rows, "wall", how, damping_of) if value == value]
    low, high = min(0, *shown), max(0, *shown)
    margin = 0.1 * (high - low) or 1e-6
    damping.set_ylim(low - margin, high + max(margin, high - low))
    handles, labels = size.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=4)
    of = data["axes"]
    figure.suptitle(f"K {data['stiffness_n_per_mm']:g} N/mm, B {of['damping_ns_per_mm']} N s/mm, {of['rate_hz']} Hz, "
                    f"delay {of['delay_periods']} (periods), estimator {of['estimator']}"
                    + ("" if data["theory_holds"] else " (theory: of the estimator difference)"), x=0.01, ha="left", fontsize=10.5)
    return fig.svg(figure)
