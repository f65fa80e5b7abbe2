# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib

import numpy as np

from . import _kerf


def _toml(key, value):
    """A value of a setting as TOML."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False)
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(_toml(key, item) for item in value) + "]"
    raise _kerf.Error(f"{key}: {type(value).__name__}; give a number, a text, True, False or a list of them")


def settings_of(tables):
    """{"force": {"stiffness_n_per_mm": 0.4}} as the lines that --set takes: ["force.stiffness_n_per_mm=0.4"]."""
    lines = []
    for table, keys in tables.items():
        if isinstance(keys, dict):
            lines += [f"{table}.{line}" for line in settings_of(keys)]
        else:
            lines.append(f"{table}={_toml(table, keys)}")
    return lines


def shipped(name, folder=""):
    """The file of that name; else that of the scenes that come with kerf, also without its ending. A name that is none stays."""
    here = pathlib.Path(__file__).resolve().parent
    clone, prefix = here.parent.parent, here.parent.parent.parent.parent
    scenes = [clone / "scenes", here / "scenes", prefix / "share/kerf/scenes"]  # the second ones are of the wheel
    name = os.fspath(name)
    for path in [pathlib.Path(name), *(root / folder / (name + ending) for root in scenes for ending in ("", ".toml"))]:
        if path.is_file():
            return path
    return pathlib.Path(name)


def python_law(scene):
    """The setting of a law that is a function of this program; it gets stiffness and damping of the scene, a dictionary."""
    force = scene["force"]
    numbers = {**force, **force.get("law", {})}
    gains = ", ".join(f"{name} = {_toml(name, numbers.get(name, 0.0))}" for name in ("stiffness_n_per_mm", "damping_ns_per_mm"))
    return f'force.law={{ name = "python", {gains} }}'


class Scene:
    """A scene, loaded and checked; immutable, for any number of loops in any thread.

    name: a TOML file, or a scene that comes with kerf, such as "touch". Each table of docs/scene-keys.md may be given by its name,
    and its keys take the place of the file's: Scene("touch", force={"stiffness_n_per_mm": 0.6}). A scene without
    `device.torque_scale` gets that of the emulated device. Raises kerf.Error."""

    def __init__(self, name, /, **tables):
        file = shipped(name)
        self._begin(lambda settings: _kerf.Scene.load(file, settings), tables)

    @classmethod
    def parse(cls, text, /, folder=".", **tables):
        """A scene from a text; files that it names lie in `folder`."""
        return cls.__new__(cls)._begin(lambda settings: _kerf.Scene.parse(text, folder, settings), tables)

    @classmethod
    def of_voxels(cls, density, /, spacing_mm=0.1, text="", **tables):
        """A scene with these densities as its first volume.

        density: uint16 [z, y, x] in C order, 0 for air to 65535 for full, up to 1024 voxels along each axis. spacing_mm: edge of a
        voxel, or three along x, y, z. text: a scene without a file of voxels; if empty, the volume as it is, a ball of 1 mm
        diameter as the tool, and no cutting. Its [[volume]] says whether the voxels are cropped, denoised or turned."""
        edges = [float(edge) for edge in np.broadcast_to(spacing_mm, 3)]
        if not isinstance(density, np.ndarray):
            raise _kerf.Error(f"density: {type(density).__name__}; give a NumPy array of uint16 [z, y, x]")
        density = density.copy() if density.flags.c_contiguous else density  # a later change of it is none of the scene
        text = text or VOXEL_SCENE
        return cls.__new__(cls)._begin(lambda settings: _kerf.Scene.of_voxels(density, edges, text, settings), tables)

    def _begin(self, load, tables):
        self._load, self._settings, self._variants = load, settings_of(tables), {}
        self._scene = load(self._settings)
        return self

    def _with_law(self):
        """The same scene, whose law is a function of this program; loaded once."""
        if "law" not in self._variants:
            of_coupling = ("force.law=", "force.stiffness_n_per_mm=", "force.damping_ns_per_mm=")
            own = [line for line in self._settings if not line.startswith(of_coupling)]
            self._variants["law"] = self._load([*own, python_law(self.json())])
        return self._variants["law"]

    arms = property(lambda self: self._scene.arms, doc="devices, each with a tool: 1 or 2")
    rate_hz = property(lambda self: self._scene.rate_hz, doc="ticks a second")
    volumes = property(lambda self: self._scene.volumes, doc="names of the volumes, by number")
    tools = property(lambda self: self._scene.tools, doc="names of the tools, by number")

    def explain(self):
        """Cost of a tick by method and stage, memory, highest rate and stability, as text; times ticks for about a second."""
        return self._scene.explain()

    def over_budget(self):
        """Why the servo cannot keep the scene's rate on the reference machine; empty if it can. In lock-step it need not."""
        return self._scene.over_budget()

    def json(self):
        """All that determines a run, as a dictionary."""
        return json.loads(self._scene.json())


VOXEL_SCENE = """
[[volume]]
file = "voxels"
crop = false
denoise = "off"

[[tool]]
shape = "ball"
radius_mm = 0.5

[cut]
model = "none"
"""
