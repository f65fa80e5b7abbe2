// SPDX-License-Identifier: Apache-2.0
#include "record/mcap_export.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "record/recording.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/ros_messages.hpp"

namespace kerf {

void export_mcap(const std::filesystem::path& folder, const std::filesystem::path& mcap,
                 McapWriter::Packing packing, TickRange range) {
  check_outputs(recording_files(folder), {{"--mcap", mcap, ".mcap"}});
  const Manifest manifest = read_manifest(folder);
  AtomicFile file(mcap);
  McapWriter writer([&](std::string_view bytes) { file.write(bytes.data(), bytes.size()); }, "ros2",
                    "kerf " KERF_VERSION, packing);
  std::vector<std::uint16_t> channels;  // of the first arm by topic, then of the second
  for (std::size_t arm = 0; arm < manifest.arms; ++arm) {
    for (const RosChannel& one : ros_channels(arm)) {
      channels.push_back(
          writer.add({std::string(one.topic), std::string(one.schema), one.definition,
                      std::string(kRosSchemaEncoding), std::string(kRosEncoding)}));
    }
  }
  RosMessages messages(manifest.tick_ns);
  const auto write_arm = [&](const TickRecord& record, std::size_t arm) {
    for (const RosTopic topic : {ros_tick, ros_tip, ros_force}) {
      if (!messages.has(topic, record)) continue;
      writer.message(channels[arm * kRosTopics + topic], record.start_ns,
                     messages.message(topic, record, arm));
    }
  };
  for_each_tick(folder, manifest, range, [&](const TickRecord& first, const TickRecord* second) {
    write_arm(first, 0);
    if (second != nullptr) write_arm(*second, 1);
  });
  writer.close();
  file.close();
  file.commit();
}

}  // namespace kerf
