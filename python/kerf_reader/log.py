# SPDX-License-Identifier: Apache-2.0
import pathlib
import warnings

import numpy as np

from .check import problems
from .files import HEADER_BYTES, TickLog, bytes_of, counted_by, end_together, words_of
from .layout import CLOCK, STARTED


def _clock_of(file, text):
    size = HEADER_BYTES[CLOCK]
    counted_by(file, CLOCK, text[:size], len(text))
    return np.frombuffer(text, CLOCK, (len(text) - size) // CLOCK.itemsize, size)


def _remedy(folder, error):
    if isinstance(error, PermissionError):
        return "check its rights"
    if any((folder / name).exists() for name in ("ticks.npy", "manifest.json")):
        return "copy the recording again"
    below = folder / "log"  # of --out of a demo
    return f"give {below if (below / 'ticks.npy').is_file() else 'the folder of a recording'}"


class Log:
    """What kerf-recorder wrote into `folder`; docs/log.md tells each column.

    ticks: one row for each tick, read from the disk as it is used; of a log that was split, from memory. second: of a run with
    two devices the second's rows, row i of the same tick as row i of ticks, and as many; else None. scene, manifest: as
    dictionaries. clock: readings of CLOCK_MONOTONIC and UTC at one moment; None in logs of earlier versions. Reads all rows once
    and compares what `kerf record info` does; what is damaged raises ValueError, and what a power cut tore behind the rows that
    the header counts is left out with a warning. A log that still grows is read as it is at this moment. check=False opens a
    long log at once, as it is: its arms may differ in length."""

    def __init__(self, folder, check=True):
        folder = pathlib.Path(folder)
        try:
            (folder / "ticks.npy").stat()  # a folder that is no recording: its error names this file
            # The manifest first, and the second arm last: what a recorder wrote down is there when the next is read.
            texts = {name: bytes_of(folder / name) for name in ("manifest.json", "scene.json")}
            self.manifest, self.scene = (words_of(folder / name, text) for name, text in texts.items())
            clock = folder / "clock.npy"
            self.clock = None
            if "clock" in self.manifest or clock.exists():
                texts["clock.npy"] = bytes_of(clock)
                self.clock = _clock_of(clock, texts["clock.npy"])
            names = ("ticks.npy", "ticks-2.npy")[:2 if self.manifest.get("arms") == 2 else 1]
            logs = [TickLog(folder / name, check) for name in names]
        except OSError as error:
            raise ValueError(f"{error.filename}: {error.strerror}; {_remedy(folder, error)}") from None
        if check:
            end_together(logs)
            self._check(folder, logs, texts)
        self.ticks = logs[0].rows
        self.second = None if len(logs) == 1 else logs[1].rows
        for log in logs if check else ():
            if log.torn:
                path, left, rows = log.torn
                warnings.warn(f"{path}: {left} bytes behind its {rows} rows are left out, since they are torn and the recorder had not "
                              "counted them; the rows before are sound", stacklevel=2)

    def _check(self, folder, logs, texts):
        try:
            found = next(problems(folder, self.manifest, self.scene, logs, self.clock, texts), None)
        except (ArithmeticError, AttributeError, KeyError, RecursionError, TypeError):  # another shape than that of any recorder
            found = f"{folder}: manifest.json and scene.json are not those of a recording; give the folder of another one"
        if found:
            raise ValueError(found)

    def __len__(self):
        return len(self.ticks)

    def __getitem__(self, column):
        """A column by its name, or rows as NumPy takes them."""
        return self.ticks[column]

    @property
    def tick_s(self):
        return self.manifest["tick_ns"] * 1e-9

    @property
    def seconds(self):
        """Time of each row since the first one."""
        return (self.ticks["tick"] - self.ticks["tick"][:1]) * self.tick_s

    @property
    def utc(self):
        """Date of each row, as datetime64[ns]; of lock-step runs in virtual time from the date of the start on."""
        if self.clock is None or len(self.clock) == 0:
            raise ValueError("the log has no date: clock.npy is missing; use seconds")
        offset_ns = self.clock["utc_ns"][-1] - self.clock["monotonic_ns"][-1]
        return (self.ticks["start_ns"].astype(np.int64) + offset_ns).view("datetime64[ns]")

    @property
    def started(self):
        """True from the first tick in hand on: before it nothing is felt."""
        return (self.ticks["flags"] & STARTED) != 0
