# SPDX-License-Identifier: Apache-2.0
"""What `kerf record info` compares of a log, in NumPy: each function yields lines "location: value; remedy"."""
import json
import zlib

import numpy as np

from .files import HEADER_BYTES, header_of
from .layout import CLOCK
from .rows import crc32c, is_sound, loss_problem, row_problem

ENDS_LATER = ("running", "no room", "unknown")  # an end_reason: rows and losses of the manifest are not those of the whole log
# Linux refuses to set a date after 2232, so that an uptime of 30 years fits into 64 bits; no date before 1823, so that differences fit.
FIRST_UTC_NS, LAST_UTC_NS = -(1 << 62), 8_277_292_036 * 10**9


def _size_problems(file, log, manifest):
    """A file may have more rows than its header counts, and a part of one: it is then of a recorder that was killed."""
    if log.files < (parts := manifest.get("parts", log.files)):
        yield f"{file}.{log.files + 1:04}: missing, and the recorder had begun {parts} files of this log; copy the recording again"
    rows, own = manifest.get("rows", 0), log.rows_in_files
    wrong = f"{file}: {own} rows, and {json.dumps(rows)[:60]} by manifest.json; copy the recording again"
    if manifest["end_reason"] in ENDS_LATER:
        if manifest["end_reason"] != "no room" and not (_is_count(rows) and rows <= own):
            yield wrong
        return
    if log.files > parts:
        yield f"{file}.{parts + 1:04}: no file of this log, which has {parts}; remove it"
    if log.files > len(log.parts):
        yield f"{file}.{log.files:04}: cut in its header; copy the recording again"
    for part in log.parts:
        if part.behind:
            yield f"{part.path}: {part.behind} bytes behind its last row; copy the recording again"
    if "rows" in manifest and not (_is_count(rows) and rows == own):
        yield wrong


def _first_row_problem(file, rows, manifest, arm):
    """Of a damaged row the other checks say it."""
    known = manifest.get("first_rows", [])
    if arm < len(known) and len(rows) and all(map(np.all, is_sound(rows[:1]))) and rows["crc32c"][0] != known[arm]:
        yield f"{file}: does not begin with the row that its recorder wrote first; copy the recording again"


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
        if type(rate_hz) is int:
            facts["tick_ns"] = 10**9 // rate_hz
    if "device" in scene:
        facts["arms"] = 2 if "second_device" in scene else 1
    of_manifest = {"arms": 1, **manifest}
    facts = [(key, of_manifest.get(key), value) for key, value in facts.items()]
    of_scene, volumes = scene.get("volumes", []), manifest.get("volumes", [])
    if of_scene and len(of_scene) != len(volumes):
        facts.append(("volumes", len(volumes), len(of_scene)))
    for number, (has, volume) in enumerate(zip(volumes, of_scene)):
        facts += [(f"volumes[{number}].size_vox", has.get("size_vox"), volume.get("grid")),
                  (f"volumes[{number}].spacing_mm", has.get("spacing_mm"), [float(side) for side in volume.get("spacing_mm")])]
    for key, value, wanted in facts:
        if json.dumps(value) != json.dumps(wanted):  # 1.0 is no number of voxels
            yield f"{file}: {key} is {value}, and {wanted} by scene.json; copy the recording again"


def _text_problems(folder, manifest, texts):
    """The checksums of manifest.json, scene.json and clock.npy; logs of earlier versions have none."""
    before, seal, digits = texts["manifest.json"].rpartition(b',\n  "crc32": "')
    if (seal or "files" in manifest) and digits != b'%08x"\n}\n' % zlib.crc32(before):
        yield f"{folder / 'manifest.json'}: its checksum is wrong: it was changed after the recorder wrote it; copy the recording again"
    for name in ("scene.json", "clock.npy"):
        wanted, content = manifest.get("files", {}).get(name), texts.get(name)
        if wanted is not None and content is None:
            yield f"{folder / name}: missing, and manifest.json has its checksum; copy the recording again"
            continue
        if wanted is None or wanted == (crc := f"{zlib.crc32(content):08x}"):
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
    monotonic, utc = clock["monotonic_ns"], clock["utc_ns"]
    possible = (monotonic >= 0) & (monotonic <= (1 << 63) - 1 - LAST_UTC_NS) & (utc >= FIRST_UTC_NS) & (utc <= LAST_UTC_NS)
    if (crc32c(clock, 0) != clock["crc32c"]).any() or not possible.all() or (np.diff(monotonic) <= 0).any():
        yield f"{file}: a row has a wrong checksum, a time that no clock shows, or is not later than the one before; copy it again"
    if not len(clock):
        yield f"{file}: has no row; copy it again"


def problems(folder, manifest, scene, logs, clock, texts):
    """Of the log in `folder`, with the TickLog of each arm; clock: None in logs without dates; texts: the bytes of each other file."""
    file = folder / "manifest.json"
    yield from _member_problems(file, manifest)
    yield from _scene_problems(file, manifest, scene)
    first = logs[0]
    for arm, log in enumerate(logs):
        path = log.parts[0].path
        yield from _size_problems(path, log, manifest)
        if log.rows_in_files < len(first.rows):
            yield f"{path}: {log.rows_in_files} rows, and {first.parts[0].path.name} has {len(first.rows)}; copy the recording again"
        yield from _first_row_problem(path, log.rows, manifest, arm)
        if (problem := row_problem(log.rows)):
            yield f"{path}: {problem}; copy it again"
    for log in logs[1:]:
        if (log.rows["seq"] != first.rows["seq"]).any():
            yield f"{log.parts[0].path}: its rows are not of the ticks of ticks.npy; copy the recording again"
    if (problem := loss_problem(first.rows, first.counted, manifest, manifest["end_reason"] not in ENDS_LATER)):
        yield f"{file}: {problem}; copy the recording again"
    yield from _time_problems(file, first.rows, manifest, manifest["tick_ns"])
    if clock is not None:
        yield from _clock_problems(folder / "clock.npy", clock)
    yield from _text_problems(folder, manifest, texts)
