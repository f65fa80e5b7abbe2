# SPDX-License-Identifier: Apache-2.0
"""The MCAP of a recording, read by the readers of that format's own project (npm: package.json of mcap/).

    mcap_test.py ROOT BIN BUILD      BUILD: folder for the readers
Exit code 77: skipped, without node, npm or its registry."""
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import yaml

ROOT, BIN, BUILD = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(3))
sys.path.insert(0, str(ROOT / "tests/record"))
from lockstep_run import record, set_clock


def get_readers():
    """Whether they are there: installed once in BUILD."""
    BUILD.mkdir(parents=True, exist_ok=True)
    for file in ("package.json", "package-lock.json", "read.mjs"):
        shutil.copy(ROOT / "tests/record/mcap" / file, BUILD)
    if not shutil.which("npm"):
        return False
    return subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--prefer-offline"], cwd=BUILD,
                          stdout=subprocess.DEVNULL).returncode == 0


def export(log, to, *options, code=0):
    done = subprocess.run([BIN / "kerf-record", "export", log, "--mcap", to, *options], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stderr


def read(path, *seek):
    done = subprocess.run(["node", "read.mjs", path, *map(str, seek)], cwd=BUILD, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


class TestMcap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        record(ROOT, BIN, cls.folder, ROOT / "scenes/touch.toml", 4)
        cls.log = cls.folder / "log"
        cls.rows = np.load(cls.log / "ticks.npy")
        clock = np.load(cls.log / "clock.npy")
        cls.offset_ns = int((clock["utc_ns"] - clock["monotonic_ns"])[-1])

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_each_tick_reads_as_it_is_in_the_log(self):
        for options in ((), ("--unpacked",)):
            path = self.folder / f"run{len(options)}.mcap"
            export(self.log, path, *options)
            found = read(path)
            self.assertTrue(found["done"])
            self.assertGreater(found["statistics"]["chunks"], 1)
            ticks = found["ticks"]
            self.assertEqual([tick[0] for tick in ticks], self.rows["tick"].tolist())
            # null is NaN: before docking no place is known.
            places = np.array([tick[1] for tick in ticks], dtype=float)
            np.testing.assert_array_equal(places, self.rows["position_mm"])
            np.testing.assert_array_equal(np.array([tick[2] for tick in ticks], dtype=np.float32), self.rows["commanded_force_n"])
            self.assertEqual([int(tick[3]) for tick in ticks], self.rows["output_hash"].tolist())
            self.assertEqual([tick[4] for tick in ticks], self.rows["crc32c"].tolist())
            self.assertEqual([int(tick[5]) for tick in ticks], (self.rows["start_ns"].astype("i8") + self.offset_ns).tolist())

    def test_poses_and_wrenches_are_those_of_ros(self):
        path = self.folder / "views.mcap"
        export(self.log, path)
        found = read(path)
        channels = found["channels"]
        self.assertEqual({topic: channel["schema"] for topic, channel in channels.items()},
                         {"/kerf/tick": "kerf_msgs/msg/Tick", "/kerf/tip": "geometry_msgs/msg/PoseStamped",
                          "/kerf/force": "geometry_msgs/msg/WrenchStamped", "/tf": "tf2_msgs/msg/TFMessage"})
        pose = found["first"]["/kerf/tip"]
        known = self.rows[np.isfinite(self.rows["position_mm"][:, 0]) & (self.rows["tick"] % 10 == 0)]
        self.assertEqual(channels["/kerf/tip"]["count"], len(known))
        self.assertEqual(channels["/kerf/force"]["count"], np.count_nonzero(self.rows["tick"] % 10 == 0))
        self.assertEqual(pose["header"]["frame_id"], "scene")
        self.assertEqual(int(pose["header"]["stamp"]["sec"]) * 10**9 + int(pose["header"]["stamp"]["nanosec"]), int(known["start_ns"][0]) + self.offset_ns)
        np.testing.assert_array_equal([pose["pose"]["position"][axis] for axis in "xyz"], known["position_mm"][0] / 1000)
        wrench = found["first"]["/kerf/force"]
        self.assertEqual(wrench["header"]["frame_id"], "device")
        self.assertEqual(set(wrench["wrench"]), {"force", "torque"})

    def test_the_device_and_the_tip_have_frames_in_the_scene(self):
        path = self.folder / "frames.mcap"
        export(self.log, path)
        found = read(path)
        self.assertEqual(found["channels"]["/tf"]["count"], found["channels"]["/kerf/force"]["count"])
        scene = json.loads((self.log / "scene.json").read_text())
        (device,) = found["first"]["/tf"]["transforms"]  # before docking there is no tip
        self.assertEqual((device["header"]["frame_id"], device["child_frame_id"]), ("scene", "device"))
        self.assertEqual(found["first"]["/kerf/force"]["header"], device["header"] | {"frame_id": "device"})
        place, turn = device["transform"]["translation"], device["transform"]["rotation"]
        self.assertEqual([place[axis] for axis in "xyz"], [mm / 1000 for mm in scene["device"]["offset_mm"]])
        self.assertEqual(turn, {"x": 0, "y": 0, "z": 0, "w": 1})
        _, tip = found["last"]["/tf"]["transforms"]
        pose = found["last"]["/kerf/tip"]
        self.assertEqual((tip["header"], tip["child_frame_id"]), (pose["header"], "tip"))
        self.assertEqual(tip["transform"], {"translation": pose["pose"]["position"], "rotation": pose["pose"]["orientation"]})

    def test_it_is_of_the_profile_ros2(self):
        """The rules of https://mcap.dev/spec/registry, of rosbag2 for the quality of service, and of ROS 2 for messages' names."""
        path = self.folder / "profile.mcap"
        export(self.log, path)
        found = read(path)
        self.assertEqual((found["profile"], found["backwards"]), ("ros2", 0))
        for topic, channel in found["channels"].items():
            self.assertEqual((channel["encoding"], channel["schemaEncoding"]), ("cdr", "ros2msg"), topic)
            self.assertRegex(channel["schema"], r"^[a-z][a-z0-9_]*/msg/[A-Z][A-Za-z0-9]*$")
            lines = channel["definition"].splitlines()
            rules = [i for i, line in enumerate(lines) if line.startswith("===")]
            self.assertEqual({lines[i] for i in rules}, {"=" * 80} if rules else set())
            for i in rules:
                self.assertRegex(lines[i + 1], r"^MSG: [a-z][a-z0-9_]*/[A-Z][A-Za-z0-9]*$")
            self.assertEqual(list(channel["metadata"]), ["offered_qos_profiles"])
            (offered,) = yaml.safe_load(channel["metadata"]["offered_qos_profiles"])
            no_end = {"sec": 2**63 // 10**9, "nsec": (2**63 - 1) % 10**9}
            self.assertEqual(offered, {"history": 1, "depth": 100, "reliability": 1, "durability": 2, "deadline": no_end, "lifespan": no_end,
                                       "liveliness": 1, "liveliness_lease_duration": no_end, "avoid_ros_namespace_conventions": False})
        self.assertEqual(found["channels"]["/kerf/tick"]["definition"], (ROOT / "ros/kerf_msgs/msg/Tick.msg").read_text())

    def test_a_reader_seeks_by_the_index(self):
        path = self.folder / "seek.mcap"
        export(self.log, path)
        found = read(path, 3.5)
        self.assertEqual(found["ticks"][0][0], 3501)  # the first message is of tick 1
        self.assertLess(found["bytesRead"], path.stat().st_size)

    def times(self, log, *options, said=""):
        """Of the messages of a tick; of the first stamp of a tip."""
        path = self.folder / "times.mcap"
        self.assertEqual(export(log, path, *options), said and f"kerf-record: {said}\n")
        found = read(path)
        stamp = found["first"]["/kerf/tip"]["header"]["stamp"]
        return np.array([int(tick[5]) for tick in found["ticks"]]), stamp["sec"] * 10**9 + stamp["nanosec"]

    def test_times_are_utc_or_monotonic(self):
        log, path = self.folder / "dated", self.folder / "dated.mcap"
        shutil.copytree(self.log, log)
        start_ns = self.rows["start_ns"].astype("i8")
        tip_ns = int(start_ns[np.isfinite(self.rows["position_mm"][:, 0]) & (self.rows["tick"] % 10 == 0)][0])
        hour = 3600 * 10**9
        set_clock(log, (5, hour), (2 * 10**9, 2 * hour))  # UTC was set on by an hour, or nearly
        words = f"{log}/clock.npy: UTC was set in the run, by +3598.000 s; dates are those of the clock as it was at the end"
        for options, offset, said in (((), 2 * hour - 2 * 10**9, words), (("--time", "epoch"), 2 * hour - 2 * 10**9, words),
                                      (("--time", "monotonic"), 0, "")):
            ticks, tip = self.times(log, *options, said=said)
            np.testing.assert_array_equal(ticks, start_ns + offset)
            self.assertEqual(tip, tip_ns + offset)
        set_clock(log, (5, 2 * hour), (2 * 10**9, hour))  # and back
        ticks, _ = self.times(log, said=words.replace("+3598.000", "-3602.000"))
        np.testing.assert_array_equal(ticks, start_ns + hour - 2 * 10**9)
        for utc_ns, date in ((-hour, "1969-12-31T23:00:00.001000Z"), ((2**31 - 2) * 10**9, "2038-01-19T03:14:08.000000Z")):
            set_clock(log, (0, utc_ns))
            self.assertEqual(export(log, path, code=2), f"kerf-record: {log}/clock.npy: {date} is no date of an MCAP for ROS 2, "
                             "which has 1970 to 2038-01-19; give --time monotonic\n")
            self.assertFalse(path.exists())
        set_clock(log)
        ticks, _ = self.times(log, said=f"{log}: no date: monotonic; recordings of this version have one")
        np.testing.assert_array_equal(ticks, start_ns)

    def test_a_damaged_clock_is_told(self):
        log, path = self.folder / "unclear", self.folder / "unclear.mcap"
        shutil.copytree(self.log, log)
        clock = log / "clock.npy"
        whole = clock.read_bytes()
        clock.write_bytes(whole[:260] + b"x" + whole[261:])
        said = f"kerf-record: {log}: no date: monotonic\nkerf-record: {clock}: "
        self.assertEqual(export(log, path, code=1), said + "row 0 has a wrong checksum; copy it again\n")
        self.assertEqual([int(tick[5]) for tick in read(path)["ticks"]], self.rows["start_ns"].tolist())
        clock.unlink()
        self.assertIn("no such file, and the manifest names it; copy it again\n", export(log, path, code=1))
        export(log, path, "--time", "monotonic", code=1)  # it cannot be attached

    def test_sizes(self):
        plain, packed, part = (self.folder / f"{name}.mcap" for name in ("plain", "packed", "part"))
        export(self.log, plain, "--unpacked")
        export(self.log, packed)
        export(self.log, part, "--from", "1")
        npy = (self.log / "ticks.npy").stat().st_size
        files = sum(path.stat().st_size for path in self.log.rglob("*.*") if path.name != "ticks.npy")
        self.assertLess(plain.stat().st_size, 1.25 * npy + files)  # 100 times a second /tf, too
        self.assertLess(packed.stat().st_size, npy + files)
        self.assertLess(part.stat().st_size, npy)

    def test_the_other_files_are_attached(self):
        path = self.folder / "attached.mcap"
        export(self.log, path)
        bytes_of = {str(file.relative_to(self.log)): file.read_bytes() for file in self.log.rglob("*") if file.is_file()}
        bytes_of["ticks.npy.head"] = bytes_of.pop("ticks.npy")[:4096]
        self.assertEqual(read(path)["attachments"], {name: len(content) for name, content in bytes_of.items()})
        whole = path.read_bytes()
        for name, content in bytes_of.items():
            self.assertIn(content, whole, name)
        export(self.log, path, "--from", "1", "--until", "100")  # a part does not replay
        self.assertEqual(read(path)["attachments"], {})

    def test_a_file_that_cannot_be_read_is_left_out_with_a_line(self):
        log, path = self.folder / "torn", self.folder / "torn.mcap"
        shutil.copytree(self.log, log)
        export(log, path)
        (log / "scene.json").unlink()
        volume = min((log / "volumes").iterdir())
        volume.unlink()
        volume.symlink_to("nothing")
        why = "no file, or one that cannot be read, so the MCAP is without it; copy the recording again"
        no_place = f"kerf-record: {log / 'scene.json'}: no device.offset_mm, so the MCAP has no /tf; copy the recording again\n"
        told = export(log, path, code=1)
        self.assertIn(no_place, told)
        for file in (log / "scene.json", volume):
            self.assertIn(f"kerf-record: {file}: {why}\n", told)
        names = read(path)["attachments"]
        self.assertIn("manifest.json", names)
        self.assertNotIn("scene.json", names)
        self.assertNotIn(f"volumes/{volume.name}", names)
        # A part has no attachments; what the manifest repeats of the scene cannot be compared.
        self.assertIn("scene.json: cannot be read; ", export(log, path, "--from", "1", code=1))
        shutil.rmtree(log / "volumes")
        (log / "scene.json").write_bytes((self.log / "scene.json").read_bytes())
        export(log, path)  # a phantom has no need of them
        (log / "volumes").write_bytes(b"")
        self.assertIn(f"{log / 'volumes'}: Not a directory, so", export(log, path, code=1))

    @unittest.skipIf("KERF_SANITIZED" in os.environ, "the address sanitizer reserves more memory than the limit")
    def test_a_file_that_is_larger_than_that_of_any_recording_is_left_out(self):
        log, path = self.folder / "large", self.folder / "large.mcap"
        shutil.copytree(self.log, log)
        files = [log / "clock.npy", min((log / "volumes").iterdir())]
        for file in files:
            os.truncate(file, 1 << 40)  # on no block of the disk
        done = subprocess.run([BIN / "kerf-record", "export", log, "--mcap", path, "--time", "monotonic"], capture_output=True, text=True,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30)))
        self.assertEqual(done.returncode, 1, done.stderr)
        for file in files:
            self.assertIn(f"{file}: larger than that of any recording, so the MCAP is without it", done.stderr)
        names = read(path)["attachments"]
        self.assertNotIn("clock.npy", names)
        self.assertIn("scene.json", names)

    def test_the_header_of_a_cut_log_has_its_count(self):
        log, path = self.folder / "cut", self.folder / "cut.mcap"
        shutil.copytree(self.log, log)
        with open(log / "ticks.npy", "r+b") as file:
            header = file.read(4096)
            file.truncate(4096 + 700 * self.rows.itemsize + 100)
        self.assertIn(f"cut after 700 of {len(self.rows)} rows", export(log, path, code=1))
        self.assertIn(header, path.read_bytes())

    def test_what_cannot_be(self):
        self.assertIn("--mcap writes no .npy", export(self.log, self.log / "ticks.npy", code=2))
        self.assertIn("cannot be read", export(self.folder / "none", self.folder / "x.mcap", code=2))
        self.assertFalse((self.folder / "x.mcap").exists())
        done = subprocess.run([BIN / "kerf-record", "export", self.log], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (2, "kerf-record: export: as what? give --csv FILE, --mcap FILE or --hdf5 FILE\n"))
        empty = self.folder / "empty"
        shutil.copytree(self.log, empty)
        with open(empty / "ticks.npy", "r+b") as file:
            file.truncate(4096)
        path = self.folder / "empty.mcap"
        self.assertIn(f"cut after 0 of {len(self.rows)} rows", export(empty, path, code=1))
        self.assertEqual(read(path)["statistics"], {"messages": 0, "chunks": 0})


if __name__ == "__main__":
    if not get_readers():
        print("skipped: no node, no npm, or its registry does not answer")
        sys.exit(77)
    unittest.main()
