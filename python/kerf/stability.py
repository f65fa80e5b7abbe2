# SPDX-License-Identifier: Apache-2.0
import dataclasses
import os

import numpy as np

from . import _kerf
from .interrupted import Interrupted

DEVICES_OF_MAPS = ("omni", "falcon", "woodenhaptics")


@dataclasses.dataclass(frozen=True)
class Map:
    """A stability map. Its arrays have one axis for each name in `axes`, in their order, and the stiffness last.

    stiffness_n_per_mm: (K,), N/mm. axes: {name: list of its values as texts}. rests, swings, active, undecided, arithmetic:
    bool (..., K): the verdict on the worst of all seeds and presses; see kerf.Verdict. travel_mm, given_mj:
    float64 (..., K) of that run. first_swing_n_per_mm, first_energy_n_per_mm: float64 (...): the lowest K, within 0.5 %, at which a
    press of any seed swings, or gives energy; 0: the lowest of all does; inf: none does. swing_by_seed_n_per_mm,
    energy_by_seed_n_per_mm: float64 (..., seeds): those of each seed alone. impossible: texts (...): why a column has no cells; empty:
    it has. Without cells flags are False and numbers NaN."""
    stiffness_n_per_mm: np.ndarray
    axes: dict
    rests: np.ndarray
    swings: np.ndarray
    active: np.ndarray
    undecided: np.ndarray
    arithmetic: np.ndarray
    travel_mm: np.ndarray
    given_mj: np.ndarray
    first_swing_n_per_mm: np.ndarray
    first_energy_n_per_mm: np.ndarray
    swing_by_seed_n_per_mm: np.ndarray
    energy_by_seed_n_per_mm: np.ndarray
    impossible: np.ndarray


def zwidth(*, stiffness, seeds=5, seed=1, seconds=60, threads=0, direction="", **axes):
    """A map of which walls rest on a device: `kerf lab zwidth` with the same bits and speed, as arrays.

    stiffness: N/mm, "0.05:50:40" (from:to:count, even in the ratio), or numbers. axes: the options of `kerf lab zwidth --help` by
    their names: device, damping (N s/mm), rate (Hz), delay (periods), mass (kg), law, estimator and so on; each a value, a list or
    array, or "from:to:count". push (N), hit (mm/s) and start (mm) are searched unless they are given (docs/stability.md). The device is
    an emulated one, with a delay of one period unless `delay` says otherwise: map_loop has its figures. It may also be one of touch,
    omega and inverse3, alone, or one device.toml of kerf identify, across `direction`: "x", "y", "z", such as "1,0,1", or "worst", as
    if it is empty: the one with the lowest stiffness that any push makes oscillate, by theory. seeds: so many of the encoders' steps against the wall, from
    `seed` on. seconds: to which a run that is still open is followed, at least. threads: 0
    for all cores; the map is the same. Returns a kerf.Map. Takes seconds to hours (docs/stability.md); Ctrl-C raises
    kerf.Interrupted with the Map of the columns that are done. Raises kerf.Error."""
    axes = _with_paths(axes)
    figures = _device_by_its_figures(axes)
    given = [(name, _text(name, value)) for name, value in figures.items()]
    measured, ended = _kerf.map_of(_text("stiffness", stiffness), given, seconds, seed, seeds, threads, direction)
    named = {"device": axes["device"]} if figures is not axes else {}
    made = _map_of(measured, list(axes), [{**dict(zip(figures, column.values)), **named} for column in measured.columns])
    if ended:
        raise Interrupted(made)
    return made


def _with_paths(axes):
    """A file may be given as a pathlib.Path."""
    return {name: os.fspath(value) if isinstance(value, os.PathLike) else value for name, value in axes.items()}


def _device_by_its_figures(axes):
    """The axis `device` of the lab knows three arms and files. A Touch has the Omni's; of the others the lab has to be given what
    differs."""
    device = axes.get("device")
    if not isinstance(device, str) or "," in device or device in DEVICES_OF_MAPS or device.endswith(".toml"):
        return axes
    if device == "touch":
        return {**axes, "device": "omni"}
    loop = _kerf.device_loop(device)
    figures = {"mass": loop.mass_kg, "friction": loop.coulomb_n, "quantum": loop.quantum_mm}
    return {**figures, **{name: value for name, value in axes.items() if name != "device"}}


def map_loop(device, rate_hz=1000.0, direction=""):
    """The kerf.SampledLoop that zwidth and cell have for a device: of the emulated arm, with a delay of one period.

    kerf.highest_stiffness(map_loop(device), damping) is the linear boundary of that map. kerf.device_loop is for a unit: with the
    2 ms of its bus, which are assumed until somebody measures them, and the least damping. rate_hz: of the servo. Of a device.toml both are the loop that was identified, across `direction` as of zwidth. Raises kerf.Error."""
    axes = _device_by_its_figures(_with_paths({"device": device, "rate": rate_hz}))
    return _kerf.column_loop([(name, _text(name, value)) for name, value in axes.items()], direction)


@dataclasses.dataclass(frozen=True)
class Impedance:
    """What a hand feels over frequency, by theory. hz: float64 (F,). wall, port: complex128 (F,), force over velocity in N s/mm, of
    the wall, and of wall and device. Their real part is the damping that is felt."""
    hz: np.ndarray
    wall: np.ndarray
    port: np.ndarray

    def stiffness_n_per_mm(self, of):
        """The stiffness that is felt of self.wall or self.port: float64 (F,)."""
        return -2 * np.pi * self.hz * of.imag


def impedance(stiffness_n_per_mm, damping_ns_per_mm=0.0, device="omni", *, rate_hz=1000.0, direction="", loop=None, hz=None,
              amplitude_mm=0.5):
    """Wall and port as a hand feels them that moves the tip as a sine within the wall: the theory's rows of `kerf lab impedance`.

    The wall is the linear one with the backward difference (docs/forces.md 5.8). device, rate_hz, direction: whose loop, map_loop,
    unless `loop`, a kerf.SampledLoop, is given. hz: frequencies; if None, 100 of them from 1 Hz to half of the Nyquist frequency.
    amplitude_mm: of the motion, in which Coulomb friction counts. Returns a kerf.Impedance. Raises kerf.Error."""
    loop = loop if loop is not None else map_loop(device, rate_hz, direction)
    hz = np.geomspace(1, 0.25 / loop.period_s, 100) if hz is None else np.atleast_1d(np.asarray(hz, float))
    if not (hz.ndim == 1 and (hz > 0).all() and (hz < 0.5 / loop.period_s).all() and amplitude_mm > 0):
        raise _kerf.Error("hz, amplitude_mm: give frequencies between 0 and half of the rate, and a positive amplitude")
    wall = _kerf.wall_impedance(loop, stiffness_n_per_mm, damping_ns_per_mm, hz)
    return Impedance(hz, wall, wall + _kerf.device_impedance(loop, hz, amplitude_mm))


def _text(name, values):
    if isinstance(values, str):
        return values
    items = np.atleast_1d(np.asarray(values))
    if items.ndim != 1 or items.dtype.kind not in "iufU":
        raise _kerf.Error(f"{name}: {values!r}: give a number, a word, a list of them, or from:to:count")
    return ",".join(str(item) if items.dtype.kind == "U" else repr(item.item()).removesuffix(".0") for item in items)


def _map_of(measured, names, values):
    """values: {name of an axis: value} of each column; the axes `names` are shown."""
    columns = measured.columns
    axes = {name: list(dict.fromkeys(of_column[name] for of_column in values)) for name in names}
    # The lab orders axes by a list of its own; here they stand as they were given.
    place = [tuple(axes[name].index(of_column[name]) for name in names) for of_column in values]
    shape = tuple(len(values) for values in axes.values())
    count = len(measured.stiffness_n_per_mm)
    seeds = max((len(column.swing_by_seed_n_per_mm) for column in columns), default=1)

    def of_cells(name, empty):
        out = np.full((*shape, count), empty)
        for at, column in zip(place, columns):
            if column.cells:
                out[at] = [getattr(cell, name) for cell in column.cells]
        return out

    def of_columns(name, *more):
        out = np.full((*shape, *more), np.nan)
        for at, column in zip(place, columns):
            if column.cells:
                out[at] = getattr(column, name)
        return out

    impossible = np.empty(shape, object)
    for at, column in zip(place, columns):
        impossible[at] = column.impossible or ("" if column.cells else "not measured")
    return Map(np.array(measured.stiffness_n_per_mm), axes,
               *(of_cells(name, False) for name in ("rests", "swings", "active", "undecided", "arithmetic")),
               *(of_cells(name, np.nan) for name in ("travel_mm", "given_mj")),
               *(of_columns(name) for name in ("first_swing_n_per_mm", "first_energy_n_per_mm")),
               *(of_columns(name, seeds) for name in ("swing_by_seed_n_per_mm", "energy_by_seed_n_per_mm")), impossible)


@dataclasses.dataclass(frozen=True)
class Cell:
    """One run of a hand against a wall. verdict: kerf.Verdict. trajectory: float64 (ticks, 2): the tip out of the wall in mm, its
    speed outwards in mm/s. period_s: from row to row."""
    verdict: _kerf.Verdict
    trajectory: np.ndarray
    period_s: float


def cell(stiffness_n_per_mm, damping_ns_per_mm=0.0, device="omni", *, rate_hz=1000.0, loop=None, push_n=0.5, hit_mm_per_s=0.0, start_mm=0.1,
         seconds=60.0, seed=1, law="coupling", estimator="foaw", numeric="fixed", limits=True):
    """One run of a cell of a map, with what moved: a hand starts `start_mm` before a wall at `hit_mm_per_s` and goes on pushing.

    stiffness_n_per_mm, damping_ns_per_mm: of the wall, N/mm and N s/mm. device, rate_hz: whose loop, map_loop, unless `loop`, a
    kerf.SampledLoop, is given. push_n: of the hand, above Coulomb friction, N. seconds: to which a run that is still open is followed. seed: shifts the
    encoder's steps against the wall; 0: one lies on it. In a map, seed s and press number h (of 0.5 N from 0.1 mm: 0, 50, 200 mm/s) have
    `s * 2**32 + h`. law:
    "coupling", "linear", "two_sided", the name of a law, or a function as of Loop.law, which gets the stiffness and damping, too.
    numeric: "fixed" or "double". limits: peak and slew of the default device. The same values give the same bits. Returns a
    kerf.Cell. Raises kerf.Error."""
    if numeric not in ("fixed", "double"):
        raise _kerf.Error(f"numeric: {numeric!r}; give fixed or double")
    run = _kerf.WallRun()
    run.loop = loop if loop is not None else map_loop(device, rate_hz)
    run.stiffness_n_per_mm, run.damping_ns_per_mm = stiffness_n_per_mm, damping_ns_per_mm
    run.push_n, run.hit_mm_per_s, run.start_mm, run.seconds, run.seed = push_n, hit_mm_per_s, start_mm, seconds, seed
    run.estimator, run.fixed_point, run.limits = estimator, numeric == "fixed", limits
    function = law if callable(law) else None
    if function is None:
        run.law = law
    verdict, trajectory = _kerf.cell_of(run, function)
    return Cell(verdict, trajectory, run.loop.period_s)
