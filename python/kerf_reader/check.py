# SPDX-License-Identifier: Apache-2.0
"""What `kerf record info` compares of a log, in NumPy: each function but the first two yields lines "place: value; remedy"."""
import json
import re
import stat
import zlib

import numpy as np

from .layout import CLOCK, TICK

HEADER_BYTES = {TICK: 4096, CLOCK: 256}
ENDS_LATER = ("running", "no room", "unknown")  # an end_reason: rows and losses of the manifest are not those of the whole log
CHUNK = 1 << 14                      # rows at a time, so that a long log needs little memory


def opened(file):
    """To read its bytes. A pipe is refused: to open it would wait for a writer."""
    if not stat.S_ISREG(file.stat().st_mode):
        raise ValueError(f"{file}: no regular file; copy the recording again")
    return file.open("rb")


def parts_of(file):
    """The files of a log, also of one that was split: file, then file.0002 and so on. Not one that is cut in its header behind them: the
    recorder was killed as it began it."""
    numbers = {path.name[len(file.name) + 1:] for path in file.parent.glob(f"{file.name}.*")}
    numbers = sorted(int(number) for number in numbers if re.fullmatch("[0-9]{4,}", number) and f"{int(number):04}" == number and int(number) > 1)
    parts = [file]
    for number in numbers:
        part = file.with_name(f"{file.name}.{number:04}")
        before = file.with_name(f"{file.name}.{len(parts) + 1:04}")
        if part != before:
            raise ValueError(f"{before}: missing, or cut in its header, and {part.name} is there; copy the recording again")
        if is_begun(part):
            parts.append(part)
    return parts


def is_begun(part):
    """Whether it has a whole header; what is no regular file is refused when it is read."""
    status = part.stat()
    return not stat.S_ISREG(status.st_mode) or status.st_size >= HEADER_BYTES[TICK]


def header_of(kind, rows):
    """The header that a recorder writes for so many rows of TICK or CLOCK."""
    columns = ["(" + ", ".join(map(repr, column)) + ")" for column in kind.descr]
    descr = "[" + (", ".join(columns) if kind == CLOCK else "".join(column + ", " for column in columns)) + "]"
    size = HEADER_BYTES[kind]
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': ({rows},), }}"
    return b"\x93NUMPY\1\0" + (size - 10).to_bytes(2, "little") + text.ljust(size - 11).encode() + b"\n"


def _crc_tables():
    byte = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        byte = byte >> 1 ^ np.where(byte & 1, np.uint32(0x82F63B78), np.uint32(0))
    two = np.arange(1 << 16, dtype=np.uint32)
    low = byte[two & 0xFF]
    return low >> 8 ^ byte[(low ^ two >> 8) & 0xFF]


def _crc32c(rows, first):
    """Of each row the checksum of its bytes from `first` up to its checksum, two at a time."""
    table = _crc_tables()
    words = np.ascontiguousarray(rows).view("<u2").reshape(len(rows), -1).T
    crc = np.full(len(rows), 0xFFFFFFFF, np.uint32)
    for word in np.ascontiguousarray(words[first // 2:-2]):
        crc = crc >> 16 ^ table[(crc ^ word) & 0xFFFF]
    return ~crc


def _is_sound(rows):
    """Of each row whether it can be one that was recorded: its checksum, and seq against tick."""
    tick, seq = rows["tick"], rows["seq"]
    return _crc32c(rows, 8) == rows["crc32c"], (seq >= 2) & (seq % 2 == 0) & (seq // 2 <= tick)


def sound_end(rows, counted):
    """Where a log ends that a power cut tore: behind its last sound row, or behind those that the header counts."""
    end = len(rows)
    while end > counted:
        first = max(counted, end - CHUNK)
        crc, of_tick = _is_sound(rows[first:end])
        sound = np.flatnonzero(crc & of_tick)
        if len(sound):
            return first + int(sound[-1]) + 1
        end = first
    return end


def _row_problems(file, rows):
    """The first row that is damaged, or cannot follow the one before it."""
    last = None
    for first in range(0, len(rows), CHUNK):
        part = rows[first:first + CHUNK]
        crc, of_tick = _is_sound(part)
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
            yield f"{file}: row {first + row} {why}; copy it again"
            return
        last = seq[-1], rests[-1]


def _size_problems(file, rows, manifest):
    """A file may have more rows than its header counts, and a part of one: it is then of a recorder that was killed."""
    files = 1
    while file.with_name(f"{file.name}.{files + 1:04}").is_file():
        files += 1
    if files < (parts := manifest.get("parts", files)):
        yield f"{file}.{files + 1:04}: missing, and the recorder had begun {parts} files of this log; copy the recording again"
    if manifest["end_reason"] in ENDS_LATER:
        if "rows" in manifest and manifest["end_reason"] != "no room" and not (_is_count(manifest["rows"]) and manifest["rows"] <= len(rows)):
            yield f"{file}: {len(rows)} rows, and {manifest['rows']} by manifest.json; copy the recording again"
        return
    if files > len(read := parts_of(file)) or files > parts:
        what = "cut in its header" if files <= parts else f"no file of this log, which has {parts}"
        yield f"{file}.{min(len(read), parts) + 1:04}: {what}; copy the recording again"
    for part in read:
        with opened(part) as head:
            np.lib.format.read_magic(head)
            (count,), _, dtype = np.lib.format.read_array_header_1_0(head)
            behind = part.stat().st_size - head.tell() - count * dtype.itemsize
        if behind:
            yield f"{part}: {behind} bytes behind its last row; copy the recording again"
    if manifest.get("rows", len(rows)) != len(rows):
        yield f"{file}: {len(rows)} rows, and {manifest['rows']} by manifest.json; copy the recording again"


def _first_row_problem(file, rows, manifest, arm):
    """Of a damaged row the other checks say it."""
    known = manifest.get("first_rows", [])
    if arm < len(known) and len(rows) and all(map(np.all, _is_sound(rows[:1]))) and rows["crc32c"][0] != known[arm]:
        yield f"{file}: does not begin with the row that its recorder wrote first; copy the recording again"


def _loss_problems(file, rows, manifest):
    if not len(rows):
        return
    index = rows["seq"] // 2 - 1
    missed = manifest.get("missed_before_start", 0)
    holes = int(index[-1]) + 1 - missed - len(rows)
    behind = sum(gap["count"] for gap in manifest.get("gaps", []) if gap["first_index"] > index[-1])
    lost = manifest.get("lost_ticks", holes + behind)
    if index[0] < missed or (manifest.get("end_reason") not in ENDS_LATER and lost < holes + behind):
        yield f"{file}: missed_before_start is {missed} and lost_ticks {lost}, and its rows say another; copy the recording again"


def _is_count(value, least=0):
    return type(value) is int and least <= value < 1 << 64


def _is_voxel(volume):
    sides = volume.get("spacing_mm") if isinstance(volume, dict) else None
    return isinstance(sides, list) and len(sides) == 3 and all(type(side) in (int, float) for side in sides) \
        and 0 < np.prod(np.array(sides, float)) < np.inf


def _member_problems(file, manifest):
    """A member that is missing, or of another kind than that of any recorder."""
    def is_text(value):
        return isinstance(value, str)

    def are_gaps(gaps):
        return isinstance(gaps, list) and all(isinstance(gap, dict) and _is_count(gap.get("first_index")) and _is_count(gap.get("count"))
                                              for gap in gaps)

    kinds = {"tick_ns": ("a whole number of ns above 0", lambda value: _is_count(value, 1) and value < 1 << 32), "end_reason": ("a text", is_text),
             "session_id": ("a text", is_text), "lost_ticks": ("a number of ticks", _is_count),
             "missed_before_start": ("a number of ticks", _is_count), "gaps": ("a list of gaps with first_index and count", are_gaps),
             "start_ns": ("a time in ns", _is_count), "parts": ("a number of files above 0", lambda value: _is_count(value, 1)), "repaired_by": ("a text", is_text),
             "first_rows": ("a list of checksums", lambda value: isinstance(value, list) and len(value) <= 2 and all(_is_count(one) and one < 1 << 32 for one in value)),
             "arms": ("1 or 2, which this version knows", lambda value: type(value) is int and value in (1, 2)),
             "volumes": ("a list of volumes with a spacing_mm above 0",
                         lambda volumes: isinstance(volumes, list) and volumes and all(map(_is_voxel, volumes)))}
    for key, (kind, fits) in kinds.items():
        optional = key in ("start_ns", "arms", "parts", "first_rows", "repaired_by")  # logs of earlier versions, or of one arm, lack them
        if not fits(manifest[key]) if key in manifest else not optional:
            shown = json.dumps(manifest[key], separators=(",", ":"))[:60] if key in manifest else "missing"
            yield f"{file}: {key} is {shown}, and not {kind}; copy the recording again"


def _scene_problems(file, manifest, scene):
    """The scene is the source of what the manifest repeats."""
    facts = {}
    if "rate_hz" in scene.get("servo", {}):
        rate_hz = scene["servo"]["rate_hz"]
        if not rate_hz > 0:
            yield f"{file.with_name('scene.json')}: servo.rate_hz is {rate_hz}, and not above 0; copy the recording again"
            return
        facts["tick_ns"] = 10**9 // rate_hz
    if "device" in scene:
        facts["arms"] = 2 if "second_device" in scene else 1
    of_manifest = {"arms": 1, **manifest}
    facts = [(key, of_manifest.get(key), value) for key, value in facts.items()]
    of_scene, volumes = scene.get("volumes", []), manifest.get("volumes", [])
    if of_scene and len(of_scene) != len(volumes):
        facts.append(("volumes", len(volumes), len(of_scene)))
    for number, (has, volume) in enumerate(zip(volumes, of_scene)):
        facts += [(f"volumes[{number}].{key}", has.get(key), volume.get(name)) for key, name in (("size_vox", "grid"),
                                                                                               ("spacing_mm", "spacing_mm"))]
    for key, value, wanted in facts:
        if value != wanted:
            yield f"{file}: {key} is {value}, and {wanted} by scene.json; copy the recording again"


def _text_problems(folder, manifest):
    """The checksums of manifest.json, scene.json and clock.npy; logs of earlier versions have none."""
    def bytes_of(name):
        with opened(folder / name) as file:
            return file.read()

    text = bytes_of("manifest.json")
    before, seal, digits = text.rpartition(b',\n  "crc32": "')
    if (seal or "files" in manifest) and digits != b'%08x"\n}\n' % zlib.crc32(before):
        yield f"{folder / 'manifest.json'}: its checksum is wrong: it was changed after the recorder wrote it; copy the recording again"
    for name in ("scene.json", "clock.npy"):
        wanted = manifest.get("files", {}).get(name)
        if wanted is None or wanted == (crc := f"{zlib.crc32(content := bytes_of(name)):08x}"):
            continue
        # A recorder that was killed had written the row of the clock, but not yet its checksum.
        rows = (len(content) - HEADER_BYTES[CLOCK]) // CLOCK.itemsize
        before = header_of(CLOCK, rows - 1) + content[HEADER_BYTES[CLOCK]:-CLOCK.itemsize]
        is_ahead = name == "clock.npy" and manifest["end_reason"] in ENDS_LATER and rows > 1 and content.startswith(header_of(CLOCK, rows))
        if not is_ahead or wanted != f"{zlib.crc32(before):08x}":
            yield f"{folder / name}: its checksum is {crc}, and {wanted} in manifest.json; copy the recording again"


def _time_problems(file, rows, manifest, tick_ns):
    """In lock-step the time of a tick follows from its number."""
    if manifest.get("start_ns") == 0 and (rows["start_ns"] != rows["tick"] * np.uint64(tick_ns)).any():
        yield f"{file}: start_ns is 0, as in lock-step, and ticks began at other times; copy the recording again"


def _clock_problems(file, clock):
    if (_crc32c(clock, 0) != clock["crc32c"]).any() or (np.diff(clock["monotonic_ns"]) <= 0).any():
        yield f"{file}: a row has a wrong checksum, or is not later than the one before; copy it again"


def problems(folder, manifest, scene, logs, clock):
    """Of the log in `folder`, whose arms have the rows `logs`; clock: None in logs without dates."""
    file = folder / "manifest.json"
    yield from _member_problems(file, manifest)
    yield from _scene_problems(file, manifest, scene)
    for arm, rows in enumerate(logs):
        path = folder / ("ticks.npy", "ticks-2.npy")[arm]
        yield from _size_problems(path, rows, manifest)
        yield from _first_row_problem(path, rows, manifest, arm)
        yield from _row_problems(path, rows)
    if len(logs) > 1:
        both = min(map(len, logs))
        if (logs[0]["seq"][:both] != logs[1]["seq"][:both]).any():
            yield f"{folder / 'ticks-2.npy'}: its rows are not of the ticks of ticks.npy; copy the recording again"
    yield from _loss_problems(file, logs[0], manifest)
    yield from _time_problems(file, logs[0], manifest, manifest["tick_ns"])
    if clock is not None:
        yield from _clock_problems(folder / "clock.npy", clock)
    yield from _text_problems(folder, manifest)
