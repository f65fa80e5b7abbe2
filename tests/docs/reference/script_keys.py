# SPDX-License-Identifier: Apache-2.0
"""The part of docs/scene-keys.md on other files: what the files of hands, of faults and of opacities may say."""
import re

from source import Source, same, same_defaults, table


def hand(root):
    file, limits = Source(root, "hil/script/hand_script_file.cpp"), Source(root, "hil/script/script_table.hpp")
    length, seconds = f"{file.number('kMaxLength'):g}", f"{limits.number('kMaxScriptSeconds'):g}"
    top = [
        ("unit_mm", f"above 0, to {file.number('kMaxUnitMm'):g}", "none: the scene's, else 1", "millimetres of the device for a unit of length in this file"),
        ("start_mm", f"[x, y, z], -{length} to {length}", "[0, 5, 0]", "first point, above the surface"),
        ("device", "table", "the device's own", "keys of the arm, below"),
        ("hand", "table", "the device's own", "keys of the grip, below"),
        ("step", f"tables, 1 to {file.number('kMaxSteps')}", "needed", "motions of the hand, in their order, below")]
    step = [
        ("move_mm", f"[x, y, z], -{length} to {length}", "", "motion: to this position"),
        ("hold", f"above 0, to {seconds} s", "", "motion: stay for this time"),
        ("circle_mm", f"0 to {length}", "", "motion: rounds about the current position in the horizontal plane, out to this radius and back"),
        ("zigzag_mm", f"[x, z], 0 to {length}", "",
         "motion: strokes of the first width along x, while z covers the second width once, there and back"),
        ("seconds", f"above 0, to {seconds} s", "1", "duration of the motion; not with `hold`"),
        ("ease", "`smooth`, `linear`", "`smooth`", "`smooth`: least jerk, from rest to rest; `linear`: constant speed"),
        ("turns", f"above 0, to {file.number('kMaxTurns'):g}", "1", "number of rounds of `circle_mm`, or of strokes of `zigzag_mm`"),
        ("sink_mm", f"-{length} to {length}", "0", "`circle_mm` and `zigzag_mm` end lower by this length"),
        ("button", "1, 2", "none", "button that is pressed during this step"),
        ("orientation_deg", f"three, -{file.number('kMaxDegrees'):g} to {file.number('kMaxDegrees'):g} degrees", "as before",
         "yaw, pitch from upright, and roll of the gimbal at the end of the step"),
        ("repeat", "true", "false", "the steps from this one to the last are repeated without end; in one step only")]
    same(f"{file.path}: the file", [row[0] for row in top], file.allowed("HandScript parse_hand_script("))
    same(f"{file.path}: [[step]]", [row[0] for row in step], file.allowed("HandStep step_of("))
    header = Source(root, "hil/device/hand_script.hpp")
    same_defaults(file.path, top, file.defaults("HandScript parse_hand_script(", header))
    same_defaults(file.path, step, file.defaults("HandStep step_of(", header))
    heads = ("key", "values", "default", "meaning")
    keys = Source(root, "hil/device/plant_params.hpp")
    rows = re.findall(r'\{"(device|hand)", "(\w+)", "(--[\w-]+)", ([\w.]+), ([\w.]+), (?:true|false),\s+"([^"]+)"', keys.text)
    same(f"{keys.path}: kPlantKeys", [row[1] for row in rows], re.findall(r'\{"(?:device|hand)", "(\w+)"', keys.text))
    params = Source(root, "hil/device/plant_params.hpp")
    plant = [(f"`[{where}] {key}`", f"{low} to {params.number(high) if high.startswith('k') else high}", f"`{option}`", meaning)
             for where, key, option, low, high, meaning in rows]
    code = lambda rows: [(f"`{row[0]}`", *row[1:]) for row in rows]
    return f"""## Hands

A hand script is a file for `--hand FILE` of `./kerf demo` and `./kerf emulator`, or for `[hand] script` of a scene. `scenes/hands`
has examples. Lengths are in units of `unit_mm`, in the device's frame: x right, y up, z to the user. The origin is the surface
point under the tool. Without `unit_mm` a unit is the radius of the scene's first tool at the device, so one script fits scenes
of all sizes. If you start `./kerf emulator` yourself, `--unit-mm` sets this unit, by default 1 mm.

{table(heads, code(top))}

Keys of a `[[step]]`. A step has exactly one motion:

{table(heads, code(step))}

Keys of the arm and the grip. An option of `./kerf emulator` replaces the value of the file:

{table(("key", "values", "option", "meaning"), plant)}
"""


def faults(root):
    head, file = Source(root, "hil/script/fault_script.hpp"), Source(root, "hil/script/fault_script.cpp")
    seconds = f"{Source(root, 'hil/script/script_table.hpp').number('kMaxScriptSeconds'):g}"
    words = lambda name: ", ".join(f"`{word}`" for word in head.words(name))
    counts = f"{file.number('kMaxCounts'):g}"
    top = [
        ("seed", f"0 to {int(file.number('kMaxSeed'))}", "1", "seed of all that is random"),
        ("clock", words("kFaultClockWords"), "`push`", "`push`: times count from the first push of the motors; `start`: from the start of the emulator"),
        ("latches", words("kLatchWords"), "not checked", "the fault that `./kerf lab faults` expects the controller to latch"),
        ("seconds", f"0.1 to {seconds} s", "4", "time for which `./kerf lab faults` plays the script"),
        ("fault", f"tables, 1 to {file.number('kMaxFaults')}", "needed, unless `seconds` is given", "the faults, below")]
    fault = [
        ("kind", "below", "needed", "kind of the fault"),
        ("packets", "`reports`, `commands`", "`reports`", "packets of the device, or of the host"),
        ("at_s", f"0 to {seconds} s", "0", "begin of the fault, by the clock"),
        ("for_s", f"0 to {seconds} s", "0: once", "duration of the fault; not for `host_late`, `hang_up`, `closing`, `half_close`, `both_closed`"),
        ("every", f"1 to {int(file.number('kMaxEvery'))}", "1", "every n-th packet, beginning with the first"),
        ("axis", "0, 1, 2", "0", "number of the encoder"),
        ("counts", f"-{counts} to {counts}, not 0", "needed", "error of the encoder"),
        ("ms", f"above 0, to {file.number('kMaxDelayMs'):g} ms", "needed", "delay, or age, of the packets")]
    same(f"{file.path}: the file", [row[0] for row in top], file.allowed("FaultScript parse_fault_script("))
    same(f"{file.path}: [[fault]]", [row[0] for row in fault], file.allowed("DeviceFault fault_of("))
    same_defaults(file.path, top, file.defaults("FaultScript parse_fault_script(", head))
    same_defaults(file.path, fault, file.defaults("DeviceFault fault_of(", head))
    kinds = [(word, comment) for word, _, comment in head.enumerators("FaultKind")]
    same(f"{head.path}: kFaultWords", [word for word, _ in kinds], head.words("kFaultWords"))
    names = [word for word, _ in kinds]
    known = {"packets": names[:names.index("corrupt") + 1], "axis": ["stick", "jump", "wander"], "counts": ["jump", "wander"],
             "ms": ["delay", "host_late", "replay"]}
    for key, begin in (("axis", "bool is_of_axis("), ("counts", "bool has_counts("), ("ms", "bool has_ms(")):
        same(f"{file.path}: {key}", known[key], re.findall(r"FaultKind::(\w+)", file.body(begin)))
    same(f"{file.path}: packets", ["corrupt"], re.findall(r"FaultKind::(\w+)", file.body("bool is_of_packets(")))
    known["every"] = known["packets"]
    of = lambda word: ", ".join(f"`{key}`" for key in ("packets", "every", "axis", "counts", "ms") if word in known[key])
    heads = ("key", "values", "default", "meaning")
    code = lambda rows: [(f"`{row[0]}`", *row[1:]) for row in rows]
    return f"""## Faults

A fault script is a file for `--fault FILE` of `./kerf emulator`, or for `--scripts` of `./kerf lab faults`. `hil/faults` has
examples. Only `./kerf lab faults --port ws` plays `unreadable` and the kinds below it. The emulated service has these as
`--bus-fault` ([wire](wire.md)).

{table(heads, code(top))}

Keys of a `[[fault]]`. A key that its kind does not have is refused:

{table(heads, code(fault))}

{table(("kind", "meaning", "keys besides `at_s` and `for_s`"), [(f"`{word}`", comment, of(word)) for word, comment in kinds])}
"""


def opacities(root):
    file, view = Source(root, "visualizer/scene/view_file.cpp"), Source(root, "visualizer/scene/appearance.cpp")
    same(f"{view.path}: tables", ["opacity"], set(re.findall(r'entry\.key == "(\w+)"', view.text)))
    return f"""## Opacities

This is a file for `--transfer FILE` of `./kerf demo` and `./kerf visualizer`, of at most {file.number('kLargest') // 1024} KiB. The key `w` of the window writes one.

    [opacity]
    enamel = 0.1

{table(("key", "values", "default", "meaning"), [("the name of a material of the scene", "0 to 1",
       "the scene's, else see below", "opacity over 1/8 mm, for `blend`, `slices` and `cast-blend`")])}

By default the softest material has {view.number('kSoftestOpacity'):g} and the hardest {view.number('kHardestOpacity'):g}. The opacities of the materials between them
fall in equal ratios. A scene with one material has {view.number('kSoftestOpacity'):g}.
"""


def camera(root):
    file, pose = Source(root, "visualizer/scene/view_file.cpp"), Source(root, "visualizer/scene/camera_pose.cpp")
    rule = Source(root, "shared/segment/presented_view.cpp")
    most = Source(root, "shared/segment/presented_view.hpp").number("kFarthestViewMm")
    rows = [(f"`{key}`", f"three numbers, {-most:g} to {most:g}", "needed", meaning) for key, meaning in (
        ("eye_mm", "position of the camera in the scene's world"),
        ("target_mm", "point in the middle of the picture, about which a drag rotates; not the position of the camera"),
        ("up", f"direction that points up in the picture; at least {rule.number('kLeastSine'):g} rad from the direction of view"))]
    same(f"{pose.path}: keys", [row[0].strip("`") for row in rows], re.findall(r'\{+"(\w+)", &pose', pose.text))
    return f"""## Camera

This is a file for `--camera FILE` of `./kerf demo` and `./kerf visualizer`, of at most {file.number('kLargest') // 1024} KiB. The key `n` of the window writes one.

    [camera]
    eye_mm = [12.5, 40, 33]
    target_mm = [0, 4, 0]
    up = [0, 1, 0]

{table(("key", "values", "default", "meaning"), rows)}
"""


def page(root, programs):
    same("kerf-emulator --help", ["--fault", "--hand"],
         {option for option in ("--fault", "--hand") if option + " " in programs.help("kerf-emulator")})
    same("kerf-lab faults --help", ["--scripts"], {o for o in ["--scripts"] if o in programs.help("kerf-lab", "faults")})
    return f"""# Hand, fault, opacity and camera files

All these files are TOML. A key that is unknown, has a wrong type or is out of its range is refused, with file, line and remedy.
A hand or fault file has at most 1 MiB.

{hand(root)}
{faults(root)}
{opacities(root)}
{camera(root)}"""
