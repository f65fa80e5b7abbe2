# SPDX-License-Identifier: Apache-2.0
"""docs/reports.md: the JSON that programs write for other programs."""
import re

from source import Source, same, table

SPREAD = "`p50`, `p99`, `p999`, `max`"
# Title; how to get it; (file, function) that write it; rows of (keys, unit, meaning). A key of a nested object has a row
# of its own, or stands in `inner`.
REPORTS = [
    ("Controller: a run", "`./kerf controller --report FILE`, and `report.json` of a demo.",
     [("controller/run/run_report.cpp", name) for name in ("std::string report_json(", "Json percentiles(", "Json list(")],
     ["p50", "p99", "p999", "max", "tick", "name", "what", "effect"], [
        ("program, version", "", "kerf-controller and its version"),
        ("scene, device, numeric", "", "file of the scene; device and numbers of the loop, empty where it was not loaded yet"),
        ("config_hash", "", "of all settings: equal where two runs had the same"),
        ("rate_hz", "Hz", "of the servo"),
        ("velocity_estimator", "", "by its name in a scene"),
        ("virtual", "", "true: in lock-step, without a clock"),
        ("end", "", "why the run ended"),
        ("waiting", "", "what the run waited for at the end: the device, or its own scene; empty: nothing"),
        ("ticks", "", "servo steps since the user picked up the device; the counts below are of these"),
        ("armed_at_tick", "", "tick of the segment and of the log that was the first of them"),
        ("overruns", "", "deadlines that were skipped because a tick ran over"),
        ("stale_ticks", "", "ticks that had no new report of the device, before it had gone"),
        ("wake_us, compute_us, publish_us", "us", f"how late ticks began; computed; published: {SPREAD}"),
        ("allocations", "", "of the heap in the loop"),
        ("allocations_counted", "", "false: a build with sanitizers does not count them"),
        ("minor_faults, major_faults", "", "page faults in the loop"),
        ("guarded", "", "true: with `--guard`"),
        ("unexpected_call", "", "system call that the guard caught; empty: none"),
        ("contact_ticks, shaft_ticks", "", "ticks in which the tool touched; in which shaft or handpiece did"),
        ("peak_force_n", "N", "highest force"),
        ("removed_mm3", "mm3", "solid that is gone since the last reset, by all arms (docs/cutting.md)"),
        ("removed_mm3_by_material", "mm3", "the same, by the scene's materials"),
        ("removed_density_mm3", "mm3", "density taken away over full density, since the last reset, by all arms"),
        ("forbidden_ms", "ms", "how long each forbidden material was touched"),
        ("sharpness", "", "rate of the bur in the hand at the end over that of a new one (docs/cutting.md)"),
        ("pulp_rise_c", "C", "how much warmer the pulp is than the body, with `cut.pulp` (docs/cutting.md): at the `end`, `highest`, and for how long above the harmful 5.5 (`harm_s`); else null"),
        ("resets, undos, redos", "", "of the volumes; of one stroke each"),
        ("energy_j", "J", "work at the device port: positive is taken from the hand"),
        ("port_minimum_j", "J", "its lowest value: below 0 the loop gave more than it took"),
        ("energy_by_source_j", "J", "the same by source, below"),
        ("faults, fault_count", "", "the first 64 as they latched, each with `tick` and `name`; how many"),
        ("events, event_count", "", "of the shell, likewise"),
        ("watchdog_trips", "", "how often the loop stood still for 20 ms, and the motors went off"),
        ("lost_packets, refused_packets", "", "of the device"),
        ("link", "", "counters of the port, below"),
        ("second", "", "of the second of two arms: its `device`, the `tool` that it held at the start, and the figures above that an arm has of its own"),
        ("missing_rights", "", "what the start could not get: `what`, and its `effect`"),
        ("load_s", "s", "from the start to the first servo tick"),
        ("start_to_force_ms", "ms", "from the start to the first force that was sent; null: none was"),
        ("volume_hash, output_hash", "", "of all that was removed, and of all that was sent")]),
    ("Controller: what a scene costs", "`./kerf controller --explain --report FILE` ([architecture](architecture.md)).",
     [("controller/run/scene_check.cpp", "std::string explanation_json(")], ["stage", "name", "bytes"], [
        ("program, version, scene, rate_hz, numeric, cut", "", "as in a run; the law of cutting"),
        ("machine, machine_factor", "", "instructions of this processor; time here over work on the reference machine"),
        ("budget_us", "us", "of work, for one tool in all volumes"),
        ("stability", "", "the gains and their limits:"),
        ("stiffness_n_per_mm, damping_ns_per_mm", "N/mm, N s/mm", "of the coupling, at the device"),
        ("highest_n_per_mm, margin", "N/mm, ratio", "highest stiffness by theory; how far the scene is from it"),
        ("highest_with_friction_n_per_mm, margin_with_friction", "N/mm, ratio", "the same with the device's friction"),
        ("tools", "", "for each: `tool`, `work_us`, `highest_rate_hz`"),
        ("tool, volume, method, why", "", "which tool in which volume; how it is computed, and why so"),
        ("highest_rate_hz", "Hz", "at which this tool fits"),
        ("ticks", "", "a tool in a volume each, with `stages` of the same figures"),
        ("measured_us, measured_p99_us", "us", "median and 99th percentile of that tick"),
        ("stages", "", "each with `stage`, its name"),
        ("operations, timed_operations", "", "at most in any tick; in the tick that was timed"),
        ("work_us, predicted_us", "us", "their price on the reference machine; here"),
        ("arrays, total_bytes", "bytes", "memory, each with `name` and `bytes`; the sum")]),
    ("Emulator", "`./kerf emulator --report FILE`, and `emulator.json` of a demo.",
     [("hil/program/program.cpp", "void write_run_report("), ("hil/program/program.cpp", "Json injected_list(")],
     ["p50", "p99", "max", "kind", "packets", "at_s", "changed"], [
        ("personality", "", "which device"),
        ("seconds", "s", "of the device's time"),
        ("packets_sent, packets_dropped", "", "to the host; that it did not read"),
        ("packets_withheld", "", "that a fault kept from the host"),
        ("injected", "", "faults of a script that began: `kind`, `packets` (commands or reports), `at_s`, `changed` "
         "(packets or readings)"),
        ("commands_received, commands_refused", "", "of the host"),
        ("resyncs", "", "how often the process slept so long that time was skipped"),
        ("wake_us", "us", "how late cycles began: `p50`, `p99`, `max`"),
        ("peak_motor_force_n, rms_motor_force_n", "N", "force of the motors at the tip: the highest; root of the mean square "
         "over all its time"),
        ("motor_work_mj", "mJ", "work of that force on the tip: what the device gave to the hand"),
        ("final_motor_force_n", "N", "of the motors at the end"),
        ("calibrated, docked", "", "at the end"),
        ("undocked_at_s", "s", "when the stylus left its rest; null: never"),
        ("final_tip_mm", "mm", "x, y, z in the device's frame"),
        ("wishes, wishes_refused", "", "with `--hand-socket`: of the window; that were none"),
        ("report_hash", "", "of all bytes that were handed out")]),
    ("Adapter to a vendor's library", "`./kerf arm --report FILE` ([devices](devices.md)).",
     [("arm/run_arm.cpp", "Json report_of("), ("arm/run_arm.cpp", "Json times_of(")], ["count", "p50", "p99", "max"], [
        ("program, version", "", "kerf-arm and its version"),
        ("device, name", "", "word of the device; name of the page"),
        ("facts", "", "what the library says of itself and of the device"),
        ("seconds", "s", "from the first frame to the end"),
        ("frames, frames_per_s", "", "of the library"),
        ("reports", "", "frames that were published"),
        ("unreadable", "", "readings that were no pose"),
        ("forced_frames, clamped_frames", "", "with a force; whose force was above the device's peak"),
        ("expired_commands", "", "times that a force ended because its command was older than 19 ms"),
        ("turn_us", "us", "what kerf-arm adds to a frame: `count`, `p50`, `p99`, `max`"),
        ("command_age_us", "us", "of the commands whose force was given, likewise"),
        ("errors", "", "how often each error of the library was seen, by name"),
        ("failure", "", "why it ended; null: it was asked to")]),
    ("Recorder", "`./kerf recorder --report FILE`.", [("record/run/recorder_run.cpp", "void write_report(")], [], [
        ("rows", "", "ticks in the log"),
        ("lost_ticks, gaps", "", "ticks that were overwritten before they were read; in how many places"),
        ("missed_before_start", "", "ticks published before the recorder came, and gone"),
        ("largest_lag_ticks", "ticks", "how far it was behind at most"),
        ("end_reason", "", "`clean end`, `fault`, `stopped` or `controller gone`")]),
    ("Manifest of a log", "`manifest.json` beside `ticks.npy` ([the log](log.md)).",
     [("record/manifest.cpp", "void write_manifest("), ("record/manifest.cpp", "void write_with_end(")], ["size_vox", "spacing_mm", "initial_hash", "first_index", "count"], [
        ("kerf, compiler, flags, build_id", "", "version, compiler, its flags and build of the controller and the recorder"),
        ("cpu", "", "processor of the recorder"),
        ("abi_hash", "", "of the layout of a row"),
        ("session_id, config_hash", "", "of the run; of its settings"),
        ("tick_ns, start_ns", "ns", "length of a tick; when the run began, CLOCK_MONOTONIC; 0 in lock-step"),
        ("scene, clock", "", "file with the scene; file with the date, missing if there is none"),
        ("volumes", "", "each with `size_vox`, `spacing_mm`, `initial_hash`"),
        ("rows, lost_ticks, missed_before_start, end_reason", "", "as above; `end_reason` is `running` until the end, `no room` if the disk was full, `unknown` if the manifest was made anew. Such a one has "
         "`repaired_by`, the version of kerf that made it, no versions of controller and recorder, and 0 for `session_id`"),
        ("parts", "", "files of the log of each device that had begun; above 1 with `--split`"),
        ("first_rows", "", "`crc32c` of the first row of each device's log; missing before a row is on the disk"),
        ("gaps", "", "each with `first_index` and `count`"),
        ("arms", "", "2: the run had two devices, and there is `ticks-2.npy`; missing with one"),
        ("summary, summary_2", "", "what `record info` shows, of all rows, of the first and the second device; missing if the recorder was killed before"),
        ("files", "", "CRC-32 of the other files, by name, 8 hexadecimal digits; until the recorder ends of those that are whole, and of `clock.npy` "
         "as it was when the manifest was written. Behind all, "
         "`crc32`: of this file, up to the comma before that member ([the log](log.md))")]),
    ("Summary of a log", "`./kerf record info LOG --report FILE`.",
     [("record/manifest.cpp", "void for_each_figure("), ("record/recording.cpp", "std::string to_json(")], [], [
        ("date", "", "of the first tick, UTC; null: the log has none"),
        ("rows, first_tick, last_tick, seconds", "", "what the log covers"),
        ("lost_ticks, missed_before_start, end_reason", "", "as above; `end_reason` of a log that was cut says after which row"),
        ("contact_ticks, shaft_ticks, stale_ticks, faults", "", "ticks of that kind, `stale_ticks` as in the report of the controller; faults that latched"),
        ("missed_deadlines, lost_packets, refused_packets", "", "at the end of the log"),
        ("peak_force_n, deepest_mm", "N, mm", "highest force, greatest depth"),
        ("removed_density_mm3", "mm3", "density taken away over full density, in all"),
        ("port_energy_mj, port_minimum_mj", "mJ", "work at the device port; its lowest value. And for each source below: "
         "`spring_mj` ...")]),
    ("Visualizer", "`./kerf visualizer --report FILE`, and `visualizer.json` of a demo.",
     [("visualizer/scene/frame_report.cpp", "void FrameReport::write("), ("visualizer/scene/frame_report.cpp", "Json spread(")],
     ["p50", "p95", "p99", "max"], [
        ("renderer, gl_renderer, context", "", "of kerf; of OpenGL; where it drew"),
        ("width, height", "pixels", "of the picture"),
        ("frames, rest_frames", "", "that were drawn; in which nothing had changed"),
        ("cpu_ms, wall_ms", "ms", "of a frame: `p50`, `p95`, `p99`, `max`"),
        ("redrawn", "0 to 1", "share of the picture whose volumes were drawn again, likewise"),
        ("latency_ms", "ms", "from the tick that removed material to the end of the first frame that shows it, likewise"),
        ("pointer_ms", "ms", "with `--hand-socket`: from the frame that saw the pointer move to the end of the first one "
         "with the tool elsewhere, likewise"),
        ("bricks_uploaded", "", "to the graphics card"),
        ("attach_ms", "ms", "from asking for the controller to its first complete volumes"),
        ("late_join_ms", "ms", "from there to the first picture"),
        ("clean_end", "", "true: the controller ended cleanly")]),
    ("Volume", "`./kerf volume info FILE --report FILE`.", [("controller/volume_tool/volume_commands.cpp", "void write_report(")],
     ["hi", "lo"], [
        ("file", "", "its path"),
        ("size_vox, spacing_mm, has_spacing", "voxels, mm", "x, y, z; whether the file has a spacing"),
        ("note", "", "of the reading: what was chosen, skipped or replaced; empty if nothing was"),
        ("axes_note", "", "which axes were guessed, because the file has none; empty if it has them or `--axes` gave them"),
        ("origin_mm, direction", "mm", "centre of voxel (0, 0, 0); axes, nine numbers by rows"),
        ("min, max", "", "values of the file"),
        ("window", "", "values that become density 0 and 1"),
        ("otsu_value, otsu_density", "", "Otsu's threshold in values of the file; as a density, 0 to 1"),
        ("solid_box, solid_ratio", "voxels, 0 to 1", "tightest box of what is at or above it, from `lo` to before `hi`; "
         "share of all voxels"),
        ("noise_density, noise_share", "", "noise of what is solid: as a density; over the surface's step"),
        ("denoise_passes", "", "that `denoise = \"auto\"` makes"),
        ("histogram", "", "voxels in 64 equal steps of the window")])]


def page(root, programs):
    parts = []
    for title, way, functions, inner, rows in REPORTS:
        there = set().union(*(Source(root, path).json_keys(name) for path, name in functions))
        if title == "Controller: what a scene costs":  # of a lambda within
            there |= {"operations", "work_us", "timed_operations", "predicted_us"}
        if functions[0][0].endswith(("record/manifest.cpp", "hil/program/program.cpp")):
            there |= set(re.findall(r'\w\["([a-z_0-9]+)"\]', Source(root, functions[0][0]).body(functions[0][1])))
        same(functions[0][0], [key for row in rows for key in row[0].split(", ")] + inner, there)
        parts.append(f"## {title}\n\n{way}\n\n" + table(("key", "unit", "meaning"), [
            (", ".join(f"`{key}`" for key in keys.split(", ")), unit, meaning) for keys, unit, meaning in rows]) + "\n")
    source = Source(root, "shared/numeric/energy_source.hpp")
    energies = re.findall(r"^  (\w+),?\s+///< (.*)", source.text, re.M)
    same(source.path, [word for word, _ in energies], source.words("kEnergySourceNames"))
    ports = []
    for name, port in (("firewire/firewire", "fw"), ("port/usb", "usb"), ("port/hid", "hid"), ("arm/arm", "arm")):
        file = Source(root, f"controller/device/{name}_port.cpp")
        body = re.search(r"::counters\(\) const \{(.*?)\n\}", file.text, re.S)[1]
        ports.append((f"`{port}`", ", ".join(f"`{key}`" for key in re.findall(r'\{"(\w+)",', body))))
    return f"""# Reports

JSON, one object a file. A file is written whole at the end, or not at all. Numbers have the unit that their name ends
in; hashes are sixteen hexadecimal digits. `./kerf lab` writes the figures of its tables, with `--report` of
each command: the head of each module of `lab/report` lists its keys, and `python3 lab/report` makes the page or the plot
of such a file again (`lab/report/__main__.py`).

{chr(10).join(parts)}
## Sources of energy

{table(("source", "work at the device port of"), [(f"`{word}`", what) for word, what in energies])}

## Counters of a port

{table(("`--port`", "`link` has"), ports)}

Sockets have none.
"""
