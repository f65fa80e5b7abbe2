# SPDX-License-Identifier: Apache-2.0
"""The functions of the rows of reproduce.toml: each returns kerf's number, in the unit behind @gives, from runs of kerf alone.

A function gets `kerf` (reproduce.Kerf: map, probe, devices) and the row's `parameters` by their names. It types in no number of
its own that a reader could take for a measurement. Forces in N, lengths in mm, time in s, as kerf has them."""
import math

# A wall as the papers have it: a spring that never pulls, with the backward difference, in exact numbers.
PAPERS = {"law": "linear", "estimator": "difference", "numeric": "double", "limits": "off"}


def gives(unit):
    def mark(function):
        function.unit = unit
        return function
    return mark


def first(boundary):
    """A first crossing in N/mm: inf if none."""
    if boundary["first_n_per_mm"] is not None:
        return boundary["first_n_per_mm"]
    return 0.0 if boundary["reason"] == "below all" else math.inf


# --- the theory's limits, as kerf computes them for a column

@gives("N/mm")
def passive_stiffness(kerf, **axes):
    """The largest K of a sampled wall that is passive, without friction."""
    return kerf.column(2, **axes)["analytic"]["passive_n_per_mm"]


@gives("N/mm")
def friction_passive_stiffness(kerf, **axes):
    """The same with Coulomb friction and encoder steps."""
    return kerf.column(2, **axes)["analytic"]["quantum_n_per_mm"]


@gives("N/mm")
def linear_stiffness(kerf, **axes):
    """The exact boundary of the linear loop: mass, dampings, delay, hold."""
    return kerf.column(2, **axes)["analytic"]["exact_n_per_mm"]


@gives("1")
def viscous_boundary(kerf, viscous, rate=1000, **axes):
    """beta = b / (K T) of the linear boundary at K."""
    return viscous * rate / linear_stiffness(kerf, viscous=viscous, rate=rate, **axes)


@gives("1")
def delay_law(kerf, **axes):
    """(1/K2 - 1/K1) / (1/K1 - 1/K0), K of the linear boundary with a delay of 0, 1 and 2 periods: 1 if 1/K is linear in it."""
    k = [linear_stiffness(kerf, delay=delay, **axes) for delay in (0, 1, 2)]
    return (1 / k[2] - 1 / k[1]) / (1 / k[1] - 1 / k[0])


# --- runs of one axis

@gives("N/mm")
def first_unstable(kerf, **axes):
    """The lowest K at which a run swings or is active, of any press and seed."""
    column = kerf.column("0.02:100:30", **axes)
    return min(first(column["by_travel"]), first(column["by_energy"]))


@gives("N/mm")
def first_active(kerf, **axes):
    """The lowest K at which the wall goes on giving energy."""
    return first(kerf.column("0.02:100:30", **axes)["by_energy"])


@gives("text")
def outcome(kerf, stiffness, **axes):
    """What one wall does: rests, is active, swings."""
    cell = kerf.column([stiffness, stiffness * 1.000001], **axes)["cells"][0]
    return next((name for name in ("swings", "active", "undecided") if cell[name]), "rests")


@gives("N s/mm")
def most_damping(kerf, stiffness=0.05, most=0.06, **axes):
    """The largest B, in 24 steps up to `most`, below which a soft wall rests after a light push."""
    press = {"push": 0.5, "hit": 0, "start": 0.1, "seeds": 1}
    columns = kerf.map([stiffness, stiffness * 1.000001], damping=f"0:{most}:25", **press, **axes)["columns"]
    highest = 0.0
    for column in sorted(columns, key=lambda column: float(column["axes"]["damping_ns_per_mm"])):
        if not column["cells"] or any(column["cells"][0][name] for name in ("swings", "active", "undecided")):
            break
        highest = float(column["axes"]["damping_ns_per_mm"])
    return highest


@gives("1")
def ratio(kerf, of, axis, values, **axes):
    """Function `of` at the second value of an axis over that at the first."""
    low, high = (FUNCTIONS[of](kerf, **{axis: value}, **axes) for value in values)
    return high / low if low else math.inf


@gives("1")
def exponent(kerf, of, axis, values, **axes):
    """e of the power law through the first and the last value."""
    low, high = (FUNCTIONS[of](kerf, **{axis: value}, **axes) for value in (values[0], values[-1]))
    return math.log(high / low) / math.log(values[-1] / values[0])


@gives("Hz")
def rate_for(kerf, stiffness, rates, **axes):
    """The lowest of these rates at which a wall of this stiffness rests."""
    for rate in rates:
        if first_unstable(kerf, rate=rate, **axes) > stiffness:
            return float(rate)
    return math.inf


@gives("ms")
def best_filter(kerf, filters, **axes):
    """The time constant of the velocity's low-pass, of these, with the highest first K."""
    return float(max(filters, key=lambda ms: first_unstable(kerf, filter=ms, **axes)))


@gives("1")
def time_over_theory(kerf, **axes):
    """First K that swings in a run of the linear loop, over its exact boundary."""
    return first_unstable(kerf, loop="ideal", **axes) / linear_stiffness(kerf, loop="ideal", **axes)


@gives("1")
def arm_mode_ratio(kerf, modes, **axes):
    """First unstable K of the whole arm with the second structural mode over that with the first; 0: rigid."""
    low, high = (min(first(column["by_travel"]), first(column["by_energy"])) for column in
                 (kerf.column("0.1:4:4", seeds=1, whole_arm=True, mode=mode, **axes) for mode in modes))
    return high / low


# --- Diolaiti's plane

@gives("1")
def cells_of_region(kerf, region, verdict):
    """How many cells of the plane of b/(KT) and f/(KD) in a region have a verdict."""
    inside = {"passive": lambda b, s: b >= 0.5 and s >= 0.5, "below the viscous line": lambda b, s: b < 0.5}[region]
    return float(sum(1 for cell in kerf.regions()["cells"] if inside(cell["beta"], cell["sigma"]) and
                     {"rests": cell["light"] == cell["hard"] == "rests",
                      "does not rest": "rests" not in (cell["light"], cell["hard"]),
                      "not at rest with some press": cell["light"] != "rests" or cell["hard"] != "rests",
                      "depends on the press": (cell["light"] == "rests") != (cell["hard"] == "rests")}[verdict]))


# --- the energy of a contact

@gives("any")
def contact(kerf, figure, **figures):
    """One figure of a contact (lab/reproduce/probes.hpp)."""
    return kerf.probe("contact", **figures)[figure]


@gives("text")
def contact_outcome(kerf, settled_mm=0.001, **figures):
    """never touches, settles, oscillates or diverges."""
    run = kerf.probe("contact", **figures)
    if run["peak_n"] == 0:
        return "never touches"
    return "diverges" if run["ended_early"] else "settles" if run["swing_mm"] < settled_mm else "oscillates"


@gives("mJ")
def energy_given(kerf, **figures):
    """The most that the port has given in a contact that began at 0."""
    return -kerf.probe("contact", **figures)["lowest_port_mj"]


@gives("1")
def rendered_stiffness(kerf, stiffness_n_per_mm, push_n, **figures):
    """Push over the depth at which a wall comes to rest, over its K."""
    run = kerf.probe("contact", stiffness_n_per_mm=stiffness_n_per_mm, push_n=push_n, **figures)
    return push_n / run["last_depth_mm"] / stiffness_n_per_mm


# --- devices

@gives("any")
def device(kerf, device, figure):
    """A figure of kerf's table of devices, or of a scene's own limits."""
    return kerf.devices()[device][figure]


@gives("N/mm")
def device_first_unstable(kerf, device, rate=1000, delay=None, **axes):
    """first_unstable with the figures of a device of that table; `delay` in periods, else the table's."""
    row = kerf.devices()[device]
    axes = {name: axes.pop(name, row[key]) for name, key in (("mass", "mass_kg"), ("viscous", "viscous_ns_per_mm"),
                                                             ("friction", "friction_n"), ("quantum", "quantum_mm"))} | axes
    return first_unstable(kerf, rate=rate, delay=row["delay_s"] * rate if delay is None else delay, **axes)


@gives("N/mm")
def device_linear_stiffness(kerf, device, rate, delay=0, **axes):
    """linear_stiffness with the mass and damping of a device of that table."""
    row = kerf.devices()[device]
    return linear_stiffness(kerf, mass=row["mass_kg"], viscous=row["viscous_ns_per_mm"], rate=rate, delay=delay, **axes)


@gives("kg")
def map_mass(kerf, device):
    """The one mass that kerf's map has for every direction of a device."""
    return float(kerf.column(2, device=device, damping=0)["axes"]["mass_kg"])


# --- cutting

def cut_figures(changed, value, figures):
    if "." not in changed:
        return {**figures, changed: value}
    return {**figures, "settings": [*figures.get("settings", []), f"{changed}={value}"]}


@gives("1")
def cut_exponent(kerf, over, values, **figures):
    """e of the removal rate over a figure of the cut, or over a key of its scene."""
    low, high = (kerf.probe("cut", **cut_figures(over, value, figures))["rate_mm3_per_s"] for value in (values[0], values[-1]))
    return math.log(high / low) / math.log(values[-1] / values[0])


@gives("1")
def cut_force_exponent(kerf, values, press, **figures):
    """e of the press over the spindle's speed at equal feed: -(that of the rate over speed) / (that over press)."""
    speed = cut_exponent(kerf, "spindle.speed_krpm", values, **figures)
    return -speed / cut_exponent(kerf, "press_n", press, **figures)


@gives("mm3/s")
def cut_rate(kerf, **figures):
    return kerf.probe("cut", **figures)["rate_mm3_per_s"]


@gives("%")
def cut_wear(kerf, **figures):
    """Change of the removal rate from the first quarter of a cut to its last."""
    run = kerf.probe("cut", **figures)
    return 100 * (run["last_mm3_per_s"] / run["first_mm3_per_s"] - 1)


@gives("1")
def cut_ratio(kerf, over, values, **figures):
    """The removal rate at the second value of a figure or key over that at the first."""
    low, high = (kerf.probe("cut", **cut_figures(over, value, figures))["rate_mm3_per_s"] for value in values)
    return high / low


@gives("N")
def cut_threshold(kerf):
    """The press below which a scene that says nothing of it cuts nothing."""
    return kerf.devices()["scene"]["cut_threshold_n"]


FUNCTIONS = {name: function for name, function in globals().items() if hasattr(function, "unit")}
