# SPDX-License-Identifier: Apache-2.0
"""kerf_wheel_test.py ROOT VERSION MODULE: the wheel of `import kerf`, installed by the lines of docs/python.md in a new environment
without a network: a first log, and the first example of the page.

Exit code 77: skipped, for want of venv, binutils or NumPy."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile

root, version, module = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
try:
    import ensurepip  # noqa: F401
    import numpy  # noqa: F401
except ImportError as lack:
    print(f"skipped: {lack}; apt-get install python3-venv python3-numpy")
    sys.exit(77)
if not shutil.which("strip"):
    print("skipped: no strip; apt-get install binutils")
    sys.exit(77)
page = (root / "docs/python.md").read_text(encoding="utf-8")
with tempfile.TemporaryDirectory() as folder:
    home = pathlib.Path(folder)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PIP_", "PYTHON", "KERF_"))}
    environment.update(HOME=folder, PIP_CONFIG_FILE=os.devnull, PIP_NO_INDEX="1", SOURCE_DATE_EPOCH="1700000000")

    def done(*command):
        run = subprocess.run(command, cwd=home, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert run.returncode == 0, f"{command}: exit code {run.returncode}: {run.stdout}"
        return run.stdout

    def made(name):
        done(sys.executable, "-B", root / "cmake/kerf_wheel.py", version, module, home / name)
        wheel, = (home / name).iterdir()
        return wheel

    wheel = made("packages")
    assert wheel.read_bytes() == made("again").read_bytes(), "the same files give other bytes"
    with zipfile.ZipFile(wheel) as file:
        names = file.namelist()
    ours = {f"kerf/{path.relative_to(root)}" for path in (root / "scenes").rglob("*.toml")}
    assert ours <= set(names), ours - set(names)
    assert not [name for name in names if "__pycache__" in name or name.endswith(".nrrd")], names

    # The lines of the page, as they stand.
    lines = re.search(r"^    python3 -m venv .*\n(?:    .*\n)+", page, re.M).group().splitlines()
    for line in lines:
        done("bash", "-c", line.strip().replace("build/python/packages", str(home / "packages")).replace("python3 -m", f"{sys.executable} -m"))
    python = home / "venv/bin/python3"
    began = time.monotonic()
    said = done(python, "-c", """
import kerf
with kerf.Loop("touch", log="run") as loop:
    loop.run(seconds=4)
print(kerf.__file__, len(kerf.Log("run")), kerf.Log("run").check())
""")
    print(f"the first log took {time.monotonic() - began:.1f} s from the start of Python")
    assert said.startswith(str(home / "venv")) and said.endswith(" 4000 []\n"), said
    program, prints = re.search(r"```python\n(.*?)```\n\nIt prints\n\n((?:    [^\n]*\n)+)", page, re.S).groups()
    found = done(python, "-c", program)
    assert found == re.sub(r"^    ", "", prints, flags=re.M), found
