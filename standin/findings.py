# SPDX-License-Identifier: Apache-2.0
"""What a program did with a stand-in: read from the ledger of the libraries and the report of the emulator, written as JSON
and JUnit."""
import json
import math
import struct
from xml.sax.saxutils import escape, quoteattr

BUCKET_US = 10
HOUSE_KEEPING_N = 1e-3  # a force below one step of the packet is none

MISUSE = {  # rows of the ledger, and what each one means
    "frames_not_ended": "a frame was still open at the end of its tick",
    "begins_refused": "a frame began within another, or a second one in its tick",
    "ends_refused": "a frame ended that had not begun",
    "set_outside_frame": "a force was set outside a frame",
    "bad_handles": "a call for a device that is not open",
    "bad_schedules": "a callback was unscheduled that is not scheduled",
    "not_finite": "a force that is not a finite number",
    "output_off": "forces while the output was off",
    "not_cleared": "the scheduler stopped, or the device was closed, with a force",
    "stalls": "a callback, or a pause while a force was on, lasted too long",
}
OF_NO_DEVICE = ("bad_handles", "bad_schedules")
NOTES = {
    "output_off": MISUSE["output_off"],
    "before_enable": "forces before dhdEnableForce: given here, perhaps not by a device",
    "after_trip": "forces after the device had switched its motors off",
    "excess": "forces above the device's limit",
    "impulses": "steps of the force above the limit",
    "too_fast": "ticks above the limit of speed",
    "lost_link": "times that the device was gone",
    "watchdog": "expiries of the watchdog",
    "in_use": "times that a program opened the device while another one used it",
    "warm": "times that a motor became warm",
}
OF_ONE = {"forces": "force", "steps": "step", "ticks": "tick", "times": "time", "expiries": "expiry"}  # the notes' first words


def read_ledger(path):
    """The rows by name, and the number of periods by bucket. A program that loaded no library leaves none."""
    try:
        with open(path, "rb") as file:
            data = file.read()
    except FileNotFoundError:
        data = b""
    if len(data) < 16:
        return {}, []
    magic, rows, buckets = struct.unpack_from("<8sII", data)
    if magic != b"kerfldg1" or len(data) < 16 + 48 * rows + 8 * buckets:
        raise ValueError(f"{path}: not a ledger of this version of kerf; build it again with ./kerf setup")
    counts = {}
    for at in range(16, 16 + 48 * rows, 48):
        name = data[at:at + 39].rstrip(b"\0").decode()
        counts[name] = struct.unpack_from("<d" if data[at + 39:at + 40] == b"d" else "<Q", data, at + 40)[0]
    return counts, list(struct.unpack_from(f"<{buckets}Q", data, 16 + 48 * rows))


def percentile_us(periods, fraction):
    """The upper end of the bucket that holds it; None without a period."""
    total, seen = sum(periods), 0
    for bucket, count in enumerate(periods):
        seen += count
        if total and seen >= fraction * total:
            return (bucket + 1) * BUCKET_US
    return None


def finite(value):
    """None, which JSON has, for a sum that no double holds."""
    return value if math.isfinite(value) else None


def rows_of(counts, meanings):
    return [{"what": name, "count": counts[name], "meaning": meaning} for name, meaning in meanings.items() if counts.get(name)]


def deadlines(counts, periods):
    return {
        "ticks": counts.get("ticks", 0),
        "missed_ticks": counts.get("missed_ticks", 0),
        "period_us": {"p50": percentile_us(periods, 0.5), "p99": percentile_us(periods, 0.99),
                      "max": counts.get("longest_period_us") if sum(periods) else None},
        "longest_callback_us": counts.get("longest_us", 0.0),
    }


def of_device(device, rate_hz, ledger, program, emulator):
    """The findings of one device. `program`: the ledger of what belongs to no device, with HD's servo thread, which all share."""
    counts, _ = ledger
    commands = counts.get("commands", 0)
    misuse = rows_of(counts, MISUSE)
    opened, closed = counts.get("opened", 0), counts.get("closed", 0)
    if opened > closed:
        misuse.append({"what": "left_open", "count": opened - closed, "meaning": "the program ended without closing the device"})
    if opened > closed and counts.get("last_n", 0) > HOUSE_KEEPING_N:
        misuse.append({"what": "force_at_end", "count": 1, "meaning": "the program ended with a force"})
    if not opened:
        misuse.append({"what": "not_opened", "count": 1, "meaning": "the program did not open the device"})
    return {
        "device": device.kind,
        "name": device.name,
        "rate_hz": rate_hz,
        "seconds": emulator.get("seconds"),
        "force": {
            "commands": commands,
            "peak_n": finite(counts.get("peak_n", 0.0)),
            "rms_n": finite((counts["square_sum_n2"] / commands) ** 0.5 if commands else 0.0),
            "given_peak_n": emulator.get("peak_motor_force_n"),
            "given_rms_n": emulator.get("rms_motor_force_n"),
            "given_at_end_n": emulator.get("final_motor_force_n"),
        },
        "energy": {"given_mj": emulator.get("motor_work_mj")},
        "deadlines": deadlines(*(program if device.kind == "touch" else ledger)),
        "misuse": misuse,
        "notes": rows_of(counts, NOTES),
        "final_tip_mm": emulator.get("final_tip_mm"),
        "report_hash": emulator.get("report_hash"),
    }


def label(device):
    return f"{device['device']} {device['name']}"


def findings(devices, program, run):
    """The report as a dictionary: of a single device its findings, of several a list of them, with all misuse and notes at the
    top, too. `run`: command, exit code and the like, which go in unchanged."""
    if len(devices) == 1:
        return {**run, **devices[0]}
    together = {}
    for key, meanings in (("misuse", MISUSE), ("notes", NOTES)):
        together[key] = rows_of(program[0], meanings)
        together[key] += [{"of": label(device), **one} for device in devices for one in device[key]]
    return {**run, **together, "devices": devices}


def write_json(path, report):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(report, file, indent=2)
        file.write("\n")


def suite(name, cases):
    """`cases`: (name, why it failed or nothing)."""
    failed = sum(bool(why) for _, why in cases)
    yield f'<testsuite name={quoteattr(name)} tests="{len(cases)}" failures="{failed}" errors="0" skipped="0">\n'
    for case, why in cases:
        yield f'  <testcase classname={quoteattr(name.removeprefix("kerf "))} name={quoteattr(case)}'
        yield f'><failure message={quoteattr(why)}>{escape(why)}</failure></testcase>\n' if why else "/>\n"
    yield "</testsuite>\n"


def junit(report):
    """One case for the command, and for each kind of misuse; of several devices a suite for each."""
    command = ("command", f"exit code {report['exit_code']}" if report["exit_code"] else "")

    def cases(found, names):
        why = {one["what"]: f"{one['count']} x {one['meaning']}" for one in found}
        return [(name, why.get(name, "")) for name in names]

    of_devices = [*MISUSE, "left_open", "force_at_end", "not_opened"]
    if "devices" not in report:
        yield from suite("kerf stand-in", [command, *cases(report["misuse"], of_devices)])
        return
    yield "<testsuites>\n"
    of_none = [one for one in report["misuse"] if "of" not in one]
    yield from suite("kerf stand-in", [command, *cases(of_none, [*OF_NO_DEVICE, "stalls"])])  # a callback stalls all devices
    for device in report["devices"]:
        names = [name for name in of_devices if name not in OF_NO_DEVICE]
        yield from suite("kerf stand-in " + label(device), cases(device["misuse"], names))
    yield "</testsuites>\n"


def write_junit(path, report):
    with open(path, "w", encoding="utf-8") as file:
        file.write('<?xml version="1.0" encoding="UTF-8"?>\n')
        file.writelines(junit(report))


def newtons(value):
    return "unknown" if value is None else f"{value:.2f} N" if value < 1e6 else f"{value:.3g} N"


def counted(note):
    count, (what, rest) = note["count"], note["meaning"].split(" ", 1)
    return f"{count} {OF_ONE[what] if count == 1 else what} {rest}"


def summary(report):
    """Lines for a person."""
    for device in report.get("devices", [report]):
        of = f"{label(device)}: " if "devices" in report else ""
        force, late = device["force"], device["deadlines"]
        work = device["energy"]["given_mj"]
        yield (f"{of}force: {force['commands']} commands, peak {newtons(force['peak_n'])}, RMS {newtons(force['rms_n'])}; given: peak "
               f"{newtons(force['given_peak_n'])}, RMS {newtons(force['given_rms_n'])}"
               + (f", {work:.1f} mJ" if work is not None else ""))
        period = late["period_us"]
        if period["p50"] is not None:
            yield (f"{of}deadlines: {late['ticks']} ticks, {late['missed_ticks']} missed; period p50 {period['p50']} us, "
                   f"p99 {period['p99']} us, max {period['max']:.0f} us")
    misused = {(one.get("of"), one["what"]) for one in report["misuse"]}
    for one in report["notes"]:
        if (one.get("of"), one["what"]) not in misused:
            yield f"note: {one['of'] + ': ' if 'of' in one else ''}{counted(one)}"
    for one in report["misuse"]:
        yield f"misuse: {one['of'] + ': ' if 'of' in one else ''}{one['what']}: {one['count']} x {one['meaning']}"
