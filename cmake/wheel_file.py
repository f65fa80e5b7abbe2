# SPDX-License-Identifier: Apache-2.0
"""Writes a wheel: what standin/wheel/make.py and cmake/kerf_wheel.py have in common.

By the format of the Python packaging user guide ("Binary distribution format"), with Python's own zipfile, so that it needs no
network. The same files give the same bytes: each entry has the time of SOURCE_DATE_EPOCH, or of the last commit, or of 1980."""
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[1]


class Refusal(Exception):
    """One line: what is wrong, and what to do."""


def entry_time():
    """(year, month, day, hour, minute, second) of every entry; a zip has the years from 1980 to 2107."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not seconds and shutil.which("git"):
        command = ["git", "-C", ROOT, "log", "-1", "--format=%ct"]
        seconds = subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
    if not re.fullmatch(r"[0-9]{0,11}", seconds):
        raise Refusal(f"SOURCE_DATE_EPOCH={seconds}: not a number of seconds; unset it, or take 1700000000")
    return min(max((1980, 1, 1, 0, 0, 0), time.gmtime(int(seconds or "0"))[:6]), (2107, 12, 31, 23, 59, 58))


def stripped(path):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "stripped")
        subprocess.run(["strip", "--strip-unneeded", "-o", out, path], check=True)
        return out.read_bytes()


def write(out, name, version, tag, files, executables, info):
    """The wheel in the folder `out`, in place of others of that name. files: {path: bytes}; the paths in `executables` get the right
    to run. info: {name: bytes} of the dist-info, all but WHEEL and RECORD."""
    folder = f"{name}-{version}.dist-info"
    about = f"Wheel-Version: 1.0\nGenerator: kerf\nRoot-Is-Purelib: false\nTag: {tag}\n"
    entries = {path: data for path, data in sorted(files.items())} | {
        f"{folder}/{path}": data for path, data in {**info, "WHEEL": about.encode()}.items()}
    record = [f"{path},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}\n"
              for path, data in entries.items()]
    entries[f"{folder}/RECORD"] = "".join([*record, f"{folder}/RECORD,,\n"]).encode()
    out.mkdir(parents=True, exist_ok=True)
    wheel, part, when = out / f"{name}-{version}-{tag}.whl", out / f"{name}.part", entry_time()
    with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        for path, data in entries.items():
            entry = zipfile.ZipInfo(path, when)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix: the rights below
            entry.external_attr = (0o100755 if path in executables else 0o100644) << 16
            file.writestr(entry, data)
    for older in out.glob(f"{name}-*.whl"):
        older.unlink()
    part.rename(wheel)
    return wheel
