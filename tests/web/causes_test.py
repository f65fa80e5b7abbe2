# SPDX-License-Identifier: Apache-2.0
"""The page where it cannot run, in headless Chromium: each time it says the cause and the cure.

    causes_test.py PAGE-FOLDER [--pictures FOLDER]

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it or of a browser."""
import contextlib
import sys
import time

from served import Quiet
from tab import RUNS, arguments, check, exit_code, keep

TOLD = "document.querySelector('#missing:not([hidden]), noscript p')?.innerText"
STATE = "document.getElementById('state')?.textContent"
WASM = "script-src 'self' 'wasm-unsafe-eval'"


class Server(Quiet):
    """The folder, with headers and without files as a case wants it; /frame has the page in a sandbox."""
    added, without, sandbox = {}, (), ''

    def end_headers(self):
        self.send_header('Cache-Control', 'no-store')  # what a case takes away is gone, in a worker too
        for name, value in Server.added.items():
            self.send_header(name, value)
        super().end_headers()

    def do_GET(self):
        name = self.path.split('?')[0].strip('/')
        if name in Server.without:
            return self.send_error(404)
        if name != 'frame':
            return super().do_GET()
        text = f'<!doctype html><iframe src="./" sandbox="{Server.sandbox}" width=900 height=600></iframe>'.encode()
        self.send_response(200)
        self.send_header('Content-Type', 'text/html')
        self.send_header('Content-Length', str(len(text)))
        self.end_headers()
        self.wfile.write(text)


@contextlib.contextmanager
def serving(**how):
    """How the server is for a while."""
    before = {name: getattr(Server, name) for name in how}
    for name, value in how.items():
        setattr(Server, name, value)
    yield
    for name, value in before.items():
        setattr(Server, name, value)


def says(page, address, what, words):
    page.go('about:blank')
    page.go(address)
    told = page.until(TOLD, 20) and page.evaluate(TOLD)
    time.sleep(0.5)
    told = told and page.evaluate(TOLD)
    check(told and all(word in told for word in words), f'{what}: {told}')
    keep(page, what.replace(' ', '-'))


def text_in_the_frame(page):
    """What a frame of another origin shows: by its own context."""
    tree = page.call('Page.getFrameTree')['frameTree']
    frame = tree['childFrames'][0]['frame']['id']
    world = page.call('Page.createIsolatedWorld', frameId=frame)['executionContextId']
    answer = page.call('Runtime.evaluate', contextId=world, expression=TOLD, returnByValue=True)
    return answer['result'].get('value')


def says_in_a_frame(page, address, sandbox, words, **how):
    with serving(sandbox=sandbox, **how):
        page.go('about:blank')
        page.go(f'{address}/frame')
        told, end = None, time.monotonic() + 20
        while not told and time.monotonic() < end:
            time.sleep(0.5)
            with contextlib.suppress(RuntimeError, KeyError):  # the frame is on its way
                told = text_in_the_frame(page)
        check(told and all(word in told for word in words), f'a frame with sandbox="{sandbox}": {told}')


def policies(page, address):
    for policy, words in ((f"{WASM}; worker-src 'none'", ('policy', 'worker.js', "worker-src 'self'")),
                          ("script-src 'self'", ('policy', "'wasm-unsafe-eval'")),
                          (f"{WASM}; connect-src 'none'", ('kerf.wasm', 'connect-src'))):
        with serving(added={'Content-Security-Policy': policy}):
            says(page, address, f'policy {policy.replace(chr(39), "")}', words)
    with serving(added={'Content-Security-Policy': "script-src 'none'"}):
        page.go('about:blank')
        page.go(address)
        check(page.until(f"{STATE}?.includes('forbidden by a policy')", 20), 'a policy against all scripts: the panel says so')
    with serving(added={'Content-Security-Policy': f"default-src 'none'; {WASM}; worker-src 'self'; connect-src 'self'; style-src 'self'"}):
        page.go(address)
        check(page.until(RUNS, 120), 'the policy that the page asks for lets it run')


def offline_in_a_run(page, address):
    page.go('about:blank')
    page.go(f'{address}/#scene=touch')
    check(page.until(RUNS, 120), 'it runs')
    page.call('Network.emulateNetworkConditions', offline=True, latency=0, downloadThroughput=0, uploadThroughput=0)
    page.evaluate("document.getElementById('scene').value = 'torus', document.getElementById('scene').dispatchEvent(new Event('change'))")
    check(page.evaluate(STATE) != 'live', 'another scene is not live at once')
    check(page.until(RUNS, 120) and page.evaluate("document.getElementById('scene').value") == 'torus', 'without network the next scene runs too')
    page.call('Network.emulateNetworkConditions', offline=False, latency=0, downloadThroughput=-1, uploadThroughput=-1)
    page.go('about:blank')
    page.go(f'{address}/#scene=touch&set=force.stiffness_n_per_mm%3D1000')
    check(page.until(TOLD, 60) and 'stiffness_n_per_mm' in page.evaluate(TOLD), f'a scene that fails: {page.evaluate(TOLD)}')
    time.sleep(4)
    check(page.evaluate(STATE) == 'the run has failed', f'and goes on saying so: {page.evaluate(STATE)}')


def all_causes(page, address):
    says(page, f'file://{folder}/index.html', 'a file', ('opened as a file', 'python3 -m http.server'))
    for name in ('try.js', 'kerf.js', 'math.js', 'scenes.js'):
        with serving(without=(name,)):
            says(page, address, f'without {name}', ('did not come', 'whole folder'))
    for name in ('worker.js', 'kerf_module.js'):
        with serving(without=(name,)):
            says(page, address, f'without {name}', ('servo of this tab did not start', 'whole folder'))
    with serving(without=('kerf.wasm',)):
        says(page, address, 'without kerf.wasm', ('kerf.wasm: 404', 'whole folder'))
    for sandbox, how in (('', {}), ('allow-scripts', {}), ('allow-scripts', {'added': {'Access-Control-Allow-Origin': '*'}})):
        says_in_a_frame(page, address, sandbox, ('sandbox', 'allow-same-origin'), **how)
    policies(page, address)
    offline_in_a_run(page, address)


folder, = arguments(__doc__, 'PAGE-FOLDER')
# A frame of another site is then one of the page's process.
sys.exit(exit_code(folder, all_causes, handler=Server, flags=['--disable-features=IsolateSandboxedIframes']))
