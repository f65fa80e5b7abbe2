// SPDX-License-Identifier: Apache-2.0
#include "record/export/log_page.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>

#include "shared/segment/tick_table.hpp"

namespace kerf {
namespace {

constexpr std::string_view kHead =
    R"(# The log of a run

`kerf-recorder` writes every tick of a running controller into a folder; `./kerf demo --out DIR` keeps it as
`DIR/log`. `./kerf record info DIR/log` sums it up, `record plot` draws it, `record export` makes CSV, MCAP or HDF5 of
it, each with `--from TICK` and `--until TICK` for a part. With two devices `--arm 2` takes the second; `arms` in the
manifest is then 2.

| file | what |
|---|---|
| `ticks.npy` | one row for each tick, the columns below, for NumPy as it is |
| `ticks.npy.0002` ... | of a recorder with `--split`: the rows that follow |
| `ticks-2.npy` | of a run with two devices: the second's, in the same columns. Row i of both is the same tick; a tick that was lost is in neither |
| `clock.npy` | the date: one row at the start, one a minute, and one after UTC was set; [below](#the-date) |
| `manifest.json` | length of a tick, voxels, versions, compiler and processor, losses of the recorder and where they lie, how the run ended, checksums ([reports](reports.md)) |
| `scene.json` | the scene as it was loaded, every setting; `source` is what it was loaded from |
| `volumes/HASH.npy.gz` | the densities of a volume as the run began, `[z, y, x]`; `HASH-labels.npy.gz`: its labels. HASH is `density_hash` in `scene.json`, of both |
| `inputs/TICK.npy.gz` | of a flight recording: what the servo was given in the ticks before the log, from tick 1 on; 65,536 rows a file, named by its first tick; `inputs-2/` of a second device |

Three lines of NumPy read it (`python/` is a reader with more, `examples/python/` uses it):

    import numpy as np
    log = np.load("DIR/log/ticks.npy", mmap_mode="r")
    print(np.abs(log["commanded_force_n"]).max(axis=0), "N")

`log["position_mm"]` is an array of rows x 3. World millimetres, newtons at the device port, little-endian.
`./kerf replay DIR/log` runs it again ([replay](determinism.md#run-a-recording-again)). `info` counts as lost what was published and is in no row, so the
manifest says the same; a recorder that was killed leaves a manifest that says `running`, and all rows.

NumPy reads the rows that the header counts. The recorder counts each 200 ms, when it makes sure that they are on the disk, so a log that
grows, or whose recorder was killed, has up to 200 ms of complete rows more, which `info`, `replay`, `export` and `kerf_reader` read.
`kerf recorder --split 10m` begins a new file each ten minutes: `ticks.npy.0002`, `ticks.npy.0003` and so on; all of these read them as
one log. So NumPy reads all rows of any log:

    from pathlib import Path
    def rows(path):
        with open(path, "rb") as file:
            np.lib.format.read_magic(file)
            dtype = np.lib.format.read_array_header_1_0(file)[2]
        return np.fromfile(path, dtype, offset=4096)  # behind the header; without a row that was cut
    parts = sorted(Path("DIR/log").glob("ticks.npy*"), key=lambda path: (len(path.name), path.name))  # .10000 is behind .9999
    log = np.concatenate([rows(path) for path in parts])

## The date

Rows have the time of CLOCK_MONOTONIC, which begins anew at each boot. Each row of `clock.npy` has both clocks of one moment: `monotonic_ns`
and `utc_ns` (since 1970-01-01, negative before), both read within `within_ns`, and `crc32c` of these. The last row dates all ticks:

    clock = np.load("DIR/log/clock.npy")
    utc_ns = log["start_ns"].astype("i8") + (clock["utc_ns"] - clock["monotonic_ns"])[-1]
    print(utc_ns.view("datetime64[ns]")[0])

`info` prints the first tick's date, and one line if UTC was set in the run: ticks before that have the date which the clock would have
shown if it had been set already, so dates do not run back. In lock-step time is virtual: tick 0 has the date at which the recorder
began, and each tick is one tick's length later, however long it took. Logs of earlier versions have no date.

## Whether it is whole

`./kerf record check DIR/log` compares all that the files say twice, and all checksums, and says of each contradiction where it is,
what stands there and what to do. `info`, `plot`, `export` and `./kerf replay` compare the same, but for the files in `volumes/` and
`inputs/`. A row that is damaged or out of order ends what they read; an export then writes nothing. `info` of a log above 256 MB
shows the recorder's figures at once, reads no row, and says so; `info --scan` reads all.

A power cut leaves zeros, or half of what was written, behind the rows that the header counts. In a log that its recorder did not end, what
is torn there is left out if no sound row follows it: one line says how many bytes and where, and all of these work with the rows before
it (`kerf_reader` warns; `np.load` reads the counted rows alone). With two devices both logs end, for all of these, with the ticks that both
have. A damaged row that is counted, or has a sound one behind it, stays an error, as are ticks that the first header counts and the second
log lacks.

A folder with a file `ticks.npy` is a recording. Whatever is wrong in it, a file that is lost, damaged, of another form or against
another one, ends all of these with exit code 1. They end with 2 for a folder that is none, for wrong arguments, and where the rights to
read or write are missing.

| fact | source | compared with it |
|---|---|---|
| length of a tick, arms, voxels, settings | `scene.json` | `tick_ns`, `arms`, `volumes`, `config_hash` of the manifest |
| ticks, losses, figures | the rows | `rows`, `lost_ticks`, `missed_before_start`, `gaps`, `summary` |
| content of the volumes | `volumes/` | `density_hash` of the scene, `initial_hash` |
| all else, as session, versions, end | `manifest.json` | `crc32`, its last member: zlib's CRC-32 of all bytes before the comma in front of it |
| bytes of the other files | themselves | `files` of the manifest: their CRC-32, of each since it was whole |
| which log is which arm's | the first row of each | `first_rows` of the manifest: their `crc32c` |
| which files there are | the folder | `parts` of the manifest: files of the log that had begun; `files` |

`crc32c` covers all of a row but `seq`. In a run `seq` is twice `tick`; only in a log of a watched replay, which rests at ticks without a
record, it is less, and the difference never falls. So `seq` and `tick` rise from row to row, and a bit of `seq` that changed is found by
its own row, by the next one, or by the losses in the manifest.

`np.load` compares nothing. It does not see rows that are damaged, doubled, exchanged or of another run, nor a manifest of another log;
`kerf_reader.Log` compares what `info` does and raises `ValueError`, but for `config_hash` and the figures of the summary, for which it
has the two CRC-32. What no reader can tell, and a replay alone may show:

* in a log whose recorder was killed, rows that are missing behind the count of the header, which are cut off or torn, or lost ticks;
* in such a log in lock-step, rows of another run of the same scene: time is virtual, so their first rows may be the same, and all checksums
  of a file of rows are its own;
* exchanged logs of two arms whose recorder was killed before the manifest had `first_rows`, which are there once the first 200 ms are synced;
* in logs of earlier versions, which have no `crc32`, the facts that only the manifest has;
* all that only a lost manifest said, after it was made anew.

A `manifest.json` that is lost or wrong is rebuilt by `./kerf record check DIR/log --repair` from scene and rows; the old one stays as
`manifest-old.json`. What only that said (session, versions, how the run ended) is unknown then, since nothing proves it, and `info` says
who made the manifest anew. If a checksum that can still be read in the wrong one (`files`, `first_rows`, `config_hash`) is not that of its
file, the file was changed, too: one line names it, and all stays as it is. With the manifest lost altogether, or no JSON, nothing is left
to compare with: the new one has the checksums of the files as they are now. It proves what scene and rows prove, `density_hash` and the
`crc32c` of each row, but not that scene, clock, log of each arm and inputs are those of the run. It lists no file that no recording has.

A recorder writes the manifest again when the volumes are on the disk, a file of the log begins or `clock.npy` gets a row, so a log whose
recorder was killed is compared like any other. `check` also names each file in `volumes/`, `inputs/` or with the name of a log that is
none of this recording.

## The energy from the other columns

`port_energy_j` adds up -F.dx for each report: dx is the motion of the tip at the device, and F the mean of `commanded_force_n`
over the ticks since the report before. `position_mm` is in the scene, so scale and offset lead back to the device. NumPy
recomputes the column to 1e-9 J, with each device of a run by its own rows and table of `scene.json` (`device`, `second_device`):

    def port_energy_j(ticks, device, tip_mm=None):
        def steps(value): return np.floor(np.asarray(value, float) * 65536 + 0.5) / 65536  # the servo's, of mm and N
        rows = np.flatnonzero((ticks["stale"] == 0) & np.isfinite(ticks["position_mm"]).all(axis=1))
        scale, offset_mm = steps(device["workspace_scale"]), steps(device["offset_mm"])
        if tip_mm is None: tip_mm = steps((ticks["position_mm"] - offset_mm) / scale)  # from the scene to the device
        sent_n = np.vstack([np.zeros(3), ticks["commanded_force_n"].cumsum(axis=0, dtype=float)])
        mean_n = steps(np.diff(sent_n[rows], axis=0) / np.diff(rows)[:, None])  # of the ticks since the last report
        taken_j = np.zeros(len(ticks))
        taken_j[rows[1:]] = -(mean_n * np.diff(tip_mm[rows], axis=0)).sum(axis=1) / 1000
        return taken_j.cumsum()

`examples/python/port_energy.py` is this on a log. All ticks have to be there (`lost_ticks` 0) and `servo.numeric` is `fixed`;
in a row with the command `restart` the motors were off, so the forces before it count as 0. With a `workspace_scale` below 1
a step of `position_mm` (2^-16 mm) is more than a step of the device, and the result is off by up to 1e-7 J at 0.4. From
`encoder_counts` the tip is exact at any scale: `device_tip.from_counts` beside it computes it for Omni, Inverse3, Touch and omega.

## For other tools

    ./kerf record export DIR/log --mcap run.mcap
    ./kerf record export DIR/log --hdf5 run.h5
    ./kerf record export DIR/log --csv run.csv

MCAP opens in Foxglove and its open forks, in PlotJuggler and with ROS 2 (`ros2 bag`); the definitions of the messages are in
the file. Times are UTC; `--time monotonic` gives `start_ns`, and a log without date has no other (one line says so). A date before 1970
or after 2038-01-19 is refused, since ROS 2 has none. The column `start_ns` stays as it is.

| topic | message | rate |
|---|---|---|
| `/kerf/tick` | `kerf_msgs/msg/Tick`: all columns below, by their names | every tick |
| `/kerf/tip` | `geometry_msgs/msg/PoseStamped`: the tool's tip in metres, in frame `scene`; from docking on | 100 Hz |
| `/kerf/force` | `geometry_msgs/msg/WrenchStamped`: `commanded_force_n`, in frame `device`, and `tip_torque_n_mm` in N m | 100 Hz |
| `/kerf/2/tick`, `/kerf/2/tip`, `/kerf/2/force` | of a second device, whose forces are in frame `device_2` | as above |
| `/tf` | `tf2_msgs/msg/TFMessage`: where `device` and, from docking on, `tip` are in `scene`; of a second device `device_2`, `tip_2` | 100 Hz |

The device's axes are parallel to the scene's, and its origin lies at `device.offset_mm`. The file is of the profile `ros2` of
[MCAP's registry](https://mcap.dev/spec/registry): each channel says the quality of service that its publisher offers. For programs of
ROS 2 that use `/kerf/tick`, copy `ros/kerf_msgs` (installed: `share/kerf/ros/kerf_msgs`) into a workspace's `src/`, `colcon build`, and
`ros2 bag play run.mcap`; its constants (`FLAGS_CONTACT`, `FAULT_OVERSPEED`) are the bits and codes below.

Chunks are packed by LZ4, and `--unpacked` leaves them as they are. The other files of the recording are attached, with the volumes
as they were at the start, so the MCAP of a whole recording replays on kerf's page ([kerf in a browser](second-machine.md#kerf-in-a-browser)); with `--from` or
`--until` it has the messages alone. `ticks.npy.head` is the header of the log, whose rows are the bytes of `/kerf/tick` behind the
four of CDR.

HDF5 opens in MATLAB (`h5read("run.h5", "/ticks/position_mm")`), Octave (`load -hdf5 run.h5`), Julia, R and h5py: one dataset per
column, `/ticks/COLUMN`, with `units`, `description` and `valid` as attributes, and `codes` if its values are codes or bits, which
`description` has too. Programs that store by columns, as MATLAB, Octave and Julia, have `position_mm` as 3 x rows. `/ticks_2` is
a second device's. `/scene` is the scene's JSON, in ASCII: other characters are `\uXXXX`. `/ticks/time_ns` is each row's time, UTC
or with `--time monotonic` `start_ns`; the file's attribute `clock` says which.

A running controller can be plotted without a log: [Foxglove](compatibility.md#foxglove) by the bridge, and PlotJuggler's UDP server
(protocol JSON, timestamp from the message; a second device is in `kerf_2`) by

    ./kerf record live --udp 127.0.0.1:9870

This page is made from the table in `shared/segment/tick_table.hpp` by

    ./kerf record columns > docs/log.md

## Columns

| column | type | unit | meaning | valid |
|---|---|---|---|---|
)";

std::string page_row(const TickField& column) {
  const LayoutField& field = column.layout;
  std::string type(field.type);
  if (field.count > 1) type += " x " + std::to_string(field.count);
  std::string meaning(column.meaning);
  if (!tick_codes(field.name).empty()) {  // "bits" or "code: ...", with a table on the page
    meaning.insert(std::min(meaning.find(':'), meaning.size()), ", below");
  }
  return "| `" + std::string(field.name) + "` | " + type + " | " + std::string(column.unit) +
         " | " + meaning + " | " + (column.valid.empty() ? "always" : std::string(column.valid)) +
         " |\n";
}

std::string codes(std::string_view title, std::string_view number, std::span<const TickCode> list) {
  std::string text = "\n## " + std::string(title) + "\n\n| " + std::string(number) +
                     " | name | meaning |\n|---|---|---|\n";
  for (const TickCode& code : list) {
    text += "| " + std::to_string(code.value) + " | " + std::string(code.name) + " | " +
            std::string(code.meaning) + " |\n";
  }
  return text;
}

}  // namespace

std::string log_page() {
  std::string page(kHead);
  for (const TickField& field : kTickFields) page += page_row(field);
  return page + codes("Flags", "bit", kTickFlags) + codes("Commands", "command", kTickCommands) +
         codes("Phases", "phase", kTickPhases) + codes("Faults", "fault", kTickFaults);
}

}  // namespace kerf
