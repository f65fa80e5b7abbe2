# SPDX-License-Identifier: Apache-2.0
"""A scene in lock-step, with one or two emulated devices and without pictures: the same bits on every machine."""
import json
import os
import subprocess
import time

PATIENCE_S = 300


def _wait_for(path, process):
    end = time.monotonic() + PATIENCE_S
    while not (path.exists() and path.stat().st_size) and process.poll() is None and time.monotonic() < end:
        time.sleep(0.02)


def run(bin_folder, out, scene, seconds, devices=("omni",), settings=(), faults=(None, None), cwd=None):
    """Runs `scene` for so many seconds. Returns the controller's report. The folder `out`, which is made, has
    final.nrrd and the log. `faults`: a fault script for each device, or None."""
    out.mkdir()
    lead, told = out / "lead", out / "told"
    os.mkfifo(lead)
    name = f"lockstep-{os.getpid()}-{out.name}"
    program = lambda word: [str(bin_folder / f"kerf-{word}")]
    scales = [subprocess.run([*program("emulator"), "--describe", "--personality", device], capture_output=True, text=True,
                             check=True).stdout.strip().removeprefix("torque_scale=") for device in devices]
    ports = [word for arm in range(len(devices)) for word in ("--port", f"socket:{out / f'device-{arm}'}")]
    first = ["--device", devices[0]] if len(devices) == 1 else []
    sets = [word for one in settings for word in ("--set", one)]
    started = []

    def start(*words):
        log = open(out / f"{len(started)}.txt", "wb")
        started.append(subprocess.Popen(list(map(str, words)), stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=cwd))
        return started[-1]

    try:
        controller = start(*program("controller"), "--scene", scene, *first, "--torque-scale", ",".join(scales), *ports,
                           "--seconds", seconds, "--virtual", "--until", lead, "--name", name, *sets, "--emulator-args", told,
                           "--report", out / "report.json", "--final", out / "final.nrrd")
        recorder = start(*program("recorder"), "--name", name, "--lead", lead, "--out", out / "log", "--strict",
                         "--wait", PATIENCE_S)
        _wait_for(told, controller)
        words = dict(line.split("=", 1) for line in told.read_text().splitlines()) if told.exists() else {}
        for arm, device in enumerate(devices):
            which = ("", "second_")[arm]
            start(*program("emulator"), "--personality", device, "--socket", out / f"device-{arm}", "--lockstep",
                  "--rate", words["rate_hz"], "--unit-mm", words[which + "hand_unit_mm"], "--hand", words[which + "hand_script"],
                  *(["--identified", words[which + "identified"]] if which + "identified" in words else []),
                  *(["--fault", faults[arm]] if faults[arm] else []))
        codes = [process.wait(PATIENCE_S) for process in (controller, recorder)]
        if any(codes[1:]) or codes[0] not in (0, 1) or not (out / "report.json").exists():
            raise KeyError(codes)
        return json.loads((out / "report.json").read_text())
    except (KeyError, subprocess.TimeoutExpired) as error:
        said = "".join(file.read_text(errors="replace") for file in sorted(out.glob("?.txt")))
        raise RuntimeError(f"{scene}: {error!r}: {said}") from None
    finally:
        for process in started:
            process.kill()
            process.wait()
