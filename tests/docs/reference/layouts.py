# SPDX-License-Identifier: Apache-2.0
"""docs/api.md: the shared segment, byte by byte."""
import re

from source import Lack, Source, same, table


# What a field's name and its comment in the source do not say.
MEANINGS = {
    "layout_major": "major version; another one is another layout", "layout_minor": "minor version", "abi_hash": "hash of this layout",
    "total_bytes": "size of the segment", "config_hash": "hash of all settings of the run", "tick_ns": "length of a servo tick",
    "volume_count": "number of volumes", "off_state": "offset of the ring of ticks", "off_dirty": "offset of the ring of boxes",
    "off_volume_table": "offset of the descriptors", "state_record_bytes": "size of a `TickRecord`",
    "dirty_record_bytes": "size of a `DirtyRecord`", "off_scene": "offset of the scene's text", "scene_bytes": "length of the scene's text",
    "lifecycle": "state of the run, above", "nx": "voxels along x", "ny": "voxels along y", "nz": "voxels along z",
    "log2_brick": "3: a brick has 8 voxels along its edge", "bits_per_voxel": "16: a density", "bricks_x": "bricks along x",
    "bricks_y": "bricks along y", "bricks_z": "bricks along z", "brick_count": "number of bricks",
    "spacing_mm": "edges of a voxel along x, y, z",
    "origin_mm": "centre of voxel (0, 0, 0) in the world", "off_versions": "offset of the version words", "off_bricks": "offset of the densities",
    "material": "not used: 0", "iso": "density of the surface, 0 to 65535", "seq": "as in a `TickRecord`", "tick": "tick of the servo",
    "lo": "first voxel of the box", "volume": "number of the volume, from 0", "cause": "cause of the change, above", "magic": "above",
    "session": "session of the run", "flags": "listed above", "build_id": "build of the program, for messages only", "heartbeat_ns": "time of the last finished tick",
    "blocks": "number of blocks that follow", "raw_bytes": "length of the payload before it was packed",
    "payload_bytes": "length of the payload as sent", "ring": "0 ticks, 1 dirty, 2 ticks of two arms", "count": "number of records",
    "first": "index of the first record", "stride": "difference between two indices", "sent_ns": "time when the frame was sent",
    "frame": "number of the frame that was applied", "argument": "argument of the command, listed above"}
SAID = {"set_hash": "sum of `block_hash` over all blocks that the viewer has after this frame",
        "record_bytes": "size of a `TickRecord`", "dirty_bytes": "size of a `DirtyRecord`", "status": "listed above",
        "index": "index of the command; the field `last_command` of a `TickRecord` will show it", "kind": "listed above",
        "hi": "end of the box (exclusive)",
        "removed": "density units removed; by an undo: given back"}


def meaning_of(file, struct, field, comment):
    if words := SAID.get(field) or comment or MEANINGS.get(field):
        return words
    raise Lack(f"{file.path}: {struct}.{field}: no comment, and tests/docs/reference has none either")


def struct_table(file, name, stated=None, told=None):
    """A struct's fields as a table, checked against the numbers that layout_table.hpp states. `told`: (unit, meaning)."""
    rows, size = file.struct(name)
    if stated is not None and [row[:4] for row in rows] != stated:
        odd = [f"{there[1]} at {there[0]}" for row, there in zip(rows, stated) if row[:4] != there] or ["its length"]
        raise Lack(f"{file.path}: {name} is not what the layout's table says: {odd[0]}")
    shown = []
    for at, word, of, count, comment in rows:
        if word.startswith(("pad_", "reserved")):
            continue
        what = (told[word] if word in told else ("", "")) if told else [meaning_of(file, name, word, comment)]
        shown.append((at, f"`{word}`", of if count == 1 else f"{of} x {count}", *what))
    if told:
        same("docs/log.md", [row[1].strip("`") for row in shown], told)
    return f"{size} bytes.\n\n" + table(("byte", "field", "type", *(["unit"] if told else []), "meaning"), shown)


FIELD = r'KERF_FIELD\((\w+), (\w+), (\w+), "(\w+)", (\d+)\)'


def stated_in(*sources):
    """Of each record its fields as the tables state them: (offset, name, type, count)."""
    stated = {}
    for record, name, at, kind, count in re.findall(FIELD, "".join(source.text for source in sources)):
        stated.setdefault(record, []).append((int(at, 0), name, kind, int(count)))
    return stated


def log_columns(root):
    """Unit and meaning of each field of a tick, from the log's page, which has a test of its own."""
    rows = re.findall(r"^\| `(\w+)` \| [^|]+ \| ([^|]*) \| ([^|]+) \| [^|]+ \|$", Source(root, "docs/log.md").text, re.M)
    return {name: (unit.strip(), meaning.replace(", below", ", listed there")) for name, unit, meaning in rows}


def numpy_tick(root, programs):
    """The module of the reader that has the type of a row."""
    table = Source(root, "shared/segment/tick_table.hpp")
    rows, line = [], "   "
    for _, name, kind, count in stated_in(table)["TickRecord"]:
        word = f' ("{name}", "<{kind[0]}{int(kind[1:]) // 8}"' + (f", {count})" if count > 1 else ")") + ","
        if len(line + word) > 120:
            rows.append(line)
            line = "   "
        line += word
    rows.append(line.rstrip(",") + "])")
    return ('# SPDX-License-Identifier: Apache-2.0\n"""The row of a log, which is the record of a tick in the segment.\n\n'
            f'Made by tests/docs/reference/make.py from {table.path}."""\nimport numpy as np\n\nTICK = np.dtype([\n' + "\n".join(rows) + "\n")


def choices(file, name):
    rows, last = [], -1
    for word, value, _ in file.enumerators(name):
        last = int(value) if value else last + 1
        rows.append(f"{last} `{word}`")
    return ", ".join(rows)


def segment(root, programs):
    file, fields = Source(root, "shared/segment/layout.hpp"), Source(root, "shared/segment/layout_table.hpp")
    homes = {"TickRecord": Source(root, "include/kerf/tick.hpp")}
    stated = stated_in(fields, Source(root, "shared/segment/tick_table.hpp"))
    told = {"TickRecord": log_columns(root)}
    parts = [f"## `{name}`\n\n{what}{struct_table(homes.get(name, file), name, stated[name], told.get(name))}\n" for name, what in (
        ("SegmentHeader", "At byte 0, one page. Each word that changes has another line of 64 bytes, except that `lifecycle` shares the "
                          "line of `heartbeat_ns`. "),
        ("VolumeDescriptor", "At `off_volume_table`, one for each volume. `origin_mm` is the position of the centre of voxel "
                             "(0, 0, 0) in the world. "),
        ("TickRecord", "At `off_state`: a ring, slot = index mod `state_slots`. [The log](log.md) has the same rows, and "
                       "lists when each field is valid. "),
        ("DirtyRecord", "At `off_dirty`: a ring, slot = index mod `dirty_slots`. A record is one box of voxels that changed. "))]
    same(fields.path, ["SegmentHeader", "VolumeDescriptor", "TickRecord", "DirtyRecord"], stated)
    return f"""# The shared segment

The controller writes the segment, and each reader maps it read-only. This is layout {file.number('kLayoutMajor')}.{file.number('kLayoutMinor')}: little-endian, natural alignment,
offsets instead of pointers. An installed kerf and `python/kerf_reader` have readers ([installation](compatibility.md#installation)).
The magic is `KERFSHM1`. `abi_hash` is a hash of the layout below. A reader with another hash refuses the segment.

A controller listens at `$XDG_RUNTIME_DIR/kerf/NAME.sock`, else `/tmp/kerf-$UID/NAME.sock`. NAME is the value of its `--name`, by
default `kerf`. For a demo NAME is `demo-PID`, unless `./kerf demo --name` gives another one. The controller answers a connection with
{8 + 4 + 4 + 8 + 8} bytes (magic, major, minor, `abi_hash`, `session_id`) and the file descriptor of the segment.

| from | what |
|---|---|
| 0 | `SegmentHeader` |
| `off_volume_table` | a `VolumeDescriptor` for each volume |
| `off_scene` | the scene as JSON, `scene_bytes` long |
| `off_state` | ring of `TickRecord`, {file.number('kStateSlots')} slots |
| `off_state_2` | the same ring for the second arm; 0: the scene has one arm. Index i of both rings is the same tick. The record of the second arm is published first |
| `off_dirty` | ring of `DirtyRecord`, {file.number('kDirtySlots')} slots |
| `off_versions`, of a volume | u64 for each brick: 2 t + 1 (odd) while tick t is written, 2 t + 2 (even) when it is complete, 0 if no tick has written it |
| `off_bricks`, of a volume | bricks of 8 x 8 x 8 densities, u16, x fastest |
| `off_labels`, of a volume | u8 for each voxel, x fastest, never changed; 0: none |

To read a record or a brick, read its sequence or version word, copy the data, and read the word again. Keep the copy if both
values are equal and even. The servo never waits for a reader.

`lifecycle`: {choices(file, 'Lifecycle')}. From 3 on it is final.
`cause` of a box: {choices(file, 'DirtyCause')}.

{chr(10).join(parts)}"""
