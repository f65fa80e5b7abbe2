# SPDX-License-Identifier: Apache-2.0
"""docs/reports.md: the JSON that programs write for other programs."""
import re

from source import Source, same, table

SPREAD = "`p50`, `p99`, `p999`, `max`"
# Title; how to get it; (file, function) that write it; rows of (keys, unit, meaning). A key of a nested object has a row
# of its own, or stands in `inner`.
REPORTS = [
    ("Controller: a run", "`./kerf controller --report FILE`, and `report.json` of a demo.",
     [("controller/run/run_report.cpp", name) for name in ("std::string report_json(", "Json percentiles(", "Json list(", "Json missing_rights_json(")],
     ["p50", "p99", "p999", "max", "tick", "name", "what", "effect"], [
        ("program, version", "", "kerf-controller and its version"),
        ("scene, device, numeric", "", "file of the scene; device and number type of the loop, empty if the scene was not loaded"),
        ("config_hash", "", "hash of all settings; equal if two runs had the same settings"),
        ("rate_hz", "Hz", "rate of the servo"),
        ("velocity_estimator", "", "name of the velocity estimator, as in a scene file"),
        ("virtual", "", "true if the run was in lock-step, without a clock"),
        ("end", "", "reason of the end"),
        ("waiting", "", "what the run waited for at the end, the device or the scene; empty if it did not wait"),
        ("ticks", "", "servo steps since the user picked up the device; the counts below are counts of these ticks"),
        ("armed_at_tick", "", "number of the first of these ticks in the segment and in the log"),
        ("overruns", "", "deadlines that were skipped because a tick took too long"),
        ("stale_ticks", "", "ticks without a new report of the device, until the device was gone"),
        ("wake_us, compute_us, publish_us", "us", f"delay of the start of a tick; time to compute; time to publish: {SPREAD}"),
        ("allocations", "", "allocations of memory in the loop"),
        ("allocations_counted", "", "false in a build with sanitizers, which does not count allocations"),
        ("minor_faults, major_faults", "", "page faults in the loop"),
        ("guarded", "", "true with `--guard`"),
        ("unexpected_call", "", "system call that the guard caught; empty if there was none"),
        ("contact_ticks, shaft_ticks", "", "ticks with contact of the tool; ticks with contact of shaft or handpiece"),
        ("peak_force_n", "N", "highest force"),
        ("removed_mm3", "mm3", "volume of solid removed since the last reset, by all arms ([cutting](cutting.md#reset))"),
        ("removed_mm3_by_material", "mm3", "`removed_mm3` for each material of the scene"),
        ("removed_density_mm3", "mm3", "sum of the density removed since the last reset, by all arms; a voxel of full density counts as its volume ([cutting](cutting.md#reset))"),
        ("forbidden_ms", "ms", "time of contact with each forbidden material"),
        ("sharpness", "", "removal rate of the selected bur at the end over the rate of a new bur ([cutting](cutting.md#burs))"),
        ("pulp_rise_c", "C", "with `cut.pulp`, rise of the pulp's temperature above the body's ([cutting](cutting.md#temperature-of-the-pulp)): at the `end`, the `highest`, and the seconds above 5.5 C (`harm_s`); else null"),
        ("resets, undos, redos", "", "resets of the volumes; strokes undone; strokes repeated"),
        ("energy_j", "J", "work at the device port; positive if the hand gave energy"),
        ("port_minimum_j", "J", "lowest value of this work during the run; below 0 if the loop gave more energy than it took"),
        ("energy_by_source_j", "J", "work at the device port [by source](#sources-of-energy)"),
        ("faults, fault_count", "", "the first 64 faults in the order of time, each with `tick` and `name`; number of faults"),
        ("events, event_count", "", "the first 64 events, each with `tick` and `name`, such as a stall of the loop or a refused command (an event does not end the run); number of events"),
        ("watchdog_trips", "", "times that the loop stood still for 20 ms and the motors went off"),
        ("lost_packets, refused_packets", "", "packets of the device that were lost; packets that were refused"),
        ("link", "", "[counters of the port](#counters-of-a-port)"),
        ("second", "", "with two arms, for the second arm: `device`, first `tool`, and those of the figures above that are counted for each arm"),
        ("missing_rights", "", "rights that the program did not have at its start: `what`, and the `effect`"),
        ("load_s", "s", "time from the start to the first servo tick"),
        ("start_to_force_ms", "ms", "time from the start to the first force that was sent; null if no force was sent"),
        ("volume_hash, output_hash", "", "hash of all removal; hash of all output")]),
    ("Controller: what a scene costs", "`./kerf controller --explain --report FILE` ([architecture](architecture.md)).",
     [("controller/run/scene_check.cpp", "std::string explanation_json(")], ["stage", "name", "bytes"], [
        ("program, version, scene, rate_hz, numeric, cut", "", "as in the report of a run; law of cutting"),
        ("machine, machine_factor", "", "instruction set of this processor; time on this machine over time on the reference machine"),
        ("budget_us", "us", "largest work for one tool in all volumes"),
        ("stability", "", "object with the gains and their limits, which are the next six keys"),
        ("stiffness_n_per_mm, damping_ns_per_mm", "N/mm, N s/mm", "gains of the coupling, at the device"),
        ("highest_n_per_mm, margin", "N/mm, ratio", "highest stiffness by theory; this stiffness over the scene's"),
        ("highest_with_friction_n_per_mm, margin_with_friction", "N/mm, ratio", "highest stiffness with the device's friction; this stiffness over the scene's"),
        ("tools", "", "list; for each tool `tool`, `work_us`, `highest_rate_hz`"),
        ("tool, volume, method, why", "", "names of tool and volume; method of computation, and the reason for it"),
        ("highest_rate_hz", "Hz", "highest rate at which this tool fits into the budget"),
        ("ticks", "", "list; one tick for each tool in each volume, with the keys below"),
        ("measured_us, measured_p99_us", "us", "median and 99th percentile of that tick"),
        ("stages", "", "list; the parts of a tick, each with its name `stage` and the two rows below"),
        ("operations, timed_operations", "", "largest number of operations in any tick; number in the measured tick"),
        ("work_us, predicted_us", "us", "computed time of `operations` on the reference machine; computed time of `timed_operations` on this machine"),
        ("arrays, total_bytes", "bytes", "list of arrays, each with `name` and `bytes`; sum of all bytes")]),
    ("Emulator", "`./kerf emulator --report FILE`, and `emulator.json` of a demo.",
     [("hil/program/program.cpp", "void write_run_report("), ("hil/program/program.cpp", "Json injected_list(")],
     ["p50", "p99", "max", "kind", "packets", "at_s", "changed"], [
        ("personality", "", "kind of the device"),
        ("seconds", "s", "length of the run in the device's time"),
        ("packets_sent, packets_dropped", "", "packets sent to the host; packets that the host did not read"),
        ("packets_withheld", "", "packets that a fault withheld from the host"),
        ("injected", "", "faults of a script that began: `kind`, `packets` (`commands` or `reports`), `at_s` (time in s), `changed` "
         "(number of packets or readings that the fault changed)"),
        ("commands_received, commands_refused", "", "commands from the host that were accepted; that were refused"),
        ("resyncs", "", "times that the process slept so long that the emulator skipped time"),
        ("wake_us", "us", "delay of the start of a cycle: `p50`, `p99`, `max`"),
        ("peak_motor_force_n, rms_motor_force_n", "N", "highest force of the motors at the tip; root mean square of this force "
         "over the run"),
        ("motor_work_mj", "mJ", "work of this force on the tip: energy that the device gave to the hand"),
        ("final_motor_force_n", "N", "force of the motors at the end"),
        ("calibrated, docked", "", "true if the device was calibrated at the end; true if it was docked"),
        ("undocked_at_s", "s", "time at which the stylus left its dock; null if it did not"),
        ("final_tip_mm", "mm", "position of the tip at the end: x, y, z in the device's frame"),
        ("wishes, wishes_refused", "", "with `--hand-socket`, targets of the window; packets that were no valid target"),
        ("report_hash", "", "hash of all bytes sent to the host")]),
    ("Adapter to a vendor's library", "`./kerf arm --report FILE` ([devices](devices.md)).",
     [("arm/run_arm.cpp", "Json report_of("), ("arm/run_arm.cpp", "Json times_of(")], ["count", "p50", "p99", "max"], [
        ("program, version", "", "kerf-arm and its version"),
        ("device, name", "", "kind of the device; name of the page"),
        ("facts", "", "facts about the library and the device, as the library reports them"),
        ("seconds", "s", "time from the first frame to the end"),
        ("frames, frames_per_s", "", "number and rate of the library's frames"),
        ("reports", "", "frames that were published"),
        ("unreadable", "", "readings without a valid pose"),
        ("forced_frames, clamped_frames", "", "frames with a force; frames with a force above the device's peak"),
        ("expired_commands", "", "times that a force ended because its command was older than 19 ms"),
        ("turn_us", "us", "time that kerf-arm adds to a frame: `count`, `p50`, `p99`, `max`"),
        ("command_age_us", "us", "age of the commands whose force was passed on: `count`, `p50`, `p99`, `max`"),
        ("errors", "", "number of each error of the library, by name"),
        ("failure", "", "reason of a failure; null if the program was asked to end")]),
    ("Recorder", "`./kerf recorder --report FILE`.", [("record/run/recorder_run.cpp", "void write_report(")], [], [
        ("rows", "", "ticks in the log"),
        ("lost_ticks, gaps", "", "ticks that were overwritten before the recorder read them; number of gaps in the log"),
        ("missed_before_start", "", "ticks that were overwritten before the recorder started"),
        ("largest_lag_ticks", "ticks", "largest distance of the recorder behind the controller"),
        ("end_reason", "", "`clean end`, `fault`, `stopped` or `controller gone`")]),
    ("Manifest of a log", "`manifest.json` beside `ticks.npy` ([the log](log.md)).",
     [("record/manifest.cpp", "void write_manifest("), ("record/manifest.cpp", "void write_with_end(")], ["size_vox", "spacing_mm", "initial_hash", "first_index", "count"], [
        ("kerf, compiler, flags, build_id", "", "of controller and recorder: version, compiler, flags of the compiler, build"),
        ("cpu", "", "processor of the recorder"),
        ("abi_hash", "", "hash of the layout of a row"),
        ("session_id, config_hash", "", "identifier of the run; hash of its settings"),
        ("tick_ns, start_ns", "ns", "length of a tick; start of the run in CLOCK_MONOTONIC, 0 in lock-step"),
        ("scene, clock", "", "file with the scene; file with the date; `clock` is missing if there is no such file"),
        ("volumes", "", "list of volumes, each with `size_vox`, `spacing_mm`, `initial_hash`"),
        ("rows, lost_ticks, missed_before_start, end_reason", "", "as in the report of the recorder. `end_reason` has three more values: `running` until the end, `no room` if the disk was full, "
         "`unknown` if the manifest was repaired. In a repaired manifest `repaired_by` is the version of kerf that repaired it, `session_id` is 0, "
         "and the versions of controller and recorder are missing"),
        ("parts", "", "number of files of each device's log; above 1 only with `--split`"),
        ("first_rows", "", "CRC-32C (`crc32c`) of the first row of each device's log; missing until a row is on the disk"),
        ("gaps", "", "list of gaps, each with `first_index` and `count`"),
        ("arms", "", "2 if the run had two devices, which makes a file `ticks-2.npy`; missing with one device"),
        ("summary, summary_2", "", "figures of `record info` over all rows, for the first and the second device; missing if the recorder was killed"),
        ("files", "", "CRC-32 of each other file, by name, in 8 hexadecimal digits. While the recorder runs, the list has only files that are complete. "
         "`clock.npy` is also listed; its CRC-32 is of the moment at which the manifest was written. The last member of the manifest, "
         "`crc32`, is the CRC-32 of the manifest up to the comma before this member ([the log](log.md))")]),
    ("Summary of a log", "`./kerf record info LOG --report FILE`.",
     [("record/manifest.cpp", "void for_each_figure("), ("record/recording.cpp", "std::string to_json(")], [], [
        ("date", "", "date of the first tick, UTC; null if the log has no date"),
        ("rows, first_tick, last_tick, seconds", "", "number of rows; first and last tick; length in seconds"),
        ("lost_ticks, missed_before_start, end_reason", "", "as in the report of the recorder; if counted rows at the end of the log are missing, `end_reason` is `cut after N of M rows`"),
        ("contact_ticks, shaft_ticks, stale_ticks, faults", "", "as in the report of the controller; number of faults"),
        ("missed_deadlines, lost_packets, refused_packets", "", "counts at the end of the log"),
        ("peak_force_n, deepest_mm", "N, mm", "highest force; largest penetration"),
        ("removed_density_mm3", "mm3", "sum of the removed density; a voxel of full density counts as its volume"),
        ("port_energy_mj, port_minimum_mj", "mJ", "work at the device port; its lowest value. Each [source of energy](#sources-of-energy) also has a key: "
         "`spring_mj` ...")]),
    ("Visualizer", "`./kerf visualizer --report FILE`, and `visualizer.json` of a demo.",
     [("visualizer/scene/frame_report.cpp", "void FrameReport::write("), ("visualizer/scene/frame_report.cpp", "Json spread(")],
     ["p50", "p95", "p99", "max"], [
        ("renderer, gl_renderer, context", "", "renderer of kerf; renderer of OpenGL; kind of the OpenGL context"),
        ("width, height", "pixels", "size of the picture"),
        ("frames, rest_frames", "", "frames that were drawn; frames without a change"),
        ("cpu_ms, wall_ms", "ms", "processor time and elapsed time of a frame: `p50`, `p95`, `p99`, `max`"),
        ("redrawn", "0 to 1", "fraction of the picture in which volumes were drawn again: `p50`, `p95`, `p99`, `max`"),
        ("latency_ms", "ms", "time from the tick that removed material to the end of the first frame that shows the removal: `p50`, `p95`, `p99`, `max`"),
        ("pointer_ms", "ms", "with `--hand-socket`, time from the frame that read a move of the pointer to the end of the first frame "
         "in which the tool has moved: `p50`, `p95`, `p99`, `max`"),
        ("bricks_uploaded", "", "bricks that were uploaded to the graphics card"),
        ("attach_ms", "ms", "time from the request for the controller to its first complete volumes"),
        ("late_join_ms", "ms", "time from the first complete volumes to the first picture"),
        ("clean_end", "", "true if the controller ended cleanly")]),
    ("Volume", "`./kerf volume info FILE --report FILE`.", [("controller/volume_tool/volume_commands.cpp", "void write_report(")],
     ["hi", "lo"], [
        ("file", "", "path of the file"),
        ("size_vox, spacing_mm, has_spacing", "voxels, mm", "size and spacing along x, y, z; true if the file has a spacing"),
        ("note", "", "what the reader chose, skipped or replaced; empty if nothing"),
        ("axes_note", "", "axes that were guessed; empty if the file or `--axes` gave the axes"),
        ("origin_mm, direction", "mm", "centre of voxel (0, 0, 0); matrix of the axes, nine numbers by rows"),
        ("min, max", "", "lowest and highest value of the file"),
        ("window", "", "values of the file that become density 0 and 1"),
        ("otsu_value, otsu_density", "", "Otsu's threshold as a value of the file; as a density, 0 to 1"),
        ("solid_box, solid_ratio", "voxels, 0 to 1", "smallest box that contains all voxels at or above this threshold, from `lo` to before `hi`; "
         "fraction of these voxels"),
        ("noise_density, noise_share", "", "noise of the solid voxels as a density; its ratio to the step of density from air to the solid"),
        ("denoise_passes", "", "number of passes of `denoise = \"auto\"`"),
        ("histogram", "", "number of voxels in each of 64 equal steps of the window")])]


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

Each report is a file with one JSON object. A program writes the file whole at its end, or not at all. The unit of a number is the end of
its name. Hashes are sixteen hexadecimal digits.

Each command of `./kerf lab` writes the figures of its tables with `--report`. The comment at the top of each module of `lab/report` lists
the keys. `python3 lab/report` makes the page or the plot again from such a file (`lab/report/__main__.py`).

{chr(10).join(parts)}
## Sources of energy

Each row is the part of the work at the device port that comes from one source. `spring` is the work that a spring without sampling would
do. The servo holds the force of the spring constant for a tick (sample and hold), which acts like a damping of -K T/2. `leak` is the work of
this effect ([forces](forces.md), 5.5).

{table(("source", "part of the work"), [(f"`{word}`", what) for word, what in energies])}

## Counters of a port

{table(("`--port`", "counters in `link`"), ports)}

[Devices](devices.md#counters-of-the-link) has the meaning of each counter. A port over a socket has no counters.
"""
