# SPDX-License-Identifier: Apache-2.0
"""What the page does where news come in parts, stop, or cannot be drawn."""
import signal
import subprocess

from case import text_of

# Two bricks side by side, sent in two passes of two frames, and once more after a new connection.
PASSES = '''Promise.all([import('./brick_store.js'), import('./constants.js')]).then(([{Held, mixed}, {kLastOfPass}]) => {
  const session = 7n;
  const hello = {session, sceneBytes: 0, volumes: [{nx: 16, ny: 8, nz: 8, brick_count: 2, log2_brick: 3,
    bits_per_voxel: 16, off_labels: 0n}]};
  const seen = held => [held.volumes[0].density[0], held.volumes[0].density[8]].join(' ');
  const says = what => { try { return what() ?? 'taken'; } catch (problem) { return problem.message; } };
  let sum, versions;
  const connect = before => { sum = 0n; versions = {}; return new Held(hello, before); };
  const send = (held, id, version, byte, flags) => {
    if (versions[id]) sum -= mixed(id, versions[id] ^ session);
    versions[id] = version;
    sum = BigInt.asUintN(64, sum + mixed(id, version ^ session));
    const frame = {session, flags, blocks: 1, ids: [id], versions: [version], setHash: sum,
      payload: new Uint8Array(1024).fill(byte)};
    return says(() => { held.apply(frame); return `${seen(held)}, new: ${[...news]}`; });
  };
  let news = new Set();
  let held = connect(null);
  const out = [send(held, 0, 2n, 1, 0), send(held, 1, 2n, 1, kLastOfPass)];
  news = held.volumes[0].follow();
  news.clear();
  out.push(send(held, 0, 4n, 2, 0), send(held, 1, 4n, 2, kLastOfPass));
  news.clear();
  held = connect(held);
  out.push(send(held, 1, 6n, 3, 0), send(held, 0, 6n, 3, kLastOfPass));
  held = connect(held);
  out.push(send(held, 0, 8n, 4, kLastOfPass), seen(held));
  held = connect(held);
  send(held, 0, 8n, 4, 0);
  out.push(send(held, 0, 8n, 5, 0), seen(held));
  return out;
})'''


def shows_whole_passes_only(case):
    wanted = ['257 0, new: ', '257 257, new: ',      # of a run that nobody sees yet
              '257 257, new: ', '514 514, new: 0,1',
              '514 514, new: ', '771 771, new: 1,0',  # joined again: the old picture stays meanwhile
              'frame: the pass ends with blocks missing', '771 771',
              'frame: a block is not newer than before', '771 771']
    told = case.page.evaluate(PASSES)
    case.check(told == wanted, f'a pass is shown whole or not at all {"" if told == wanted else told}')


def draws_small_until_it_knows_the_cost(case):
    """By the width of the first thing that each picture is drawn into."""
    case.page.evaluate('''(proto => {
      window.widths = [];
      window.wide = proto.viewport;
      proto.viewport = function(...all) { widths.push(all[2]); return wide.apply(this, all); };
    })(WebGL2RenderingContext.prototype)''')
    case.choose('#renderer', 'ArrowDown')
    case.settle()
    widths = case.page.evaluate('widths')
    case.page.evaluate('WebGL2RenderingContext.prototype.viewport = wide')
    full = round(case.page.box('#picture')[2])
    case.check(widths[0] == int(full / 8 + 0.5), f'the first picture of a renderer is an eighth as wide: {widths[0]} of {full}')
    case.check(widths[-2] == full, 'and in the end there is the finest one')
    case.choose('#renderer', 'ArrowUp')
    case.page.evaluate('document.activeElement.blur()')
    case.check(case.settle() == case.rest, 'and back')


def says_why_there_is_no_picture(case):
    page = case.page
    hidden = "getComputedStyle(document.getElementById('picture')).visibility === 'hidden'"
    page.evaluate("(window.lost = document.getElementById('picture').getContext('webgl2')"
                  ".getExtension('WEBGL_lose_context')).loseContext()")
    case.check(page.until(text_of('#missing') + ".startsWith('The graphics card took the picture away')"),
               'a lost context is told')
    case.check(page.evaluate(hidden), 'and no old picture stays')
    page.evaluate('lost.restoreContext()')
    case.check(page.until("document.getElementById('missing').hidden"), 'until it comes back')
    case.check(case.settle() == case.rest, 'with the same picture')
    page.evaluate('''(proto => {
      window.told = proto.getError;
      proto.getError = function() { return this.OUT_OF_MEMORY; };
    })(WebGL2RenderingContext.prototype)''')
    case.choose('#renderer', 'ArrowDown')
    case.check(page.until(text_of('#missing') + ".startsWith('The graphics memory is full')"), 'full memory is told')
    case.check(page.evaluate(hidden), 'and no other picture stays')
    page.evaluate('WebGL2RenderingContext.prototype.getError = told')
    case.choose('#renderer', 'ArrowUp')
    page.evaluate('document.activeElement.blur()')
    case.check(case.settle() == case.rest, 'what takes less is shown again')


def tells_how_old_a_picture_is(case):
    page, rig = case.page, case.rig
    rig.processes['controller'].send_signal(signal.SIGSTOP)
    old = r"/^Stale: no news from the servo\. This picture is [1-9]\d* s old\.$/"
    case.check(page.until(f"{old}.test({text_of('#banner')})"), 'a servo that is stopped is told, and how old the picture is')
    case.check(page.evaluate('document.body.dataset.state') == 'stale', 'it is not called live')
    rows = page.evaluate("document.getElementById('figures').textContent")
    case.check('servo–' in rows and 'data age–' in rows, 'no figure pretends that it is alive')
    rig.processes['controller'].send_signal(signal.SIGCONT)
    case.check(page.until(f"document.getElementById('banner').hidden || !{text_of('#banner')}.startsWith('Stale')"),
               'until it goes on')
    rig.end('controller', subprocess.Popen.kill)
    old = r"/^The controller is gone: this is its last state\. This picture is \d+ s old\.$/"
    case.check(page.until(f"{old}.test({text_of('#banner')})"), 'so is one that was killed')
    rig.end('emulator')
    rig.start_run()
    case.check(page.until(text_of('#banner') + ".startsWith('A new run')"), 'a new run follows')
    case.check(page.until('document.body.dataset.state === "live"'), 'which is shown')


# Of 5 x 4 x 3 bricks, the last ones cut off: which voxels the boxes of some bricks hold, and how many boxes.
BOXES = '''import('./textures.js').then(({boxesOf}) => {
  const volume = {grid: [5, 4, 3], size: [37, 31, 20]};
  const all = [...Array(60).keys()];
  const told = bricks => {
    const boxes = boxesOf(volume, bricks);
    const held = new Set();
    let twice = 0;
    for (const {low, high} of boxes) {
      if (high.some((n, axis) => n > volume.size[axis] || n <= low[axis])) return 'no box';
      for (let z = low[2]; z < high[2]; z += 8) {
        for (let y = low[1]; y < high[1]; y += 8) {
          for (let x = low[0]; x < high[0]; x += 8) {
            const id = (z / 8 * 4 + y / 8) * 5 + x / 8;
            twice += held.has(id);
            held.add(id);
          }
        }
      }
    }
    const most = Math.max(0, ...boxes.map(({low, high}) => [0, 1, 2].reduce(
      (n, axis) => n * Math.ceil((high[axis] - low[axis]) / 8), 1)));
    return [boxes.length, bricks.every(id => held.has(id)), held.size <= 3 * bricks.length, twice, most <= 20].join(' ');
  };
  return [told([]), told([0]), told([59]), told([0, 59]), told([0, 1, 5, 6, 20, 21, 25, 26]), told([0, 2]), told(all),
    told(all.filter(id => id % 7 === 0))];
})'''


def uploads_few_boxes(case):
    told = case.page.evaluate(BOXES)
    fine = all(one.endswith(' true true 0 true') for one in told)
    counts = [int(one.split()[0]) for one in told] if fine else told
    case.check(fine and counts[:6] == [0, 1, 1, 2, 1, 1] and counts[6] <= 6,
               f'changed bricks go up in boxes, all of them and little else: {counts}')
