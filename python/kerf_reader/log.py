# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import warnings

import numpy as np

from .check import HEADER_BYTES, header_of, opened, parts_of, problems, sound_end
from .layout import CLOCK, STARTED, TICK


def _rows_of(file, kind=TICK):
    """All complete rows, also those that the header of a recorder that was killed does not count."""
    with opened(file) as head:
        size = file.stat().st_size
        try:
            np.lib.format.read_magic(head)
            shape, _, dtype = np.lib.format.read_array_header_1_0(head)
            rows = (size - head.tell()) // max(dtype.itemsize, 1)
            if rows < np.prod(shape, dtype=object):
                raise ValueError
            offset = head.tell()
        except OSError:
            raise
        except Exception:  # each release of NumPy has its own, of which some are of its parser
            what = "is empty" if size == 0 else f"{size} bytes are no table of NumPy, or the file was cut"
            raise ValueError(f"{file}: {what}; record it again, or give the folder of another recording") from None
        head.seek(0)
        is_ours = len(shape) == 1 and head.read(HEADER_BYTES[kind]) == header_of(kind, shape[0])
    if not is_ours:
        raise ValueError(f"{file}: no ticks of this version of kerf; give the folder of a recording, or use its kerf_reader")
    return np.memmap(file, kind, "r", offset, rows) if rows else np.empty(0, kind)


def _counted_by(file):
    with opened(file) as head:
        np.lib.format.read_magic(head)
        return np.lib.format.read_array_header_1_0(head)[0][0]


def _all_rows_of(file, as_it_is):
    """The rows, and how many of them may not be left out: the headers count them."""
    parts = parts_of(file)
    rows = [_rows_of(path) for path in parts]
    counted = _counted_by(parts[-1])
    before = sum(map(len, rows[:-1]))
    if not as_it_is:
        rows[-1] = rows[-1][:sound_end(rows[-1], counted)]
    return rows[0] if len(rows) == 1 else np.concatenate(rows), before + counted


def _no_json(word):
    raise ValueError(f"{word} is no JSON")


def _words_of(file):
    with opened(file) as bytes_of:
        text = bytes_of.read()
    twice = []

    def members(pairs):
        words = {}
        for name, value in pairs:
            if name in words:
                twice.append(name)
            words[name] = value
        return words

    try:
        words = json.loads(text.decode(), object_pairs_hook=members, parse_constant=_no_json)
    except (ValueError, RecursionError):
        raise ValueError(f"{file}: no JSON, or the file was cut; give the folder of another recording") from None
    if twice:
        raise ValueError(f'{file}: "{twice[0]}" stands twice in it; copy the recording again')
    if not isinstance(words, dict):
        raise ValueError(f"{file}: no table of names and values; give the folder of another recording")
    return words


class Log:
    """What kerf-recorder wrote into `folder`; docs/log.md tells each column.

    ticks: one row for each tick, read from the disk as it is used; of a log that was split, from memory. second: of a run with
    two devices the second's rows, row i of the same tick as row i of ticks; else None. scene, manifest: as dictionaries. clock:
    readings of CLOCK_MONOTONIC and UTC at one moment; None in logs of earlier versions. Reads all rows once and compares what
    `kerf record info` does; what is damaged raises ValueError, and what a power cut tore behind the
    rows that the header counts is left out with a warning. check=False opens a long log at once, as it is."""

    def __init__(self, folder, check=True):
        folder = pathlib.Path(folder)
        try:
            self.ticks, counted = _all_rows_of(folder / "ticks.npy", not check)
            self.manifest = _words_of(folder / "manifest.json")
            self.scene = _words_of(folder / "scene.json")
            self.clock = _rows_of(folder / "clock.npy", CLOCK) if "clock" in self.manifest else None
            self.second = _all_rows_of(folder / "ticks-2.npy", not check)[0] if self.manifest.get("arms") == 2 else None
        except OSError as error:
            below = folder / "log"  # of --out of a demo
            way = below if (below / "ticks.npy").is_file() else "the folder of a recording"
            raise ValueError(f"{error.filename}: {error.strerror}; give {way}") from None
        if check:
            self._check(folder)
            for rows, name in ((self.ticks, "ticks.npy"), (self.second, "ticks-2.npy")):
                if rows is not None:
                    self._tell_torn(rows, folder / name)
            if self.second is not None:  # of a recorder that was killed they end with the ticks that both have
                both = min(len(self.ticks), len(self.second))
                if both < counted:
                    raise ValueError(f"{folder / 'ticks-2.npy'}: {both} rows, and ticks.npy has {len(self.ticks)}; copy the recording again")
                self.ticks, self.second = self.ticks[:both], self.second[:both]

    def _tell_torn(self, rows, file):
        parts = parts_of(file)
        own = len(rows) - sum((part.stat().st_size - 4096) // TICK.itemsize for part in parts[:-1])
        left = parts[-1].stat().st_size - 4096 - own * TICK.itemsize
        if left >= TICK.itemsize:
            warnings.warn(f"{parts[-1]}: {left} bytes behind its {own} rows are left out, since they are torn and the recorder had not counted "
                          "them; the rows before are sound", stacklevel=3)

    def _check(self, folder):
        logs = [self.ticks] if self.second is None else [self.ticks, self.second]
        try:
            found = next(problems(folder, self.manifest, self.scene, logs, self.clock), None)
        except OSError as error:
            found = f"{error.filename}: {error.strerror}; copy the recording again"
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
