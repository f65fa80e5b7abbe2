# SPDX-License-Identifier: Apache-2.0
"""`import kerf` against the programs: the same rows, voxels, maps, to the last bit; what a wrong argument, law, array or signal does.

    module_test.py ROOT BIN        with PYTHONPATH=build/release/python
Exit code 77: skipped, for want of NumPy."""
import concurrent.futures
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

try:
    import numpy as np
except ImportError as lack:
    print(f"skipped: {lack}; apt-get install python3-numpy")
    sys.exit(77)
ROOT, BIN = (pathlib.Path(path).resolve() for path in (sys.argv.pop(1), sys.argv.pop(1)))
sys.path.insert(0, str(ROOT / "tests/examples"))
import kerf  # noqa: E402
import lockstep  # noqa: E402

COUPLING = {"servo": {"numeric": "double"}, "force": {"stiffness_n_per_mm": 0.4, "damping_ns_per_mm": 0.0}}


def spring(d):
    return 0.4 * d.spring_mm


class Case(unittest.TestCase):
    def setUp(self):
        home = tempfile.TemporaryDirectory()
        self.addCleanup(home.cleanup)
        self.home = pathlib.Path(home.name)

    def refused(self, words, what, *arguments, **named):
        with self.assertRaises(kerf.Error) as caught:
            what(*arguments, **named)
        line = str(caught.exception)
        self.assertNotIn("\n", line)
        self.assertIn(words, line)
        return caught.exception

    def same_as_programs(self, name, devices=("omni",), faults=None, **tables):
        scene = ROOT / "scenes" / f"{name}.toml"
        settings = [f"{table}.{key}={json.dumps(value)}" for table, keys in tables.items() for key, value in keys.items()]
        out = self.home / f"{name}-{devices[0]}"
        faults = (faults, None)
        report = lockstep.run(BIN, out, scene, 1.5, devices, settings, faults)
        log = kerf.Log(out / "log")
        if len(devices) == 1:
            tables = {**tables, "device": {**tables.get("device", {}), "personality": devices[0]}}
        loop = kerf.Loop(kerf.Scene(name, **tables), faults=faults[0])
        rows = loop.run(ticks=len(log))
        theirs = log.ticks if log.second is None else np.stack([log.ticks, log.second], axis=1)
        self.assertEqual(rows.dtype, log.ticks.dtype)
        if faults[0]:  # counts of the loop's driver, which no servo has
            theirs = theirs.copy()
            for column in ("lost_packets", "crc32c"):
                theirs[column] = rows[column]
        self.assertEqual(rows.tobytes(), np.ascontiguousarray(theirs).tobytes())
        self.assertEqual(loop.output_hash, int(log.ticks[-1]["output_hash"]))
        header, _, data = (out / "final.nrrd").read_bytes().partition(b"\n\n")
        if b"encoding: raw" in header and len(loop.scene.volumes) == 1:
            self.assertEqual(loop.volume().tobytes(), data)
        return report


class TestRuns(Case):
    def test_each_row_is_that_of_the_programs(self):
        self.same_as_programs("touch", force={"stiffness_n_per_mm": 0.6})
        self.same_as_programs("phantom")
        self.same_as_programs("touch", ("omega",))
        self.same_as_programs("wall", faults=ROOT / "hil/faults/lost_reports.toml")

    def test_two_arms(self):
        self.same_as_programs("two_arms", ("omni", "touch"))

    def test_steps_and_parts_are_one_run(self):
        whole, steps = kerf.Loop("touch"), kerf.Loop("touch")
        rows = whole.run(seconds=0.3)
        self.assertEqual(len(rows), 300)
        self.assertTrue(all(steps.step().tobytes() == row.tobytes() for row in rows[:100]))
        part = steps.run(ticks=200, every=10)
        self.assertEqual(part.tobytes(), rows[109::10].tobytes())
        self.assertEqual(len(steps.run(ticks=5, every=0)), 0)
        self.assertEqual(steps.tick, 305)
        self.assertEqual(steps.last.tobytes(), whole.run(ticks=5)[-1].tobytes())

    def test_a_state_brings_servo_and_hand_back(self):
        scene = kerf.Scene("phantom")
        loop, other = kerf.Loop(scene), kerf.Loop(scene)
        loop.run(ticks=1200)
        state = loop.snapshot()
        first = loop.run(ticks=1500)
        voxels = loop.volume().copy()
        self.assertGreater(first["removed"].sum(), 0)
        loop.restore(state)
        self.assertEqual((loop.tick, state.tick), (1200, 1200))
        self.assertFalse((loop.volume() == voxels).all())
        for again in (loop, other):
            again.restore(state)
            self.assertEqual(again.run(ticks=1500).tobytes(), first.tobytes())
            self.assertTrue((again.volume() == voxels).all())
        self.refused("another scene", kerf.Loop("touch").restore, state)
        self.refused("another hand", kerf.Loop(scene, hand="touch").restore, state)

    def test_a_hand_that_is_led_comes_back_too(self):
        loop = kerf.Loop("touch", hand=self.still_hand())
        loop.run(seconds=3)
        self.assertTrue(loop.hand_ended())
        loop.lead((1, 2, 3))
        loop.run(ticks=100)
        state = loop.snapshot()
        loop.lead((2, 2, 3))
        rows = loop.run(ticks=100)
        loop.restore(state)
        loop.lead((2, 2, 3))
        self.assertEqual(loop.run(ticks=100).tobytes(), rows.tobytes())

    def still_hand(self):
        hand = self.home / "still.toml"
        hand.write_text("start_mm = [0, 8, 0]\n[[step]]\nhold = 0.01\n")
        return hand

    def test_commands(self):
        loop = kerf.Loop("touch")
        loop.run(ticks=1000)
        self.assertTrue(loop.apply("select_tool", 1))
        self.assertFalse(loop.apply("reset"))  # a second one in a tick
        loop.run(ticks=10)
        self.assertEqual(loop.last["active_tool"], 1)
        self.assertFalse(loop.apply("undo"))
        self.refused("apply: no command fly; they are select_tool, hold", loop.apply, "fly")

    def test_loops_in_threads_have_the_bits_of_one(self):
        scene = kerf.Scene("touch")
        alone = kerf.Loop(scene).run(ticks=1500)
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            for rows in pool.map(lambda _: kerf.Loop(scene).run(ticks=1500), range(8)):
                self.assertEqual(rows.tobytes(), alone.tobytes())

    def test_one_loop_has_one_thread(self):
        loop = kerf.Loop("touch")
        other = threading.Thread(target=loop.run, kwargs={"ticks": 30000, "every": 0})
        other.start()
        while loop.tick == 0:
            time.sleep(0.001)
        self.refused("busy in another thread", loop.step)
        other.join()

    def test_a_child_by_fork_has_the_same_bits(self):
        scene = kerf.Scene("touch")
        loop = kerf.Loop(scene)
        loop.run(ticks=500)
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                loop.run(ticks=500)
                os.write(writer, f"{loop.output_hash} {kerf.Loop(kerf.Scene('touch')).run(ticks=1000)['output_hash'][-1]}".encode())
            finally:
                os._exit(0)
        os.close(writer)
        loop.run(ticks=500)
        self.assertEqual(os.read(reader, 100).decode(), f"{loop.output_hash} {loop.output_hash}")
        os.waitpid(child, 0)


class TestViews(Case):
    def test_a_volume_is_a_view_that_outlives_its_loop(self):
        loop = kerf.Loop("phantom")
        view = loop.volume(0)
        before = view.copy()
        self.assertEqual((view.dtype, view.ndim, view.flags.writeable), (np.uint16, 3, False))
        with self.assertRaises(ValueError):
            view[0, 0, 0] = 1
        loop.run(seconds=3, every=0)
        self.assertFalse((view == before).all())
        after = view.copy()
        del loop
        self.assertTrue((view == after).all())
        self.refused("volume 7: the scene has 1; they count from 0", kerf.Loop("touch").volume, 7)

    def test_a_scene_from_voxels(self):
        density = np.zeros((20, 30, 40), np.uint16)
        density[3:17, 3:15, 3:37] = 40000
        scene = kerf.Scene.of_voxels(density, spacing_mm=0.2)
        loop = kerf.Loop(scene)
        self.assertTrue((loop.volume() == density).all())
        self.assertEqual(loop.grid()["spacing_mm"], [0.2, 0.2, 0.2])
        density[:] = 0
        self.assertGreater(kerf.Loop(scene).volume().max(), 0)
        voxels = kerf.Scene.of_voxels
        self.refused("density: float64 numbers; give uint16", voxels, np.zeros((4, 4, 4)))
        self.refused("density: >u2 numbers; give uint16", voxels, np.zeros((4, 4, 4), ">u2"))
        self.refused("density: 2 axes", voxels, np.zeros((4, 4), np.uint16))
        self.refused("density: not in C order", voxels, np.zeros((4, 5, 6), np.uint16, order="F"))
        self.refused("density: list", voxels, [[[1]]])
        self.refused("voxels", voxels, np.zeros((0, 4, 4), np.uint16))
        self.refused("spacing", voxels, np.zeros((4, 4, 4), np.uint16), spacing_mm=float("nan"))


class TestLaws(Case):
    def test_a_spring_in_python_is_the_coupling(self):
        scene = kerf.Scene("touch", **COUPLING)
        ours, theirs = kerf.Loop(scene), kerf.Loop(scene)
        self.assertIsNone(ours.law)
        ours.law = spring
        self.assertIs(ours.law, spring)
        ours, theirs = ours.run(seconds=3), theirs.run(seconds=3)
        self.assertGreater(theirs["commanded_force_n"].max(), 0.1)
        self.assertLess(np.abs(ours["commanded_force_n"] - theirs["commanded_force_n"]).max(), 1e-3)

    def test_a_law_that_fails_ends_the_run_without_force(self):
        def raising(d):
            return 1 / 0 if d.spring_mm.any() else spring(d)
        for numeric in ("fixed", "double"):
            for what, words in ((raising, "it raised ZeroDivisionError: division by zero"), (lambda d: None, "it returned None"),
                                (lambda d: d.spring_mm * np.nan, "it returned array([nan, nan, nan])"), (lambda d: d.spring_mm[:2], "it returned array("),
                                (lambda d: "xyz", "it returned 'xyz'"), (lambda d: 3.0, "it returned 3.0"), (lambda: 1, "it raised TypeError")):
                loop = kerf.Loop(kerf.Scene("touch", servo={"numeric": numeric}), law=what)
                error = self.refused(words, loop.run, seconds=4)
                self.assertTrue(str(error).startswith("law, tick "), error)
                self.assertEqual(len(loop.ticks), loop.tick)
                self.assertEqual(f"law, tick {loop.tick}", str(error).split(":")[0])
                self.assertFalse(loop.last["commanded_force_n"].any())
                self.assertEqual(loop.last["fault"], 4)
                self.assertFalse(loop.last["dac_counts"].any() or loop.last["flags"] & (1 << 7))
                self.refused(words, loop.run, ticks=1)
                self.refused(words, loop.step)
                loop.law = spring
                loop.run(ticks=10)
        self.assertIsInstance(self.refused("raised", kerf.Loop("touch", law=lambda d: 1 / 0).run, seconds=4).__cause__, ZeroDivisionError)

    def test_a_law_can_be_replaced_but_not_the_scene_s(self):
        loop = kerf.Loop("touch")
        loop.law = spring
        loop.law = None
        self.assertIsNone(loop.law)
        loop.run(ticks=10)
        self.refused("the loop has made 10 ticks", setattr, loop, "law", spring)
        self.refused("law: int; give a function", kerf.Loop, "touch", law=3)
        loop = kerf.Loop("touch", law=spring)
        loop.run(ticks=900)
        loop.law = lambda d: 0 * d.spring_mm
        self.assertLess(np.abs(loop.run(seconds=2)["contact_force_n"]).max(), 1e-6)
        loop.law = lambda d: loop.run(ticks=1)
        self.refused("busy", loop.run, seconds=2)

    def test_its_log_is_replayed_with_the_function_alone(self):
        with kerf.Loop("touch", law=spring, log=self.home / "log") as loop:
            rows = loop.run(seconds=2)
        log = kerf.Log(self.home / "log")
        self.assertEqual(log.ticks.tobytes(), rows.tobytes())
        self.assertEqual(log.check(), [])
        again = kerf.replay(self.home / "log", law=spring, rows=True)
        self.assertIsNone(again.difference)
        self.assertEqual((again.ticks, again.output_hash, again.rows.tobytes()), (2000, loop.output_hash, rows.tobytes()))
        other = kerf.replay(self.home / "log", law=lambda d: 0.2 * d.spring_mm, rows=True)
        self.assertEqual((other.difference.stage, other.ticks), ("contact", 2000))
        self.refused("its law is a function of a Python program", kerf.replay, self.home / "log")
        self.refused("it raised ZeroDivisionError", kerf.replay, self.home / "log", law=lambda d: 1 / 0)
        self.assertIsNotNone(kerf.replay(self.home / "log", law="coupling").difference)
        done = subprocess.run([BIN / "kerf-replay", self.home / "log"], capture_output=True, text=True, check=False)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("python", done.stderr)


class TestLogs(Case):
    def test_a_log_of_a_loop_is_one_of_the_recorder(self):
        with kerf.Loop("phantom", log=self.home / "log") as loop:
            loop.run(seconds=1)
            self.refused("is of one run", loop.restore, loop.snapshot())
        for words in (["kerf-record", "check"], ["kerf-replay"]):
            subprocess.run([BIN / words[0], *words[1:], self.home / "log"], check=True, capture_output=True)
        self.assertIsNone(kerf.Log(self.home / "log").replay().difference)
        stiffer = kerf.replay(self.home / "log", force={"stiffness_n_per_mm": 0.9})
        self.assertEqual(stiffer.ticks, 1000)
        self.refused("recording", kerf.Loop, "touch", log=self.home / "log")
        with open(self.home / "log/ticks.npy", "r+b") as file:
            file.seek(9000)
            file.write(b"x")
        self.assertTrue(kerf.Log(self.home / "log").check())
        self.refused("give the folder of a recording", kerf.Log, self.home / "log/second")


class TestMaps(Case):
    def test_a_map_is_that_of_the_lab(self):
        ours = kerf.zwidth(device=["falcon", "omni"], stiffness="0.5:20:4", damping=[0, 0.004], seeds=2)
        out = self.home / "map.json"
        subprocess.run([BIN / "kerf-lab", "zwidth", "--device", "falcon,omni", "--stiffness", "0.5:20:4", "--damping", "0,0.004", "--seeds", "2",
                        "--json", out], check=True, capture_output=True)
        theirs = json.loads(out.read_text())
        self.assertEqual(ours.swings.shape, (2, 2, 4))
        self.assertEqual(ours.swing_by_seed_n_per_mm.shape, (2, 2, 2))
        self.assertTrue((ours.swing_by_seed_n_per_mm.min(axis=-1) == ours.first_swing_n_per_mm).all())
        for device in range(2):
            for damping in range(2):
                column = next(c for c in theirs["columns"] if c["axes"]["device"] == ours.axes["device"][device]
                              and c["axes"]["damping_ns_per_mm"] == ours.axes["damping"][damping])
                for rule, first in (("by_travel", ours.first_swing_n_per_mm), ("by_energy", ours.first_energy_n_per_mm)):
                    self.assertEqual(column[rule]["first_n_per_mm"] or np.inf, first[device, damping])
                    self.assertEqual(column[rule]["last_n_per_mm"] or np.inf,
                                     {"by_travel": ours.swing_by_seed_n_per_mm, "by_energy": ours.energy_by_seed_n_per_mm}[rule][device, damping].max())
                for key in ("swings", "active", "undecided", "arithmetic", "travel_mm", "given_mj"):
                    self.assertEqual([cell[key] for cell in column["cells"]], getattr(ours, key)[device, damping].tolist())

    def test_a_cell_is_that_of_the_map_and_has_its_trajectory(self):
        for device, grid in (("falcon", [0.5, 7, 7.5, 20]), ("omega", [0.5, 2, 5, 20])):
            hits = (0, 50, 200)
            made = kerf.zwidth(device=device, stiffness=grid, damping=0.002, seeds=1, push=0.5, hit=list(hits), start=0.1)
            flags = []
            for stiffness in grid:
                cells = [kerf.cell(stiffness, 0.002, device, hit_mm_per_s=speed, seed=1 << 32) for speed in hits]
                flags.append([one.verdict.swings for one in cells])
            self.assertEqual(np.transpose(flags).tolist(), made.swings.reshape(3, 4).tolist(), device)
            self.assertEqual(len(set(sum(flags, []))), 2, device)
            self.assertEqual(cells[0].trajectory.shape[1], 2)
            self.assertLess(np.abs(cells[1].trajectory[0] - (0.1 - 0.05, -50)).max(), 10)
        law = kerf.cell(0.5, 0.002, "falcon", seconds=1, numeric="double", law=lambda d: d.stiffness_n_per_mm * d.spring_mm)
        self.assertTrue(law.verdict.rests or law.verdict.swings or law.verdict.undecided)
        self.refused("it returned None", kerf.cell, 0.5, law=lambda d: None)

    def test_each_family_has_a_map(self):
        for device in ("omega", "touch", "inverse3"):
            made = kerf.zwidth(damping=[0.002, 0], device=device, stiffness=[0.5, 30], seeds=1, seconds=1)
            self.assertEqual(made.axes, {"damping": ["0", "0.002"], "device": [device]})
            self.assertEqual(made.rests.shape, (2, 1, 2))
            self.assertTrue(made.rests[..., 0].all() or made.swings.any(), device)
            self.assertEqual((kerf.map_loop(device).delay_s, kerf.map_loop(device, 4000).delay_s), (0.001, 0.00025))
            self.assertEqual(kerf.device_loop(device, 4000).delay_s, 0.002)
        loop = kerf.device_loop("omega")
        self.assertTrue(kerf.is_stable(loop, 0.5 * kerf.highest_stiffness(loop, 0.002), 0.002))
        loop.mass_kg = -1
        self.refused("mass_kg = -1: give a positive one", kerf.highest_stiffness, loop, 0)
        self.refused("device: nix", kerf.zwidth, device="nix", stiffness=1)
        self.refused("nonsense", kerf.zwidth, nonsense=1, stiffness=1)
        self.refused("stiffness", kerf.zwidth, device="omni", stiffness=-1)
        self.refused("damping_ns_per_mm = -1", kerf.cell, 1, -1)


class TestIdentified(Case):
    """A device.toml of kerf identify, in place of a device's name."""

    def setUp(self):
        super().setUp()
        self.file = self.home / "device.toml"
        self.file.write_text("[device]\nmass_kg = [0.15, 0.2, 0.3, 0.01, 0, 0.02]\nviscous_ns_per_mm = [0.0008, 0.001, 0.0012]\n"
                             "coulomb_n = [0.1, 0.15, 0.2]\nquantum_mm = [0.01, 0.01, 0.02]\ndelay_s = 0.0015\nrate_hz = 1000\n")

    def test_its_map_is_that_of_the_lab(self):
        made = kerf.zwidth(device=self.file, direction="z", stiffness="0.5:30:6", damping=[0, 0.004], seeds=1)
        self.assertEqual(made.axes, {"device": [str(self.file)], "damping": ["0", "0.004"]})
        out = self.home / "map.json"
        subprocess.run([BIN / "kerf-lab", "zwidth", "--device", self.file, "--direction", "z", "--stiffness", "0.5:30:6", "--damping", "0,0.004",
                        "--seeds", "1", "--json", out], check=True, capture_output=True)
        theirs = [next(column for column in json.loads(out.read_text())["columns"] if column["axes"]["damping_ns_per_mm"] == damping)
                  for damping in ("0", "0.004")]
        self.assertEqual([[cell["swings"] for cell in column["cells"]] for column in theirs], made.swings[0].tolist())
        self.assertEqual([column["by_travel"]["first_n_per_mm"] or np.inf for column in theirs], made.first_swing_n_per_mm[0].tolist())
        # Across z alone: 1 / (M^-1)zz.
        mass = np.array([[0.15, 0.01, 0], [0.01, 0.2, 0.02], [0, 0.02, 0.3]])
        for loop in (kerf.map_loop(self.file, direction="z"), kerf.device_loop(str(self.file), direction="0,0,1")):
            self.assertAlmostEqual(loop.mass_kg, 1 / np.linalg.inv(mass)[2, 2], places=6)
            self.assertAlmostEqual(loop.delay_s, 0.0015)
        worst = kerf.highest_stiffness(kerf.map_loop(self.file), 0.002)
        self.assertLessEqual(worst, min(kerf.highest_stiffness(kerf.map_loop(self.file, direction=axis), 0.002) for axis in "xyz"))

    def test_its_wall_is_felt_as_in_the_lab(self):
        out = self.home / "felt.json"
        subprocess.run([BIN / "kerf-lab", "impedance", "--device", self.file, "--direction", "z", "--stiffness", "2", "--damping", "0.003",
                        "--frequency", "3,30,100", "--json", out], check=True, capture_output=True)
        rows = json.loads(out.read_text())["rows"]
        felt = kerf.impedance(2, 0.003, self.file, direction="z", hz=[row["hz"] for row in rows])
        for of, z in (("wall", felt.wall), ("port", felt.port)):
            np.testing.assert_allclose(felt.stiffness_n_per_mm(z), [row[of]["theory"]["stiffness_n_per_mm"] for row in rows], rtol=1e-9)
        np.testing.assert_allclose(felt.wall.real, [row["wall"]["theory"]["damping_ns_per_mm"] for row in rows], rtol=1e-9)
        self.assertEqual(kerf.impedance(2, rate_hz=4000).hz[[0, -1]].tolist(), [1, 1000])
        self.refused("hz, amplitude_mm", kerf.impedance, 2, hz=500)

    def test_a_scene_that_names_it_is_emulated_so_and_its_log_needs_no_file(self):
        device = {"identified": str(self.file)}
        self.same_as_programs("touch", device=device)
        log = self.home / "run"
        with kerf.Loop(kerf.Scene("touch", device=device), log=log) as loop:
            loop.run(seconds=1)
            rows = loop.ticks.copy()
        self.assertFalse(np.array_equal(rows["position_mm"], kerf.Loop("touch").run(seconds=1)["position_mm"]))
        self.file.unlink()
        self.assertIsNone(kerf.replay(log).difference)

    def test_what_is_none_is_one_line(self):
        self.refused("direction: z: is that of a file", kerf.zwidth, device="omni", direction="z", stiffness=1)
        self.refused("up: no direction", kerf.zwidth, device=self.file, direction="up", stiffness=1)
        self.refused("no.toml: not a file", kerf.zwidth, device="no.toml", stiffness=1)
        self.refused("give one file alone", kerf.zwidth, device=["omni", "no.toml"], stiffness=1)
        self.refused("not a file", kerf.Scene, "touch", device={"identified": str(self.home)})
        self.file.write_text("")
        self.refused("no table [device]", kerf.Scene, "touch", device={"identified": str(self.file)})
        self.refused("no table [device]", kerf.device_loop, str(self.file))


class TestArguments(Case):
    def test_what_is_wrong_is_one_line(self):
        self.refused("nosuch", kerf.Scene, "nosuch")
        self.refused("force.stifness", kerf.Scene, "touch", force={"stifness": 1})
        self.refused("object; give a number", kerf.Scene, "touch", force={"stiffness_n_per_mm": object()})
        self.refused("nosuch", kerf.Loop, "touch", hand="nosuch")
        self.refused("2 given, and the scene has 1 arms", kerf.Loop, "touch", hand=["touch", "touch"])
        loop = kerf.Loop("touch")
        for wrong in ({}, {"seconds": 1, "ticks": 1}):
            self.refused("give seconds or ticks", loop.run, **wrong)
        for wrong in (-1, float("nan"), float("inf"), "2", None, 1j, 1e30):
            self.refused("run: ", loop.run, seconds=1 if wrong is None else wrong, **({"every": "x"} if wrong is None else {}))
        self.assertEqual(loop.tick, 0)


class TestCtrlC(Case):
    def interrupted(self, body, after="begun"):
        program = subprocess.Popen([sys.executable, "-B", "-c", "import kerf, sys\n" + body], stdout=subprocess.PIPE, text=True)
        self.addCleanup(program.stdout.close)
        self.addCleanup(program.kill)
        self.assertEqual(program.stdout.readline(), after + "\n")
        time.sleep(0.3)
        program.send_signal(signal.SIGINT)
        said, _ = program.communicate(timeout=60)
        self.assertEqual(program.returncode, 0)
        return said

    def test_rows_are_kept_and_the_loop_runs_on(self):
        for law in ("", "loop.law = lambda d: 0.4 * d.spring_mm\n"):
            said = self.interrupted("loop = kerf.Loop('touch')\n" + law + "print('begun', flush=True)\n"
                                    "try:\n  loop.run(seconds=100000)\n"
                                    "except kerf.Interrupted as stop:\n"
                                    "  assert len(stop.kept) == loop.tick > 0 and stop.kept is loop.ticks\n"
                                    "  rows = loop.run(ticks=10); print(rows['tick'][0] == len(stop.kept) + 1)\n")
            self.assertEqual(said, "True\n")

    def test_columns_are_kept(self):
        said = self.interrupted("print('begun', flush=True)\n"
                                "try:\n  kerf.zwidth(device='omni', stiffness='0.05:50:40', damping='0:0.02:40', seconds=600, seeds=100)\n"
                                "except kerf.Interrupted as stop: print(stop.kept.swings.shape, (stop.kept.impossible == 'not measured').any())\n")
        self.assertEqual(said, "(1, 40, 40) True\n")


class TestSpeed(Case):
    def test_ratios_are_printed(self):
        """Ticks a second, as ratios to one run in C++: of run, of single steps, of a law in Python. Not checked: it is a clock."""
        def cost(what, ticks):
            what(100)
            begin = time.process_time()
            what(ticks)
            return (time.process_time() - begin) / ticks
        scene = kerf.Scene("touch")
        loop, stepped, law = kerf.Loop(scene), kerf.Loop(scene), kerf.Loop(scene, law=spring)
        run = min(cost(lambda n: loop.run(ticks=n), 3000) for _ in range(3))
        step = min(cost(lambda n: [stepped.step() for _ in range(n)], 3000) for _ in range(3))
        own = min(cost(lambda n: law.run(ticks=n), 3000) for _ in range(3))
        print(f"run {run * 1e6:.1f} us a tick, step {run / step:.2f} of it, law in Python {1 / own:.0f} ticks/s")


if __name__ == "__main__":
    unittest.main()
