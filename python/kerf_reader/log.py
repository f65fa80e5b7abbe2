# SPDX-License-Identifier: Apache-2.0
import json
import pathlib

import numpy as np

from .layout import STARTED


class Log:
    """What kerf-recorder wrote into `folder`; docs/log.md tells each column.

    ticks: one row for each tick, read from the disk as it is used. scene, manifest: as dictionaries."""

    def __init__(self, folder):
        folder = pathlib.Path(folder)
        try:
            self.ticks = np.load(folder / "ticks.npy", mmap_mode="r")
            self.manifest = json.loads((folder / "manifest.json").read_text())
            self.scene = json.loads((folder / "scene.json").read_text())
        except (OSError, ValueError, EOFError) as error:
            raise ValueError(f"{folder}: {error}; give the folder of a recording") from None
        if "tick_ns" not in self.manifest or self.ticks.dtype.names is None:
            raise ValueError(f"{folder}: no recording of kerf; give the folder of one")

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
