# SPDX-License-Identifier: Apache-2.0
"""A recording is replayed to the bit, and what is wrong with one is named: runs controller, emulator, recorder and replay.

    replay_test.py ROOT BIN LIBM     LIBM: a C library with other last bits (next_libm.cpp)"""
import gzip
import json
import math
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROOT, BIN, LIBM = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(3))
sys.path[:0] = [str(ROOT / "tests/record"), str(ROOT / "tests/support")]
import lack
from lockstep_run import crc32c, record

HEADER = 4096  # bytes before the first row


def replay(log, *options, code=0, libm=None):
    environment = {**os.environ, "LD_PRELOAD": str(libm)} if libm else None
    done = subprocess.run([BIN / "kerf-replay", log, *options], capture_output=True, text=True, env=environment)
    assert done.returncode == code, f"{done.returncode}: {done.stdout}{done.stderr}"
    if code == 2 or (code == 1 and not done.stdout):  # nothing was replayed
        assert done.stderr.count("\n") == 1, done.stderr
        return done.stderr
    return done.stdout


SCENE_OF_FILES = """
[[volume]]
file = "ball.nrrd"
iso = 0.45
[[tool]]
name = "bur"
shape = "stl"
file = "bur.stl"
[cut]
machinability_mm3_per_s_n = 40
[[material]]
name = "enamel"
felt_iso = 0.4
[hand]
script = "touch.toml"
"""


def write_ball(path, labels):
    """A ball of 10 mm that grows denser inwards, in 48 voxels of 0.25 mm a side; its upper half has label 1."""
    side = 48
    places = [(x, y, z) for z in range(side) for y in range(side) for x in range(side)]
    depth = [20 - sum((2 * c - side + 1) ** 2 for c in place) ** 0.5 / 2 for place in places]
    head = f"NRRD0004\ntype: %s\ndimension: 3\nspace: left-posterior-superior\nsizes: {side} {side} {side}\n" \
        "space directions: (0.25,0,0) (0,0.25,0) (0,0,0.25)\nendian: little\nencoding: raw\nspace origin: (0,0,0)\n\n"
    density = [max(0, min(65535, int(29000 + 4000 * inside))) for inside in depth]
    path.write_bytes((head % "uint16").encode() + struct.pack(f"<{len(density)}H", *density))
    if labels:
        path.with_name(path.stem + "-labels.nrrd").write_bytes(
            (head % "uint8").encode() + bytes(int(value > 0 and place[2] > 24) for place, value in zip(places, depth)))


class TestReplay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.run_folder = pathlib.Path(cls.temporary.name)
        cls.scene = cls.run_folder / "own.toml"
        cls.scene.write_text((ROOT / "scenes/phantom.toml").read_text())
        cls.report = record(ROOT, BIN, cls.run_folder, cls.scene, 2)
        cls.log = cls.run_folder / "log"
        cls.row = 496

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def setUp(self):
        self.copies = 0

    def copy(self):
        self.copies += 1
        copy = self.run_folder / f"{self.id().split('.')[-1]}-{self.copies}"
        shutil.copytree(self.log, copy)
        return copy

    def rows(self, log):
        return (log / "ticks.npy").read_bytes()

    def with_row(self, tick, offset, data):
        """A copy of the recording with other bytes in one row, and the checksum that fits them."""
        log = self.copy()
        rows = bytearray(self.rows(log))
        at = HEADER + (tick - 1) * self.row
        rows[at + offset:at + offset + len(data)] = data
        rows[at + self.row - 4:at + self.row] = struct.pack("<I", crc32c(rows[at + 8:at + self.row - 4]))
        (log / "ticks.npy").write_bytes(rows)
        return log

    def test_a_run_is_replayed_to_the_bit(self):
        found = replay(self.log)
        self.assertIn("each equal to the last bit", found)
        self.assertIn(self.report["output_hash"], found)
        self.assertIn(self.report["volume_hash"], found)
        self.assertGreater(self.report["removed_density_mm3"], 0.01)  # else it proves less

    def test_the_scalar_kernels_give_the_same_bits(self):
        self.assertIn(self.report["output_hash"], replay(self.log, "--kernels", "scalar"))
        self.assertIn("--kernels mmx: unknown; use one of avx512, ", replay(self.log, "--kernels", "mmx", code=2))

    def test_another_c_library_gives_the_same_bits(self):
        """The scene is made again, all samples of its tools and its volume, and must be the recorded one to the last bit."""
        shutil.rmtree((log := self.copy()) / "volumes")
        self.assertIn(self.report["output_hash"], replay(log, libm=LIBM))
        folder = self.run_folder / "meshes"
        folder.mkdir()
        record(ROOT, BIN, folder, ROOT / "scenes/fluted_bur.toml", 1)
        self.assertIn("each equal", replay(folder / "log", libm=LIBM))

    def test_a_flight_recording_replays_from_the_first_tick(self):
        """The device is silent for a while: a fault, at which the last second is kept."""
        folder = self.run_folder / "flight"
        folder.mkdir()
        (folder / "silence.toml").write_text('latches = "stale_input"\n[[fault]]\nkind = "silence"\nat_s = 1.4\nfor_s = 0.3\n')
        (folder / "scene.toml").write_text(self.scene.read_text())
        record(ROOT, BIN, folder, folder / "scene.toml", 2.5, flight=True, fault=folder / "silence.toml")
        (folder / "scene.toml").unlink()
        self.assertEqual([path.name[:4] for path in (folder / "flights").iterdir()], ["0000"])  # the start of the run is gone
        kept, = (folder / "flights").iterdir()
        manifest = json.loads((kept / "manifest.json").read_text())
        before = manifest["missed_before_start"]
        self.assertEqual(manifest["rows"], 1000)
        self.assertGreater(before, 200)
        found = replay(kept)
        self.assertIn(f"{before} ticks before the log, by their inputs\n1000 ticks, each equal to the last bit", found)
        # The log of the whole run says the same of these ticks.
        whole = self.rows(folder / "log")[HEADER + before * self.row:]
        self.assertEqual(self.rows(kept)[HEADER:], whole[:1000 * self.row])
        self.assertIn("11 ticks, each equal", replay(kept, "--from", str(before + 100), "--until", str(before + 110)))
        self.assertIn(f"begins at tick {before + 1}", replay(kept, "--until", str(before), code=2))
        # What if, and that once more.
        changed = ("--set", "force.stiffness_n_per_mm=0.3")
        again = folder / "again"
        self.assertIn(f"{before} ticks before", replay(kept, *changed, "--out", again))
        self.assertIn("1000 ticks, each equal", replay(again))
        self.assertNotEqual(self.rows(again)[HEADER:], self.rows(kept)[HEADER:])
        (changed_in_place := next((again / "inputs").iterdir())).write_bytes(b"")  # a copy, not the same file
        self.assertIn("1000 ticks, each equal", replay(kept))
        self.assertEqual(changed_in_place.stat().st_nlink, 1)
        # No link leads out of the folder, and what is refused leaves no log.
        (folder / "linked").mkdir()
        (folder / "victim").mkdir()
        (folder / "linked/inputs").symlink_to(folder / "victim")
        self.assertIn("linked/inputs: there is one; choose another --out", replay(kept, "--out", folder / "linked", code=2))
        self.assertEqual([*(folder / "victim").iterdir()], [])
        self.assertEqual([path.name for path in (folder / "linked").iterdir()], ["inputs"])
        (kept / "manifest.json").write_text(json.dumps({**manifest, "missed_before_start": before + 1}))
        self.assertIn(f"{before + 1} ticks are before the log, and it begins at tick {before + 1};", replay(kept, code=1))
        (kept / "manifest.json").write_text(json.dumps(manifest))
        # Watched from its first tick on, with the volumes of then.
        _, watched, told = self.watch(kept)
        told(" ", "paused")
        self.assertIn(f"tick {before + 1} of {before + 1000}", told("1g", "tick"))
        self.assertIn(f"tick {before + 7} of", told(f"{before + 7}g", "tick"))
        watched.communicate("q", timeout=20)
        # Inputs that are not those of the run: missing, cut, longer, another array; or sound and wrong.
        inputs, = (kept / "inputs").iterdir()
        sound = gzip.decompress(inputs.read_bytes())
        for damaged in (inputs.read_bytes()[:-20], gzip.compress(sound[:-60]), gzip.compress(sound + b"x"), gzip.compress(sound[256:]), b""):
            inputs.unlink()
            inputs.write_bytes(damaged)
            self.assertIn("inputs from tick 1 on are missing or damaged", replay(kept, code=1))
        wrong = bytearray(sound)
        wrong[256 + 60 * (before - 1)] ^= 64  # an encoder count of the last of these ticks
        inputs.write_bytes(gzip.compress(wrong))
        self.assertIn(f"tick {before + 1} (", replay(kept, code=1))
        inputs.unlink()
        self.assertIn("inputs from tick 1 on are missing", replay(kept, code=1))
        (kept / "inputs").rmdir()
        self.assertIn("inputs: missing, and manifest.json lists its files", replay(kept, code=1))

    def test_the_scene_file_may_have_gone(self):
        text = self.scene.read_text()
        self.scene.unlink()
        try:
            self.assertIn("each equal", replay(self.log))
        finally:
            self.scene.write_text(text)

    def test_the_files_of_the_scene_may_have_gone(self):
        """A volume with labels and a mesh, and a volume without settings for which the scene's materials are proposed."""
        folder = self.run_folder / "files"
        folder.mkdir()
        (folder / "scene.toml").write_text(SCENE_OF_FILES)
        shutil.copy(ROOT / "scenes/burs/fluted.stl", folder / "bur.stl")
        shutil.copy(ROOT / "scenes/hands/touch.toml", folder)
        write_ball(folder / "ball.nrrd", labels=True)
        write_ball(folder / "scan.nrrd", labels=False)
        for name, options in (("own", ()), ("proposed", ("--volume", folder / "scan.nrrd"))):
            (folder / name).mkdir()
            report = record(ROOT, BIN, folder / name, folder / "scene.toml", 2, *options)
            self.assertGreater(report["removed_mm3"], 1e-3)
            (folder / name / "hash").write_text(report["output_hash"])
        kept = folder / "own/log/volumes"
        self.assertEqual(len(list(kept.iterdir())), 2)
        for file in folder.iterdir():
            if file.is_file():
                file.unlink()
        for name in ("own", "proposed"):
            self.assertIn((folder / name / "hash").read_text(), replay(folder / name / "log"))
        again = folder / "again"
        self.assertIn("peak force", replay(folder / "own/log", "--set", "force.stiffness_n_per_mm=0.2", "--out", again))
        self.assertIn("each equal", replay(again))
        # Another window or scale needs the file itself.
        for key, file in (("volume.window=[0, 50000]", "ball.nrrd: no such file"), ("tool.scale=0.9", "bur.stl: no such STL file")):
            self.assertIn(file, replay(folder / "own/log", "--set", key, code=2))
        labels, density = sorted(kept.iterdir(), key=lambda path: len(path.name), reverse=True)
        sound = density.read_bytes()
        for damaged in (sound[:100], sound[:-12], gzip.compress(gzip.decompress(sound) + b"x"),
                        gzip.compress(gzip.decompress(sound)[:-1] + b"x"), labels.read_bytes(), b""):
            density.write_bytes(damaged)
            self.assertIn("copy the recording again", replay(folder / "own/log", code=1))
        density.unlink()
        self.assertIn("ball.nrrd", replay(folder / "own/log", code=2))

    def test_recorded_volumes_and_meshes_are_checked_as_files_are(self):
        log = self.copy()
        scene = json.loads((log / "scene.json").read_text())
        volume, tool = scene["volumes"][0], scene["tools"][0]

        def refused(why, **changed):
            (log / "scene.json").write_text(json.dumps({**scene, **changed}))
            for options in ((), ("--set", "force.friction=0.1")):
                self.assertIn(why, replay(log, *options, code=1))

        mesh = {"points_mm": [], "triangles": []}
        refused("loaded from", volumes=[])
        refused("loaded from", volumes=[volume] * 9)
        refused("above the limit", volumes=[{**volume, "grid": [4096, 4096, 4096]}])
        refused("mm from the origin", volumes=[{**volume, "pose": {**volume["pose"], "position_mm": [1e300, 0, 0]}}])
        refused("no rotation", volumes=[{**volume, "pose": {**volume["pose"], "orientation": [0, 0, 0, 0]}}])
        refused("loaded from", tools=[{**tool, "mesh": {**mesh, "triangles": [[0, 1, 2]]}}])
        (log / "scene.json").write_text(json.dumps(scene))
        # A label that stands for no material, under the hash of its content.
        density, labels = (gzip.decompress((log / f"volumes/{volume['density_hash']}{part}.npy.gz").read_bytes())[128:]
                           for part in ("", "-labels"))
        value = 0xCBF29CE484222325
        for byte in density + (labels := labels[:-1] + b"\xc8"):
            value = (value ^ byte) * 0x100000001B3 & (1 << 64) - 1
        for part, data in (("", density), ("-labels", labels)):
            path = log / f"volumes/{volume['density_hash']}{part}.npy.gz"
            (log / f"volumes/{value:016x}{part}.npy.gz").write_bytes(gzip.compress(gzip.decompress(path.read_bytes())[:128] + data, 1))
        refused("label 200 stands for no material", volumes=[{**volume, "density_hash": f"{value:016x}"}])

    def test_a_replay_writes_only_below_out(self):
        out, elsewhere = self.run_folder / "linked", self.run_folder / "elsewhere"
        out.mkdir(), elsewhere.mkdir()
        (out / "volumes").symlink_to(elsewhere)
        self.assertIn("no folder of its own", replay(self.log, "--out", out, code=2))
        self.assertEqual(list(elsewhere.iterdir()), [])

    def test_another_input_is_found_at_its_tick(self):
        encoder = struct.unpack_from("<i", self.rows(self.log), HEADER + 1500 * self.row + 264)[0]
        found = replay(self.with_row(1501, 264, struct.pack("<i", encoder + 3)), code=1)
        self.assertRegex(found, r"tick 1501 \(1\.501 s\), pose: encoder_counts\[0\] was -?\d+, is -?\d+")

    def test_another_output_is_found_at_its_tick_and_stage(self):
        log = self.with_row(1600, 172, struct.pack("<I", 12345))  # removed
        self.assertIn("tick 1600 (1.600 s), cut: removed was 12345, is ", replay(log, code=1))
        self.assertIn("each equal", replay(log, "--from", "1601", code=1))  # the manifest's figures are of another row
        self.assertIn("1599 ticks, each equal", replay(log, "--until", "1599"))
        self.assertIn("100 ticks, each equal", replay(log, "--from", "1500", "--until", "1599"))
        self.assertIn("no tick would be compared", replay(log, "--from", "1600", "--until", "1599", code=2))
        self.assertIn("the recording ends at tick ", replay(log, "--from", "999999", code=1))
        self.assertIn("--until", replay(log, "--until", "0", code=2))

    def test_what_if(self):
        out, plot, report = (self.run_folder / name for name in ("soft", "soft.svg", "soft.json"))
        found = replay(self.log, "--set", "force.stiffness_n_per_mm=0.2", "--out", out, "--plot", plot, "--report", report)
        self.assertRegex(found, r"peak force +\d+\.\d+ +\d+\.\d+ N")
        self.assertNotIn(self.report["output_hash"], found)
        self.assertIn("each equal", replay(out))  # a replay is a recording like any other
        self.assertTrue(plot.read_text().startswith("<?xml"))
        self.assertEqual(json.loads(report.read_text())["ticks"], len(self.rows(self.log)[HEADER:]) // self.row)
        self.assertIn(f"{out}/ticks.npy: holds a recording; ", replay(self.log, "--out", out, code=2))
        self.assertIn("places of the tool", replay(self.log, "--numeric", "double"))
        self.assertIn("did you mean", replay(self.log, "--set", "force.stifness_n_per_mm=1", code=2))
        self.assertIn("places of the tool", replay(self.log, "--scene", ROOT / "scenes/touch.toml"))
        self.assertIn("the ticks of the recording are of 1000 Hz", replay(self.log, "--set", "servo.rate_hz=2000", code=2))
        self.assertIn("the counts of the recording are of omni",
                      replay(self.log, "--set", "device.personality=falcon", code=2))

    def test_another_law_is_named_or_refused_with_the_known_names(self):
        for name, word in (("--law", "coupling"), ("--estimator", "difference"), ("--stabiliser", "passivity")):
            self.assertIn("places of the tool", replay(self.log, name, word))
        yours = "; yours is in the programs built with it (docs/own-law.md)"
        for name, key, known in (("--law", "force.law", f': this program has no force law{yours}; none: "coupling"'),
                                 ("--estimator", "servo.velocity", f"; known: difference, foaw{yours}"),
                                 ("--stabiliser", "force.stabiliser",
                                  f'; known: energy_bounding, passivity{yours}; none: "none"')):
            self.assertEqual(replay(self.log, name, "x", code=2), f"kerf-replay: {name} x is unknown{known}\n")
            self.assertEqual(replay(self.log, "--set", f"{key}=x", code=2),
                             f'kerf-replay: {self.scene}: --set {key} = "x" is unknown{known}\n')
        self.assertIn('--set servo.velocity.name = "x" is unknown', replay(self.log, "--estimator", '{name = "x"}', code=2))

    def test_a_recorded_setting_of_a_law_goes_with_the_law(self):
        folder = self.run_folder / "set"
        folder.mkdir()
        record(ROOT, BIN, folder, self.scene, 1, "--set", "servo.velocity=difference", "--set", "servo.velocity.tau_ms=1")
        self.assertIn("each equal", replay(folder / "log"))
        self.assertIn("places of the tool", replay(folder / "log", "--estimator", "foaw"))

    def test_other_voxels_are_counted_by_their_own_size(self):
        found = replay(self.log, "--set", "volume.size=[128,128,80]", "--out", out := self.run_folder / "coarse")
        recorded_mm3, replayed_mm3 = map(float, re.search(r"removed density +([0-9.]+) +([0-9.]+) mm3", found).groups())
        volume, = json.loads((out / "scene.json").read_text())["volumes"]
        voxel_mm3 = math.prod(volume["spacing_mm"])
        self.assertGreater(voxel_mm3, 4 * math.prod(json.loads((self.log / "scene.json").read_text())["volumes"][0]["spacing_mm"]))
        rows = self.rows(out)
        removed = sum(struct.unpack_from("<I", rows, at + 172)[0] for at in range(HEADER, len(rows), self.row)) / 65535 * voxel_mm3
        self.assertGreater(removed, 0.01)
        self.assertAlmostEqual(recorded_mm3, self.report["removed_density_mm3"], 3)
        self.assertAlmostEqual(replayed_mm3, removed, 3)

    def test_a_recording_of_a_replay_has_the_figures_of_the_replay(self):
        was = json.loads((self.log / "manifest.json").read_text())
        for name, options, same in (("same", (), True), ("softer", ("--set", "force.stiffness_n_per_mm=0.2"), True),
                                    ("coarser", ("--set", "volume.size=[128,128,80]"), False),
                                    ("shorter", ("--until", "1500"), True)):
            out, report = self.run_folder / name, self.run_folder / f"{name}.json"
            replay(self.log, *options, "--out", out)
            subprocess.run([BIN / "kerf-record", "info", out, "--report", report], check=True, stdout=subprocess.DEVNULL)
            manifest, figures = json.loads((out / "manifest.json").read_text()), json.loads(report.read_text())
            self.assertEqual((out / "clock.npy").read_bytes(), (self.log / "clock.npy").read_bytes())
            self.assertEqual(manifest["summary"] | {"date": figures["date"]}, figures)
            self.assertEqual(figures["end_reason"], "replayed")
            self.assertEqual(figures["rows"], manifest["rows"])
            volume, = json.loads((out / "scene.json").read_text())["volumes"]
            self.assertEqual([manifest["volumes"][0][key] for key in ("size_vox", "spacing_mm")],
                             [volume["grid"], volume["spacing_mm"]])
            self.assertEqual(manifest["volumes"] == was["volumes"], same)
            self.assertEqual(figures["peak_force_n"] == was["summary"]["peak_force_n"], name == "same")

    def test_gaps_and_cuts(self):
        log = self.copy()
        rows = self.rows(log)
        at = HEADER + 700 * self.row
        (log / "ticks.npy").write_bytes(rows[:at] + rows[at + 9 * self.row:])
        self.assertIn("stopped: ticks 701 to 709 were not recorded", replay(log, code=1))
        (log / "ticks.npy").write_bytes(rows[:at] + rows[at + self.row:])
        self.assertIn("stopped: tick 701 was not recorded", replay(log, code=1))
        (log / "ticks.npy").write_bytes(rows[:at + 100])
        cut = replay(log, code=1)
        self.assertIn("700 ticks, each equal", cut)
        self.assertRegex(cut, r"stopped: the log is cut after 700 of \d+ rows")
        (log / "ticks.npy").write_bytes(rows[:HEADER])
        self.assertIn("0 rows; nothing to replay", replay(log, code=1))
        (log / "ticks.npy").write_bytes(rows[:at + 50] + b"x" + rows[at + 51:])
        sound = replay(log, code=1)
        self.assertIn("700 ticks, each equal", sound)
        self.assertIn("row 700 has a wrong checksum", sound)
        (log / "ticks.npy").write_bytes(rows[:-50] + b"xyz" + rows[-47:])
        last = (len(rows) - HEADER) // self.row - 1
        self.assertIn("5 ticks, each equal", replay(log, "--until", "5"))
        sound = replay(log, code=1)
        self.assertIn(f"{last} ticks, each equal", sound)
        self.assertIn(f"row {last} has a wrong checksum", sound)

    def watch(self, log, *options):
        name = f"watched-{self.run_folder.name}"
        watched = subprocess.Popen([BIN / "kerf-replay", log, "--watch", name, *options], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, text=True)
        self.addCleanup(watched.kill)

        def told(keys, words):
            """Presses keys, and returns the first line with these words."""
            watched.stdin.write(keys)
            watched.stdin.flush()
            for line in watched.stdout:
                if words in line:
                    return line
            raise AssertionError(f"{words}: not said after {keys!r}")
        return name, watched, told

    def ticks(self, log):
        """Of each row: output hash by place, as all rows in order."""
        out = log.parent / f"{log.name}.csv"
        subprocess.run([BIN / "kerf-record", "export", log, "--csv", out], check=True)
        head, *lines = out.read_text().splitlines()
        column = head.split(",").index("output_hash")
        return [line.split(",")[column] for line in lines]

    def test_a_watched_replay_is_a_run_that_can_be_paused_stepped_and_sought(self):
        was = self.ticks(self.log)
        name, watched, told = self.watch(self.log)
        told(" ", "paused")
        out = self.run_folder / "seen"
        recorder = subprocess.Popen([BIN / "kerf-recorder", "--wait", "300", "--name", name, "--out", out], stdout=subprocess.DEVNULL)
        while not (out / "manifest.json").exists():
            time.sleep(0.01)
        self.assertIn("tick 1000 of", told("1000g", "tick"))
        self.assertIn("tick 1001 of", told(".", "tick"))
        self.assertIn("tick 1 of", told("b", "tick"))
        self.assertIn("tick 1001 of", told("f", "tick"))
        self.assertIn(f"tick {len(was)} of", told("999999999999999999999999g", "tick"))
        self.assertIn("tick 1990 of", told("1990g", "tick"))
        self.assertIn("speed 64", told("++++++", "speed 64"))
        self.assertIn(f"tick {len(was)} of", told(" ", f"tick {len(was)}"))
        watched.communicate("q", timeout=20)
        self.assertEqual(watched.returncode, 0)
        self.assertEqual(recorder.wait(timeout=20), 0)
        seen = self.ticks(out)[-(6 + len(was) - 1990):]
        self.assertEqual(seen, [was[tick - 1] for tick in [1000, 1001, 1, 1001, len(was), *range(1990, len(was) + 1)]])

    def test_a_watched_replay_takes_keys_on_the_way_to_a_tick(self):
        """All keys are there before the replay is: what it prints does not depend on time."""
        def printed(keys, *options):
            file = self.run_folder / "keys"
            file.write_text(keys)
            with file.open() as lines:
                done = subprocess.run([BIN / "kerf-replay", self.log, "--watch", f"keyed-{self.run_folder.name}", *options],
                                      stdin=lines, capture_output=True, text=True, timeout=60)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            return done.stdout

        self.assertNotIn("tick 1990 of", printed(" 1990gq"))
        self.assertNotIn("tick 1990 of", printed("q", "--from", "1990"))
        _, watched, told = self.watch(self.log)
        told(" ", "paused")
        self.assertIn("tick 1501 of", told("1500g.", "tick 1501"))
        self.assertIn("tick 501 of", told("1gf.b1500gb.", "tick 501"))
        watched.communicate("q", timeout=20)
        self.assertEqual(watched.returncode, 0)

    def test_ticks_are_sent_as_json_and_a_receiver_may_go(self):
        if not lack.has_network():
            print("skipped: " + lack.NETWORK)
            return
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(20)
        name, watched, told = self.watch(self.log)
        told(" ", "paused")
        sender = subprocess.Popen([BIN / "kerf-record", "live", "--name", name, "--udp", str(receiver.getsockname()[1])],
                                  stdout=subprocess.PIPE, text=True)
        self.assertIn("sends to", sender.stdout.readline())
        for tick in (40, 1500):  # before docking, and in contact
            told(f"{tick}g", "tick")
            sent = json.loads(receiver.recv(65536))
            while sent["kerf"]["tick"] != tick:  # those before the pause
                sent = json.loads(receiver.recv(65536))
            self.assertAlmostEqual(sent["timestamp"], sent["kerf"]["start_ns"] * 1e-9, 6)
            self.assertEqual("position_mm" in sent["kerf"], tick > 40)  # no NaN
            self.assertNotIn("output_hash", sent["kerf"])
        self.assertGreater(sent["kerf"]["penetration_mm"], 0)
        self.assertEqual(len(sent["kerf"]["plane_normal"]), 9)
        receiver.close()
        for _ in range(3):
            told(".", "tick")
        watched.communicate("q", timeout=20)
        self.assertRegex(sender.communicate(timeout=20)[0], r"^\d ticks sent, [23] not taken, 0 lost\n$")
        for wrong, why in (("127.0.0.1:99999", "no port"), ("no.such.host.invalid:1", "no.such.host.invalid")):
            done = subprocess.run([BIN / "kerf-record", "live", "--name", name, "--udp", wrong], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(why, done.stderr)

    def test_a_watched_replay_stops_before_a_gap_and_refuses_what_it_cannot_do(self):
        log = self.copy()
        rows = self.rows(log)
        at = HEADER + 700 * self.row
        (log / "ticks.npy").write_bytes(rows[:at] + rows[at + 9 * self.row:])
        _, watched, told = self.watch(log, "--from", "690")
        self.assertIn("tick 700 of 700", told("", "paused"))
        out, _ = watched.communicate("q", timeout=20)
        self.assertIn("tick 701 is not in the recording", out)
        self.assertEqual(watched.returncode, 1)
        self.assertIn("--watch: compares nothing", replay(self.log, "--watch", "x", "--out", "y", code=2))
        self.assertIn("'a/b'", replay(self.log, "--watch", "a/b", code=2))

    def test_a_changed_scene_is_named_first(self):
        log = self.copy()
        scene = json.loads((log / "scene.json").read_text())
        for key, value, place in [("force", {**scene["force"], "stiffness_n_per_mm": 0.123}, "force.stiffness_n_per_mm is 0.123 in "),
                                  ("volumes", [{**scene["volumes"][0], "density_hash": "00"}], 'the content of volumes[0] has hash "00" in')]:
            (log / "scene.json").write_text(json.dumps({**scene, key: value}))
            self.assertIn(place, replay(log, code=1))
        del scene["source"]
        (log / "scene.json").write_text(json.dumps(scene))
        self.assertIn("what the scene was loaded from", replay(log, code=1))
        (log / "scene.json").write_text("[" * 100000)
        self.assertIn("scene.json", replay(log, code=1))

    def test_no_recording(self):
        self.assertIn("give the folder of a recording", replay(self.run_folder / "none", code=2))
        self.assertIn(f"give {self.log}", replay(self.run_folder, code=2))
        log = self.copy()
        manifest = json.loads((log / "manifest.json").read_text())
        (log / "manifest.json").write_text(json.dumps({**manifest, "missed_before_start": 12}))
        self.assertIn("the first 12 ticks of the run are not in it", replay(log, code=1))
        (log / "manifest.json").write_text(json.dumps({**manifest, "missed_before_start": 1}))
        self.assertIn("the first tick of the run is not in it", replay(log, code=1))
        self.assertTrue(replay(self.log, "--until", "1").startswith("1 tick, equal to the last bit\n"))


if __name__ == "__main__":
    unittest.main()
