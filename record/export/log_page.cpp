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

`kerf-recorder` writes every tick of a running controller into a folder. `./kerf demo --out DIR` keeps this folder as `DIR/log`.
`./kerf record info DIR/log` prints a summary, `record plot` draws the log, and `record export` converts it to CSV, MCAP or HDF5.
Each takes `--from TICK` and `--until TICK` for a part of the log. With two devices (`arms` of the manifest is 2) `--arm 2` takes
the second one.

| file | content |
|---|---|
| `ticks.npy` | one row for each tick, with the columns below; NumPy reads it directly |
| `ticks.npy.0002` ... | the rows that follow, if the recorder has `--split` |
| `ticks-2.npy` | rows of a second device, with the same columns. Row i of both files is the same tick. A tick that was lost is in neither |
| `clock.npy` | the date: one row at the start, one a minute, and one after UTC was set; [below](#the-date) |
| `manifest.json` | length of a tick, voxels, versions, compiler and processor, losses of the recorder with their positions, end of the run, checksums ([reports](reports.md)) |
| `scene.json` | the scene as it was loaded, with every setting; `source` names what it was loaded from |
| `volumes/HASH.npy.gz` | densities of a volume at the start of the run, `[z, y, x]`; `HASH-labels.npy.gz`: its labels. HASH is `density_hash` in `scene.json`, for both |
| `inputs/TICK.npy.gz` | of a flight recording: inputs of the servo in the ticks before the log, from tick 1 on. A file has 65,536 rows and the number of its first tick as name; `inputs-2/` is for a second device |

Three lines of NumPy read it (`python/` has a reader with more functions, which `examples/python/` uses):

    import numpy as np
    log = np.load("DIR/log/ticks.npy", mmap_mode="r")
    print(np.abs(log["commanded_force_n"]).max(axis=0), "N")

`log["position_mm"]` is an array of rows x 3. Lengths are world millimetres, forces are newtons at the device port, and numbers are
little-endian. `./kerf replay DIR/log` runs the recording again ([replay](determinism.md#run-a-recording-again)).

`info` counts a tick as lost if it was published and is in no row; the manifest has the same count. A recorder that was killed
leaves all rows, and a manifest with the word `running`.

`np.load` reads the rows that the header counts. The recorder updates this count each 200 ms, when it has synced the rows to the disk.
So a log that grows, or whose recorder was killed, has up to 200 ms of complete rows behind the count. `info`, `replay`, `export` and
`kerf_reader` read these rows, too.

`kerf recorder --split 10m` begins a new file each ten minutes: `ticks.npy.0002`, `ticks.npy.0003` and so on. The same programs read
all these files as one log. With NumPy, this code reads all rows of any log:

    from pathlib import Path
    def rows(path):
        with open(path, "rb") as file:
            np.lib.format.read_magic(file)
            dtype = np.lib.format.read_array_header_1_0(file)[2]
        return np.fromfile(path, dtype, offset=4096)  # behind the header; without a row that was cut
    parts = sorted(Path("DIR/log").glob("ticks.npy*"), key=lambda path: (len(path.name), path.name))  # .10000 is behind .9999
    log = np.concatenate([rows(path) for path in parts])

## The date

Rows have the time of CLOCK_MONOTONIC, which begins again at each boot. Each row of `clock.npy` has both clocks at one moment:
`monotonic_ns` and `utc_ns` (since 1970-01-01, negative before), both read within `within_ns`. `crc32c` is the checksum of these. The
last row dates all ticks:

    clock = np.load("DIR/log/clock.npy")
    utc_ns = log["start_ns"].astype("i8") + (clock["utc_ns"] - clock["monotonic_ns"])[-1]
    print(utc_ns.view("datetime64[ns]")[0])

`info` prints the date of the first tick, and one line if UTC was set during the run. Earlier ticks are dated as if UTC had been right
from the start. So dates never go back. In lock-step time is virtual: tick 0 has the date at which the recorder began, and each further
tick is later by the length of a tick. Logs of earlier versions have no date.

## Whether it is whole

`./kerf record check DIR/log` compares all facts that the files contain twice, and all checksums. For each contradiction it prints
where it is, what the file has there, and what to do. `info`, `plot`, `export` and `./kerf replay` compare the same, except for the
files in `volumes/` and `inputs/`. They stop at a row that is damaged or out of order, and an export then writes nothing. For a log
above 256 MB `info` prints the figures of the recorder at once and reads no row; it prints one line about this. `info --scan` reads all
rows.

A power cut leaves zeros, or half-written rows, behind the rows that the header counts. If the recorder did not end the log, such a torn
part is left out, provided that no sound row follows it. One line has its size and position, and all commands work with the rows before
it. (`kerf_reader` warns; `np.load` reads only the counted rows.) With two devices all commands read only the ticks that both logs have.
Three cases remain errors: a damaged row that is counted, a damaged row with a sound row behind it, and ticks that the first header
counts and the second log does not have.

A folder with a file `ticks.npy` is a recording. Any fault in it ends these commands with exit code 1: a file that is lost or damaged,
has another form, or contradicts another file. The exit code is 2 for a folder that is no recording, for wrong arguments, and if the
rights to read or write are missing.

| fact | source | compared with |
|---|---|---|
| length of a tick, arms, voxels, settings | `scene.json` | `tick_ns`, `arms`, `volumes`, `config_hash` of the manifest |
| ticks, losses, figures | the rows | `rows`, `lost_ticks`, `missed_before_start`, `gaps`, `summary` |
| content of the volumes | `volumes/` | `density_hash` of the scene, `initial_hash` |
| all other facts, such as session, versions, end | `manifest.json` | `crc32`, its last member: zlib's CRC-32 of all bytes before the comma in front of it |
| bytes of the other files | the files | `files` of the manifest: the CRC-32 of each file, from the moment at which the file was complete |
| which arm a log belongs to | first row of each log | `first_rows` of the manifest: their `crc32c` |
| list of files | the folder | `parts` (number of `ticks.npy` files that were begun) and `files` (their names) of the manifest |

`crc32c` covers all of a row except `seq`. In a run `seq` is twice `tick`. A watched replay pauses at ticks without a record. In its
log `seq` is less than twice `tick`, and this difference never becomes smaller. So `seq` and `tick` rise from row to row. A changed bit
of `seq` is found by its own row, by the next row, or by the losses in the manifest.

`np.load` compares nothing. It does not detect rows that are damaged, doubled, exchanged or of another run, or a manifest of another
log. `kerf_reader.Log` compares what `info` compares, and raises `ValueError`. It does not compute `config_hash` and the figures of the
summary again. Two CRC-32 protect them. No reader can detect the following faults; a replay may show them:

* in a log whose recorder was killed: whether rows behind the count of the header are missing because they were cut off or torn, or
  because ticks were lost;
* in such a log in lock-step: rows of another run of the same scene. Time is virtual, so the first rows may be the same. Each file of
  rows contains its own checksums, so a foreign file also agrees with itself;
* exchanged logs of two arms, if the recorder was killed before the manifest had `first_rows`, which it has after the first 200 ms;
* in logs of earlier versions, which have no `crc32`: the facts that only the manifest has;
* all facts that only a lost manifest had, after it was made again.

`./kerf record check DIR/log --repair` makes a lost or wrong `manifest.json` again, from scene and rows. The old one is kept as
`manifest-old.json`. The facts that only the old one had (session, versions, end of the run) are then unknown, because nothing proves
them. `info` reports which version of kerf made the manifest again.

* If the wrong manifest still has a readable checksum (`files`, `first_rows`, `config_hash`) and this checksum does not match its file,
  the file was changed, too. Then one line names the file, and nothing is written.
* If the manifest is lost, or is no JSON, there is nothing to compare with. The new manifest then has the checksums of the files as
  they are now. It proves only that the rows and the volumes are intact (`crc32c` of each row, `density_hash`). It does not prove that
  scene, clock, inputs and the log of each arm are those of the run. It lists only files of the kinds in the first table.

The recorder writes the manifest again when the volumes are on the disk, when a file of the log begins, and when `clock.npy` gets a row.
So the log of a killed recorder is compared like any other log. `check` also names each file in `volumes/` or `inputs/`, and each file
with the name of a log, that does not belong to this recording.

## The energy from the other columns

`port_energy_j` is the sum of -F.dx over the reports. dx is the motion of the tip at the device, and F the mean of `commanded_force_n`
over the ticks since the previous report. `position_mm` is in the scene; scale and offset convert it to the device. NumPy recomputes the
column to 1e-9 J. In a run with two devices, each device has its own rows and its own table of `scene.json` (`device`, `second_device`):

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

`examples/python/port_energy.py` does this for a log. The log must have all ticks (`lost_ticks` is 0), and `servo.numeric` must be
`fixed`. In a row with the command `restart` the motors were off, so the forces before this row count as 0. With a `workspace_scale`
below 1 a step of `position_mm` (2^-16 mm) is more than a step of the device, and the result is off by up to 1e-7 J at a `workspace_scale` of 0.4. From
`encoder_counts` the tip is exact at any scale: `device_tip.from_counts` in the same folder computes it for Omni, Inverse3, Touch and
omega.

## For other tools

    ./kerf record export DIR/log --mcap run.mcap
    ./kerf record export DIR/log --hdf5 run.h5
    ./kerf record export DIR/log --csv run.csv

**MCAP** opens in Foxglove and its open forks, in PlotJuggler and with ROS 2 (`ros2 bag`). The definitions of the messages are in the
file. Times are UTC. With `--time monotonic` they are `start_ns`. If the log has no date, the times are always `start_ns`, and one line
reports it. A date before 1970 or after 2038-01-19 is refused, because ROS 2 has no such date. The column `start_ns` is not changed.

| topic | message | rate |
|---|---|---|
| `/kerf/tick` | `kerf_msgs/msg/Tick`: all columns below, by their names | every tick |
| `/kerf/tip` | `geometry_msgs/msg/PoseStamped`: the tool's tip in metres, in frame `scene`; from docking on | 100 Hz |
| `/kerf/force` | `geometry_msgs/msg/WrenchStamped`: `commanded_force_n`, in frame `device`, and `tip_torque_n_mm` in N m | 100 Hz |
| `/kerf/2/tick`, `/kerf/2/tip`, `/kerf/2/force` | the same of a second device; its forces are in frame `device_2` | the same |
| `/tf` | `tf2_msgs/msg/TFMessage`: `device` and, from docking on, `tip` in `scene`; of a second device `device_2`, `tip_2` | 100 Hz |

The device's axes are parallel to the scene's, and its origin is at `device.offset_mm`. The file has the profile `ros2` of
[MCAP's registry](https://mcap.dev/spec/registry): each channel states the quality of service that its publisher offers. For programs of
ROS 2 that use `/kerf/tick`, copy `ros/kerf_msgs` (installed: `share/kerf/ros/kerf_msgs`) into the `src/` of a workspace, run
`colcon build`, and play the file by `ros2 bag play run.mcap`. The constants of the message (`FLAGS_CONTACT`, `FAULT_OVERSPEED`) are the
bits and codes below.

Chunks are compressed by LZ4, unless `--unpacked` is given. The other files of the recording are attached, with the volumes as they
were at the start. So the MCAP of a whole recording replays on kerf's page ([kerf in a browser](second-machine.md#kerf-in-a-browser)).
With `--from` or `--until` the file has the messages alone. `ticks.npy.head` is the header of the log. To restore `ticks.npy`, write
this header, then each `/kerf/tick` message without its first four bytes (the CDR header).

**HDF5** opens in MATLAB (`h5read("run.h5", "/ticks/position_mm")`), Octave (`load -hdf5 run.h5`), Julia, R and h5py. It has one dataset
for each column, `/ticks/COLUMN`, with the attributes `units`, `description` and `valid`. If the values are codes or bits, the attribute
`codes` lists them, and `description` has them, too. In programs that store by columns, such as MATLAB, Octave and Julia, `position_mm`
is 3 x rows. `/ticks_2` has the columns of a second device. `/scene` is the JSON of the scene in ASCII; other characters are `\uXXXX`.
`/ticks/time_ns` is the time of each row: UTC, or `start_ns` with `--time monotonic`. The attribute `clock` of the file names the clock.

A running controller can be plotted without a log: in [Foxglove](compatibility.md#foxglove) by the bridge, and in PlotJuggler by its UDP
server (protocol JSON, timestamp from the message; a second device is in `kerf_2`):

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
