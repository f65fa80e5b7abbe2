# SPDX-License-Identifier: Apache-2.0
"""The parts of `./kerf demo`: options, the folder of --out, processes. .ci/check-kerf.sh runs whole demos.

    demo_test.py ROOT"""
import contextlib
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

sys.path.insert(0, str(pathlib.Path(sys.argv.pop(1), "demo").resolve()))
import options
import out_folder
import processes


def checked(*words, display=""):
    with unittest.mock.patch.dict(os.environ, {"DISPLAY": display, "WAYLAND_DISPLAY": ""}):
        found = options.parse(words)
        options.choose_devices(found, "")
        options.choose_port(found, "")
        options.check(found)
    return found


class TestOptions(unittest.TestCase):
    def test_what_cannot_be_is_refused_by_name(self):
        for words, place in [(["--fast"], "--fast"), (["--seconds"], "--seconds"), (["--out", ""], "--out"),
                             (["--out", "--headless"], "--out"), (["--seconds", "1", "--seconds", "2"], "--seconds"),
                             (["--seconds", "0.0"], "--seconds 0.0"), (["--seconds", "1e3"], "--seconds"),
                             (["--seconds", "1234567"], "--seconds"), (["--size", "big"], "--size big"),
                             (["--size", "8193x10"], "--size"), (["--size", "0x480"], "--size"), (["--device", "pen"], "--device"),
                             (["--port", "usb"], "--port usb"), (["--device", "falcon", "--port", "usb", "--virtual"], "--virtual"),
                             (["--listen", "0.0.0.0:1"], "--listen"), (["--record", "-"], "--record"),
                             (["--hand", "mouse"], "--hand mouse"), (["--hand", "mouse", "--virtual"], "--hand mouse"),
                             (["--hand", "mouse", "--sheet", "s.png"], "--hand mouse"),
                             (["--name", "a/b"], "--name a/b"), (["--name", ".x"], "--name"), (["--name", "x" * 65], "--name")]:
            with self.subTest(words), self.assertRaises(options.Refusal) as refused:
                checked(*words)
            self.assertTrue(str(refused.exception).startswith(place), refused.exception)
            self.assertNotIn("\n", str(refused.exception))

    def test_a_name_that_runs_is_refused(self):
        with tempfile.TemporaryDirectory() as runtime, unittest.mock.patch.dict(os.environ, {"XDG_RUNTIME_DIR": runtime}), \
                socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
            self.assertEqual(checked("--name", "tooth").name, "tooth")
            os.mkdir(runtime + "/kerf")
            server.bind(runtime + "/kerf/tooth.sock")
            server.listen()
            self.assertEqual(checked("--name", "teeth").again, ["--name", "teeth"])
            with self.assertRaisesRegex(options.Refusal, "^--name tooth: a controller of this name runs"):
                checked("--name", "tooth")

    def test_defaults(self):
        self.assertEqual((checked().seconds, checked().out, checked().headless), ("10", "kerf-demo", True))
        self.assertEqual(checked("--serve").seconds, "60")
        self.assertTrue(checked("--device", "inverse3", "--port", "arm", "--virtual").virtual)
        mouse = checked("--hand", "mouse", display=":0")
        self.assertEqual((mouse.seconds, mouse.bound_is_told), ("600", True))
        self.assertFalse(checked("--seconds", "3").bound_is_told)
        self.assertFalse(checked(display=":0").headless)
        self.assertEqual(checked("--headless", display=":0").out, "kerf-demo")
        self.assertEqual((checked(display=":0").out, checked("--sheet", "s.png", display=":0").out, checked("--record", "v").out), ("", "", ""))
        self.assertEqual(checked("--size", "8192x1", "--seconds", "999999.5").size, "8192x1")

    def test_how_large_files_become_is_said_beforehand(self):
        raw = checked("--record", "no-such.y4m", "--seconds", "61", "--out", "o")
        with unittest.mock.patch.object(options.shutil, "which", return_value="/usr/bin/ffmpeg"):
            self.assertEqual(options.growth(raw, 2000), [
                "--record no-such.y4m: raw, 28 MB a second; a name that ends in .mp4 compresses it",
                "--out o: its log grows by 60 MB a minute"])
            self.assertEqual(options.growth(checked("--record", "v.mp4", "--seconds", "60", "--out", "o"), 1000), [])
            self.assertEqual(options.growth(checked("--record", "/dev/null"), 1000), [])
            two = checked("--seconds", "61", "--out", "o")
            two.second = "touch"
            self.assertEqual(options.growth(two, 2000), ["--out o: its log grows by 119 MB a minute"])
        with unittest.mock.patch.object(options.shutil, "which", return_value=None), \
                self.assertRaisesRegex(options.Refusal, "--record v.mp4: no ffmpeg"):
            checked("--record", "v.mp4")

    def test_the_rate_is_known_before_the_controller_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder, "scene.toml")
            for text, words, rate_hz in [("", [], 1000), ("[servo]\nrate_hz = 4000", [], 4000), ("[servo", [], 1000),
                                         ("servo = 1", [], 1000), ("[servo]\nrate_hz = 'x'", [], 1000), ("[servo]\nrate_hz = inf", [], 1000),
                                         ("[servo]\nrate_hz = 4000", ["--set", "servo.rate_hz=500", "--set", "servo.rate_hz=2000"], 2000),
                                         ("[servo]\nrate_hz = 4000", ["--set", "servo.rate_hz=500", "--rate", "8000"], 8000),
                                         ("", ["--rate", "fast"], 1000), ("", ["--rate", "10000000"], 8000)]:
                scene.write_text(text)
                with self.subTest(text=text, words=words):
                    self.assertEqual(options.expected_rate_hz(checked(*words), str(scene)), rate_hz)
            self.assertEqual(options.expected_rate_hz(checked(), folder), 1000)

    def test_a_scene_is_read_in_any_locale(self):
        words = "import sys, options\nfound = options.parse([])\noptions.choose_devices(found, sys.argv[1])\nprint(found.second)"
        with tempfile.NamedTemporaryFile(suffix=".toml") as scene:
            scene.write('title = "\u00e4"\n[[device]]\n[[device]]\npersonality = "touch"\n'.encode())
            scene.flush()
            done = subprocess.run([sys.executable, "-B", "-c", words, scene.name], capture_output=True, text=True, check=False,
                                  cwd=sys.path[0], env={**os.environ, "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"})
        self.assertEqual(done.stdout, "touch\n", done.stderr)

    def test_the_next_demo_gets_all_but_the_scene(self):
        found = checked("--scene", "a.toml", "--volume", "b.nrrd", "--set", "x=1", "--set", "y=2", "--stereo", "--rate", "500")
        self.assertEqual(found.again, ["--set", "x=1", "--set", "y=2", "--stereo", "--rate", "500"])
        self.assertEqual(found.volume, ["--volume", "b.nrrd", "--set", "x=1", "--set", "y=2"])


class TestOutFolder(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.root = pathlib.Path(temporary.name)
        self.out = self.root / "new" / "out"

    def demo(self, names=("report.json", "log/ticks.npy", "frame-0001.png"), meanwhile=()):
        folder = out_folder.OutFolder(str(self.out))
        folder.check()
        folder.open(1)
        for base, files in ((folder.results, names), (folder.place, meanwhile)):
            for name in files:
                path = pathlib.Path(base, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text("some")
        said, in_place = folder.publish()
        folder.close()
        return said, in_place

    def held(self):
        return sorted(str(path.relative_to(self.out)) for path in self.out.rglob("*") if ".kerf-demo" not in path.parts)

    def test_a_demo_replaces_the_last_one(self):
        self.assertTrue(self.demo()[1])
        said, in_place = self.demo(("report.json", "final.nrrd"))
        self.assertTrue(in_place)
        self.assertEqual(said, f"kept in {self.out}: final.nrrd report.json, 0 frames")
        self.assertEqual(self.held(), ["final.nrrd", "report.json"])

    def test_what_the_windows_keys_write_lies_there_at_once_and_is_replaced_with_the_rest(self):
        said, in_place = self.demo(meanwhile=["kerf-0001.mp4"])
        self.assertTrue(in_place)
        self.assertTrue(said.startswith(f"kept in {self.out}: log report.json kerf-0001.mp4, 1 frame"), said)
        self.assertTrue(self.demo()[1])
        self.assertNotIn("kerf-0001.mp4", self.held())
        (self.out / "kerf-0002.png").write_text("not by a demo")
        with self.assertRaisesRegex(options.Refusal, "holds kerf-0002.png, which no demo wrote"):
            self.demo()

    def test_files_of_others_are_refused_and_stay(self):
        self.demo()
        for name, text in (("mine", "x"), ("log/note", "x"), ("report.json", "changed")):
            (self.out / name).write_text(text)
            with self.subTest(name), self.assertRaisesRegex(options.Refusal, f"holds {name}, which no demo wrote"):
                self.demo()
            self.assertEqual((self.out / name).read_text(), text)
            (self.out / name).unlink()

    def test_however_it_is_named(self):
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.root)
        (self.root / "linked").mkdir()
        (self.root / "link").symlink_to("linked")
        for name in ("plain/", f"{self.root}/absolute/", "run[1]", "a path/with spaces", "-x/y", "a/../b//", "link", "back\\slash*"):
            self.out = name
            for _ in range(2):
                said, in_place = self.demo()
                self.assertEqual((said, in_place), (f"kept in {name}: log report.json, 1 frame", True))
                self.assertEqual(sorted(os.listdir(os.path.realpath(name))), [".kerf-demo", "frame-0001.png", "log", "report.json"])
        self.assertEqual(os.readlink("link"), "linked")
        (self.root / "ring").symlink_to("ring")
        with self.assertRaisesRegex(options.Refusal, "--out ring: cannot be created"):
            out_folder.OutFolder("ring").open(1)

    def test_a_file_is_never_touched_whatever_its_name_is(self):
        for name in ("log/thesis.txt", "final-patient-7.nrrd", "kerf-0001.png", "report.json", ".kerf-demo", ".partial-mine"):
            self.out = self.root / name.replace("/", "-")
            (self.out / name).parent.mkdir(parents=True)
            (self.out / name).write_text("mine")
            with self.subTest(name), self.assertRaisesRegex(options.Refusal, "which no demo wrote"):
                self.demo()
            self.assertEqual((self.out / name).read_text(), "mine")

    def test_the_list_of_what_it_left_has_the_form_of_find(self):
        self.demo()
        listed = (self.out / ".kerf-demo" / "files").read_text().splitlines()
        found = subprocess.run(["find", self.out, "-mindepth", "1", "-name", ".kerf-demo", "-prune", "-o", "-type", "d", "-printf",
                                r"d - - %P\n", "-o", "-printf", r"%y %s %T@ %P\n"], capture_output=True, text=True, check=True)
        self.assertEqual(sorted(listed), sorted(found.stdout.splitlines()))

    def test_what_comes_meanwhile_stays_beside_the_results(self):
        said, in_place = self.demo(meanwhile=["log/mine"])
        self.assertFalse(in_place)
        self.assertIn("log is in the way", said)
        self.assertEqual((self.out / "log" / "mine").read_text(), "some")
        self.assertTrue(list(self.out.glob("demo-??????/report.json")))

    def test_two_at_once(self):
        first = out_folder.OutFolder(str(self.out))
        first.open(1)
        second = out_folder.OutFolder(str(self.out))
        with self.assertRaisesRegex(options.Refusal, "another demo is at work"):
            second.open(1)
        second.close()
        self.assertTrue(os.path.isdir(first.results))
        first.close()
        self.assertFalse(self.out.parent.exists())

    def test_no_room_and_no_name(self):
        folder = out_folder.OutFolder(str(self.out))
        self.addCleanup(folder.close)
        with self.assertRaisesRegex(options.Refusal, "MiB free and"):
            folder.open(1e15)
        with self.assertRaisesRegex(options.Refusal, "control character"):
            out_folder.OutFolder("a\nb")
        with self.assertRaisesRegex(options.Refusal, "cannot be created"):
            out_folder.OutFolder("/dev/null/x").open(1)

    def test_the_room_is_that_of_the_log_by_seconds_rate_and_arms(self):
        a_gib = os.statvfs_result((4096, 4096, 2**18, 2**18, 2**18, 0, 0, 0, 0, 255))
        for rate_hz, second, needed_mib in ((2000, "", 0), (2000, "touch", 1151), (8000, "", 2286)):
            log_bytes = 600 * options.log_bytes_per_s(options.Options(second=second), rate_hz)
            folder = out_folder.OutFolder(str(self.out))
            refused = self.assertRaisesRegex(options.Refusal, f": 1024 MiB free and {needed_mib} needed")
            with self.subTest(rate_hz=rate_hz, second=second), unittest.mock.patch.object(out_folder.os, "statvfs", return_value=a_gib):
                with refused if needed_mib else contextlib.nullcontext():
                    folder.open(log_bytes)
            folder.close()


class TestProcesses(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.programs = processes.Processes(str(self.folder), ("/secret", "out"))
        self.addCleanup(self.programs.end)
        self.said = []
        patch = unittest.mock.patch.object(processes, "complain", self.said.append)
        patch.start()
        self.addCleanup(patch.stop)

    def start(self, script):
        (self.folder / "kerf-x").write_text("#!/bin/sh\n" + script)
        (self.folder / "kerf-x").chmod(0o755)
        return self.programs.start("x", [], out="x.log", log="x.log")

    def test_ends(self):
        for script, code, said in [("exit 0", 0, []), ("echo a; echo /secret/b >&2; exit 2", 2, ["out/b"]),
                                   ("exit 1", 1, ["kerf: demo: x: ended without a word"]),
                                   ("kill -SEGV $$", 1, ["kerf: demo: x: ended by signal 11"]),
                                   ("exit 7", 1, ["kerf: demo: x: ended with exit code 7"])]:
            self.said.clear()
            self.assertEqual(self.programs.conclude("x", self.start(script), 10), code)
            self.assertEqual(self.said, said)

    def test_none_survives(self):
        stuck = self.start("trap '' TERM; echo on; while :; do sleep 0.1; done")
        while not os.path.getsize(self.programs.path("x.log")):
            time.sleep(0.01)
        self.programs.end()
        self.assertEqual(stuck.returncode, -signal.SIGKILL)
        self.assertFalse(os.path.exists(self.programs.run))

    def test_none_survives_a_demo_that_is_killed(self):
        (self.folder / "kerf-x").write_text(f"#!/bin/sh\necho $$ >{self.folder}/pid\nwhile :; do sleep 0.05; done\n")
        (self.folder / "kerf-x").chmod(0o755)
        demo = subprocess.Popen([sys.executable, "-B", "-c", "import sys, time\n"
                                 f"sys.path.insert(0, {sys.path[0]!r})\nimport processes\n"
                                 f"processes.Processes({str(self.folder)!r}, ('a', 'b')).start('x', [])\ntime.sleep(60)"],
                                env={**os.environ, "TMPDIR": str(self.folder)})
        pid = self.folder / "pid"
        while not pid.exists() or not pid.read_text().endswith("\n"):
            time.sleep(0.02)
        demo.kill()
        demo.wait()
        def runs():
            """A container's first process may leave the end of it unread: a zombie."""
            try:
                state = pathlib.Path("/proc", pid.read_text().strip(), "stat").read_text()
            except (FileNotFoundError, ProcessLookupError):
                return False
            return state.rpartition(")")[2].split()[0] not in "XZ"

        deadline = time.monotonic() + 20
        while runs() and time.monotonic() < deadline:
            time.sleep(0.02)
        self.assertFalse(runs())


unittest.main()
