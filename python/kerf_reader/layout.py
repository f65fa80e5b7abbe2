# SPDX-License-Identifier: Apache-2.0
"""The shared segment byte by byte, as shared/segment/layout.hpp and include/kerf/tick.hpp have it; a log has the same rows.

Its test compares all with a log and with a running controller of the same build: ABI is the hash of the layout,
and a segment with another one is refused."""
import numpy as np

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

TICK = np.dtype([
    ("seq", "<u8"), ("tick", "<u8"), ("start_ns", "<u8"), ("period_error_ns", "<i4"), ("execution_ns", "<u4"),
    ("flags", "<u4"), ("missed_deadlines", "<u4"), ("encoder_counts", "<i4", 6), ("position_mm", "<f8", 3),
    ("orientation", "<f4", 4), ("velocity_mm_per_s", "<f4", 3), ("commanded_force_n", "<f4", 3),
    ("contact_force_n", "<f4", 3), ("modification_force_n", "<f4", 3), ("proxy_offset_mm", "<f4", 3),
    ("dac_counts", "<i2", 3), ("phase", "<u2"), ("removed", "<u4"), ("port_energy_j", "<f8"),
    ("port_minimum_j", "<f8"), ("joint_torque_n_mm", "<f4", 3), ("refused_packets", "<u4"), ("volume_hash", "<u8"),
    ("output_hash", "<u8"), ("dirty_lo", "<u2", 3), ("dirty_hi", "<u2", 3), ("lost_packets", "<u4"),
    ("dirty_volumes", "<u4"), ("last_command", "<u4"), ("tip_torque_n_mm", "<f4", 3), ("spindle_ratio", "<f4"),
    ("raw", "<i4", 11), ("press_n", "<f4"), ("energy_spring", "<i8"), ("energy_damping", "<i8"),
    ("energy_friction", "<i8"), ("energy_cutting", "<i8"), ("energy_limits", "<i8"), ("energy_hold", "<i8"),
    ("energy_leak", "<i8"), ("energy_stabiliser", "<i8"), ("spindle_load", "<f4"), ("active_tool", "<u4"),
    ("fault", "<u4"), ("stale", "<u4"), ("penetration_mm", "<f4"), ("plane_count", "<u4"), ("plane_load_n", "<f4", 3),
    ("plane_normal", "<f4", 9), ("plane_arm_mm", "<f4", 9), ("command", "<u4"), ("command_argument", "<u4"),
    ("crc32c", "<u4")])

CLOCK = np.dtype([("monotonic_ns", "<i8"), ("utc_ns", "<i8"), ("within_ns", "<u4"), ("crc32c", "<u4")])  # of clock.npy

STARTED = 1 << 9  # of `flags`: taken in hand at least once
FINAL = 3         # the first `lifecycle` that ends a run
BRICK = 8         # voxels along its edge
