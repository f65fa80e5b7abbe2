# SPDX-License-Identifier: Apache-2.0
"""The options of `./kerf demo`: `./kerf demo --help` has their meaning."""
import dataclasses
import errno
import os
import pathlib
import re
import shutil
import socket
import tomllib

BUSES = {"omni": ("fw", "fw1"), "falcon": ("usb", "usb"), "woodenhaptics": ("hid", "hidraw0"),  # word of --port, its node
         "inverse3": ("arm", ""), "touch": ("arm", ""), "omega": ("arm", "")}  # no node: a service or a library of the vendor
STAND_INS = {"touch": "libHD.so", "omega": "libdrd.so.3"}  # kerf's own in place of the vendor's library
PICTURE_SIZE, WINDOW_SIZE = "640x480", "1280x800"  # if none is given; a window's on a screen of 96 dots per inch
FLAGS = ("--headless", "--full-screen", "--serve", "--stereo", "--voxel-tool", "--mute", "--colour-blind", "--present", "--follow-view", "--virtual", "--two-machines")
OF_SCENE = ("--scene", "--volume", "--spacing", "--override-spacing", "--window", "--set")
OF_LINK = {"--loss": (50, 1), "--delay-ms": (2000, 20), "--mbit": (100000, 4)}  # of two machines: the most of each, a bad one
WITH_VALUE = (*OF_SCENE, *OF_LINK, "--hand", "--seconds", "--rate", "--out", "--size", "--renderer", "--camera", "--aov",
              "--gradient", "--panels", "--panel-scale", "--monitor",
              "--device", "--port", "--library", "--sheet", "--transfer", "--record", "--listen", "--name")


class Refusal(Exception):
    """Bad input or set-up: `location: value; remedy`. Ends the demo with exit code 2."""


@dataclasses.dataclass
class Options:
    scene: str = ""
    volume: list = dataclasses.field(default_factory=list)  # those of OF_SCENE, for the controller
    look: list = dataclasses.field(default_factory=list)  # for the visualizer
    screen: list = dataclasses.field(default_factory=list)  # for its window alone
    again: list = dataclasses.field(default_factory=list)  # all but the scene: for the next demo of the same window
    hand: str = ""
    seconds: str = ""
    rate: str = ""
    out: str = ""
    size: str = ""  # of the pictures; none: PICTURE_SIZE, and a window takes what suits its screen
    device: str = ""  # by choose_devices
    second: str = ""  # the other device of a scene with two; by choose_devices
    port: str = ""  # by choose_port
    library: str = ""  # for --port arm: in place of kerf's stand-in for the vendor's
    stand_in: bool = False  # that one is used
    listen: str = ""
    name: str = ""  # of the controller; demo-PID
    sheet: str = ""
    record: str = ""
    link: list = dataclasses.field(default_factory=list)  # those of OF_LINK
    two_machines: bool = False
    headless: bool = False
    serve: bool = False
    virtual: bool = False
    bound_is_told: bool = False

    @property
    def mouse(self):
        return self.hand == "mouse"


def parse(words):
    """Options from the command line. Throws Refusal at the first word that is wrong."""
    options, given = Options(), set()
    words = list(words)
    while words:
        name = words.pop(0)
        if name in FLAGS:
            options.again.append(name)
            if name in ("--headless", "--serve", "--virtual", "--two-machines"):
                setattr(options, name[2:].replace("-", "_"), True)
            else:
                (options.screen if name == "--full-screen" else options.look).append(name)
            continue
        if name not in WITH_VALUE:
            raise Refusal(f"{name}: unknown; see ./kerf demo --help")
        if not words or not words[0] or words[0].startswith("--"):
            raise Refusal(f"{name}: no value; see ./kerf demo --help")
        if name in given and name != "--set":
            raise Refusal(f"{name}: is given twice; give it once")
        given.add(name)
        value = words.pop(0)
        if name not in OF_SCENE or name == "--set":
            options.again += [name, value]
        if name in ("--renderer", "--camera", "--aov", "--gradient", "--transfer", "--panels", "--panel-scale"):
            options.look += [name, value]
        elif name == "--monitor":
            options.screen += [name, value]
        elif name in OF_SCENE and name != "--scene":
            options.volume += [name, value]
        elif name in OF_LINK:
            options.link += [name, value]
        else:
            setattr(options, name[2:], value)
    options.headless = options.headless or bool(options.sheet) or "--aov" in given
    return options


def has_display():
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def runs(name):
    """Whether a controller of this name is there: its socket refuses one of another type, and does not notice."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    folder = f"{runtime}/kerf" if runtime.startswith("/") else f"/tmp/kerf-{os.geteuid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        try:
            return asking.connect_ex(f"{folder}/{name}.sock") == errno.EPROTOTYPE
        except OSError:  # longer than a socket's path, which the controller refuses
            return False


def check_link(options):
    """What belongs to two machines, and what they exclude."""
    for name, value in zip(options.link[::2], options.link[1::2]):
        if not options.two_machines:
            raise Refusal(f"{name} {value}: of a link between two machines; give --two-machines too")
        most, usual = OF_LINK[name]
        if not re.fullmatch(r"[0-9]{1,6}(\.[0-9]+)?", value) or float(value) > most:
            raise Refusal(f"{name} {value}: not a number from 0 to {most}; take {usual}")
    if not options.two_machines:
        return
    for given, word, why in ((options.virtual, "--virtual", "a link has a clock"),
                             (options.mouse, "--hand mouse", "the picture is on one machine and the hand on the other"),
                             (options.serve, "--serve", "no browser of this machine reaches a network of their own"),
                             (options.name, "--name", "no reader of this machine reaches it"),
                             (options.port != "socket", f"--port {options.port}", "their device is a socket")):
        if given:
            raise Refusal(f"{word}: not with --two-machines: {why}; leave one of them out")


def is_compressed(video):
    """As the visualizer has it."""
    return video.endswith((".mp4", ".mkv"))


TICK_BYTES = 496  # a row of the log, of one arm


def table_of(scene):
    """The scene's TOML. A file that is no scene is left to the controller, which says why: nothing is known of it here."""
    try:
        return tomllib.loads(pathlib.Path(scene).read_text(encoding="utf-8")) if os.path.isfile(scene) else {}
    except (OSError, ValueError, RecursionError):
        return {}


def expected_rate_hz(options, scene):
    """Of the servo, before its controller runs, which refuses what is no rate."""
    held = table_of(scene).get("servo")
    rates = [held.get("rate_hz")] if isinstance(held, dict) else []
    rates += [word.partition("=")[2] for word in options.volume if word.startswith("servo.rate_hz=")]
    try:
        return min(int([1000, *rates, *filter(None, [options.rate])][-1]), 8000)
    except (OverflowError, TypeError, ValueError):
        return 1000


def log_bytes_per_s(options, rate_hz):
    return TICK_BYTES * rate_hz * (2 if options.second else 1)


def growth(options, rate_hz):
    """Lines that say beforehand how large files become: a raw video, the log of more than a minute."""
    lines, seconds = [], float(options.seconds)
    width, height = map(int, (options.size or (PICTURE_SIZE if options.headless else WINDOW_SIZE)).split("x"))
    is_stream = os.path.exists(options.record) and not os.path.isfile(options.record)
    if options.record and not is_compressed(options.record) and not is_stream:
        way = "a name that ends in .mp4 compresses it" if shutil.which("ffmpeg") else "ffmpeg would compress it, apt-get install ffmpeg"
        lines.append(f"--record {options.record}: raw, {1.5 * width * height * 60 / 1e6:.0f} MB a second; {way}")
    if options.out and seconds > 60:
        lines.append(f"--out {options.out}: its log grows by {60 * log_bytes_per_s(options, rate_hz) / 1e6:.0f} MB a minute")
    return lines


def choose_devices(options, scene):
    """Those of a scene with two devices; else the one of --device, or an Omni."""
    held = table_of(scene).get("device")
    devices = [one.get("personality", "omni") for one in held if isinstance(one, dict)] if isinstance(held, list) else []
    if len(devices) == 2 and not options.device and all(isinstance(one, str) and one in BUSES for one in devices):
        options.device, options.second = devices
    else:
        options.second = options.device if len(devices) == 2 else ""
        options.device = options.device or "omni"
    if not options.second:
        return
    if options.two_machines:
        raise Refusal("--two-machines: not for a scene with two devices, whose emulators are on one; leave it out")
    if options.port not in ("", "socket"):
        raise Refusal(f"--port {options.port}: not for a scene with two devices; take socket, which is the default there")
    options.port = "socket"


def choose_port(options, stand_ins):
    """If none is given: a Cartesian device by its vendor's service or library, as a real one, unless in lock-step or between two
    machines; any other by a socket. `stand_ins`: the folder of kerf's libraries; empty if an installed kerf has none."""
    has_library = options.device in STAND_INS  # an inverse3 has a service, which the emulator is
    if options.port == "arm" and has_library:  # on the user's word alone: it may be a vendor's, and its device a real one
        options.library = options.library or os.environ.get("KERF_ARM_LIBRARY", "")
    if not options.port:
        own = BUSES.get(options.device, ("socket", ""))[0]
        fits = own == "arm" and (not has_library or (stand_ins and not options.library))
        options.port = own if fits and not options.virtual and not options.two_machines else "socket"
    if options.port == "arm" and not options.library and stand_ins and has_library:
        options.library, options.stand_in = os.path.join(stand_ins, STAND_INS[options.device]), True


def check(options):
    """Completes the options by defaults, and throws Refusal for values and combinations that cannot be."""
    if options.record == "-":
        raise Refusal("--record -: the demo itself writes to the standard output; name a file or a pipe")
    if options.listen and not options.serve:
        raise Refusal(f"--listen {options.listen}: nothing listens without --serve; give both")
    check_link(options)
    if options.mouse:
        if options.virtual:
            raise Refusal("--hand mouse: no user is as fast as --virtual; leave one of them out")
        if options.headless:
            raise Refusal("--hand mouse: --headless and --sheet have no window to point at; leave one of them out")
        if not has_display():
            raise Refusal("--hand mouse: no display; set DISPLAY, or leave it out: a script is the hand then")
    if options.screen and options.headless:
        raise Refusal(f"{options.screen[0]}: --headless and --sheet have no window; leave one of them out")
    if options.name and not re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}", options.name):
        raise Refusal(f"--name {options.name}: no name of a controller; use 1 to 64 letters, digits, '.', '_' or '-'")
    if options.name and runs(options.name):
        raise Refusal(f"--name {options.name}: a controller of this name runs; stop it or choose another name")
    options.bound_is_told = options.mouse or options.serve  # a person works as long as they do, not as a script does
    options.seconds = options.seconds or ("600" if options.mouse else "60" if options.serve else "10")
    if not re.fullmatch(r"[0-9]{1,6}(\.[0-9]+)?", options.seconds) or not re.search("[1-9]", options.seconds):
        raise Refusal(f"--seconds {options.seconds}: not a positive number of seconds; take 10")
    if is_compressed(options.record) and not shutil.which("ffmpeg"):
        raise Refusal(f"--record {options.record}: no ffmpeg to compress it; apt-get install ffmpeg, or name a .y4m")
    size = re.fullmatch(r"([1-9][0-9]{0,4})x([1-9][0-9]{0,4})", options.size or PICTURE_SIZE)
    if not size or int(size[1]) > 8192 or int(size[2]) > 8192:
        raise Refusal(f"--size {options.size}: not WIDTHxHEIGHT in pixels, 1 to 8192 each; take 640x480")
    if options.device not in BUSES:
        raise Refusal(f"--device {options.device}: unknown; take " + ", ".join(BUSES))
    bus = BUSES[options.device][0]
    if options.port not in ("socket", bus):
        raise Refusal(f"--port {options.port}: not for --device {options.device}; take socket or {bus}")
    if options.port == "arm" and options.device in STAND_INS and not options.stand_in and not os.path.isfile(options.library):
        given = f"--library {options.library}: not a file" if options.library else "--port arm: no library"
        raise Refusal(f"{given}; name that of a stand-in for the vendor's: --library PATH")
    if options.virtual and options.port not in ("socket", "fw") and options.device != "inverse3":
        own = "a vendor's library" if options.port == "arm" else "a USB bus"
        raise Refusal(f"--virtual: {own} keeps its own time; take --port socket")
    options.headless = options.headless or not has_display()
    if options.headless and not (options.sheet or options.record):
        options.out = options.out or "kerf-demo"  # who sees no window finds the pictures there
