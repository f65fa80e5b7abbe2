// SPDX-License-Identifier: Apache-2.0
#include "record/mcap_export.hpp"

#include <array>
#include <cstdint>
#include <string_view>

#include "record/recording.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/ros_messages.hpp"

namespace kerf {

void export_mcap(const std::filesystem::path& folder, const std::filesystem::path& mcap,
                 McapWriter::Packing packing, TickRange range) {
  check_outputs(recording_files(folder), {{"--mcap", mcap, ".mcap"}});
  const Manifest manifest = read_manifest(folder);
  TickLogReader log(folder / kTickLogName);
  AtomicFile file(mcap);
  McapWriter writer([&](std::string_view bytes) { file.write(bytes.data(), bytes.size()); }, "ros2",
                    "kerf " KERF_VERSION, packing);
  std::array<std::uint16_t, kRosTopics> channels{};
  std::uint16_t* added = channels.data();
  for (const RosChannel& one : ros_channels()) {
    *added++ = writer.add({std::string(one.topic), std::string(one.schema), one.definition,
                           std::string(kRosSchemaEncoding), std::string(kRosEncoding)});
  }
  RosMessages messages(manifest.tick_ns);
  const auto write_tick = [&](const TickRecord& record) {
    for (const RosTopic topic : {ros_tick, ros_tip, ros_force}) {
      if (!messages.has(topic, record)) continue;
      writer.message(channels[topic], record.start_ns, messages.message(topic, record));
    }
  };
  log.for_each(write_tick, range);
  writer.close();
  file.close();
  file.commit();
}

}  // namespace kerf
