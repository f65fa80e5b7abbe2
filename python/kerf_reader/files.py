# SPDX-License-Identifier: Apache-2.0
"""The files of a log. A recorder may write on meanwhile, so each is opened once, and all is decided from that one reading."""
import collections
import io
import json
import math
import os
import re
import stat
import time

import numpy as np

from .layout import CLOCK, TICK
from .rows import sound_end

HEADER_BYTES = {TICK: 4096, CLOCK: 256}
MOST_LEVELS = 64  # of JSON, as the programs have it

Part = collections.namedtuple("Part", "path rows counted behind")  # one file: its rows, those of its header, bytes behind these


def opened(file):
    """To read its bytes. A pipe is refused: to open it would wait for a writer."""
    if not stat.S_ISREG(file.stat().st_mode):
        raise ValueError(f"{file}: no regular file; copy the recording again")
    return file.open("rb")


def bytes_of(file):
    with opened(file) as head:
        return head.read()


def header_of(kind, rows):
    """The header that a recorder writes for so many rows of TICK or CLOCK."""
    columns = ["(" + ", ".join(map(repr, column)) + ")" for column in kind.descr]
    descr = "[" + (", ".join(columns) if kind == CLOCK else "".join(column + ", " for column in columns)) + "]"
    size = HEADER_BYTES[kind]
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': ({rows},), }}"
    return b"\x93NUMPY\1\0" + (size - 10).to_bytes(2, "little") + text.ljust(size - 11).encode() + b"\n"


def counted_by(file, kind, begin, size):
    """The rows that a file's header counts; begin, size: its first bytes, and how many it has. ValueError if it is no such table."""
    head = io.BytesIO(begin)
    try:
        np.lib.format.read_magic(head)
        shape, _, dtype = np.lib.format.read_array_header_1_0(head)
        if (size - head.tell()) // max(dtype.itemsize, 1) < np.prod(shape, dtype=object):
            raise ValueError
    except Exception:  # each release of NumPy has its own, of which some are of its parser
        what = "is empty" if size == 0 else f"{size} bytes are no table of NumPy, or the file was cut"
        raise ValueError(f"{file}: {what}; record it again, or give the folder of another recording") from None
    if len(shape) != 1 or begin != header_of(kind, shape[0]):
        raise ValueError(f"{file}: no ticks of this version of kerf; give the folder of a recording, or use its kerf_reader")
    return shape[0]


def _read_part(file, is_first):
    """None if it has no whole header and is not the first, which has one from its begin on."""
    with opened(file) as head:
        now = None
        while True:
            # The header first: the rows that it counts are there before it.
            before, now = now, (os.pread(head.fileno(), HEADER_BYTES[TICK], 0), os.fstat(head.fileno()).st_size)
            try:
                counted = counted_by(file, TICK, *now)
                break
            except ValueError:
                if now == before:
                    # Zeros: of a power cut before the header was on the disk, which is before any row.
                    if not is_first and (len(now[0]) < HEADER_BYTES[TICK] or not any(now[0])):
                        return None
                    raise
            time.sleep(0.001)  # read while it was written, perhaps
        bytes_of_rows = now[1] - HEADER_BYTES[TICK]
        rows = bytes_of_rows // TICK.itemsize
        table = np.memmap(head, TICK, "r", HEADER_BYTES[TICK], rows) if rows else np.empty(0, TICK)
    return Part(file, table, counted, bytes_of_rows - counted * TICK.itemsize)


class TickLog:
    """The rows of one arm, also of a log that was split: file, then file.0002 and so on.

    rows: of all files. counted: how many of these the headers count. parts: the files that have a whole header. files: how many there
    are; one more than parts if its recorder was killed as it began the last. With check, what a power cut tore behind the last
    sound row is not in rows. torn: (file, bytes of it, rows before them); None if it is less than a row, which may be one that
    is being written. rows_in_files: that rows had before the other arm's were fewer."""

    def __init__(self, file, check):
        self.parts, self.files = [_read_part(file, True)], 1
        numbers = {path.name[len(file.name) + 1:] for path in file.parent.glob(f"{file.name}.*")}
        numbers = sorted(int(number) for number in numbers if re.fullmatch("[0-9]{4,}", number) and f"{int(number):04}" == number and int(number) > 1)
        for number in numbers:
            part = file.with_name(f"{file.name}.{number:04}")
            before = file.with_name(f"{file.name}.{len(self.parts) + 1:04}")
            if part != before:
                raise ValueError(f"{before}: missing, or cut in its header, and {part.name} is there; copy the recording again")
            self.files += 1
            if (read := _read_part(part, False)):
                self.parts.append(read)
        *others, last = self.parts
        self.counted = sum(part.counted for part in self.parts)
        end = sound_end(last.rows, last.counted) if check else len(last.rows)
        self.rows = np.concatenate([*(part.rows for part in others), last.rows[:end]]) if others else last.rows[:end]
        self.rows_in_files = len(self.rows)
        left = last.behind - (end - last.counted) * TICK.itemsize
        self.torn = (last.path, left, end) if left >= TICK.itemsize else None


def end_together(logs):
    """Leaves out the rows of ticks that not all arms have, unless the header of the first counts them."""
    first = logs[0]
    end = min(max(len(log.rows), first.counted) for log in logs)
    for log in logs:
        log.rows = log.rows[:end]


def _number(word):
    """As the programs read one: a whole number above 64 bits is a fraction there."""
    if math.isinf(float(word)):
        raise ValueError(f"{word} is out of range")
    return int(word) if word.lstrip("-").isdigit() else float(word)


def _no_json(word):
    raise ValueError(f"{word} is no JSON")


def _is_too_deep(value, levels=MOST_LEVELS):
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return levels == 0 or any(_is_too_deep(one, levels - 1) for one in inner)


def words_of(file, text):
    """The table of names and values in the bytes of a file of JSON."""
    twice = []

    def members(pairs):
        words = {}
        for name, value in pairs:
            if name in words:
                twice.append(name)
            words[name] = value
        return words

    try:
        # The programs' parser takes a byte order mark, and ends at a zero.
        words = json.loads(text.partition(b"\0")[0].decode("utf-8-sig"), object_pairs_hook=members, parse_constant=_no_json,
                           parse_float=_number, parse_int=_number)
        json.dumps(words, ensure_ascii=False).encode()  # half a surrogate pair is no text
        if _is_too_deep(words):
            raise ValueError
    except (ValueError, RecursionError):
        raise ValueError(f"{file}: no JSON, or the file was cut; give the folder of another recording") from None
    if twice:
        raise ValueError(f'{file}: "{twice[0]}" stands twice in it; copy the recording again')
    if not isinstance(words, dict):
        raise ValueError(f"{file}: no table of names and values; give the folder of another recording")
    return words
