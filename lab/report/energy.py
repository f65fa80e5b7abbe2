# SPDX-License-Identifier: Apache-2.0
"""The part of docs/stability.md on energy, and its tables for the terminal. JSON of `kerf lab energy --report`:

    provenance                  day, machine and compiler of the run
    loops                       {model, numeric, share, most_share, friction_mj, leak_mj}
    feel                        {hand, stiffness_n_per_mm, stabiliser, peak_n, delay_ms, depth_mm, swing_mm, drag_n, port_minimum_mj}
    cost                        {name, numeric, ns}"""
import text

HEAD = """\
## Energy at the device port

This part measures the work at the device port, by the servo's own energy ledger (docs/forces.md 5.5), and the cost of the
stabilisers (docs/forces.md 5.6). Positive energy flows from the hand into the loop. Made by
`./kerf lab energy --page docs/stability.md`.

"""

LOOPS = """\
### Closed paths on a static ball

The tool is a ball of 1 mm radius. It penetrates a ball of 3 mm radius by about 0.6 mm, and moves twice along each of six
tilted circles of 0.375 mm radius. The figures are of the second lap.

* `ratio`: |SUM dW| / SUM |dW| of the contact force without sample and hold, on the worst circle. A force with a potential
  has 0: a closed path gives no energy.
* `friction`: mean work of a lap that friction takes from the hand.
* `leak`: mean work of a lap that sample and hold takes. It is negative: the loop gives this energy to the hand.

"""

FEEL = """
### The effect of a stabiliser on the hand

A hand pushes with 1 N from 0.1 mm above a wall, and after 2 s it pulls back. Fixed point, 1 kHz, encoder steps of
0.055 mm, the limits of an Omni, no virtual damping.

* `hand`: `bare` is the device alone, 0.045 kg and 0.2 N s/m; `gripped` is the device in a hand, 0.145 kg and 3.2 N s/m. The
  stabilisers know the figures of the device only.
* `delay`: time from first contact until the force is half of the push (3000: never).
* `depth`, `travel`: mean penetration and its peak-to-peak value in the last half second of the push. A negative depth means
  that the tip bounces, and is on average above the wall.
* `drag`: largest force in air after the hand pulled back.
* `minimum`: lowest energy of the port. The correction of `passivity` comes one tick late. So with a stiff wall the minimum
  may be lower with `passivity` than without a stabiliser, if the hand itself already damps the device.

"""

COST = """
### The time they take

Time added to a tick in contact. *Ledger and observer* includes the split of the spring's work into stored energy and leak.
The aim for all of it is 1000 ns.

"""


def tables(data):
    return (LOOPS
            + text.table(["model", "numbers", "ratio", "at most", "friction mJ", "leak mJ"],
                         [[row["model"], row["numeric"], f"{row['share']:.2g}", f"{row['most_share']:.2g}",
                           f"{row['friction_mj']:.4f}", f"{row['leak_mj']:.5f}"] for row in text.rows_of(data, "loops")])
            + FEEL
            + text.table(["hand", "K N/mm", "stabiliser", "peak N", "delay ms", "depth mm", "travel mm", "drag N", "minimum mJ"],
                         [[row["hand"], f"{row['stiffness_n_per_mm']:g}", row["stabiliser"], f"{row['peak_n']:.2f}",
                           f"{row['delay_ms']:.0f}", f"{row['depth_mm']:.2f}", f"{row['swing_mm']:.3f}",
                           f"{row['drag_n']:.2f}", f"{row['port_minimum_mj']:.3f}"] for row in data["feel"]])
            + COST
            + text.table(["what", "numbers", "ns a tick"],
                         [[row["name"], row["numeric"], f"{row['ns']:.0f}"] for row in data["cost"]]))


def page(data):
    return HEAD + tables(data) + "\n" + data["provenance"] + "\n"
