# SPDX-License-Identifier: Apache-2.0
"""kerf in a browser's tab beside kerf itself: the module under Node, then the page in headless Chromium with real pointers.

    web_test.py BIN-FOLDER PAGE-FOLDER [--pictures FOLDER]

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it, of Node or of a browser."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from tab import DESKTOP, IS_LED, PHONE, REMOVED, ROOT, RUNS, arguments, check, exit_code, keep

programs, folder = arguments(__doc__, 'BIN-FOLDER', 'PAGE-FOLDER')
SECONDS = 2
SCENES = {'phantom': 'cut_cavity', 'touch': 'touch'}


def native(scene, seconds, *more):
    """output_hash and volume_hash of ./kerf demo --virtual."""
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([ROOT / 'kerf', 'demo', '--headless', '--virtual', '--seconds', str(seconds), '--scene', scene,
                        '--out', out + '/run', *more], check=True, stdout=subprocess.DEVNULL, env=os.environ | {'KERF_BIN': str(programs)})
        report = json.loads(pathlib.Path(out, 'run/report.json').read_text())
    return report['output_hash'], report['volume_hash']


def in_node(script, *words):
    run = subprocess.run(['node', '--experimental-default-type=module', ROOT / 'tests/web' / script, folder / 'kerf.wasm', ROOT, *words],
                         capture_output=True, text=True, check=False)
    if run.returncode:
        raise RuntimeError(run.stderr)
    return json.loads(run.stdout)


def has_one_arm():
    """A scene of two devices is refused with what to do, and so is a command for a second arm."""
    found = in_node('commands_module.js')
    check(found['refused'] is not None and 'a tab has one hand; choose another scene' in found['refused'], f'two arms: {found["refused"]}')
    wanted = {'arm 0, tool 1': 0, 'arm 1, tool 1': 2, 'arm 0, tool 99': 2, 'arm 0, tool 0': 0}
    check(found['answers'] == wanted, f'commands: {found["answers"]}')


def has_the_bits_of_kerf(page, address, known):
    """The same seed and script end in the hashes of ./kerf demo --virtual."""
    page.go(f'{address}/#scene=phantom&seconds={SECONDS}&pace=0')
    ended = page.until("['done', 'failed'].includes(document.body?.dataset.run)", 240)
    check(ended, 'the run in the tab ends')
    found = tuple(page.evaluate('[document.body.dataset.outputHash, document.body.dataset.volumeHash]'))
    print(f'      in the tab {found[0]} {found[1]}\n      kerf demo  {known[0]} {known[1]}')
    check(found == known, 'hashes in the tab are those of ./kerf demo --virtual')
    check(page.evaluate("document.getElementById('run-figures').textContent").count(found[0]) == 1, 'the page shows it')


def cuts_by_a_pointer(page, address, touch):
    page.size(*(PHONE if touch else DESKTOP), touch)
    page.go('about:blank')
    page.go(f'{address}/#scene=phantom&hand=mine')
    check(page.until(RUNS, 120), 'the tab has a run')
    x, y, width, height = page.box('#picture')
    middle = x + width / 2, y + height / 2
    check(page.until(IS_LED, 90), 'the hand waits to be led')
    before = page.evaluate(REMOVED)
    end = time.monotonic() + 60
    at, down = 0, False
    while time.monotonic() < end and not page.evaluate(REMOVED) > before + 0.05:
        at += 1
        place = (middle[0] + 12 * ((at % 9) - 4) / 4, middle[1] + 10 * ((at % 5) - 2) / 2)
        if touch:
            page.touch('touchMove' if down else 'touchStart', place)
        elif down:
            page.mouse('mouseMoved', *place, button='left', buttons=1)
        else:
            page.mouse('mousePressed', *place, button='left', buttons=1, clickCount=1)
        down = True
        time.sleep(0.03)
    removed = page.evaluate(REMOVED)
    if touch:
        page.touch('touchEnd')
    else:
        page.mouse('mouseReleased', *middle, button='left')
    name = 'a finger' if touch else 'the mouse'
    check(removed > before, f'{name} cuts: {removed:.3f} mm3')
    keep(page, 'phone' if touch else 'desktop', 2)


def says_what_is_wrong(page, address):
    page.size(*DESKTOP)
    page.go('about:blank')
    page.go(f'{address}/#scene=touch&set=force.stiffness_n_per_mm%3D1000')
    check(page.until("document.body?.dataset.run === 'failed'", 60), 'a value out of range ends the run')
    said = page.evaluate("document.getElementById('run-state').textContent")
    check('stiffness_n_per_mm' in said and '100' in said, f'the page says why: {said}')
    # What a browser lacks, one thing more each time: the first of these that it misses is told.
    missing = "document.getElementById('missing')"
    for name, without, word in (
            ('WebGL 2', "HTMLCanvasElement.prototype.getContext = (f => function (kind, ...more) {"
                        " return kind === 'webgl2' ? null : f.call(this, kind, ...more); })(HTMLCanvasElement.prototype.getContext)", 'WebGL 2'),
            ('workers', 'delete globalThis.Worker', 'workers'),
            ('WebAssembly', 'delete globalThis.WebAssembly', 'WebAssembly')):
        page.call('Page.addScriptToEvaluateOnNewDocument', source=without)
        page.go('about:blank')
        page.go(f'{address}/#scene=touch')
        told = page.until(f"{missing}?.hidden === false", 30) and page.evaluate(f'{missing}.textContent')
        check(told and word in told, f'a browser without {name}: {told}')
        if name == 'WebGL 2':
            check(page.until("document.body.dataset.run === 'runs' && document.getElementById('force').textContent !== '–'", 60),
                  'the run goes on without a picture')


def all_of_it(page, address):
    known = {scene: native(scene, SECONDS) for scene in SCENES}
    for scene, hand in SCENES.items():
        run = in_node('run_module.js', f'{scene}.toml', f'hands/{hand}.toml', str(SECONDS))
        check((run['output_hash'], run['volume_hash']) == known[scene],
              f'{scene} under Node: {run["output_hash"]} {run["volume_hash"]}; {run["times_real_time"]:.2f} times real time')
    has_one_arm()
    has_the_bits_of_kerf(page, address, known['phantom'])
    cuts_by_a_pointer(page, address, touch=False)
    cuts_by_a_pointer(page, address, touch=True)
    says_what_is_wrong(page, address)


sys.exit(exit_code(folder, all_of_it, needs=('kerf.wasm', 'node')))
