# SPDX-License-Identifier: Apache-2.0
"""Recordings replayed by the module of a browser's tab, under Node, beside kerf-replay.

    replay_module_test.py BIN-FOLDER PAGE-FOLDER

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it or of Node."""
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

from recordings import demo, flight_recording, make_recordings, Recordings, replayed_by_kerf
from tab import ROOT, arguments, check, failures

programs, folder = arguments(__doc__, 'BIN-FOLDER', 'PAGE-FOLDER')


def replayed_in_node(work, names, most=1 << 30, options=()):
    run = subprocess.run(['node', *options, '--experimental-default-type=module', ROOT / 'tests/web/replay_module.js', folder / 'kerf.wasm', str(most),
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
    # The worker stops there too, wherever in its batch of ticks it is.
    same = same and (not module['difference'] or module['rests_at'] == module['difference_tick'])
    return same and module['returns'] and (kerf['equal'] == equal if not kerf['difference'] else True)


def tells_the_same(work, recordings):
    """The module finds, tick for tick and word for word, what kerf-replay finds."""
    kerf, module = replayed_by_kerf(programs, work, recordings), replayed_in_node(work, recordings)
    for name in recordings:
        told = module[name].get('failed') or module[name]['difference'] or module[name]['cut_short'] or \
            f'{module[name]["compared"]} ticks, {module[name]["output_hash"]}, {module[name]["times_real_time"]:.1f} times real time'
        check(same_as_kerf(name, module[name], kerf[name]), f'{name}: {told}')
        if not same_as_kerf(name, module[name], kerf[name]):
            print(f'      module {module[name]}\n      kerf   {kerf[name]}')
    return kerf


def replays_one_file(work, kerf):
    """The MCAP of a recording is found to be what its folder is."""
    names = []
    for name, options in (('whole', ()), ('whole', ('--unpacked',)), ('another-report', ()), ('two-arms', ()), ('flight', ()),
                          ('gap', ()), ('cut-in-a-row', ())):
        names.append(f'{name}{"".join(options)}.mcap')
        # It exits with 1 if the recording is cut.
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
    start, = struct.unpack_from('<Q', whole, len(whole) - 28)  # of the summary; its last field but two

    def first(opcode, begin):
        """Where the first record of that kind is, from a record on."""
        while whole[begin] != opcode:
            begin += 9 + struct.unpack_from('<Q', whole, begin + 1)[0]
        return begin

    def patched(at, layout, value):
        return whole[:at] + struct.pack(layout, value) + whole[at + struct.calcsize(layout):]
    chunk, rows, files = first(6, 8), first(7, 8), first(10, start)
    broken = {'no-summary': patched(len(whole) - 28, '<Q', 0), 'summary-outside': patched(len(whole) - 28, '<Q', len(whole)),
              'odd-index': patched(rows + 11, '<I', 17), 'no-index': patched(rows, '<B', 15),
              'many-rows': patched(rows + 11, '<I', 1 << 31), 'small-in-index': patched(files + 41, '<Q', 10)}
    for name, data in (*((f'{name}.mcap', data) for name, data in broken.items()),
                       ('huge-chunk.mcap', patched(chunk + 25, '<Q', 1 << 31)), ('foreign.mcap', b'\x89MCAP0\r\n' * 100), ('cut.mcap', whole[:-100]), ('empty.mcap', b''), ('CAPITALS.MCAP', b''), ('picture.png', b'\x89PNG'),
                       ('damaged.mcap', whole[:middle] + bytes(5000) + whole[middle + 5000:])):
        (work / name).write_bytes(data)
        some.names.append(name)
    words = {'no-log': 'no-log/manifest.json: ticks.npy is not beside it; drop the folder',
             'two': '2 recordings: two, two/second; drop one of them',
             'part.mcap': 'part.mcap: has ticks, and neither scene nor volumes; export the whole recording',
             'damaged.mcap': 'damaged.mcap/ticks.npy: ',
             'huge-chunk.mcap': 'huge-chunk.mcap/ticks.npy: ',
             **{f'{name}.mcap': f'{name}.mcap: cut, or no MCAP of kerf-record export; copy it again' for name in ('foreign', 'cut', 'empty', *broken)},
             'CAPITALS.MCAP': 'CAPITALS.MCAP: cut, or no MCAP of kerf-record export; copy it again',
             'picture.png': 'picture.png: no recording; drop the folder'}
    for name, found in replayed_in_node(work, some.names).items():
        failed = found.get('failed') or found.get('cut_short') or 'nothing'
        check(failed.startswith(words[name]) and '\n' not in failed, f'{name}: {failed}')
    for pages in (900, 1500, 2300):  # of 64 KiB: while it loads, while it plans, at a snapshot
        failed = replayed_in_node(work, ['whole'], options=[f'--wasm-max-mem-pages={pages}'])['whole'].get('failed', 'nothing')
        check(failed.startswith('memory: none is left for this run; close other tabs'), f'{pages / 16:.0f} MiB of memory: {failed}')
    few = replayed_in_node(work, ['whole'], most=1 << 20)['whole'].get('failed', 'nothing')
    check('npy.gz: ' in few and few.endswith('too large for a tab; replay it with ./kerf replay'), f'1 MiB of memory: {few}')


def refuses_broken_lz4():
    """A block whose literals or match are behind its end, and a size that no chunk has."""
    script = """
const {unpackedLz4} = await import(process.argv[1]);
const frame = block => new Uint8Array([4, 0x22, 0x4d, 0x18, 0x40, 0x40, 0, block.length, 0, 0, 0, ...block, 0, 0, 0, 0]);
const found = (block, size) => {
  try {
    return [...unpackedLz4(frame(block), size)].join();
  } catch {
    return 'refused';
  }
};
console.log(JSON.stringify([found([0x20, 7, 8], 2), found([0x10, 7, 1, 0, 0x10, 8], 6), found([0x50, 7, 8], 5), found([0xf0], 15),
  found([0x10, 7, 1], 5), found([0x20, 7, 8], 2 ** 40)]));
"""
    run = subprocess.run(['node', '--experimental-default-type=module', '--input-type=module', '-e', script, ROOT / 'web/page/mcap_log.js'], capture_output=True, text=True, check=False)
    found = json.loads(run.stdout) if run.stdout else run.stderr
    check(found == ['7,8', '7,7,7,7,7,8', *4 * ['refused']], f'blocks of LZ4: {found}')


def main():
    for there, name in ((shutil.which('node'), 'node'), ((folder / 'kerf.wasm').exists(), f'{folder}/kerf.wasm')):
        if not there:
            print(f'skipped: no {name}')
            return 77
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        demo(ROOT, programs, work / 'demo', 'phantom', 2)
        demo(ROOT, programs, work / 'arms', 'two_arms', 1)
        (work / 'arms/log').rename(work / 'two-arms')
        names = make_recordings(work, work / 'demo/log').names + ['two-arms'] + flight_recording(ROOT, programs, work)
        kerf = tells_the_same(work, names)
        report = json.loads((work / 'demo/report.json').read_text())
        check(kerf['whole']['output_hash'] == report['output_hash'], 'the run had that hash, too')
        replays_one_file(work, kerf)
        says_its_own_lines(work, work / 'demo/log')
        refuses_broken_lz4()
    return 1 if failures else 0


sys.exit(main())
