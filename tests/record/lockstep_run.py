# SPDX-License-Identifier: Apache-2.0
"""A run that tests record: controller, emulator and recorder in lock-step."""
import json
import os
import signal
import struct
import subprocess
import time
import zlib

CRC32C = []
for index in range(256):
    value = index
    for _ in range(8):
        value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    CRC32C.append(value)


def sealed(manifest):
    """The text of a manifest with its checksum, as a recorder writes it."""
    text = json.dumps({key: value for key, value in manifest.items() if key != "crc32"}, indent=2)[:-2]
    return f'{text},\n  "crc32": "{zlib.crc32(text.encode()):08x}"\n}}\n'


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ CRC32C[(crc ^ byte) & 0xFF]
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
        others.append(subprocess.Popen([programs / "kerf-recorder", "--wait", "300", "--name", name, "--out", folder / out, "--lead", lead, *own],
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


def record_killed(root, programs, folder, scene, hands, *recorder, parts=1, rows=1500, synced=False):
    """The log, `folder`/log, of a recorder that is killed in a run, after its manifest has the volumes, its log so many files and
    the last one some rows, and these are in the manifest if `synced`. hands: of an Omni, or of an Omni and a Touch, each with options of its emulator."""
    name, log = f"killed-{folder.name}", folder / "log"
    os.mkfifo(lead := folder / "lead")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    others = [subprocess.Popen([programs / "kerf-recorder", "--wait", "300", "--name", name, "--out", log, "--lead", lead, *recorder], **quiet)]
    ports = []
    for number, hand in enumerate(hands):
        device = folder / f"device-{number}"
        ports += ["--port", f"socket:{device}"]
        others.append(subprocess.Popen([programs / "kerf-emulator", "--lockstep", "--rate", "1000", "--socket", device, "--hand",
                                        root / "scenes/hands" / hand, *hands[hand]], **quiet))
    others.append(subprocess.Popen([programs / "kerf-controller", "--scene", scene, "--virtual", "--until", lead, "--name", name,
                                    "--seconds", "1000", "--torque-scale", ",".join(["0.05,0.05,0.05", "1,1,1"][:len(hands)]), *ports], **quiet))
    files = lambda: sorted(log.glob("ticks.npy*"))  # noqa: E731
    try:
        give_up = time.monotonic() + 20
        while time.monotonic() < give_up and others[0].poll() is None and len(files()) <= parts:
            try:
                lists = json.loads((log / "manifest.json").read_text())
                if len(files()) == parts and files()[-1].stat().st_size > 4096 + 496 * rows and len(lists["files"]) > 2:
                    others[-1].send_signal(signal.SIGSTOP)  # the run: the recorder writes down what there is
                    if lists["parts"] == len(files()) and ("first_rows" in lists or not synced):
                        break
                else:  # it may have begun another file before it stood still
                    others[-1].send_signal(signal.SIGCONT)
            except (OSError, ValueError, IndexError):
                pass
            time.sleep(0.001)
    finally:
        for program in others:
            program.kill()
            program.wait()
    if len(files()) <= parts:
        return log
    (again := folder / "again").mkdir()  # it was faster than we looked
    return record_killed(root, programs, again, scene, hands, *recorder, parts=parts, rows=rows, synced=synced)
