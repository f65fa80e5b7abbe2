# SPDX-License-Identifier: Apache-2.0
"""Figures of a run by tests/examples/lockstep.py: what was cut, how deep, and with what force."""
import gzip
import io

import numpy as np

CONTACT_N, SIDES, SIDE_STEP_MM = 0.01, 24, 0.02


def _nrrd(path):
    """The voxels of a volume that kerf wrote, [z, y, x]."""
    head, body = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    data = gzip.decompress(body) if fields["encoding"] == "gzip" else body
    return np.frombuffer(data, "<u2").reshape([int(size) for size in fields["sizes"].split()][::-1])


def _npy(path):
    return np.load(io.BytesIO(gzip.decompress(path.read_bytes())))


def _grown(flat):
    """With its neighbours in both directions."""
    grown = np.pad(flat, 1)
    grown[:-2, 1:-1] |= flat
    grown[2:, 1:-1] |= flat
    grown[1:-1, :-2] |= flat
    grown[1:-1, 2:] |= flat
    return grown[1:-1, 1:-1]


def _matrix(quaternion):
    x, y, z, w = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class Cut:
    """The first volume of a scene, at the start and at the end. Arrays are [x, z, y] of the scene, y up; the volume's pose
    takes axes to axes. `x`, `z`, `y`: mm from the device's origin, which is the surface under the middle of a tooth."""

    def __init__(self, out, log):
        volume = log.scene["volumes"][0]
        files = out / "log/volumes" / volume["density_hash"]
        turn = _matrix(volume["pose"]["orientation"])
        axes = [int(np.argmax(abs(turn[axis]))) for axis in (0, 2, 1)]  # of the file: those along x, z and y of the scene
        signs = [int(np.sign(turn[axis, source])) for axis, source in zip((0, 2, 1), axes)]
        upright = lambda voxels: voxels.transpose([2 - axis for axis in axes])[tuple(slice(None, None, sign) for sign in signs)]
        self.iso, self.spacing_mm = volume["iso"], [volume["spacing_mm"][axis] for axis in axes]
        self.first, self.now = (upright(voxels) for voxels in (_npy(files.with_suffix(".npy.gz")), _nrrd(out / "final.nrrd")))
        labels = files.with_name(files.name + "-labels.npy.gz")
        self.labels = upright(_npy(labels)) if labels.exists() else None
        corner = np.array(volume["pose"]["position_mm"]) - log.scene["device"]["offset_mm"]
        self.x, self.z, self.y = (
            corner[axis] + (sign * step * np.arange(size))[::sign]
            for axis, sign, step, size in zip((0, 2, 1), signs, self.spacing_mm, self.first.shape))
        self.materials = log.scene["materials"]
        self.names = [material["name"] for material in self.materials]

    def lost_mm3(self):
        """Of each voxel the solid that is gone, as docs/cutting.md defines it."""
        part = np.where(self._solid(), 1 - self.now / np.maximum(self.first, 1.0), 0)
        return part * np.prod(self.spacing_mm)

    def removed_mm3(self):
        """By material; of a volume without labels, all as the last one."""
        lost = self.lost_mm3()
        if self.labels is None:
            return {self.names[-1]: float(lost.sum())}
        return {name: float(lost[self.labels == label].sum()) for label, name in enumerate(self.names) if label}

    def material_mm3(self, name):
        """At the start."""
        return float((self._solid() & (self.labels == self.names.index(name))).sum() * np.prod(self.spacing_mm))

    def _solid(self):
        """A label also makes a solid of what is softer than the surface, from the density of its material."""
        shows = np.array([int(material["iso"] * 65535) for material in self.materials])
        at_least = self.iso if self.labels is None else np.where(
            self.labels > 0, np.minimum(self.iso, shows[self.labels]), self.iso)
        return self.first >= at_least

    def _top_mm(self, voxels):
        solid = voxels >= self.iso
        row = solid.shape[2] - 1 - np.argmax(solid[:, :, ::-1], axis=2)
        at = lambda row: np.take_along_axis(voxels, row[..., None], 2)[..., 0].astype(float)
        here, above = at(row), at(np.minimum(row + 1, solid.shape[2] - 1))
        part = np.where(here > above, (here - self.iso) / np.maximum(here - above, 1), 0)  # the surface lies between
        return np.where(solid.any(axis=2), self.y[row] + part * self.spacing_mm[2], np.nan)

    def depth_mm(self):
        """[x, z]: how much solid is gone there from above, in mm of height."""
        return self.lost_mm3().sum(axis=2) / (self.spacing_mm[0] * self.spacing_mm[1])

    def _sunk(self):
        """[x, z]: where the surface has sunk by more than half of the most."""
        sunk_mm = self._top_mm(self.first) - self._top_mm(self.now)
        return sunk_mm > np.nanmax(sunk_mm) / 2

    def floor_mm(self):
        """Heights of the surface where it has sunk."""
        return self._top_mm(self.now)[self._sunk()]

    def walls_mm(self):
        """How high what stands two voxels beyond that is over its middle height: if all of it is high, walls are upright."""
        sunk = _grown(_grown(self._sunk()))
        return self._top_mm(self.now)[_grown(sunk) & ~sunk] - np.median(self.floor_mm())

    def side_depth_mm(self):
        """[direction, y]: how much nearer to the middle axis the outermost solid is, for SIDES directions around it."""
        depth = np.zeros((SIDES, len(self.y)))
        reach_mm = np.arange(0, 8, SIDE_STEP_MM)
        solid = [np.pad(voxels >= self.iso, ((1, 1), (1, 1), (0, 0))) for voxels in (self.first, self.now)]
        for side in range(SIDES):
            turn = 2 * np.pi * side / SIDES
            column = np.clip(np.rint((reach_mm * np.cos(turn) - self.x[0]) / self.spacing_mm[0]).astype(int) + 1, 0, len(self.x) + 1)
            row = np.clip(np.rint((-reach_mm * np.sin(turn) - self.z[0]) / self.spacing_mm[1]).astype(int) + 1, 0, len(self.z) + 1)
            first, now = ((reach_mm[:, None] * one[column, row]).max(axis=0) for one in solid)
            depth[side] = first - now
        return depth


def peak_n(ticks):
    return float(np.linalg.norm(ticks["commanded_force_n"], axis=1).max())
