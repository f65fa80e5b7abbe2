# SPDX-License-Identifier: Apache-2.0
"""Recordings to replay in a browser's tab, sound ones and others, and what kerf-replay finds in them."""
import gzip
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / 'record'))
from lockstep_run import crc32c, record  # noqa: E402

HEADER, ROW = 4096, 496  # bytes before the first row, and of one


def demo(root, programs, to, scene, seconds):
    """A run of ./kerf demo; its recording is in `to`/log."""
    subprocess.run([root / 'kerf', 'demo', '--headless', '--virtual', '--seconds', str(seconds), '--scene', scene, '--out', to], check=True,
                   stdout=subprocess.DEVNULL, env=os.environ | {'KERF_BIN': str(programs)})


class Recordings:
    """Copies of a recording, each with something else in it, side by side in one folder."""

    def __init__(self, work, log):
        self.work, self.log, self.names = work, log, []

    def copy(self, name):
        shutil.copytree(self.log, self.work / name)
        self.names.append(name)
        return self.work / name

    def with_file(self, name, file, change):
        """`change` takes the bytes and returns others."""
        path = self.copy(name) / file
        path.write_bytes(change(path.read_bytes()))

    def with_rows(self, name, change):
        """`change` takes the rows of ticks as a bytearray."""
        def changed(data):
            rows = bytearray(data)
            change(rows)
            return bytes(rows)
        self.with_file(name, 'ticks.npy', changed)

    def with_json(self, name, file, change):
        def changed(data):
            value = json.loads(data)
            change(value)
            return json.dumps(value).encode()
        self.with_file(name, file, changed)


def set_in_row(rows, tick, offset, data):
    """Other bytes in one row, and the checksum that fits them."""
    at = HEADER + (tick - 1) * ROW
    rows[at + offset:at + offset + len(data)] = data
    rows[at + ROW - 4:at + ROW] = struct.pack('<I', crc32c(rows[at + 8:at + ROW - 4]))


def split_log(log, rows):
    """Its rows in files of so many."""
    ticks = log / 'ticks.npy'
    data = ticks.read_bytes()
    for part, at in enumerate(range(HEADER, len(data), rows * ROW), start=1):
        these = data[at:at + rows * ROW]
        header = re.sub(rb"\((\d+),\), } *\n$", b"(%d,), }" % (len(these) // ROW), data[:HEADER])
        path = ticks if part == 1 else log / f'ticks.npy.{part:04}'
        path.write_bytes(header.ljust(HEADER - 1) + b'\n' + these)


def make_recordings(work, log):
    """Of each a name that says what it is."""
    some = Recordings(work, log)
    some.copy('whole')
    encoder = struct.unpack_from('<i', (log / 'ticks.npy').read_bytes(), HEADER + 1500 * ROW + 264)[0]
    some.with_rows('another-report', lambda rows: set_in_row(rows, 1501, 264, struct.pack('<i', encoder + 3)))
    some.with_rows('another-state', lambda rows: set_in_row(rows, 1497, 172, struct.pack('<I', 12345)))
    some.with_rows('another-output', lambda rows: set_in_row(rows, 1600, 172, struct.pack('<I', 12345)))

    def drop_rows(rows):
        del rows[HEADER + 700 * ROW:HEADER + 709 * ROW]
    some.with_rows('gap', drop_rows)
    some.with_file('cut-in-a-row', 'ticks.npy', lambda data: data[:HEADER + 700 * ROW + 100])
    split_log(some.copy('split'), 1000)
    (some.copy('part-missing') / 'ticks.npy.0003').write_bytes(b'')
    some.with_file('no-rows', 'ticks.npy', lambda data: data[:HEADER])
    some.with_file('cut-in-the-header', 'ticks.npy', lambda data: data[:1000])
    some.with_file('empty-log', 'ticks.npy', lambda data: b'')
    some.with_file('flipped-bit', 'ticks.npy', lambda data: data[:HEADER + 700 * ROW + 50] + b'x' + data[HEADER + 700 * ROW + 51:])
    some.with_file('flipped-bit-at-first', 'ticks.npy', lambda data: data[:HEADER + 50] + b'x' + data[HEADER + 51:])
    some.with_file('other-byte-order', 'ticks.npy', lambda data: data[:HEADER].replace(b"'<", b"'>") + data[HEADER:])
    some.with_file('foreign-log', 'ticks.npy', lambda data: b'\x89PNG\r\n' * 5000)
    some.with_json('missing-start', 'manifest.json', lambda manifest: manifest.update(missed_before_start=12))
    some.with_json('three-arms', 'manifest.json', lambda manifest: manifest.update(arms=3))
    some.with_json('other-scene', 'scene.json', lambda scene: scene['force'].update(friction=0.123))
    some.with_json('huge-volume', 'scene.json', lambda scene: scene['volumes'][0].update(grid=[4096, 4096, 4096]))
    some.with_file('broken-manifest', 'manifest.json', lambda data: data[:200])
    some.with_json('odd-manifest', 'manifest.json', lambda manifest: manifest.pop('tick_ns'))
    some.with_file('broken-scene', 'scene.json', lambda data: data[:200])
    some.with_json('scene-without-source', 'scene.json', lambda scene: scene.pop('source'))
    (some.copy('no-scene') / 'scene.json').unlink()
    (some.copy('no-manifest') / 'manifest.json').unlink()
    shutil.rmtree(some.copy('no-volumes') / 'volumes')  # a phantom is made again
    density = min((log / 'volumes').iterdir(), key=lambda path: len(path.name)).name
    packed = (log / 'volumes' / density).read_bytes()
    for name, data in (('cut-volume', packed[:-20]), ('short-volume', gzip.compress(gzip.decompress(packed)[:-1])),
                       ('long-volume', gzip.compress(gzip.decompress(packed) + b'x')), ('empty-volume', b''),
                       ('other-volume', gzip.compress(gzip.decompress(packed)[:-1] + b'x'))):
        some.with_file(name, f'volumes/{density}', lambda _, data=data: data)
    return some


def flight_recording(root, programs, work):
    """A recording of a run's last second, of which the ticks before are known by their inputs."""
    run = work / 'flight-run'
    run.mkdir()
    (run / 'silence.toml').write_text('latches = "stale_input"\n[[fault]]\nkind = "silence"\nat_s = 1.4\nfor_s = 0.3\n')
    (run / 'scene.toml').write_text((root / 'scenes/phantom.toml').read_text())
    record(root, programs, run, run / 'scene.toml', 2.5, flight=True, fault=run / 'silence.toml')
    kept, = (run / 'flights').iterdir()
    kept.rename(work / 'flight')
    shutil.copytree(work / 'flight', work / 'flight-of-cut-inputs')
    inputs, = (work / 'flight-of-cut-inputs/inputs').iterdir()
    packed = inputs.read_bytes()
    inputs.unlink()
    inputs.write_bytes(packed[:-20])
    return ['flight', 'flight-of-cut-inputs']


def replayed_by_kerf(programs, work, names):
    """What kerf-replay prints of each, by name: as the module's facts, or {failed: line}."""
    found = {}
    for name in names:
        done = subprocess.run([programs / 'kerf-replay', name], cwd=work, capture_output=True, text=True, check=False)
        if not done.stdout:  # it was not replayed
            found[name] = {'failed': done.stderr.strip().removeprefix('kerf-replay: ')}
            continue

        def line(pattern, text=done.stdout):
            match = re.search(pattern, text, re.MULTILINE)
            return match and match[1]
        found[name] = {'difference': line(r'^(tick \d+ \(.*)$'), 'cut_short': line(r'^stopped: (.*)$') or '',
                       'output_hash': line(r'^output hash  (\w+)$'), 'second_output_hash': line(r'^output hash  (\w+) of the second arm$'),
                       'volume_hash': line(r'^volume hash  (\w+)'), 'equal': line(r'^(\d+) ticks, each equal')}
    return found
