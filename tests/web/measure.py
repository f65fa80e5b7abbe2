# SPDX-License-Identifier: Apache-2.0
"""How a tab comes to its first picture, in headless Chromium with a new profile: of pages by turns, the best of N times, in
ms from the address on; and what all of its processes took of the cores until then.

    measure.py N PAGE-FOLDER...      PAGE-FOLDER: what ./kerf page wrote, of this version and of others

Exit code 77: skipped, for want of a page or of a browser."""
import os
import pathlib
import sys
import tempfile
import time

from served import served
from tab import DESKTOP, find_chromium
from browser import Page

STEPS = {'worker': 'the worker is begun', 'to open': 'it is asked for a scene', 'context': 'WebGL', 'w opened': 'the scene is loaded',
         'live': 'the volumes are in the page', 'drawn': 'the first picture is finished', 'cpu': 'of the cores, by all processes of the browser'}
# What happens first, by its name.
WATCH = '''(() => {
  const times = window.kerfTimes = {};
  const mark = name => times[name] ??= performance.now();
  window.Worker = class extends Worker {
    constructor(...all) {
      mark('worker');
      super(...all);
      this.addEventListener('message', ({data}) => Object.keys(data).forEach(kind => mark('w ' + kind)));
    }
    postMessage(...all) {
      for (const kind of Object.keys(all[0])) mark('to ' + kind);
      super.postMessage(...all);
    }
  };
  const kinds = WebGL2RenderingContext.prototype, context = HTMLCanvasElement.prototype.getContext, {fenceSync} = kinds;
  HTMLCanvasElement.prototype.getContext = function(kind, ...all) {
    const made = context.call(this, kind, ...all);
    if (kind === 'webgl2') mark('context');
    return made;
  };
  kinds.fenceSync = function(...all) {
    if (!('fence' in times)) {
      mark('fence');
      const own = fenceSync.apply(this, all);
      const see = () => this.getSyncParameter(own, this.SYNC_STATUS) === this.SIGNALED ? mark('drawn') : setTimeout(see, 1);
      setTimeout(see, 1);
    }
    return fenceSync.apply(this, all);
  };
  new MutationObserver(() => document.body?.dataset.state === 'live' && mark('live')).observe(document,
    {subtree: true, attributes: true, attributeFilter: ['data-state']});
})();'''


def cpu_ms(pid):
    """Of a process and those that it has begun."""
    children = pathlib.Path(f'/proc/{pid}/task/{pid}/children').read_text().split()
    user, system = pathlib.Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[11:13]
    return 1000 * (int(user) + int(system)) / os.sysconf('SC_CLK_TCK') + sum(cpu_ms(child) for child in children)


def times_of(folder):
    with tempfile.TemporaryDirectory() as profile, served(folder) as address:
        page = Page(find_chromium(), profile)
        try:
            page.size(*DESKTOP)
            page.call('Page.addScriptToEvaluateOnNewDocument', source=WATCH)
            time.sleep(1)  # the start of the browser is not the page's
            before = cpu_ms(page.process.pid)
            page.go(address)
            page.until("window.kerfTimes && 'drawn' in kerfTimes", 60)
            after = cpu_ms(page.process.pid)
            return page.evaluate('kerfTimes') | {'cpu': after - before}
        finally:
            page.close()


count, *folders = sys.argv[1:]
if not find_chromium() or not all(pathlib.Path(folder, 'kerf.wasm').exists() for folder in folders):
    print('skipped: no chromium, or no page; ./kerf page makes one')
    sys.exit(77)
found = {folder: [] for folder in folders}
for _ in range(int(count)):
    for folder in folders:
        found[folder].append(times_of(folder))
print(''.join(f'{folder:>30}' for folder in folders))
for name, what in STEPS.items():
    print(''.join(f'{min((times.get(name, float("inf")) for times in found[folder])):30.0f}' for folder in folders), what)
