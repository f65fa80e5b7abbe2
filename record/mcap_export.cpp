// SPDX-License-Identifier: Apache-2.0
#include "record/mcap_export.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "record/input_rows.hpp"
#include "record/kept_volumes.hpp"
#include "record/recording.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/layout_table.hpp"
#include "shared/segment/ros_messages.hpp"

namespace kerf {
namespace {

/// Each column begins where the one before ends: CDR, which aligns as the record does, adds
/// nothing.
constexpr bool has_no_padding() {
  std::uint32_t end = 0;
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != "TickRecord") continue;
    if (field.offset != end) return false;
    end += type_bytes(field.type) * field.count;
  }
  return end == sizeof(TickRecord);
}
static_assert(has_no_padding(), "mcap_export.hpp: the bytes of a message are those of a row");

/// The regular files of a folder, by name; none if there is no such folder.
std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code fault;
  for (const auto& entry : std::filesystem::directory_iterator(folder, fault)) {
    if (entry.is_regular_file(fault)) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

/// What a replay needs besides the ticks.
void attach_files(const std::filesystem::path& folder, const Manifest& manifest,
                  McapWriter& writer) {
  const auto attach = [&](const std::string& name, std::string_view type,
                          const std::filesystem::path& file) {
    writer.attach(name, type, text_in(file));
  };
  for (const std::string_view name : {kManifestName, kSceneName}) {
    attach(std::string(name), "application/json", folder / name);
  }
  for (const std::string_view below : {kVolumesName, inputs_name(0), inputs_name(1)}) {
    for (const std::filesystem::path& file : files_in(folder / below)) {
      attach(std::string(below) + "/" + file.filename().string(), "application/gzip", file);
    }
  }
  for (std::size_t arm = 0; arm < manifest.arms; ++arm) {
    const std::string name(tick_log_name(arm));
    const std::uint64_t rows = TickLogReader(folder / name).rows();
    writer.attach(name + ".head", "application/octet-stream", tick_log_header(rows));
  }
}

}  // namespace

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
  if (range.is_whole()) attach_files(folder, manifest, writer);
  writer.close();
  file.close();
  file.commit();
}

}  // namespace kerf
