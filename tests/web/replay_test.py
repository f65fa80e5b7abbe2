# SPDX-License-Identifier: Apache-2.0
"""Recordings in a browser's tab beside kerf-replay: the module under Node, then the page in headless Chromium.

    replay_test.py ROOT BIN-FOLDER PAGE-FOLDER [--pictures FOLDER]

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it, of Node or of a browser."""
import gzip
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time

root, programs, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
pictures = pathlib.Path(sys.argv[5]) if sys.argv[4:5] == ['--pictures'] else None
sys.path[:0] = [str(root / part) for part in ('tests/page', 'tests/record')]
from browser import Page, find_chromium  # noqa: E402
from lockstep_run import record  # noqa: E402
from served import served  # noqa: E402

HEADER, ROW = 4096, 496  # bytes before the first row, and of one
failures = []


def check(holds, what):
    print(('ok    ' if holds else 'FAILS ') + what, flush=True)
    if not holds:
        failures.append(what)


def demo(to, scene, seconds):
    subprocess.run([root / 'kerf', 'demo', '--headless', '--virtual', '--seconds', str(seconds), '--scene', scene, '--out', to], check=True,
                   stdout=subprocess.DEVNULL, env=os.environ | {'KERF_BIN': str(programs)})


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


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


def replayed_by_kerf(work, names):
    """What kerf-replay prints of each, by name: as the module's facts, or {failed: line}."""
    found = {}
    for name in names:
        done = subprocess.run([programs / 'kerf-replay', name], cwd=work, capture_output=True, text=True, check=False)
        if done.returncode == 2:
            found[name] = {'failed': done.stderr.strip().removeprefix('kerf-replay: ')}
            continue

        def line(pattern, text=done.stdout):
            match = re.search(pattern, text, re.MULTILINE)
            return match and match[1]
        found[name] = {'difference': line(r'^(tick \d+ \(.*)$'), 'cut_short': line(r'^stopped: (.*)$') or '',
                       'output_hash': line(r'^output hash  (\w+)$'), 'second_output_hash': line(r'^output hash  (\w+) of the second arm$'),
                       'volume_hash': line(r'^volume hash  (\w+)'), 'equal': line(r'^(\d+) ticks, each equal')}
    return found


def replayed_in_node(work, names, most=1 << 30):
    run = subprocess.run(['node', '--experimental-default-type=module', root / 'tests/web/replay_module.js', folder / 'kerf.wasm', str(most),
                          *(work / name for name in names)], capture_output=True, text=True, check=False)
    lines = run.stdout.splitlines()
    if len(lines) != len(names):
        raise RuntimeError(run.stderr)
    return dict(zip(names, map(json.loads, lines)))


def same_as_kerf(name, module, kerf):
    if 'failed' in kerf or 'failed' in module:
        return module.get('failed') == kerf.get('failed')
    same = all(module.get(key) == kerf[key] for key in ('difference', 'cut_short', 'output_hash', 'second_output_hash', 'volume_hash'))
    equal = str(module['compared'] + 1 - module['first_tick'])
    return same and module['returns'] and (kerf['equal'] == equal if not kerf['difference'] else True)


def tells_the_same(work, recordings):
    """The module finds, tick for tick and word for word, what kerf-replay finds."""
    kerf, module = replayed_by_kerf(work, recordings), replayed_in_node(work, recordings)
    for name in recordings:
        told = module[name].get('failed') or module[name]['difference'] or module[name]['cut_short'] or \
            f'{module[name]["compared"]} ticks, {module[name]["output_hash"]}, {module[name]["times_real_time"]:.1f} times real time'
        check(same_as_kerf(name, module[name], kerf[name]), f'{name}: {told}')
        if not same_as_kerf(name, module[name], kerf[name]):
            print(f'      module {module[name]}\n      kerf   {kerf[name]}')
    return kerf


def make_recordings(work, log):
    """Of each a name that says what it is."""
    some = Recordings(work, log)
    some.copy('whole')
    encoder = struct.unpack_from('<i', (log / 'ticks.npy').read_bytes(), HEADER + 1500 * ROW + 264)[0]
    some.with_rows('another-report', lambda rows: set_in_row(rows, 1501, 264, struct.pack('<i', encoder + 3)))
    some.with_rows('another-output', lambda rows: set_in_row(rows, 1600, 172, struct.pack('<I', 12345)))

    def drop_rows(rows):
        del rows[HEADER + 700 * ROW:HEADER + 709 * ROW]
    some.with_rows('gap', drop_rows)
    some.with_file('cut-in-a-row', 'ticks.npy', lambda data: data[:HEADER + 700 * ROW + 100])
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


def replays_one_file(work, kerf):
    """The MCAP of a recording is found to be what its folder is."""
    names = []
    for name, options in (('whole', ()), ('whole', ('--unpacked',)), ('another-report', ()), ('two-arms', ()), ('flight', ()),
                          ('gap', ())):
        names.append(f'{name}{"".join(options)}.mcap')
        # It exits with 1 if the recording has a gap.
        subprocess.run([programs / 'kerf-record', 'export', work / name, '--mcap', work / names[-1], *options], check=False,
                       stdout=subprocess.DEVNULL)
    for name, module in replayed_in_node(work, names).items():
        folder_name = name.removesuffix('.mcap').removesuffix('--unpacked')
        check(same_as_kerf(name, module, kerf[folder_name]), f'{name}: {module.get("failed") or module["difference"] or module["output_hash"]}')


def says_its_own_lines(work, log):
    """What no program but the page meets, or says in other words."""
    some = Recordings(work, log)
    (some.copy('no-log') / 'ticks.npy').unlink()
    shutil.copytree(log, some.copy('two') / 'second')
    whole = (work / 'whole.mcap').read_bytes()
    subprocess.run([programs / 'kerf-record', 'export', log, '--mcap', work / 'part.mcap', '--until', '100'], check=True, stdout=subprocess.DEVNULL)
    some.names.append('part.mcap')
    middle = len(whole) // 4
    for name, data in (('foreign.mcap', b'\x89MCAP0\r\n' * 100), ('cut.mcap', whole[:-100]), ('empty.mcap', b''), ('picture.png', b'\x89PNG'),
                       ('damaged.mcap', whole[:middle] + bytes(5000) + whole[middle + 5000:])):
        (work / name).write_bytes(data)
        some.names.append(name)
    words = {'no-log': 'no-log/manifest.json: ticks.npy is not beside it; drop the folder',
             'two': '2 recordings: two, two/second; drop one of them',
             'part.mcap': 'part.mcap: has ticks, and neither scene nor volumes; export the whole recording',
             'damaged.mcap': 'damaged.mcap/ticks.npy: ',
             **{f'{name}.mcap': f'{name}.mcap: cut, or no MCAP of kerf-record export; copy it again' for name in ('foreign', 'cut', 'empty')},
             'picture.png': 'picture.png: no recording; drop the folder'}
    for name, found in replayed_in_node(work, some.names).items():
        failed = found.get('failed') or found.get('cut_short') or 'nothing'
        check(failed.startswith(words[name]) and '\n' not in failed, f'{name}: {failed}')
    few = replayed_in_node(work, ['whole'], most=1 << 20)['whole'].get('failed', 'nothing')
    check('npy.gz: ' in few and few.endswith('too large for a tab; replay it with ./kerf replay'), f'1 MiB of memory: {few}')


def flight_recording(work):
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


# -- The page

TICK, FOUND, RESTS = (f'document.body.dataset.{name}' for name in ('replayTick', 'replayFound', 'replayState'))
STATE_LINE = "document.getElementById('run-state').textContent"


def drop(page, path):
    """A drop of a file or folder from outside of the browser, upon the picture."""
    x, y, width, height = page.box('#picture')
    data = {'items': [], 'files': [str(path)], 'dragOperationsMask': 1}
    for kind in ('dragEnter', 'dragOver', 'drop'):
        page.call('Input.dispatchDragEvent', type=kind, x=x + width / 2, y=y + height / 2, data=data)


def choose(page, selector, files):
    document = page.call('DOM.getDocument')['root']['nodeId']
    node = page.call('DOM.querySelector', nodeId=document, selector=selector)['nodeId']
    page.call('DOM.setFileInputFiles', nodeId=node, files=[str(path) for path in files])


def take_picture(page, name):
    if not pictures:
        return
    page.evaluate("document.getElementById('run').scrollIntoView()")
    time.sleep(2)
    pictures.mkdir(parents=True, exist_ok=True)
    (pictures / f'{name}.png').write_bytes(page.picture())


def rests_at(page, tick, seconds=60):
    return page.until(f"{RESTS} === 'rests' && {TICK} === '{tick}'", seconds)


def hashes(page):
    return tuple(page.evaluate('[document.body.dataset.outputHash, document.body.dataset.volumeHash]'))


def replays_a_folder(page, work, kerf):
    """Dropped on a live run: replayed to its end, and then looked at."""
    known, last = kerf['whole'], int(kerf['whole']['equal'])
    drop(page, work / 'whole')
    check(rests_at(page, last, 120), f'a dropped folder is replayed to its last tick: {page.evaluate(FOUND)}')
    check(page.evaluate(FOUND) == f'{last} ticks, each equal to the last bit', 'no tick differs')
    check(hashes(page) == (known['output_hash'], known['volume_hash']), f'hashes in the tab are those of kerf-replay: {hashes(page)}')
    check(page.evaluate("document.getElementById('run-figures').textContent").count(known['output_hash']) == 1, 'the page shows them')
    take_picture(page, 'replay-end')
    slide = "at = document.getElementById('replay-at'); at.value = 700; for (const kind of ['input', 'change']) at.dispatchEvent(new Event(kind))"
    page.evaluate(f'(() => {{ const {slide} }})()')
    check(rests_at(page, 700), 'the slider goes to a tick')
    there = hashes(page)
    page.press('#replay-step')
    check(rests_at(page, 701), 'one tick on')
    check(hashes(page) != there, 'the hashes are those of the tick')
    page.evaluate(f'(() => {{ const {slide} }})()')
    check(rests_at(page, 700) and hashes(page) == there, 'and back to the same bits')
    for _ in range(3):
        page.press('#replay-slower')
    page.press('#replay-play')
    page.until(f"{RESTS} === 'plays' && Number({TICK}) > 710", 30)
    ticks = [int(page.evaluate(TICK))]
    began = time.monotonic()
    page.until(f"Number({TICK}) > {ticks[0] + 60}", 30)
    # The lower bound alone: a busy machine is slower, never faster.
    check(time.monotonic() - began > 0.3, 'slow motion: 60 ticks at an eighth of real time take more than 0.3 s')
    take_picture(page, 'replay-slow')
    page.press('#replay-play')
    check(page.until(f"{RESTS} === 'rests'", 30), 'it pauses')


def stands_still_when_hidden(page):
    """A page in the background gives the worker no turn to make up for."""
    hide = "Object.defineProperty(document, 'hidden', {value: %s, configurable: true}); document.dispatchEvent(new Event('visibilitychange'))"
    page.press('#replay-play')
    page.until(f"{RESTS} === 'plays'", 30)
    page.evaluate(hide % 'true')
    time.sleep(0.5)  # what was under way
    before = int(page.evaluate(TICK))
    time.sleep(3)
    check(int(page.evaluate(TICK)) == before, 'a replay in the background stands still')
    page.evaluate(hide % 'false')
    page.until(f"Number({TICK}) > {before}", 30)
    after = int(page.evaluate(TICK))
    # An eighth of real time: 3 s are 375 ticks, which a burst would make up for at once.
    check(before < after < before + 200, f'and goes on without a burst: {before}, then {after}')
    page.press('#replay-play')


def finds_a_difference(page, work, kerf):
    """A second recording ends the first."""
    drop(page, work / 'another-report')
    check(rests_at(page, 1501, 120), 'it stops at the first tick that differs')
    check(page.evaluate(FOUND) == f'first difference: {kerf["another-report"]["difference"]}', page.evaluate(FOUND))
    take_picture(page, 'replay-difference')
    page.press('#replay-play')
    check(page.until(f"{RESTS} === 'rests' && Number({TICK}) > 1600", 120), 'goes on behind it')
    page.press('#replay-there')
    check(rests_at(page, 1501), 'and back to it')


def replays_a_file(page, work, kerf):
    """A fault report is one file."""
    drop(page, work / 'whole.mcap')
    check(page.until(f"document.getElementById('run-figures').textContent.startsWith('recordingwhole.mcap')", 60) and
          rests_at(page, kerf['whole']['equal'], 120), f'a dropped MCAP is replayed: {page.evaluate(FOUND)}')
    check(hashes(page) == (kerf['whole']['output_hash'], kerf['whole']['volume_hash']), 'to the same hashes')


def says_what_is_wrong(page, work, kerf):
    for name in ('cut-in-the-header', 'other-byte-order', 'missing-start', 'other-scene', 'cut-volume', 'huge-volume'):
        drop(page, work / name)
        line = json.dumps(kerf[name]['failed'])
        check(page.until(f"document.body.dataset.run === 'failed' && {STATE_LINE} === {line}", 60), f'{name}: {page.evaluate(STATE_LINE)}')
    drop(page, work / 'whole')
    check(rests_at(page, kerf['whole']['equal'], 120), 'a sound one is replayed after them')
    drop(page, work / 'picture.png')
    check(page.until(f"{STATE_LINE}.startsWith('picture.png: no recording')", 30), f'a foreign file: {page.evaluate(STATE_LINE)}')
    page.press('#replay-step')
    check(page.evaluate(RESTS) == 'rests' and page.evaluate("document.body.dataset.state") == 'live', 'the replay is still there')


def replays_files_on_a_phone(page, address, work, kerf):
    """A phone chooses files, which have no folder."""
    page.size(390, 844, True)
    page.go('about:blank')
    page.go(f'{address}/#scene=touch')
    page.until("document.body?.dataset.run === 'runs' && document.body.dataset.state === 'live'", 120)
    choose(page, '#files-input', [path for path in (work / 'whole').rglob('*') if path.is_file()])
    check(rests_at(page, kerf['whole']['equal'], 120), f'chosen files are replayed: {page.evaluate(FOUND)}')
    check(hashes(page) == (kerf['whole']['output_hash'], kerf['whole']['volume_hash']), 'to the same hashes')
    take_picture(page, 'replay-phone')
    page.press('#again')
    check(page.until("document.body.dataset.run === 'runs' && document.body.dataset.replayTick === undefined && "
                     "document.body.dataset.timesRealTime > 0", 120), 'a run of its own again')


def main():
    chromium = find_chromium()
    for there, name in ((chromium, 'chromium'), (shutil.which('node'), 'node'), ((folder / 'kerf.wasm').exists(), f'{folder}/kerf.wasm')):
        if not there:
            print(f'skipped: no {name}')
            return 77
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        demo(work / 'demo', 'phantom', 2)
        demo(work / 'arms', 'two_arms', 1)
        (work / 'arms/log').rename(work / 'two-arms')
        some = make_recordings(work, work / 'demo/log')
        kerf = tells_the_same(work, some.names + ['two-arms'] + flight_recording(work))
        report = json.loads((work / 'demo/report.json').read_text())
        check(kerf['whole']['output_hash'] == report['output_hash'], 'the run had that hash, too')
        replays_one_file(work, kerf)
        says_its_own_lines(work, work / 'demo/log')
        with served(folder) as address:
            page = Page(chromium, work / 'profile')
            try:
                page.size(1280, 800)
                page.go(f'{address}/#scene=touch')
                check(page.until("document.body?.dataset.run === 'runs' && document.body.dataset.state === 'live'", 120), 'the tab has a run')
                replays_a_folder(page, work, kerf)
                stands_still_when_hidden(page)
                finds_a_difference(page, work, kerf)
                replays_a_file(page, work, kerf)
                says_what_is_wrong(page, work, kerf)
                replays_files_on_a_phone(page, address, work, kerf)
            finally:
                page.close()
    return 1 if failures else 0


sys.exit(main())
