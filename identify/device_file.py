# SPDX-License-Identifier: Apache-2.0
"""device.toml: what was found, in the units of scenes, for `kerf lab zwidth --device`; with intervals, and lines for the user."""
import numpy as np

from estimate import NAMES

_MASS, _VISCOUS, _COULOMB, _WEIGHT, _SPRING, _DELAY = slice(0, 6), slice(6, 9), slice(9, 12), slice(12, 15), slice(15, 18), 18
WHITE = 0.01         # p below which residuals are not white
UNEXPLAINED = 0.05   # of the force: an error of this size is as large as those that are promised for friction


def _number(value):
    return f"{value:.6g}"


def _list(values):
    return "[" + ", ".join(map(_number, values)) + "]"


def text_of(found, period_s, origin):
    """The file. Keys of what the log does not have are left out."""
    lines = [f"# A device, as kerf identify found it in {origin}: docs/gains.md.", "", "[device]"]

    def table(values, delay):
        parts = [("mass_kg", values[_MASS], 1.0, "xx, yy, zz, xy, xz, yz"), ("viscous_ns_per_mm", values[_VISCOUS], 1e-3, "x, y, z"),
                 ("coulomb_n", values[_COULOMB], 1.0, ""), ("weight_n", values[_WEIGHT], 1.0, "")]
        for key, part, unit, what in parts:
            if np.isfinite(part).all():
                yield f"{key} = {_list(part * unit)}" + (f"  # {what}" if what else "")
        if np.isfinite(delay):
            yield f"delay_s = {_number(max(delay, 0.0) * period_s)}"

    bounded = found.values.copy()
    for part in (_VISCOUS, _COULOMB):
        bounded[part] = np.maximum(bounded[part], 0.0)  # NaN stays
    lines += table(bounded, found.values[_DELAY])
    lines += [f"quantum_mm = {_list(found.quantum_m * 1000)}", f"rate_hz = {_number(1 / period_s)}"]
    if found.mode:
        lines += [f"mode_hz = {_number(found.mode.hz)}", f"mode_damping_ratio = {_number(found.mode.damping_ratio)}"]
    for name, values in (("low", found.low), ("high", found.high)):
        lines += ["", f"[{name}]  # end of the 95 % intervals", *table(values, values[_DELAY])]
        if found.mode:
            lines.append(f"mode_hz = {_number(getattr(found.mode, name + '_hz'))}")
    lines += ["", "[fit]", f"unexplained = {_number(found.unexplained)}", f"seconds = {_number(found.seconds)}",
              f"whiteness = {_list(np.nan_to_num(found.whiteness))}", ""]
    return "\n".join(lines)


def report(found, period_s):
    """Lines for the user: values with intervals, then what to know about them."""
    units = [("g", 1e3)] * 6 + [("N s/mm", 1e-3)] * 3 + [("N", 1.0)] * 6 + [("N/mm", 1e-3)] * 3 + [("ms", period_s * 1e3)]
    for name, value, low, high, (unit, factor) in zip(NAMES, found.values, found.low, found.high, units):
        if np.isfinite(value):
            yield f"{name:11} {value * factor:10.4g}  ({low * factor:.4g} to {high * factor:.4g}) {unit}"
    yield "quantum     " + ", ".join(f"{q * 1e6:.3g}" for q in found.quantum_m) + " um along x, y, z"
    yield (f"mode        {found.mode.hz:10.4g}  ({found.mode.low_hz:.4g} to {found.mode.high_hz:.4g}) Hz" if found.mode
           else "mode        none that the log shows")
    yield from remarks(found)


def remarks(found):
    if found.joint_friction:
        yield "Coulomb friction acts against the direction of the motion as a whole, f v / |v|, rather than on each axis alone"
    missing = [axis for axis in "xyz" if axis not in found.moved]
    if missing:
        yield f"{', '.join(missing)} did not move by 20 steps of the encoder: it was not identified; free it, or give it more force"
    for begin, end in found.spoilt:
        yield f"{begin:.1f} to {end:.1f} s is left out: something else moved the tip, as a hand or a knock does"
    if found.slips:
        at, axes, size = found.slips[0]
        more = f"; {len(found.slips) - 1} more follow" if len(found.slips) > 1 else ""
        yield f"a slip at {at:.2f} s: {', '.join(axes)} jumped by {size:.2g} mm in one tick, which no force explains{more}; left out"
    for one, other, correlation in found.together:
        yield f"{one} and {other} cannot be separated (correlation {correlation:+.2f}): each interval includes the error of the other"
    for name, value, low, high in zip(NAMES, found.values, found.low, found.high):
        if np.isfinite(value) and not name.startswith(("weight", "spring", "delay")) and name[-2:] not in ("xy", "xz", "yz"):
            if high - low > abs(value):
                yield f"{name} is not determined: its interval is wider than its value"
    if found.unexplained > UNEXPLAINED:
        yield f"the model does not fit: {found.unexplained:.0%} of the force has no explanation by mass, friction and delay"
    coloured = [axis for axis, p in zip("xyz", found.whiteness) if p < WHITE]
    if coloured:
        yield (f"what is left of {', '.join(coloured)} is not white (Ljung and Box, p < {WHITE}): the arm is more complex than the model, "
               "and intervals may be too narrow")
