# SPDX-License-Identifier: Apache-2.0
import dataclasses
import os

import numpy as np
import kerf_reader

from . import _kerf
from .scene import python_law, settings_of


class Log(kerf_reader.Log):
    """A recording of `folder`, by kerf-recorder or by Loop(log=...): kerf_reader.Log with what needs the programs.

    ticks: its rows, dtype kerf.TICK; log["commanded_force_n"] is a column. second: those of the second arm, or None. It is opened
    at once, as it is; check() compares all. Raises kerf.Error."""

    def __init__(self, folder):
        self.folder = os.fspath(folder)
        try:
            super().__init__(folder, check=False)
        except ValueError as error:
            raise _kerf.Error(str(error)) from None

    def check(self):
        """What is inconsistent in the recording, by all of its checksums: a list of lines; empty: intact."""
        return _kerf.problems_of(self.folder)

    def replay(self, law=None, rows=False, **tables):
        """kerf.replay of it."""
        return replay(self.folder, law, rows, **tables)


@dataclasses.dataclass(frozen=True)
class Replay:
    """What a replay found. ticks: stepped. output_hash: of the first arm, after them. difference: the first one, a
    kerf.ReplayDifference, or None if each tick is equal to the last bit. cut_short: why the recording ends before its run did, or
    empty. rows: the ticks of the first arm as they were stepped, dtype kerf.TICK, if they were asked for."""
    ticks: int
    output_hash: int
    difference: object
    cut_short: str
    rows: np.ndarray


def replay(folder, law=None, rows=False, **tables):
    """Steps a recording again from its inputs; compares each tick of all arms, to the last bit.

    law: a name of a law, or a function as of Loop.law; a recording of such a function has no other way to be repeated. tables: as
    those of Scene, in place of the recorded ones. Without law and tables it stops at the first difference, with them it runs to
    the end. Returns a kerf.Replay. Raises kerf.Error."""
    function = law if callable(law) else None
    if function is None and law is not None:
        tables = {**tables, "force": {**tables.get("force", {}), "law": law}}
    settings = settings_of(tables)
    scene = Log(folder).scene
    recorded = scene["force"].get("law", {}).get("name")
    if function is not None:
        settings.append(python_law(scene))
    if law is None and recorded == "python":
        raise _kerf.Error(f"{os.fspath(folder)}: its law is a function of a Python program, which no log has; give replay(..., law=...)")
    outcome, stepped = _kerf.replay(folder, settings, function, bool(rows))
    return Replay(outcome.ticks, outcome.output_hash, outcome.difference, outcome.cut_short, stepped)
