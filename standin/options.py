# SPDX-License-Identifier: Apache-2.0
"""The options of `./kerf stand-in`, checked against each other and against what the libraries take."""
import ctypes
import dataclasses
import itertools
import os
import re

RATES_HZ = {"touch": (1000, 1000), "omega": (4000, 1000)}  # in real time, in lock-step
NAMES = {"touch": "Default Device", "omega": "omega.3"}  # of the first of its kind, unless --vendor-name gives one
MOST_DEVICES = 4  # as kMostDevices of settings.hpp
OF_DEVICE = {"--hand": "hand", "--fault": "fault", "--rate": "rate", "--vendor-name": "name"}
WITH_VALUE = ("--device", "--vendor-name", "--hand", "--fault", "--seconds", "--rate", "--on-silence", "--switch", "--report",
              "--junit")


class Refusal(Exception):
    """Bad input or set-up: `place: value; remedy`. Exit code 2."""


@dataclasses.dataclass
class Device:
    kind: str = "touch"
    name: str = ""
    hand: str = ""  # empty: the usual one
    fault: str = ""
    rate: str = ""  # Hz; empty: that of RATES_HZ

    def rate_hz(self, lockstep):
        return int(self.rate) if self.rate else RATES_HZ[self.kind][lockstep]

    @property
    def label(self):
        return f"{self.kind} {self.name}"


@dataclasses.dataclass
class Options:
    devices: list = dataclasses.field(default_factory=list)
    seconds: str = ""
    on_silence: str = "hold"
    report: str = ""
    junit: str = ""
    lockstep: bool = False
    switches: list = dataclasses.field(default_factory=list)
    command: list = dataclasses.field(default_factory=list)


def parse(words, libraries):
    """Throws Refusal at the first word that is wrong.

    An option of a device belongs to the --device before it; before the first, to all devices that have none of their own.
    """
    options, words, usual = Options(), list(words), Device()
    while words:
        name = words.pop(0)
        if name == "--":
            options.command = words
            break
        if name == "--lockstep":
            options.lockstep = True
            continue
        if name not in WITH_VALUE:
            raise Refusal(f"{name}: unknown; write -- before the command, and see ./kerf stand-in --help")
        if not words or not words[0] or words[0].startswith("--"):
            raise Refusal(f"{name}: no value; see ./kerf stand-in --help")
        value = words.pop(0)
        if name == "--device":
            options.devices.append(dataclasses.replace(usual, kind=value))
        elif name in OF_DEVICE:
            setattr(options.devices[-1] if options.devices else usual, OF_DEVICE[name], value)
        elif name == "--switch":
            options.switches.append(value)
        else:
            setattr(options, name[2:].replace("-", "_"), value)
    options.devices = options.devices or [usual]
    check(options, libraries)
    return options


def refusal_of_switch(libraries, switch):
    """What the libraries will say of it: they alone know the words and ranges. None: nothing."""
    path = os.path.join(libraries, "libHD.so")
    try:
        ask = ctypes.CDLL(path).kerf_stand_in_refusal_of_switch
    except (OSError, AttributeError):
        raise Refusal(f"{path}: not built, or of another version; try ./kerf setup") from None
    ask.argtypes, ask.restype = [ctypes.c_char_p], ctypes.c_char_p
    line = ask(os.fsencode(switch))
    return line and os.fsdecode(line)


def check_device(device, lockstep):
    if device.kind not in RATES_HZ:
        raise Refusal(f"--device {device.kind}: unknown; take touch or omega")
    if device.rate and (not re.fullmatch(r"[0-9]{3,4}", device.rate) or not 100 <= int(device.rate) <= 8000
                        or lockstep and 8000 % int(device.rate)):
        raise Refusal(f"--rate {device.rate}: not a rate in Hz (in lock-step it divides 8000); take 1000")
    if device.name and (not device.name.isprintable() or "," in device.name):  # it divides the libraries' settings
        raise Refusal(f"--vendor-name {device.name!a}: has a comma or a character that cannot be printed; take another name")
    for name, path in (("--hand", device.hand), ("--fault", device.fault)):
        if path and not os.path.isfile(path):
            raise Refusal(f"{name} {path}: no such file; name a script")


def free_name(kind, number, given):
    """The usual one of the device of that number, or of the next number whose name no device of the kind has."""
    names = (NAMES[kind] + (f" {at}" if at > 1 else "") for at in itertools.count(number))
    return next(name for name in names if (kind, name) not in given)


def check_devices(options):
    """Each, and all of a kind together. Devices without a name get one."""
    if len(options.devices) > MOST_DEVICES:
        raise Refusal(f"--device {options.devices[MOST_DEVICES].kind}: number {MOST_DEVICES + 1}; a program has at most "
                      f"{MOST_DEVICES} devices")
    of_kind = {}
    given = {(device.kind, device.name) for device in options.devices}
    for device in options.devices:
        check_device(device, options.lockstep)
        others = of_kind.setdefault(device.kind, [])
        if not device.name:
            device.name = free_name(device.kind, len(others) + 1, given)
            given.add((device.kind, device.name))
        for other in others:
            if other.name == device.name:
                raise Refusal(f"--vendor-name {device.name}: two devices of one kind have it; give each its own")
            if device.kind == "touch" and other.rate_hz(options.lockstep) != device.rate_hz(options.lockstep):
                raise Refusal(f"--rate {device.rate}: another one than for the other touch, and one servo thread serves both; "
                              "give --rate once, before the first --device")
        others.append(device)


def check(options, libraries):
    if not options.command:
        raise Refusal("no command; write it behind --, as in ./kerf stand-in -- python3 program.py")
    check_devices(options)
    if options.on_silence not in ("hold", "drop"):
        raise Refusal(f"--on-silence {options.on_silence}: unknown; take hold or drop")
    if options.seconds and (not re.fullmatch(r"[0-9]{1,6}(\.[0-9]+)?", options.seconds) or float(options.seconds) < 0.01):
        raise Refusal(f"--seconds {options.seconds}: not a number of seconds; take 10")
    for switch in options.switches:
        if refusal := refusal_of_switch(libraries, switch):
            raise Refusal(f"--switch {switch}: {refusal}")
    for name, path in (("--report", options.report), ("--junit", options.junit)):
        if path and not os.path.isdir(os.path.dirname(os.path.abspath(path))):
            raise Refusal(f"{name} {path}: no such folder; create it first")
