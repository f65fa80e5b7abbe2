# SPDX-License-Identifier: Apache-2.0
"""What the tests of kerf in a tab share: their command line, checks, pictures, and a tab of headless Chromium that a server
of this process has the page for."""
import argparse
import pathlib
import shutil
import tempfile
import time

from browser import Page, find_chromium
from served import Quiet, served

ROOT = pathlib.Path(__file__).resolve().parents[2]

# Of the page, as JavaScript.
RUNS = "document.body?.dataset.run === 'runs' && document.body.dataset.state === 'live'"
IS_LED = f"{RUNS} && document.body.dataset.handLed === 'true'"
REMOVED = 'parseFloat(document.body.dataset.removedMm3)'
HIDE = "Object.defineProperty(document, 'hidden', {value: %s, configurable: true}); document.dispatchEvent(new Event('visibilitychange'))"
DESKTOP, PHONE = (1280, 800), (390, 844)

failures, _pictures = [], []


def arguments(text, *names):
    """Folders of the command line by `names`; --pictures FOLDER: where `keep` leaves pictures."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in names:
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument('--pictures', type=pathlib.Path)
    given = parser.parse_args()
    if given.pictures:
        given.pictures.mkdir(parents=True, exist_ok=True)
        _pictures.append(given.pictures)
    return [getattr(given, name).resolve() for name in names]


def check(holds, what):
    print(('ok    ' if holds else 'FAILS ') + what, flush=True)
    if not holds:
        failures.append(what)


def keep(page, name, after_s=0):
    """A picture of the tab after a while, if there is a folder for it."""
    for folder in _pictures:
        time.sleep(after_s)
        (folder / f'{name}.png').write_bytes(page.picture())


def exit_code(folder, use, *, needs=('kerf.wasm',), handler=Quiet, flags=()):
    """Calls `use(page, address)` with a tab of 1280x800 and the address of `folder`. 1 if a check failed; 77, and nothing is
    called, if there is no browser or one of `needs` is neither in the folder nor a program."""
    chromium = find_chromium()
    for name in ('chromium', *needs):
        if not (chromium if name == 'chromium' else (folder / name).exists() or shutil.which(name)):
            print(f'skipped: no {name}' + (f' in {folder}; ./kerf page makes it' if '.' in name else ''))
            return 77
    with tempfile.TemporaryDirectory() as profile, served(folder, handler) as address:
        page = Page(chromium, profile, flags)
        try:
            page.size(*DESKTOP)
            use(page, address)
        finally:
            page.close()
    return 1 if failures else 0
