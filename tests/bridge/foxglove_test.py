# SPDX-License-Identifier: Apache-2.0
"""A run in lock-step as Foxglove's own client sees it (npm: package.json of foxglove/), beside the log of the run.

    foxglove_test.py ROOT BIN BUILD      BUILD: folder for the client
Exit code 77: skipped, without node, npm or its registry."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

ROOT, BIN, BUILD = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(3))
sys.path.insert(0, str(ROOT / "tests/record"))
from lockstep_run import record

TOKEN = "a-token-of-the-foxglove-test"
SECONDS = 8


def get_client():
    """Whether it is there: installed once in BUILD."""
    BUILD.mkdir(parents=True, exist_ok=True)
    for file in ("package.json", "package-lock.json", "client.mjs"):
        shutil.copy(ROOT / "tests/bridge/foxglove" / file, BUILD)
    if not shutil.which("npm"):
        return False
    return subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--prefer-offline"], cwd=BUILD,
                          stdout=subprocess.DEVNULL).returncode == 0


class Client:
    def __init__(self, mode, url, *topics, protocols=None):
        self.process = subprocess.Popen(["node", "client.mjs", mode, url, *topics], cwd=BUILD, stdout=subprocess.PIPE, text=True,
                                        env={**os.environ, **({} if protocols is None else {"PROTOCOLS": protocols})})

    def is_subscribed(self):
        return self.process.stdout.readline() == "subscribed\n"

    def end(self):
        lines = self.process.communicate(timeout=120)[0].splitlines()
        return json.loads(lines[-1])

    def ended_by(self):
        """The signal that has ended it, less than 0."""
        self.process.communicate(timeout=120)
        return self.process.returncode


class TestFoxglove(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        tokens = cls.folder / "tokens"
        with open(tokens, "w", opener=lambda path, flags: os.open(path, flags, 0o600)) as file:
            file.write(TOKEN + "\n")
        os.environ["XDG_RUNTIME_DIR"] = str(cls.folder)
        log = open(cls.folder / "bridge.log", "w+")
        cls.bridge = subprocess.Popen([BIN / "kerf-bridge", "serve", "--listen", "127.0.0.1:0", "--name",
                                       f"recorded-{cls.folder.name}", "--token-file", tokens], stdout=log, stderr=log)
        log.close()
        cls.addClassCleanup(cls.end_bridge)
        end = time.monotonic() + 30
        while not (found := re.search(rf"ws://(127.0.0.1:\d+)/\?token={TOKEN}\n", (cls.folder / "bridge.log").read_text())):
            assert time.monotonic() < end and cls.bridge.poll() is None, "the bridge does not print its address"
            time.sleep(0.02)
        cls.place = f"ws://{found[1]}/foxglove"
        cls.url = f"{cls.place}?token={TOKEN}"
        cls.follow_a_run()

    @classmethod
    def follow_a_run(cls):
        clients = {"all": Client("follow", cls.url), "old": Client("follow", cls.url, "/kerf/tip", protocols="foxglove.websocket.v1"),
                   "leaves": Client("leave", cls.url), "killed": Client("die", cls.url)}
        assert all(client.is_subscribed() for client in clients.values())
        cls.report = record(ROOT, BIN, cls.folder, ROOT / "scenes/touch.toml", SECONDS)
        cls.killed_by = clients.pop("killed").ended_by()
        cls.seen = {name: client.end() for name, client in clients.items()}
        cls.rows = np.load(cls.folder / "log/ticks.npy")

    @classmethod
    def end_bridge(cls):
        cls.bridge.terminate()
        code = cls.bridge.wait(timeout=20)
        assert code == 0, f"the bridge ended with {code}"

    def rows_of(self, messages):
        """The rows of the log with the times of these messages, of those that the log has; and these messages."""
        place = {int(start_ns): i for i, start_ns in enumerate(self.rows["start_ns"])}
        both = [(place[int(one["at"])], one["value"]) for one in messages if int(one["at"]) in place]
        self.assertGreater(len(both), 0.9 * len(messages))
        return self.rows[[i for i, _ in both]], [value for _, value in both]

    def test_each_tick_is_that_of_the_log(self):
        seen = self.seen["all"]
        self.assertNotIn("error", seen)
        self.assertEqual((seen["protocol"], seen["wrongTimes"]), ("foxglove.sdk.v1", 0))
        rows, values = self.rows_of(seen["messages"]["/kerf/tick"])
        self.assertGreater(len(rows), 500)
        self.assertTrue((np.diff(rows["tick"].astype(np.int64)) > 0).all())
        self.assertEqual(list(values[0]), list(self.rows.dtype.names))
        self.assertGreater(np.abs(rows["commanded_force_n"]).max(), 0.1)  # the hand has touched
        for name in self.rows.dtype.names:
            whole = self.rows[name].dtype.kind in "iu"
            column = np.array([np.array(value[name], dtype=object) for value in values])
            column = np.vectorize(int if whole else float, otypes=[self.rows[name].dtype.base])(
                np.where(column == None, np.nan, column))  # noqa: E711: JSON's null is NaN
            np.testing.assert_array_equal(column.reshape(rows[name].shape), rows[name], err_msg=name)

    def test_tips_and_forces_are_those_of_the_log(self):
        rows, tips = self.rows_of(self.seen["all"]["messages"]["/kerf/tip"])
        self.assertGreater(len(rows), 50)
        self.assertFalse((rows["tick"] % 10).any())
        for row, tip in zip(rows, tips):
            self.assertEqual(tip["header"]["frame_id"], "scene")
            stamp = tip["header"]["stamp"]
            self.assertEqual(int(stamp["sec"]) * 10**9 + int(stamp["nanosec"]), row["start_ns"])
            self.assertEqual([tip["pose"]["position"][axis] for axis in "xyz"], (row["position_mm"] / 1000).tolist())
            self.assertEqual([tip["pose"]["orientation"][axis] for axis in "xyzw"], row["orientation"].tolist())
        rows, forces = self.rows_of(self.seen["all"]["messages"]["/kerf/force"])
        self.assertFalse((rows["tick"] % 10).any())
        for row, force in zip(rows, forces):
            self.assertEqual([force["wrench"]["force"][axis] for axis in "xyz"], row["commanded_force_n"].tolist())
            self.assertEqual([force["wrench"]["torque"][axis] for axis in "xyz"],
                             (row["tip_torque_n_mm"].astype(float) / 1000).tolist())

    def test_channels_are_those_of_the_export(self):
        self.assertEqual({topic: tuple(channel.values()) for topic, channel in self.seen["all"]["channels"].items()},
                         {"/kerf/tick": ("cdr", "kerf_msgs/msg/Tick", "ros2msg"),
                          "/kerf/tip": ("cdr", "geometry_msgs/msg/PoseStamped", "ros2msg"),
                          "/kerf/force": ("cdr", "geometry_msgs/msg/WrenchStamped", "ros2msg")})
        before, of_the_run = self.seen["all"]["infos"]
        self.assertEqual((before["sessionId"], before["capabilities"]), ("none", ["time"]))
        self.assertNotEqual(of_the_run["sessionId"], "none")

    def test_a_second_client_has_its_own_subscriptions(self):
        seen = self.seen["old"]
        self.assertEqual(seen["protocol"], "foxglove.websocket.v1")
        self.assertEqual(seen["messages"]["/kerf/tick"] + seen["messages"]["/kerf/force"], [])
        self.assertGreater(len(self.rows_of(seen["messages"]["/kerf/tip"])[0]), 50)

    def test_nothing_comes_after_unsubscribing(self):
        seen = self.seen["leaves"]
        self.assertEqual((seen["afterwards"], "closed" in seen), (0, False))
        self.assertGreaterEqual(len(seen["messages"]["/kerf/tick"]), 100)

    def test_a_killed_client_changes_nothing(self):
        self.assertEqual((self.killed_by, self.bridge.poll()), (-signal.SIGKILL, None))
        self.assertEqual(self.report["ticks"], SECONDS * 1000)
        self.assertEqual(Client("open", self.url).end(), {"status": 101, "protocol": "foxglove.sdk.v1"})

    def test_who_is_not_let_in(self):
        for url in (self.place, self.place + "?token=wrong-but-long-enough"):
            answer = Client("open", url).end()
            self.assertEqual(answer["status"], 401)
            self.assertIn("Foxglove needs a token", answer["body"])
        for protocols in ("", "foxglove.websocket.v2"):
            answer = Client("open", self.url, protocols=protocols).end()
            self.assertEqual(answer["status"], 400)

    def test_what_is_refused_is_told(self):
        said = [(status["level"], status["message"]) for status in Client("refused", self.url).end()["statuses"]]
        for start in ("advertise is refused", "getParameters is refused", "setParameters is refused", "a binary message is refused",
                      "subscribeConnectionGraph is refused", "fetchAsset is refused", "no JSON at character 2"):
            self.assertTrue(any(level == 2 and message.startswith(start) for level, message in said), (start, said))
        self.assertIn((2, "subscribe: id 0, channelId 99: no such channel; 1 to 3 are advertised"), said)
        self.assertIn((1, "unsubscribe: 98 is no id of a subscription"), said)


if __name__ == "__main__":
    if not get_client():
        print("skipped: no node, no npm, or its registry does not answer")
        sys.exit(77)
    unittest.main()
