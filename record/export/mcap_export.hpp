// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "record/export/mcap_file.hpp"
#include "record/log_clock.hpp"
#include "record/tick_log.hpp"

namespace kerf {

/// Writes the recording in `folder` as MCAP, for Foxglove, PlotJuggler and ROS 2: messages in CDR,
/// whose definitions are in the file. Whole or not at all; memory for the index and the largest
/// attachment.
///
///   /kerf/tick    kerf_msgs/msg/Tick            every column of every tick, in their order
///   /kerf/tip     geometry_msgs/msg/PoseStamped    the tool's tip in metres, from docking on
///   /kerf/force   geometry_msgs/msg/WrenchStamped  the commanded force, in the device's axes
///
///   /tf           tf2_msgs/msg/TFMessage        where device and tip are in the scene, of all arms
///
/// The file has the profile ros2 of https://mcap.dev/spec/registry, whose channels say which
/// quality of service their publishers offer. A second arm has /kerf/2/tick, /kerf/2/tip and
/// /kerf/2/force, whose frame is device_2.
///
/// A whole recording has its other files, too, as attachments, so that it replays from this file
/// alone (web/page/mcap_log.js): manifest.json, scene.json, clock.npy, volumes/, inputs/, and as
/// ticks.npy.head, ticks-2.npy.head the headers of the logs, whose rows are the messages' bytes
/// behind the four of CDR; the count in them is that of the log, more than its rows if it was cut.
/// A range of ticks has none. Returns one line, "location: value; remedy", for each file that is
/// left out because it cannot be read, and if scene.json has no place of a device, without which
/// there is no /tf.
///
/// Tip, force and frames come 100 times a second: the tick has all of them. Times are UTC by
/// `clock`, or `start_ns` if that has no date; they do not fall, since one that would is that of
/// the message before. Throws `RecordError`, also for a date that MCAP or ROS 2 has not, before
/// 1970 or after 2038-01-19; or `FileError` if the file cannot be written.
std::vector<std::string> export_mcap(const std::filesystem::path& folder,
                                     const std::filesystem::path& mcap, McapWriter::Packing packing,
                                     TickRange range = {}, const LogClock& clock = {});

}  // namespace kerf
