# SPDX-License-Identifier: Apache-2.0
"""Recordings dropped on kerf's page in headless Chromium, beside kerf-replay.

    replay_page_test.py BIN-FOLDER PAGE-FOLDER [--pictures FOLDER]

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it or of a browser."""
import json
import pathlib
import subprocess
import sys
import tempfile
import time

from recordings import demo, make_recordings, replayed_by_kerf
from tab import HIDE, ROOT, RUNS, arguments, check, exit_code, keep

programs, folder = arguments(__doc__, 'BIN-FOLDER', 'PAGE-FOLDER')
WRONG = ('cut-in-the-header', 'other-byte-order', 'missing-start', 'other-scene', 'cut-volume', 'huge-volume')
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
    page.evaluate("document.getElementById('run').scrollIntoView()")
    keep(page, name, 2)


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
    page.evaluate(f"(() => {{ const {slide}; for (let i = 0; i < 2; ++i) document.getElementById('replay-step').click(); }})()")
    check(rests_at(page, 702), 'steps asked for on the way are made there')
    page.evaluate(f'(() => {{ const {slide} }})()')
    check(rests_at(page, 700) and hashes(page) == there, 'a new way drops none and adds none')
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
    page.press('#replay-play')
    page.until(f"{RESTS} === 'plays'", 30)
    page.evaluate(HIDE % 'true')
    time.sleep(0.5)  # what was under way
    before = int(page.evaluate(TICK))
    time.sleep(3)
    check(int(page.evaluate(TICK)) == before, 'a replay in the background stands still')
    page.evaluate(HIDE % 'false')
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
    for name in WRONG:
        drop(page, work / name)
        line = json.dumps(kerf[name]['failed'])
        check(page.until(f"document.body.dataset.run === 'failed' && {STATE_LINE} === {line}", 60), f'{name}: {page.evaluate(STATE_LINE)}')
    drop(page, work / 'whole')
    check(rests_at(page, kerf['whole']['equal'], 120), 'a sound one is replayed after them')
    drop(page, work / 'picture.png')
    check(page.until(f"{STATE_LINE}.startsWith('picture.png: no recording')", 30), f'a foreign file: {page.evaluate(STATE_LINE)}')
    page.press('#replay-play')  # from its first tick again
    check(page.until(f"{RESTS} === 'plays'", 30) and page.evaluate("document.body.dataset.state") == 'live', 'the replay is still there')
    page.press('#replay-play')


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


def all_recordings(page, address):
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        demo(ROOT, programs, work / 'demo', 'phantom', 2)
        make_recordings(work, work / 'demo/log')
        subprocess.run([programs / 'kerf-record', 'export', work / 'whole', '--mcap', work / 'whole.mcap'], check=True, stdout=subprocess.DEVNULL)
        (work / 'picture.png').write_bytes(b'\x89PNG')
        kerf = replayed_by_kerf(programs, work, ('whole', 'another-report', *WRONG))
        page.go(f'{address}/#scene=touch')
        check(page.until(RUNS, 120), 'the tab has a run')
        replays_a_folder(page, work, kerf)
        stands_still_when_hidden(page)
        finds_a_difference(page, work, kerf)
        replays_a_file(page, work, kerf)
        says_what_is_wrong(page, work, kerf)
        replays_files_on_a_phone(page, address, work, kerf)


sys.exit(exit_code(folder, all_recordings))
