# SPDX-License-Identifier: Apache-2.0
import errno
import glob
import json
import mmap
import os
import re
import select
import socket

import numpy as np

from .layout import ABI, BRICK, FINAL, HEADER, HELLO, MAGIC, TICK, VERSION, VOLUME

TRIES = 64  # copies of what is being written meanwhile


class SegmentError(Exception):
    """One line: place, what is wrong, way out."""


NAME = r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}"


def _folder():
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    return f"{runtime}/kerf" if runtime.startswith("/") else f"/tmp/kerf-{os.getuid()}"


def _socket_of(name):
    if not re.fullmatch(NAME, name):
        raise SegmentError(f"{name!r}: no name of a controller; use letters, digits, '.', '_' or '-'")
    return os.path.join(_folder(), name + ".sock")


def _listens(path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:  # another type: no listener notices
        return asking.connect_ex(path) == errno.EPROTOTYPE


def _running():
    """", or take a name that runs: ...", or nothing."""
    files = glob.glob(os.path.join(glob.escape(_folder()), "*.sock"))
    names = sorted(os.path.basename(file)[:-5] for file in files if _listens(file))
    names = [name for name in names if re.fullmatch(NAME, name)]
    return f", or take a name that runs: {', '.join(names[:8])}{', ...' * (len(names) > 8)}" if names else ""


class Segment:
    """The segment of a running controller, read-only; it stays readable when that has gone.

    Never disturbs the servo, which does not wait for readers. scene: as a dictionary. tick_s: length of a tick.
    volumes: one row of layout.VOLUME for each volume. arms: 1 or 2 devices, each with rows of its own; the same index
    is the same tick, and arm 0 is the first."""

    def __init__(self, name="kerf"):
        path = _socket_of(name)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(2)
        try:
            self._socket.connect(path)
            hello, files, _, _ = socket.recv_fds(self._socket, HELLO.itemsize, 1)
        except OSError as error:
            self._socket.close()
            raise SegmentError(f"{path}: {error.strerror or error}; start kerf-controller with this name "
                               f"first{_running()}") from None
        try:
            self._map(path, hello, files)
        except SegmentError:
            self._socket.close()
            raise
        finally:
            for file in files:
                os.close(file)

    def _map(self, path, hello, files):
        if len(hello) != HELLO.itemsize or not files:
            raise SegmentError(f"{path}: no greeting of a kerf-controller; is it of this version?")
        told = np.frombuffer(hello, HELLO)[0]
        if told["magic"] != MAGIC or (told["major"], told["minor"]) != VERSION or told["abi_hash"] != ABI:
            raise SegmentError(f"{path}: layout {int(told['abi_hash']):016x}, and this reader knows {ABI:016x}; "
                               "use the kerf_reader of the same kerf")
        self._bytes = mmap.mmap(files[0], 0, prot=mmap.PROT_READ)
        self._header = np.frombuffer(self._bytes, HEADER, 1)
        header = self._header[0]
        offsets = [int(header[word]) for word in ("off_state", "off_state_2")]
        self._rings = [np.frombuffer(self._bytes, TICK, int(header["state_slots"]), at) for at in offsets if at]
        self.arms = len(self._rings)
        self.volumes = np.frombuffer(self._bytes, VOLUME, int(header["volume_count"]), int(header["off_volume_table"]))
        begin = int(header["off_scene"])
        self.scene = json.loads(self._bytes[begin:begin + int(header["scene_bytes"])].rstrip(b"\0"))
        self.tick_s = int(header["tick_ns"]) * 1e-9

    @property
    def alive(self):
        """Whether the controller is still there and its run has not ended."""
        poll = select.poll()
        poll.register(self._socket, select.POLLIN)
        gone = any(events & (select.POLLHUP | select.POLLERR) for _, events in poll.poll(0))
        return not gone and self._header["lifecycle"][0] < FINAL

    @property
    def head(self):
        """How many ticks were published so far."""
        return int(self._header["state_head"][0])

    def records(self, since=0, arm=0):
        """(rows of layout.TICK, next): what is still there of an arm's ticks published from index `since` on. Ask for
        `next` the next time; more rows than since - next say that some were lost."""
        head, ring = self.head, self._rings[arm]  # the second arm's row is published before the first's
        first = max(since, head - len(ring), 0)
        indices = np.arange(first, head, dtype=np.uint64)
        rows = ring[indices % len(ring)]  # a copy
        # Written anew while it was copied: its number before or after says so.
        after = ring["seq"][indices % len(ring)]
        whole = (rows["seq"] == 2 * indices + 2) & (after == 2 * indices + 2)
        return rows[whole], head

    def latest(self, arm=0):
        """The newest row of an arm that came whole; None before the first."""
        for _ in range(TRIES):
            head = self.head
            if head == 0:
                return None
            rows, _ = self.records(head - 1, arm)
            if len(rows):
                return rows[-1]
        return None

    def density(self, volume=0):
        """The voxels of a volume as they are now, 0 to 65535, indexed [z, y, x]. A brick of 8^3 voxels is always
        whole; two that are cut meanwhile may be of different ticks."""
        told = self.volumes[volume]
        count = int(told["brick_count"])
        versions = np.frombuffer(self._bytes, "<u8", count, int(told["off_versions"]))
        bricks = np.frombuffer(self._bytes, "<u2", count * BRICK**3, int(told["off_bricks"])).reshape(count, -1)
        copy, todo = np.empty_like(bricks), np.arange(count)
        for _ in range(TRIES):
            before = versions[todo].copy()
            copy[todo] = bricks[todo]
            todo = todo[(before % 2 != 0) | (versions[todo] != before)]
            if not len(todo):
                break
        else:
            raise SegmentError(f"volume {volume}: {len(todo)} bricks never came whole; is the controller alive?")
        bx, by, bz = (int(n) for n in told["bricks"])
        nx, ny, nz = (int(n) for n in told["size"])
        cubes = copy.reshape(bz, by, bx, BRICK, BRICK, BRICK).transpose(0, 3, 1, 4, 2, 5)
        return cubes.reshape(bz * BRICK, by * BRICK, bx * BRICK)[:nz, :ny, :nx]

    def labels(self, volume=0):
        """The material of each voxel, indexed [z, y, x]; None where the volume has none."""
        told = self.volumes[volume]
        if told["off_labels"] == 0:
            return None
        size = tuple(int(n) for n in told["size"][::-1])
        return np.frombuffer(self._bytes, "u1", int(np.prod(size)), int(told["off_labels"])).reshape(size)

    def close(self):
        self._socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
