# SPDX-License-Identifier: Apache-2.0
"""The shared segment byte by byte, as shared/segment/layout.hpp has it. Its ticks are the rows of a log: tick.py.

Its test compares all with a log and with a running controller of the same build: ABI is the hash of the layout,
and a segment with another one is refused."""
import numpy as np

from .tick import TICK  # noqa: F401  of the rings

MAGIC = int.from_bytes(b"KERFSHM1", "little")
VERSION = (1, 4)
ABI = 0xCF3BEB3F32128E50

HELLO = np.dtype([("magic", "<u8"), ("major", "<u4"), ("minor", "<u4"), ("abi_hash", "<u8"), ("session_id", "<u8")])

HEADER = np.dtype([
    ("magic", "<u8"), ("major", "<u4"), ("minor", "<u4"), ("abi_hash", "<u8"), ("session_id", "<u8"),
    ("total_bytes", "<u8"), ("config_hash", "<u8"), ("start_ns", "<u8"), ("tick_ns", "<u4"), ("volume_count", "<u4"),
    ("off_state", "<u8"), ("off_dirty", "<u8"), ("off_volume_table", "<u8"), ("state_slots", "<u4"),
    ("dirty_slots", "<u4"), ("state_record_bytes", "<u4"), ("dirty_record_bytes", "<u4"), ("off_scene", "<u8"),
    ("scene_bytes", "<u8"), ("off_state_2", "<u8"), ("build_id", "S64"), ("reserved1", "<u8", 8),
    ("state_head", "<u8"), ("pad_state", "<u8", 7), ("dirty_head", "<u8"), ("pad_dirty", "<u8", 7),
    ("epoch", "<u8"), ("pad_epoch", "<u8", 7), ("heartbeat_ns", "<u8"), ("lifecycle", "<u4"),
    ("pad_life", "<u4"), ("pad_heartbeat", "<u8", 6), ("state_head_2", "<u8")])

VOLUME = np.dtype([
    ("size", "<u2", 3), ("log2_brick", "u1"), ("bits_per_voxel", "u1"), ("bricks", "<u4", 3), ("brick_count", "<u4"),
    ("spacing_mm", "<f8", 3), ("origin_mm", "<f8", 3), ("off_versions", "<u8"), ("off_bricks", "<u8"),
    ("initial_hash", "<u8"), ("material", "<u4"), ("iso", "<u4"), ("orientation", "<f4", 4), ("off_labels", "<u8")])

CLOCK = np.dtype([("monotonic_ns", "<i8"), ("utc_ns", "<i8"), ("within_ns", "<u4"), ("crc32c", "<u4")])  # of clock.npy

STARTED = 1 << 9  # of `flags`: picked up at least once
FINAL = 3         # the first `lifecycle` that ends a run
BRICK = 8         # voxels along its edge
