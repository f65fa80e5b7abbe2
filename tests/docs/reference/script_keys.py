# SPDX-License-Identifier: Apache-2.0
"""The part of docs/scene-keys.md on other files: what the files of hands, of faults and of opacities may say."""
import re

from source import Source, same, same_defaults, table


def hand(root):
    file, limits = Source(root, "hil/script/hand_script_file.cpp"), Source(root, "hil/script/script_table.hpp")
    length, seconds = f"{file.number('kMaxLength'):g}", f"{limits.number('kMaxScriptSeconds'):g}"
    top = [
        ("unit_mm", f"above 0, to {file.number('kMaxUnitMm'):g}", "none: the scene's, else 1", "device mm per unit of length in this file"),
        ("start_mm", f"[x, y, z], -{length} to {length}", "[0, 5, 0]", "first point, above the surface"),
        ("device", "table", "the device's own", "the arm, below"),
        ("hand", "table", "the device's own", "the grip, below"),
        ("step", f"tables, 1 to {file.number('kMaxSteps')}", "needed", "what the hand does, one after the other, below")]
    step = [
        ("move_mm", f"[x, y, z], -{length} to {length}", "", "a motion: to this place"),
        ("hold", f"above 0, to {seconds} s", "", "a motion: stay for so long"),
        ("circle_mm", f"0 to {length}", "", "a motion: around here in the horizontal plane, out to this radius and back"),
        ("zigzag_mm", f"[x, z], 0 to {length}", "",
         "a motion: strokes of the first width along x, while z goes over the second once, there and back"),
        ("seconds", f"above 0, to {seconds} s", "1", "how long the motion takes; not with `hold`"),
        ("ease", "`smooth`, `linear`", "`smooth`", "least jerk, from rest to rest; or constant speed"),
        ("turns", f"above 0, to {file.number('kMaxTurns'):g}", "1", "rounds of `circle_mm`, strokes of `zigzag_mm`"),
        ("sink_mm", f"-{length} to {length}", "0", "`circle_mm` and `zigzag_mm` end this much lower"),
        ("button", "1, 2", "none", "pressed during this step"),
        ("orientation_deg", f"three, -{file.number('kMaxDegrees'):g} to {file.number('kMaxDegrees'):g} degrees", "as before",
         "yaw, pitch from upright, and roll of the gimbal, reached at the step's end"),
        ("repeat", "true", "false", "from this step to the last again and again; of one step")]
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

`--hand FILE` of `./kerf demo` and `./kerf emulator`, and `[hand] script` of a scene. Lengths count in units of `unit_mm`,
in the device's frame: x right, y up, z to the user. The origin is the surface point under the tool. Without `unit_mm` a unit
is the radius of the scene's first tool at the device, so one script fits scenes of all sizes; `--unit-mm` of
`./kerf emulator` sets it then. `scenes/hands` has examples.

{table(heads, code(top))}

Of a `[[step]]`. It has exactly one motion:

{table(heads, code(step))}

Of the arm and the grip. An option of `./kerf emulator` wins over the file:

{table(("key", "values", "option", "meaning"), plant)}
"""


def faults(root):
    head, file = Source(root, "hil/script/fault_script.hpp"), Source(root, "hil/script/fault_script.cpp")
    seconds = f"{Source(root, 'hil/script/script_table.hpp').number('kMaxScriptSeconds'):g}"
    words = lambda name: ", ".join(f"`{word}`" for word in head.words(name))
    counts = f"{file.number('kMaxCounts'):g}"
    top = [
        ("seed", f"0 to {int(file.number('kMaxSeed'))}", "1", "of everything that is random"),
        ("clock", words("kFaultClockWords"), "`push`", "times count from the motors' first push, or from the emulator's start"),
        ("latches", words("kLatchWords"), "not checked", "what `./kerf lab faults` demands that the controller latches"),
        ("seconds", f"0.1 to {seconds} s", "4", "how long `./kerf lab faults` plays it"),
        ("fault", f"tables, 1 to {file.number('kMaxFaults')}", "needed, but where `seconds` is given", "below")]
    fault = [
        ("kind", "below", "needed", "what goes wrong"),
        ("packets", "`reports`, `commands`", "`reports`", "whose packets: the device's, or the host's"),
        ("at_s", f"0 to {seconds} s", "0", "when it begins, by the clock"),
        ("for_s", f"0 to {seconds} s", "0: once", "how long it lasts; not of `host_late`, `hang_up`, `closing`, `half_close`, `both_closed`"),
        ("every", f"1 to {int(file.number('kMaxEvery'))}", "1", "each so-many-th packet, the first one included"),
        ("axis", "0, 1, 2", "0", "which encoder"),
        ("counts", f"-{counts} to {counts}, not 0", "needed", "how far the encoder is off"),
        ("ms", f"above 0, to {file.number('kMaxDelayMs'):g} ms", "needed", "how late, or how old")]
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

`--fault FILE` of `./kerf emulator`, and `--scripts` of `./kerf lab faults`. `hil/faults` has examples. `unreadable` and the kinds
below it are played by `./kerf lab faults --port ws` alone; the emulated service has them as `--bus-fault` ([wire](wire.md)).

{table(heads, code(top))}

Of a `[[fault]]`. A key that its kind does not have is refused:

{table(heads, code(fault))}

{table(("kind", "meaning", "its keys, beside at_s and for_s"), [(f"`{word}`", comment, of(word)) for word, comment in kinds])}
"""


def opacities(root):
    file, view = Source(root, "visualizer/scene/view_file.cpp"), Source(root, "visualizer/scene/appearance.cpp")
    same(f"{view.path}: tables", ["opacity"], set(re.findall(r'entry\.key == "(\w+)"', view.text)))
    return f"""## Opacities

`--transfer FILE` of `./kerf demo` and `./kerf visualizer`; `w` in the window writes such a file. At most {file.number('kLargest') // 1024} KiB.

    [opacity]
    enamel = 0.1

{table(("key", "values", "default", "meaning"), [("the name of a material of the scene", "0 to 1",
       "the scene's, else below", "opacity over 1/8 mm, for `blend`, `slices` and `cast-blend`")])}

By default the softest material has {view.number('kSoftestOpacity'):g} and the hardest {view.number('kHardestOpacity'):g}, those between them in equal
ratios; a scene of one material has {view.number('kSoftestOpacity'):g}.
"""


def camera(root):
    file, pose = Source(root, "visualizer/scene/view_file.cpp"), Source(root, "visualizer/scene/camera_pose.cpp")
    rule = Source(root, "shared/segment/presented_view.cpp")
    most = Source(root, "shared/segment/presented_view.hpp").number("kFarthestViewMm")
    rows = [(f"`{key}`", f"three numbers, {-most:g} to {most:g}", "needed", meaning) for key, meaning in (
        ("eye_mm", "where the camera stands, in the scene's world"),
        ("target_mm", "what is in the middle of the picture, and what a drag turns about; not at the eye"),
        ("up", f"a direction that is upright in the picture; {rule.number('kLeastSine'):g} rad or more beside the view"))]
    same(f"{pose.path}: keys", [row[0].strip("`") for row in rows], re.findall(r'\{+"(\w+)", &pose', pose.text))
    return f"""## Camera

`--camera FILE` of `./kerf demo` and `./kerf visualizer`; `n` in the window writes such a file. At most {file.number('kLargest') // 1024} KiB.

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

Each is TOML. A key that is unknown, of a wrong type or out of its range is refused with file, line and way out. A hand or
fault file has at most 1 MiB.

{hand(root)}
{faults(root)}
{opacities(root)}
{camera(root)}"""
