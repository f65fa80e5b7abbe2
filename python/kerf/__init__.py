# SPDX-License-Identifier: Apache-2.0
"""kerf's servo, its emulated device and hand, its recordings and stability maps, for scripts.

    import kerf
    loop = kerf.Loop(kerf.Scene("touch"))      # lock-step: the bits of ./kerf demo --virtual
    ticks = loop.run(seconds=4)                # a structured array, the columns of a log
    print(ticks["commanded_force_n"].max())

Units are in the names: mm, N, s, N/mm, N s/mm. Voxels are indexed [z, y, x]. What is wrong with a file or an argument raises
kerf.Error with one line; Ctrl-C in a run raises kerf.Interrupted, which has what there is. docs/python.md has examples that run."""
from kerf_reader import Segment, SegmentError
from kerf_reader.tick import TICK

from ._kerf import (Device, DeviceState, Error, LawInput, Phase, ReplayDifference, SampledHand, SampledLoop, State, Verdict, __version__,
                    device_loop, highest_damping, highest_stiffness, is_stable, passive_stiffness, passive_viscosity, quantum_stiffness)
from .interrupted import Interrupted
from .log import Log, Replay, replay
from .loop import Loop
from .scene import Scene
from .stability import Cell, Impedance, Map, cell, impedance, map_loop, zwidth

__all__ = ["Cell", "Device", "DeviceState", "Error", "Impedance", "Interrupted", "LawInput", "Log", "Loop", "Map", "Phase", "Replay", "ReplayDifference",
           "SampledHand", "SampledLoop", "Scene", "Segment", "SegmentError", "State", "TICK", "Verdict", "__version__", "cell", "device_loop",
           "highest_damping", "highest_stiffness", "impedance", "is_stable", "map_loop", "passive_stiffness", "passive_viscosity", "quantum_stiffness", "replay",
           "zwidth"]
