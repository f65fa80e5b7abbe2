# SPDX-License-Identifier: Apache-2.0
"""What the rows of a log say themselves: whether each is sound, follows the one before, and which ticks are in none."""
import bisect

import numpy as np

CHUNK = 1 << 14                      # rows at a time, so that a long log needs little memory
MOST_GAPS = 4096                     # that a recorder writes down; lost_ticks has all


def _crc_tables():
    byte = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        byte = byte >> 1 ^ np.where(byte & 1, np.uint32(0x82F63B78), np.uint32(0))
    two = np.arange(1 << 16, dtype=np.uint32)
    low = byte[two & 0xFF]
    return low >> 8 ^ byte[(low ^ two >> 8) & 0xFF]


def crc32c(rows, first):
    """Of each row the checksum of its bytes from `first` up to its checksum, two at a time."""
    table = _crc_tables()
    words = np.ascontiguousarray(rows).view("<u2").reshape(len(rows), -1).T
    crc = np.full(len(rows), 0xFFFFFFFF, np.uint32)
    for word in np.ascontiguousarray(words[first // 2:-2]):
        crc = crc >> 16 ^ table[(crc ^ word) & 0xFFFF]
    return ~crc


def is_sound(rows):
    """Of each row whether it can be one that was recorded: its checksum, and seq against tick."""
    tick, seq = rows["tick"], rows["seq"]
    return crc32c(rows, 8) == rows["crc32c"], (seq >= 2) & (seq % 2 == 0) & (seq // 2 <= tick)


def sound_end(rows, counted):
    """Where a log ends that a power cut tore: behind its last sound row, or behind those that the header counts."""
    end = len(rows)
    while end > counted:
        first = max(counted, end - CHUNK)
        crc, of_tick = is_sound(rows[first:end])
        sound = np.flatnonzero(crc & of_tick)
        if len(sound):
            return first + int(sound[-1]) + 1
        end = first
    return end


def row_problem(rows):
    """The first row that is damaged, or cannot follow the one before it; None if there is none."""
    last = None
    for first in range(0, len(rows), CHUNK):
        part = rows[first:first + CHUNK]
        crc, of_tick = is_sound(part)
        tick, seq = part["tick"], part["seq"]
        rests = tick - seq // 2  # ticks of a watched replay without a record
        before = (np.r_[seq[:1] if last is None else last[0], seq[:-1]], np.r_[rests[:1] if last is None else last[1], rests[:-1]])
        follows = (seq > before[0]) & (rests >= before[1])
        follows[:1] |= last is None
        wrong = np.flatnonzero(~(crc & of_tick & follows))
        if len(wrong):
            row = wrong[0]
            why = "has a wrong checksum" if not crc[row] else f"has seq {seq[row]}, which is not of tick {tick[row]}" \
                if not of_tick[row] else f"(tick {tick[row]}, seq {seq[row]}) cannot follow seq {before[0][row]}"
            return f"row {first + row} {why}"
        last = seq[-1], rests[-1]
    return None


def loss_problem(rows, counted, manifest, is_final):
    """What the manifest says of lost ticks against those that are in no row. `counted`: rows that the headers count, whose losses a
    recorder had written down before."""
    missed, gaps, lost = manifest["missed_before_start"], manifest["gaps"], manifest["lost_ticks"]
    index = (rows["seq"] // 2).astype(np.int64) - 1
    if len(index) and index[0] < missed:
        return f"missed_before_start is {missed}, and its first row is of an earlier record"
    at = np.flatnonzero(np.diff(index) > 1)
    holes = [(int(index[row]) + 1, int(index[row + 1]), int(row) + 1) for row in at]  # first index, behind the last, rows before it
    if len(index) and index[0] > missed:
        holes.insert(0, (missed, int(index[0]), 0))
    end = int(index[-1]) + 1 if len(index) else missed
    begins, listed, behind = [hole[0] for hole in holes], [0] * len(holes), 0
    for first, count in ((gap["first_index"], gap["count"]) for gap in gaps):
        hole = bisect.bisect(begins, first) - 1
        if first >= end:
            behind += count
        elif hole < 0 or first + count > holes[hole][1]:
            return f"gaps has {count} records from index {first}, and some of them are in its rows"
        else:
            listed[hole] += count
    may_lack = len(gaps) == MOST_GAPS
    for (first, behind_last, row), known in zip(holes, listed):
        if not is_final and not may_lack and row < counted and known != behind_last - first:
            return f"gaps lacks {behind_last - first} records from index {first}, which are in no row"
    of_rows = sum(behind_last - first for first, behind_last, _ in holes) + behind
    if not is_final or lost == of_rows or (may_lack and lost > of_rows):
        return None
    return f"lost_ticks is {lost}, and {of_rows} by its rows"
