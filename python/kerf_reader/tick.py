# SPDX-License-Identifier: Apache-2.0
"""The row of a log, which is the record of a tick in the segment.

Made by tests/docs/reference/make.py from shared/segment/tick_table.hpp."""
import numpy as np

TICK = np.dtype([
    ("seq", "<u8"), ("tick", "<u8"), ("start_ns", "<u8"), ("period_error_ns", "<i4"), ("execution_ns", "<u4"),
    ("flags", "<u4"), ("missed_deadlines", "<u4"), ("encoder_counts", "<i4", 6), ("position_mm", "<f8", 3),
    ("orientation", "<f4", 4), ("velocity_mm_per_s", "<f4", 3), ("commanded_force_n", "<f4", 3),
    ("contact_force_n", "<f4", 3), ("modification_force_n", "<f4", 3), ("proxy_offset_mm", "<f4", 3),
    ("dac_counts", "<i2", 3), ("phase", "<u2"), ("removed", "<u4"), ("port_energy_j", "<f8"), ("port_minimum_j", "<f8"),
    ("joint_torque_n_mm", "<f4", 3), ("refused_packets", "<u4"), ("volume_hash", "<u8"), ("output_hash", "<u8"),
    ("dirty_lo", "<u2", 3), ("dirty_hi", "<u2", 3), ("lost_packets", "<u4"), ("dirty_volumes", "<u4"),
    ("last_command", "<u4"), ("tip_torque_n_mm", "<f4", 3), ("spindle_ratio", "<f4"), ("raw", "<i4", 11),
    ("press_n", "<f4"), ("energy_spring", "<i8"), ("energy_damping", "<i8"), ("energy_friction", "<i8"),
    ("energy_cutting", "<i8"), ("energy_limits", "<i8"), ("energy_hold", "<i8"), ("energy_leak", "<i8"),
    ("energy_stabiliser", "<i8"), ("spindle_load", "<f4"), ("active_tool", "<u4"), ("fault", "<u4"), ("stale", "<u4"),
    ("penetration_mm", "<f4"), ("plane_count", "<u4"), ("plane_load_n", "<f4", 3), ("plane_normal", "<f4", 9),
    ("plane_arm_mm", "<f4", 9), ("command", "<u4"), ("command_argument", "<u4"), ("crc32c", "<u4")])
