#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""wheel_test.py ROOT VERSION LIBRARIES EMULATOR: the wheel kerf-standin, made twice, and installed by the lines of docs/stand-ins.md
in an empty environment without a network, where a program by ctypes passes.

Exit code 77: skipped, for want of venv or binutils."""
import ast
import base64
import csv
import hashlib
import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile

root, version, libraries, emulator = (pathlib.Path(path) for path in sys.argv[1:5])
root = root.resolve()
try:
    import ensurepip  # noqa: F401
except ImportError as lack:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):  # Debian's own has it
        os.execv("/usr/bin/python3", ["/usr/bin/python3", "-B", *sys.argv])
    print(f"skipped: {lack}; apt-get install python3-venv")
    sys.exit(77)
if not shutil.which("readelf"):
    print("skipped: no readelf; apt-get install binutils")
    sys.exit(77)

temporary = tempfile.TemporaryDirectory()
home = pathlib.Path(temporary.name)
# Nothing of this user's pip: neither a proxy nor wheels of his own.
environment = {name: value for name, value in os.environ.items() if not name.startswith(("PIP_", "KERF_"))}
environment.update(HOME=str(home), PIP_CONFIG_FILE=os.devnull, PIP_NO_INDEX="1", PIP_FIND_LINKS=str(home / "others"))


def done(command, code=0, **options):
    run = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    assert run.returncode == code, f"{command}: exit code {run.returncode}: {run.stdout}"
    return run.stdout


def made(out, **of_environment):
    command = [sys.executable, "-B", root / "standin/wheel/make.py", version, libraries, emulator, home / out]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env={**environment, **of_environment})
    wheel, = (home / out).iterdir()
    return wheel


# The same bytes, whenever and wherever they are made.
os.umask(0o077)
first = made("first", SOURCE_DATE_EPOCH="1700000000", TZ="Asia/Tokyo")
os.umask(0o022)
wheel = made("second", SOURCE_DATE_EPOCH="1700000000")
assert first.name == wheel.name and first.read_bytes() == wheel.read_bytes(), "the same files give other bytes"
# From an archive of the sources, on a machine without git.
(home / "tools").mkdir()
for tool in ("readelf", "strip"):
    (home / "tools" / tool).symlink_to(shutil.which(tool))
with zipfile.ZipFile(made("third", PATH=str(home / "tools"))) as file:
    assert {entry.date_time for entry in file.infolist()} == {(1980, 1, 1, 0, 0, 0)}
made("far", SOURCE_DATE_EPOCH="99999999999")  # beyond the years of a zip
refused = subprocess.run([sys.executable, "-B", root / "standin/wheel/make.py", version, libraries, emulator, home / "none"],
                         env={**environment, "SOURCE_DATE_EPOCH": "today"}, capture_output=True, text=True)
assert refused.returncode == 2 and refused.stderr.startswith("wheel: SOURCE_DATE_EPOCH=today: "), refused.stderr

# Its name says which glibc it needs: the newest whose symbols its programs and libraries ask for. Nothing else is asked for.
name, tagged = wheel.name.split("-")[0], tuple(map(int, re.search(r"-manylinux_(\d+)_(\d+)_", wheel.name).groups()))
assert name == "kerf_standin" and wheel.name.endswith(f"_{platform.machine()}.whl"), wheel.name
newest = (0, 0)
with zipfile.ZipFile(wheel) as file:
    assert file.testzip() is None
    contents = {entry.filename: file.read(entry) for entry in file.infolist()}
    programs = {entry.filename for entry in file.infolist() if entry.external_attr >> 16 & 0o111}
binaries = {path for path, data in contents.items() if data.startswith(b"\x7fELF")}
assert binaries == programs == {f"{name}/bin/kerf-emulator", f"{name}/lib/libHD.so", f"{name}/lib/libdrd.so.3"}, binaries
for path in binaries:
    data = contents[path]
    # As the loader finds them: in the string table that names libraries and versions.
    newest = max(newest, *(tuple(map(int, match.split(b"."))) for match in re.findall(rb"\0GLIBC_(\d+\.\d+)(?:\.\d+)?(?=\0)", data)))
    assert not re.search(rb"\0(GLIBCXX|CXXABI|GCC)_\d", data), f"{path}: asks for a C++ library"
assert newest == tagged, f"{wheel.name}: needs glibc {newest}"
if tuple(map(int, platform.libc_ver()[1].split(".")[:2])) <= (2, 36):
    assert tagged <= (2, 35), f"{wheel.name}: not for Ubuntu 22.04, although this machine has no newer glibc than Debian 12"
record, = (path for path in contents if path.endswith(".dist-info/RECORD"))
rows = {row[0]: row[1:] for row in csv.reader(contents[record].decode().splitlines())}
assert set(rows) == set(contents)
for path, (digest, size) in rows.items():
    if path != record:
        of_file = base64.urlsafe_b64encode(hashlib.sha256(contents[path]).digest()).rstrip(b"=").decode()
        assert (digest, size) == (f"sha256={of_file}", str(len(contents[path]))), path
    if path.endswith(".py"):
        ast.parse(contents[path], path, feature_version=(3, 10))  # Ubuntu 22.04

# Another project, with the lines of the page. Their pytest would come from a registry: here it is one that runs test_*.py.
page = (root / "docs/stand-ins.md").read_text(encoding="utf-8")
step = re.search(r"```yaml\n((?:.*\n){5})```\n", page).group(1).splitlines()
section = page.partition("## A haptic program without its device\n")[2]
assert 0 <= section.find("```yaml") < 200 and step[1].strip() == "run: |", step
lines = [line[8:] for line in step[2:]]
assert all(line.startswith(" " * 8) for line in step[2:]) and any(f"ci/{name}-{version}-" in line for line in lines), step
if wheel.name not in lines[1]:  # made on a newer system
    lines[1] = re.sub(r"ci/\S+", f"ci/{wheel.name}", lines[1])
project = home / "project"
(project / "ci").mkdir(parents=True)
(home / "others").mkdir()
shutil.copy(wheel, project / "ci")
with zipfile.ZipFile(home / "others/pytest-0-py3-none-any.whl", "w") as file:
    info = "pytest-0.dist-info/"
    file.writestr("pytest.py", "import glob, runpy\n\n\ndef main():\n    for path in glob.glob('test_*.py'):\n"
                               "        for name, test in runpy.run_path(path).items():\n"
                               "            if name.startswith('test_'):\n                test()\n")
    file.writestr(info + "METADATA", "Metadata-Version: 2.1\nName: pytest\nVersion: 0\n")
    file.writestr(info + "WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
    file.writestr(info + "entry_points.txt", "[console_scripts]\npytest = pytest:main\n")
    file.writestr(info + "RECORD", "")
for client in ("hd_client.py", "dhd_client.py"):
    shutil.copy(root / "tests/standin" / client, project)
(project / "test_touch.py").write_text("import runpy, sys\n\n\ndef test_spring():\n"
                                       "    sys.argv = ['hd_client.py', 'spring', '3000', 'client.json']\n"
                                       "    runpy.run_path('hd_client.py', run_name='__main__')\n")
done(["bash", "-euc", lines[0]], cwd=project)
began = time.monotonic()
done(["bash", "-euc", "\n".join([lines[0].split("&&")[1], *lines[1:]])], cwd=project)
print(f"wheel: {wheel.name}, {wheel.stat().st_size} bytes; from an empty environment to a passed program: {time.monotonic() - began:.1f} s")
measured = json.loads((project / "client.json").read_text())
assert measured["ticks"] == 3000 and measured["vendor"] == "kerf stand-in" and measured["rms_n"] > 0.1, measured
assert 'failures="0"' in (project / "haptics.xml").read_text()

# The command itself, which knows its own name; also where nobody called activate.
command = project / "haptics/bin/kerf-standin"
report = done([command, "--device", "omega", "--lockstep", "--report", "omega.json", "--", "python3", "dhd_client.py", "spring", "1000",
               "omega-client.json"], cwd=project)
assert report.startswith("kerf-standin: force: 1000 commands") and not json.loads((project / "omega.json").read_text())["misuse"], report
assert done([command, "--version"]) == f"kerf-standin {version}\n"
where = pathlib.Path(done([command, "--where"]).strip())
assert where.is_relative_to(project.resolve()) and (where / "faults/late_reports.toml").exists()
help_text = done([command, "--help"])
assert help_text.startswith("kerf-standin [OPTION...] -- COMMAND...") and "./kerf" not in help_text and str(where) in help_text, help_text
for words in (["--device", "toch", "--", "true"], ["true"], ["--lockstep"], ["--", "no/such/program"]):
    said = done([project / "haptics/bin/python3", "-m", "kerf_standin", *words], code=2)
    assert said.startswith("kerf-standin: ") and said.count("\n") == 1 and "./kerf" not in said, said
# A program in C++, by the line of the page.
line = re.search(r"^ *(g\+\+ touch\.cpp .*)", page, re.M).group(1)
shutil.copy(root / "tests/standin/hdu_client.cpp", project / "touch.cpp")
done(["bash", "-euc", f". haptics/bin/activate; {line}"], cwd=project)
said = done([command, "--lockstep", "--", "./touch"], code=1, cwd=project)  # it calls a device that it does not have, on purpose
assert said.startswith("no error 1000 ticks") and re.findall("misuse: (.*?):", said) == ["bad_handles"], said
