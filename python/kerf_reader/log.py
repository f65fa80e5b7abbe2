# SPDX-License-Identifier: Apache-2.0
import json
import pathlib

import numpy as np

from .layout import STARTED


def _rows_of(file):
    try:
        rows = np.load(file, mmap_mode="r")
    except (ValueError, EOFError, OverflowError):  # each release of NumPy has its own words
        size = file.stat().st_size
        what = "is empty" if size == 0 else f"{size} bytes are no table of NumPy, or the file was cut"
        raise ValueError(f"{file}: {what}; record it again, or give the folder of another recording") from None
    if rows.dtype.names is None:
        raise ValueError(f"{file}: no ticks of kerf; give the folder of a recording")
    return rows


def _words_of(file):
    try:
        return json.loads(file.read_text())
    except ValueError:
        raise ValueError(f"{file}: no JSON, or the file was cut; give the folder of another recording") from None


class Log:
    """What kerf-recorder wrote into `folder`; docs/log.md tells each column.

    ticks: one row for each tick, read from the disk as it is used. scene, manifest: as dictionaries."""

    def __init__(self, folder):
        folder = pathlib.Path(folder)
        try:
            self.ticks = _rows_of(folder / "ticks.npy")
            self.manifest = _words_of(folder / "manifest.json")
            self.scene = _words_of(folder / "scene.json")
        except OSError as error:
            raise ValueError(f"{error.filename}: {error.strerror}; give the folder of a recording") from None
        if "tick_ns" not in self.manifest:
            raise ValueError(f"{folder / 'manifest.json'}: no tick_ns; give the folder of a recording")

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
    def started(self):
        """True from the first tick in hand on: before it nothing is felt."""
        return (self.ticks["flags"] & STARTED) != 0
