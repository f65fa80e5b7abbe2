#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page's scripts without a browser: each file of tests/web/script under Node, beside the page's own modules.

    script_test.py [NAME...]      NAME: only these of the files, such as arrows
Exit code 77: skipped, without node."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
HELPERS = {"bridge_end", "fake_page", "figures", "steered"}



def failures(tap):
    """The failed tests of a TAP stream, each with its error."""
    blocks = re.split(r"^(?=(?:not )?ok |# )", tap, flags=re.MULTILINE)
    return "".join(block.split("  stack:")[0] for block in blocks if block.startswith("not ok"))


if not shutil.which("node"):
    print("skipped: no node; install nodejs")
    sys.exit(77)
with tempfile.TemporaryDirectory() as temporary:
    folder = pathlib.Path(temporary)
    for place in ("bridge/page/web/*.js", "bridge/page/web/index.html", "web/page/*.js", "tests/web/script/*.mjs",
                  "tests/visualizer/view/cell_gradients.json"):
        for file in ROOT.glob(place):
            shutil.copy(file, folder)
    (folder / "package.json").write_text('{"type": "module"}')
    subprocess.run(["cmake", f"-DOUTPUT={folder / 'constants.js'}", f"-DROOT={ROOT}", "-P", ROOT / "bridge/page/constants.cmake"], check=True)
    subprocess.run(["cmake", f"-DOUTPUT={folder / 'scene_texts.js'}", f"-DROOT={ROOT}", "-P", ROOT / "web/scene_texts.cmake"], check=True)
    # A shader is never compiled here.
    (folder / "shaders.js").write_text("export const head = '', shaders = new Proxy({}, {get: () => ({vertex: '', fragment: ''})});")
    subprocess.run(["cmake", f"-DOUTPUT={folder / 'tab.html'}", f"-DPAGE={folder / 'index.html'}", f"-DMODULES={folder}",
                    "-P", ROOT / "web/index.cmake"], check=True)
    names = sys.argv[1:] or sorted(file.stem for file in folder.glob("*.mjs") if file.stem not in HELPERS)
    failed = []
    for name in names:
        done = subprocess.run(["node", "--test-reporter=tap", f"{name}.mjs"], cwd=folder, capture_output=True, text=True, timeout=60)
        print(f"{'ok   ' if done.returncode == 0 else 'FAILS'} {name}", flush=True)
        if done.returncode != 0:
            print(failures(done.stdout) or done.stdout + done.stderr)
            failed.append(name)
sys.exit(1 if failed else 0)
