# SPDX-License-Identifier: Apache-2.0
"""The HDF5 of a recording, read by h5py, and by Octave if that is there.

    hdf5_test.py ROOT BIN
Exit code 77: skipped, without h5py."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
sys.path.insert(0, str(ROOT / "tests/record"))
from lockstep_run import record, set_clock


def export(log, to, *options, code=0):
    done = subprocess.run([BIN / "kerf-record", "export", log, "--hdf5", to, *options], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stderr


def crc32c(rows):
    """The checksum of each row: of its bytes between seq and crc32c, all rows at once."""
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ np.uint32(0x82F63B78), table >> 1)
    bytes_of = np.frombuffer(rows.tobytes(), np.uint8).reshape(len(rows), -1)[:, 8:-4]
    crc = np.full(len(rows), 0xFFFFFFFF, np.uint32)
    for column in bytes_of.T:
        crc = table[(crc ^ column) & 0xFF] ^ (crc >> 8)
    return crc ^ np.uint32(0xFFFFFFFF)


class TestHdf5(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.scene = shutil.copy(ROOT / "scenes/touch.toml", cls.folder / "Zähne 🦷.toml")  # its name is in scene.json
        record(ROOT, BIN, cls.folder, cls.scene, 4)
        cls.log = cls.folder / "log"
        cls.rows = np.load(cls.log / "ticks.npy")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_each_column_reads_as_it_is_in_the_log(self):
        path = self.folder / "run.h5"
        export(self.log, path)
        with h5py.File(path, "r") as file:
            ticks = file["ticks"]
            self.assertEqual(sorted(ticks), sorted([*self.rows.dtype.names, "time_ns"]))
            for name in self.rows.dtype.names:
                self.assertEqual(ticks[name].dtype, self.rows[name].dtype, name)
                np.testing.assert_array_equal(ticks[name][:], self.rows[name], name)
                for attribute in ("units", "description", "valid"):
                    self.assertIsInstance(ticks[name].attrs[attribute], (str, bytes))
            self.assertEqual(ticks["position_mm"].attrs["units"], b"mm")
            self.assertIn(b"4 contact:", [code[:10] for code in ticks["flags"].attrs["codes"]])
            self.assertEqual(file.attrs["tick_ns"], 1_000_000)
            scene = file["scene"][()].decode("ascii")
            self.assertEqual(json.loads(scene), json.loads((self.log / "scene.json").read_text()))
            self.assertIn("Z\\u00e4hne \\ud83e\\uddb7.toml", scene)
            self.assertEqual(h5py.check_string_dtype(file["scene"].dtype).encoding, "ascii")
        self.assertLess(path.stat().st_size, (self.log / "ticks.npy").stat().st_size)

    def test_descriptions_have_their_codes_and_bits(self):
        path = self.folder / "codes.h5"
        export(self.log, path)
        with h5py.File(path, "r") as file:
            of = {name: column.attrs["description"].decode("ascii") for name, column in file["ticks"].items()}
            for name in ("flags", "command", "phase", "fault"):
                for code in file["ticks"][name].attrs["codes"]:
                    self.assertFalse(code.rstrip().endswith(b":"), code)
                    number, _, meaning = code.decode().partition(": ")
                    self.assertIn(number + (f" ({meaning})" if meaning else ""), of[name])
        self.assertIn("bits; 1 button 1 (pressed), 2 button 2 (pressed), 4 contact (", of["flags"])
        self.assertIn("code: why there is no force; 0 none, 1 stale_input (no report for 20 ms), ", of["fault"])
        self.assertFalse([text for text in of.values() if ", below" in text])

    @unittest.skipUnless(shutil.which("octave-cli"), "no octave-cli: apt-get install --no-install-recommends octave")
    def test_octave_loads_all_of_it(self):
        path, script = self.folder / "octave.h5", self.folder / "read.m"
        script.write_text("""s = load("-hdf5", argv(){1});
printf("%s\\n", s.scene);
for f = fieldnames(s.ticks)'
  v = s.ticks.(f{1});
  printf("%s %d %d", f{1}, size(v));
  if any(strcmp(class(v), {"int64", "uint64"})) v = typecast(v(:), "uint32"); end  % it prints no large numbers
  if isa(v, "double") printf(" %.17g", v); else printf(" %d", v); end
  printf("\\n");
end
""")
        export(self.log, path)
        done = subprocess.run(["octave-cli", "--no-gui", "--quiet", "--no-history", script, path], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        scene, *lines = done.stdout.splitlines()
        self.assertEqual(json.loads(scene), json.loads((self.log / "scene.json").read_text()))
        found = {line.split()[0]: line.split()[1:] for line in lines}
        self.assertEqual(sorted(found), sorted([*self.rows.dtype.names, "time_ns"]))
        for name in self.rows.dtype.names:
            values = self.rows[name]
            count = values.size // len(values)
            self.assertEqual(found[name][:2], [str(count), str(len(values))], name)
            halves = values.dtype.kind in "iu" and values.dtype.itemsize == 8
            kind = "<u4" if halves else values.dtype
            printed = np.array(found[name][2:], dtype=float if values.dtype.kind == "f" else "i8").astype(kind)
            np.testing.assert_array_equal(printed.view(values.dtype) if halves else printed, values.ravel(), name)

    def test_times_are_utc_or_monotonic(self):
        log, path = self.folder / "dated", self.folder / "dated.h5"
        shutil.copytree(self.log, log)
        start_ns, hour = self.rows["start_ns"].astype("i8"), 3600 * 10**9
        for utc_ns in (1795960147910139031, -hour, 2**31 * 10**9):  # now, 1969, 2038
            set_clock(log, (0, utc_ns))
            for options, offset, clock in (((), utc_ns, b"UTC"), (("--time", "monotonic"), 0, b"CLOCK_MONOTONIC")):
                self.assertEqual(export(log, path, *options), "")
                with h5py.File(path, "r") as file:
                    self.assertEqual(file["ticks/time_ns"].dtype, np.int64)
                    np.testing.assert_array_equal(file["ticks/time_ns"][:], start_ns + offset)
                    np.testing.assert_array_equal(file["ticks/start_ns"][:], self.rows["start_ns"])
                    self.assertEqual(file.attrs["clock"], clock)
        set_clock(log)
        self.assertEqual(export(log, path), f"kerf-record: {log}: no date: monotonic; recordings of this version have one\n")
        with h5py.File(path, "r") as file:
            np.testing.assert_array_equal(file["ticks/time_ns"][:], start_ns)
            self.assertEqual(file.attrs["clock"], b"CLOCK_MONOTONIC")

    def test_info_has_the_date(self):
        log, report = self.folder / "info", self.folder / "info.json"
        shutil.copytree(self.log, log)
        hour = 3600 * 10**9

        def date(*options, code=0):
            done = subprocess.run([BIN / "kerf-record", "info", log, "--report", report, *options], capture_output=True, text=True)
            self.assertEqual(done.returncode, code)
            return done.stdout.splitlines()[0].split(None, 1)[1], json.loads(report.read_text())["date"], done.stderr

        set_clock(log, (0, -hour))
        of_first = "1969-12-31T23:00:00.001000Z"
        self.assertEqual(date(), (of_first + ", of ticks in virtual time", of_first, ""))
        self.assertEqual(date("--from", "1500")[1], "1969-12-31T23:00:01.500000Z")
        set_clock(log, (7, hour + 7), (8, 9), (9, 10))
        words = f"kerf-record: {log}/clock.npy: UTC was set in the run, by -3600.000 s; dates are those of the clock as it was at the end\n"
        self.assertEqual(date(), ("1970-01-01T00:00:00.001000Z",) * 2 + (words,))
        (log / "clock.npy").write_bytes((log / "clock.npy").read_bytes()[:-1])
        self.assertEqual(date(code=1)[2], words + f"kerf-record: {log}/clock.npy: cut after 2 of 3 rows; copy it again\n")
        set_clock(log)
        self.assertEqual(date(), ("none", None, ""))

    def test_a_range_and_no_rows(self):
        path = self.folder / "part.h5"
        export(self.log, path, "--from", "1000", "--until", "3100")
        with h5py.File(path, "r") as file:
            self.assertEqual(file["ticks/tick"][:].tolist(), list(range(1000, 3101)))
        export(self.log, path, "--from", "999999")  # an old file is replaced
        with h5py.File(path, "r") as file:
            self.assertEqual(file["ticks/position_mm"].shape, (0, 3))

    def test_a_second_arm_has_a_group_of_its_own(self):
        two = self.folder / "two"
        shutil.copytree(self.log, two)
        rows = self.rows.copy()
        rows["commanded_force_n"] *= 0.5
        rows["crc32c"] = crc32c(rows)
        header = (self.log / "ticks.npy").read_bytes()[:4096]
        (two / "ticks-2.npy").write_bytes(header + rows.tobytes())
        manifest = json.loads((two / "manifest.json").read_text())
        (two / "manifest.json").write_text(json.dumps(manifest | {"arms": 2}))
        path = self.folder / "two.h5"
        scene = json.loads((two / "scene.json").read_text())
        (two / "scene.json").write_text(json.dumps(scene | {"second_device": scene["device"]}))
        self.assertIn("config_hash is ", export(two, path, code=1))  # the run had one device
        with h5py.File(path, "r") as file:
            for group, expected in (("ticks", self.rows), ("ticks_2", rows)):
                self.assertEqual(sorted(file[group]), sorted([*rows.dtype.names, "time_ns"]))
                for name in rows.dtype.names:
                    np.testing.assert_array_equal(file[group][name][:], expected[name], name)
        export(self.log, path)
        with h5py.File(path, "r") as file:
            self.assertNotIn("ticks_2", file)
        self.assertIn("has no arm 2, the run had one device", export(self.log, path, "--arm", "2", code=2))

    def test_what_cannot_be(self):
        self.assertIn("--hdf5 writes no .npy", export(self.log, self.log / "ticks.npy", code=2))
        self.assertIn("give the name of a file", export(self.log, "/dev/stdout", code=2))
        none = self.folder / "none.h5"
        self.assertIn("cannot be read", export(self.folder / "none", none, code=2))
        damaged = self.folder / "damaged"
        shutil.copytree(self.log, damaged)
        with open(damaged / "ticks.npy", "r+b") as file:
            file.seek(4096 + 700 * self.rows.dtype.itemsize + 100)
            file.write(b"x")
        self.assertIn("row 700 has a wrong checksum", export(damaged, none, code=1))
        self.assertIn("no.such", export(self.log, self.folder / "no.such/x.h5", code=2))
        shutil.copy(self.log / "ticks.npy", damaged)
        (damaged / "scene.json").write_bytes(b"\xff\xfe")
        self.assertIn("no JSON", export(damaged, none, code=1))
        self.assertEqual(list(self.folder.glob("*.new-*")) + list(self.folder.glob("none*")), [])

    def test_a_cut_log_gives_what_it_has_and_says_so(self):
        cut = self.folder / "cut"
        shutil.copytree(self.log, cut)
        with open(cut / "ticks.npy", "r+b") as file:
            file.truncate(4096 + 193 * self.rows.dtype.itemsize + 7)
        self.assertIn(f"cut after 193 of {len(self.rows)} rows", export(cut, self.folder / "cut.h5", code=1))
        with h5py.File(self.folder / "cut.h5", "r") as file:
            self.assertEqual(len(file["ticks/tick"]), 193)

    def test_a_killed_export_leaves_nothing(self):
        folder = self.folder / "killed"
        folder.mkdir()
        try:
            os.close(os.open(folder, os.O_TMPFILE | os.O_WRONLY))
        except OSError:
            self.skipTest("a file system whose files all have names")
        for i in range(12):
            export_it = subprocess.Popen([BIN / "kerf-record", "export", self.log, "--hdf5", folder / "x.h5"])
            time.sleep(i * 0.005)
            export_it.kill()
            export_it.wait()
            self.assertEqual([path for path in folder.iterdir() if path.name != "x.h5"], [])

    def test_a_full_disk_leaves_nothing(self):
        full = self.folder / "full"
        full.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", full], stderr=subprocess.DEVNULL).returncode:
            self.skipTest("no right to mount")
        try:
            self.assertIn("is the disk full?", export(self.log, full / "x.h5", code=2))
            self.assertEqual(list(full.iterdir()), [])
        finally:
            subprocess.run(["umount", full], check=True)


if __name__ == "__main__":
    try:
        import h5py
    except ImportError:
        print("skipped: no h5py")
        sys.exit(77)
    unittest.main()
