# SPDX-License-Identifier: Apache-2.0
"""A run that tests record: controller, emulator and recorder in lock-step."""
import json
import os
import subprocess


def record(root, programs, folder, scene, seconds, *options, flight=False, fault=None):
    """Runs a scene with the hand of scenes/touch.toml; the log is `folder`/log. With `flight` a flight recorder of a second
    is beside the recorder, with `folder`/flights. Returns the controller's report."""
    report, device = folder / "report.json", folder / "device"
    name = f"recorded-{folder.name}"
    recorders = {"log": []} | ({"flights": ["--flight", "1"]} if flight else {})
    others, leads = [], []
    for out, own in recorders.items():
        os.mkfifo(lead := folder / f"lead-{out}")
        leads += ["--until", lead]
        others.append(subprocess.Popen([programs / "kerf-recorder", "--name", name, "--out", folder / out, "--lead", lead, *own],
                                       stdout=subprocess.DEVNULL))
    others.append(subprocess.Popen([programs / "kerf-emulator", "--lockstep", "--rate", "1000", "--socket", device, "--hand",
                                    root / "scenes/hands/touch.toml", *(["--fault", fault] if fault else [])],
                                   stdout=subprocess.DEVNULL))
    controller = subprocess.run([programs / "kerf-controller", "--scene", scene, "--virtual", *leads, "--name", name,
                                 "--seconds", str(seconds), *options, "--torque-scale", "0.05,0.05,0.05", "--port", f"socket:{device}", "--report",
                                 report], stdout=subprocess.DEVNULL)
    for program in others:
        if controller.returncode != 0 and not fault:
            program.kill()
        program.wait(timeout=60)
    assert controller.returncode == 0 or fault
    return json.loads(report.read_text())
