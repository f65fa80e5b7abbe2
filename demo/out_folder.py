# SPDX-License-Identifier: Apache-2.0
"""The folder of --out. It is new, empty, or holds the unchanged results of an earlier demo, which this demo replaces:
files of others are never touched.

The keys of the window write to it at once; what they wrote goes on the list, too.

In it, `.kerf-demo` is kerf's own: `lock` (one demo at a time), `files` (the list of the results of the last demo), `new` (the
results of this one, until they move to their places together at the end)."""
import fcntl
import os
import pathlib
import re
import secrets
import shutil
import stat
import time

from options import Refusal

OWN = ".kerf-demo"
KIB_AT_LEAST = 16384  # pictures, plot and volume; the log comes on top
RESERVE_BYTES = 65536  # for the list of the results, even on a disk that is full by then
BY_KEYS = re.compile(r"kerf-[0-9]{4}(\.(png|y4m|mp4|toml|ply)|-camera\.toml)")  # names that the window's keys give
KINDS = ((stat.S_ISREG, "f"), (stat.S_ISLNK, "l"), (stat.S_ISFIFO, "p"), (stat.S_ISSOCK, "s"), (stat.S_ISBLK, "b"),
         (stat.S_ISCHR, "c"))


def entries(folder, below=""):
    """(line of the list, path below `folder`) of all in it but OWN, a folder before its contents. The line has kind, size,
    time of change and path; of a folder only the path. Throws OSError for a folder that cannot be read."""
    with os.scandir(os.path.join(folder, below)) as found:
        for entry in found:
            path = os.path.join(below, entry.name)
            if entry.is_dir(follow_symlinks=False):
                if path == OWN:
                    continue
                yield f"d - - {path}", path
                yield from entries(folder, path)
            else:
                status = entry.stat(follow_symlinks=False)
                kind = next(letter for is_kind, letter in KINDS if is_kind(status.st_mode))
                time_s = f"{status.st_mtime_ns // 10**9}.{status.st_mtime_ns % 10**9:09d}0"
                yield f"{kind} {status.st_size} {time_s} {path}", path


class OutFolder:
    """`name`: as the user wrote it. Methods throw Refusal with one line."""

    def __init__(self, name):
        self.name = name
        self.lock = None  # file descriptor, while no other demo may write there
        self.made = []  # folders that exist only because of this demo, the innermost first
        if re.search(r"[\x00-\x1f\x7f]", name):
            raise self.refusal("holds a control character; name another folder")
        self.place = os.path.realpath(name)
        self.own = os.path.join(self.place, OWN)
        self.results = os.path.join(self.own, "new")

    def refusal(self, rest):
        return Refusal(f"--out {self.name}: {rest}")

    def left(self):
        """Lines of the list of the last demo."""
        try:
            return set(pathlib.Path(self.own, "files").read_text(errors="surrogateescape").split("\n"))
        except OSError:
            return set()

    def check(self):
        """Before anything is built or run."""
        if not os.path.exists(self.place):
            return
        if not os.path.isdir(self.place):
            raise self.refusal("not a folder; name another")
        if not os.access(self.place, os.R_OK | os.X_OK):
            raise self.refusal("cannot be read; name another folder")
        if not os.access(self.place, os.W_OK):
            raise self.refusal("cannot be written; name another folder")
        left = self.left()
        try:
            for line, path in entries(self.place):
                if line not in left:
                    raise self.refusal(f"holds {path}, which no demo wrote or which changed since; name a new or an empty folder")
        except OSError:
            raise self.refusal("cannot be read as a whole; name another folder") from None

    def make(self, folder):
        """Creates a folder with all above it, and notes the new ones."""
        missing = []
        while not os.path.exists(folder):
            missing.append(folder)
            folder = os.path.dirname(folder)
        self.made = missing + self.made
        for one in reversed(missing):
            os.mkdir(one)

    def open(self, log_bytes):
        """Takes the lock and makes an empty folder for the results, among them a log of that size."""
        try:
            self.make(self.place)
        except OSError:
            raise self.refusal("cannot be created; name another folder") from None
        try:
            self.make(self.own)
            lock = os.open(os.path.join(self.own, "lock"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        except OSError:
            raise self.refusal("cannot be written; name another folder") from None
        if not self.lock_within(lock, 2):
            os.close(lock)
            raise self.refusal("another demo is at work there; wait for its end or name another folder")
        self.lock = lock
        try:
            if os.path.lexists(self.results):
                shutil.rmtree(self.results)
            os.mkdir(self.results)
            pathlib.Path(self.own, "reserve").write_bytes(bytes(RESERVE_BYTES))
        except OSError:
            raise self.refusal("cannot be written; name another folder") from None
        needed_kib = int(KIB_AT_LEAST + log_bytes / 1024)
        room = os.statvfs(self.results)
        free_kib = room.f_bavail * room.f_frsize // 1024
        if free_kib < needed_kib:
            raise self.refusal(f"{free_kib // 1024} MiB free and {needed_kib // 1024} needed; make room or name another folder")

    def lock_within(self, lock, seconds):
        end = time.monotonic() + seconds
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError:
                if time.monotonic() > end:
                    return False
                time.sleep(0.02)
        try:  # the demo before may have removed its lock with its folder
            return os.path.samestat(os.fstat(lock), os.stat(os.path.join(self.own, "lock")))
        except OSError:
            return False

    def empty_results(self):
        """Drops what there is so far: with room again, the controller's report does not fail next. If another program took
        the folder away, a new one keeps the last reports until the end."""
        try:
            for name in os.listdir(self.results):
                path = os.path.join(self.results, name)
                if os.path.isdir(path) and not os.path.islink(path):
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    os.unlink(path)
        except OSError:
            try:
                self.make(self.results)
            except OSError:
                pass

    def publish(self):
        """Replaces the results of the last demo by those of this one. At every moment, all results in the folder are on the
        list. Returns the line to print, and whether the results lie where they belong."""
        old = self.left()
        try:
            os.unlink(os.path.join(self.own, "reserve"))
            lines = [line for line, _ in entries(self.results)]
            pathlib.Path(self.own, "files.new").write_text("".join(line + "\n" for line in lines), errors="surrogateescape")
        except OSError:
            raise self.refusal("cannot be written; make room or name another folder") from None
        for path in sorted((path for line, path in entries(self.place) if line in old), reverse=True):
            try:  # the contents of a folder before the folder
                whole = os.path.join(self.place, path)
                os.rmdir(whole) if os.path.isdir(whole) and not os.path.islink(whole) else os.unlink(whole)
            except OSError:
                pass
        names = sorted(name for name in os.listdir(self.results) if not name.startswith("."))
        taken = [name for name in names if os.path.lexists(os.path.join(self.place, name))]
        try:
            if taken:  # by another program, since the demo began
                os.unlink(os.path.join(self.own, "files.new"))
                beside = "demo-" + secrets.token_hex(3)
                os.mkdir(os.path.join(self.place, beside), 0o700)
                self.move(names, beside)
                return f"kerf: demo: --out {self.name}: {taken[-1]} is in the way; this demo is kept in {self.name}/{beside}", False
            os.rename(os.path.join(self.own, "files.new"), os.path.join(self.own, "files"))
            self.move(names, "")
        except OSError:
            raise self.refusal("cannot be written; name another folder") from None
        frames = [name for name in names if re.fullmatch(r"frame-.*\.png", name)]
        kept = [name for name in names if not re.fullmatch(r"frame-.*\.(png|npy)", name)]
        kept += [line.split(" ", 3)[3] for line in self.written_by_keys()]
        return f"kept in {self.name}: {' '.join(kept)}, {len(frames)} frame{'s' if len(frames) != 1 else ''}", True

    def written_by_keys(self):
        """Lines of the files that the window's keys wrote in this demo: before it, all there was stood on the list."""
        try:
            left = self.left()
            return [line for line, path in entries(self.place) if BY_KEYS.fullmatch(path) and line not in left]
        except OSError:
            return []

    def move(self, names, to):
        for name in names:
            os.rename(os.path.join(self.results, name), os.path.join(self.place, to, name))

    def close(self):
        """Removes what is not a result: on every way out."""
        if self.lock is not None:
            shutil.rmtree(self.results, ignore_errors=True)
            lines = self.written_by_keys()
            if lines:
                with open(os.path.join(self.own, "files"), "a", errors="surrogateescape") as listed:
                    listed.write("".join(line + "\n" for line in lines))
            try:
                os.unlink(os.path.join(self.own, "reserve"))
            except OSError:
                pass
            if not os.path.exists(os.path.join(self.own, "files")):
                shutil.rmtree(self.own, ignore_errors=True)
            os.close(self.lock)
            self.lock = None
        for folder in self.made:
            try:
                os.rmdir(folder)
            except OSError:
                pass
