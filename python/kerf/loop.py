# SPDX-License-Identifier: Apache-2.0
import operator

from . import _kerf
from .interrupted import Interrupted
from .scene import shipped


def _by_arm(what, value, arms):
    """One value for each arm; one alone is the first's."""
    values = list(value) if isinstance(value, (list, tuple)) else [value]
    if len(values) > arms:
        raise _kerf.Error(f"{what}: {len(values)} given, and the scene has {arms} arms; give one for each")
    return values + [None] * (arms - len(values))


class Loop(_kerf.Loop):
    """A servo with its emulated device and the hand that holds it, in lock-step: the run of ./kerf demo --virtual, to the bit.

    scene: kerf.Scene, or what kerf.Scene takes. hand: a TOML file of docs/scene-keys.md, or a name in scenes/hands; None: the
    scene's own. faults: a fault script of the same page. With two arms both may be lists. law: see `law`. log: a new folder, for a
    recording of every tick, which close() ends.

    One thread at a time: a second one gets kerf.Error. The interpreter is unlocked while a loop runs, so that loops in several
    threads run at once, unless their law is a function. Raises kerf.Error."""

    def __init__(self, scene, /, hand=None, faults=None, law=None, log=None):
        from .scene import Scene
        self.scene = scene if isinstance(scene, Scene) else Scene(scene)
        arms = self.scene.arms
        hands = [shipped(one, "hands") if one is not None else None for one in _by_arm("hand", hand, arms)]
        files = [_kerf.HandFiles(one, fault or "") for one, fault in zip(hands, _by_arm("faults", faults, arms))]
        super().__init__(self.scene._with_law() if law is not None else self.scene._scene, files, log or "", _function(law))

    def run(self, seconds=None, *, ticks=None, every=1):
        """Runs on for so many seconds or ticks; returns the rows.

        Returns an array of dtype kerf.TICK, (n,), of two arms (n, 2): the rows of docs/log.md whose tick is a multiple of `every`;
        0: none. 496 bytes a row. Ctrl-C raises kerf.Interrupted with the rows so far in `kept`; `ticks` has them too, and after an
        error. The loop can run on after Ctrl-C."""
        if (seconds is None) == (ticks is None):
            raise _kerf.Error("run: give seconds or ticks, one of both")
        count = ticks if seconds is None else seconds * self.scene.rate_hz
        count, every = (_count(name, value) for name, value in (("ticks" if seconds is None else "seconds", count), ("every", every)))
        try:
            self._run(count, every)
        except KeyboardInterrupt:
            raise Interrupted(self.ticks) from None
        return self.ticks

    @property
    def law(self):
        """The force law: a function of kerf.LawInput that returns three numbers, the force on the hand in N; None: the scene's own.

            loop.law = lambda d: 0.4 * d.spring_mm - 0.002 * d.velocity_mm_per_s

        To try a law: slower than one in C++ (docs/own-law.md), and its log says force.law = "python", which only
        kerf.replay(log, law=...) repeats. Limits act after it, as after any law. If it raises, or returns something else, the run
        ends at that tick with kerf.Error; the loop goes on only with another function. A function may replace another at any
        time, and the scene's own before the first tick."""
        return self._law()

    @law.setter
    def law(self, function):
        self._set_law(_function(function), self.scene._scene if function is None else self.scene._with_law())

    @property
    def output_hash(self):
        """Of all ticks so far, of the first arm: that of ./kerf demo."""
        last = self.last
        return int((last if self.arms == 1 else last[0])["output_hash"])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _function(law):
    if law is not None and not callable(law):
        raise _kerf.Error(f"law: {type(law).__name__}; give a function of kerf.LawInput, and laws by their names to Scene(force={{'law': ...}})")
    return law


def _count(name, value):
    try:
        count = operator.index(value) if name == "every" or not isinstance(value, float) else int(round(value))
        if 0 <= count < 1 << 63:
            return count
    except (OverflowError, TypeError, ValueError):
        pass
    raise _kerf.Error(f"run: {name} = {value!r}: give a positive number")
