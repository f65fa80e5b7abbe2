# SPDX-License-Identifier: Apache-2.0
"""A run that tests record: controller, emulator and recorder in lock-step."""
import json
import os
import subprocess


def record(root, programs, folder, scene, seconds, *options):
    """Runs a scene with the hand of scenes/touch.toml; the log is `folder`/log. Returns the controller's report."""
    out, report, device, lead = folder / "log", folder / "report.json", folder / "device", folder / "lead"
    os.mkfifo(lead)
    name = f"recorded-{folder.name}"
    others = [subprocess.Popen([programs / "kerf-recorder", "--name", name, "--out", out, "--lead", lead], stdout=subprocess.DEVNULL),
              subprocess.Popen([programs / "kerf-emulator", "--lockstep", "--rate", "1000", "--socket", device, "--hand",
                                root / "scenes/hands/touch.toml"], stdout=subprocess.DEVNULL)]
    controller = subprocess.run([programs / "kerf-controller", "--scene", scene, "--virtual", "--until", lead, "--name", name,
                                 "--seconds", str(seconds), *options, "--torque-scale", "0.05,0.05,0.05", "--port", f"socket:{device}", "--report",
                                 report], stdout=subprocess.DEVNULL)
    for program in others:
        if controller.returncode != 0:
            program.kill()
        program.wait(timeout=60)
    assert controller.returncode == 0
    return json.loads(report.read_text())
