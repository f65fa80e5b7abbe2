# SPDX-License-Identifier: Apache-2.0
"""A run that tests record: controller, emulator and recorder in lock-step."""
import json
import os
import struct
import subprocess
import zlib


def sealed(manifest):
    """The text of a manifest with its checksum, as a recorder writes it."""
    text = json.dumps({key: value for key, value in manifest.items() if key != "crc32"}, indent=2)[:-2]
    return f'{text},\n  "crc32": "{zlib.crc32(text.encode()):08x}"\n}}\n'


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def set_clock(log, *pairs):
    """clock.npy of (monotonic_ns, utc_ns); without pairs the log is one of a version that had none."""
    path, manifest = log / "clock.npy", json.loads((log / "manifest.json").read_text())
    manifest.pop("clock", None)
    manifest["files"].pop("clock.npy", None)
    if pairs:
        manifest["clock"] = "clock.npy"
        rows = [struct.pack("<qqI", *pair, 40) for pair in pairs]
        header = path.read_bytes()[:256]
        count = b"(%d,), }" % len(pairs)
        header = (header[:header.index(b"'shape': ") + 9] + count).ljust(255) + b"\n"
        path.write_bytes(header + b"".join(row + struct.pack("<I", crc32c(row)) for row in rows))
        manifest["files"]["clock.npy"] = f"{zlib.crc32(path.read_bytes()):08x}"
    else:
        path.unlink()
    (log / "manifest.json").write_text(sealed(manifest))


def record(root, programs, folder, scene, seconds, *options, flight=False, fault=None, recorder=()):
    """Runs a scene with the hand of scenes/touch.toml; the log is `folder`/log, of a recorder with the options `recorder`. With
    `flight` a flight recorder of a second is beside it, with `folder`/flights. Returns the controller's report."""
    report, device = folder / "report.json", folder / "device"
    name = f"recorded-{folder.name}"
    recorders = {"log": list(recorder)} | ({"flights": ["--flight", "1"]} if flight else {})
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
