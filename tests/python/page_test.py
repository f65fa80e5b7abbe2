# SPDX-License-Identifier: Apache-2.0
"""page_test.py ROOT BIN [write]: each example of docs/python.md runs as it stands, and prints what the page says. write: the page gets it.

PYTHONPATH=build/release/python. Exit code 77: skipped, for want of NumPy or Matplotlib."""
import pathlib
import re
import subprocess
import sys
import tempfile

try:
    import matplotlib  # noqa: F401
    import numpy  # noqa: F401
except ImportError as lack:
    print(f"skipped: {lack}; apt-get install python3-numpy python3-matplotlib")
    sys.exit(77)
page = pathlib.Path(sys.argv[1], "docs/python.md")
text = page.read_text(encoding="utf-8")
EXAMPLE = re.compile(r"```python\n(.*?)```\n\nIt prints\n\n((?:    [^\n]*\n)+)", re.S)
wrong = 0


def checked(match):
    global wrong
    program, said = match.groups()
    with tempfile.TemporaryDirectory() as home:
        done = subprocess.run([sys.executable, "-B", "-W", "error", "-c", program], cwd=home, capture_output=True, text=True, check=False)
        pictures = [path for path in pathlib.Path(home).glob("*.png") if path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size > 10000]
        assert "savefig" not in program or pictures, "no picture"
    assert done.returncode == 0, done.stderr
    prints = "".join(f"    {line}\n" for line in done.stdout.splitlines())
    if prints != said:
        wrong += 1
        print(f"{page}: says\n{said}and it prints\n{prints}")
    return match.group(0).replace(said, prints)


assert len(EXAMPLE.findall(text)) == 5
text = EXAMPLE.sub(checked, text)
if sys.argv[3:] == ["write"]:
    page.write_text(text, encoding="utf-8")
else:
    sys.exit(wrong > 0)
