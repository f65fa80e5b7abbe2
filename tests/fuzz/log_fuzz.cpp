// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "controller/load/scene_json.hpp"
#include "record/check/recording_check.hpp"
#include "record/export/mcap_export.hpp"
#include "record/input_rows.hpp"
#include "record/log_clock.hpp"
#include "record/recording.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "tests/support/temporary_folder.hpp"

/// The files of a recording, each as foreign bytes beside sound ones. By the first byte:
/// 0 manifest.json, 1 scene.json, 2 ticks.npy, 3 rows of ticks behind a sound header, with sound
/// checksums, 4 inputs before the log, 5 such rows and the log of a second arm, by the second byte
/// as it is or behind a sound header. 255: clock.npy, by the second byte as it is, or as pairs with
/// sound checksums. Every reader gives a result, or one line.
namespace {

constexpr std::string_view kManifest = R"({"session_id": "0", "tick_ns": 1000000, "end_reason": "",
  "lost_ticks": 0, "missed_before_start": 0, "gaps": [], "volumes": [{"spacing_mm": [1, 1, 1]}]})";

/// The same of a run with two devices.
std::string manifest_of_two() {
  return R"({"arms": 2, )" + std::string(kManifest.substr(1));
}

void must_be_a_line(std::string_view line) {
  if (line.empty() || line.size() > 1000 || line.find('\n') != line.npos) std::abort();
}

template <class Error, class Read>
void must_read_or_explain(Read read) {
  try {
    read();
  } catch (const Error& error) {
    must_be_a_line(error.what());
  }
}

/// The bytes as rows, a checksum in each, behind their header.
std::string log_of(std::string_view bytes) {
  const std::size_t count = bytes.size() / sizeof(kerf::TickRecord);
  std::string log = kerf::tick_log_header(count);
  for (std::size_t i = 0; i < count; ++i) {
    kerf::TickRecord row;
    std::memcpy(&row, bytes.data() + i * sizeof row, sizeof row);
    row.crc32c = kerf::tick_record_crc(row);
    log.append(reinterpret_cast<const char*>(&row), sizeof row);
  }
  return log;
}

void read_foreign_clock(const kerf::test::TemporaryFolder& folder, std::string_view bytes) {
  if (!bytes.empty() && bytes[0] % 2 != 0) {
    folder.write("clock.npy", std::string(bytes.substr(1)));
  } else {
    std::vector<kerf::ClockPair> pairs(bytes.size() / sizeof(kerf::ClockPair));
    bytes.copy(reinterpret_cast<char*>(pairs.data()), pairs.size() * sizeof(kerf::ClockPair));
    for (kerf::ClockPair& pair : pairs) pair = kerf::sealed(pair);
    kerf::write_clock(folder.path(), pairs);
  }
  const kerf::LogClock clock = kerf::read_clock(folder.path(), true);
  if (!clock.problem().empty()) must_be_a_line(clock.problem());
  if (const std::string set = clock.set_in_the_run(); !set.empty()) must_be_a_line(set);
  must_be_a_line(kerf::date_text(clock.offset_ns()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const kerf::test::TemporaryFolder folder;
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] == 255) {
    read_foreign_clock(folder, bytes);
    return 0;
  }
  const int kind = data[0] % 6;
  if (kind == 1) {
    must_read_or_explain<kerf::JsonError>([&] { static_cast<void>(kerf::source_in(bytes)); });
    must_read_or_explain<kerf::JsonError>(
        [&] { static_cast<void>(kerf::json_without_source(bytes)); });
    return 0;
  }
  if (kind == 4) {
    std::filesystem::create_directory(folder / "inputs");
    folder.write("inputs/000000000001.npy.gz", bytes);
    must_read_or_explain<kerf::RecordError>([] {
      kerf::InputReader reader(folder.path(), 10, 1);
      while (!reader.next().empty()) {
      }
    });
    return 0;
  }
  folder.write("manifest.json", kind == 0   ? std::string(bytes)
                                : kind == 5 ? manifest_of_two()
                                            : std::string(kManifest));
  const bool rows = kind == 3 || kind == 5;
  folder.write("ticks.npy", kind == 2 ? std::string(bytes) : log_of(rows ? bytes : ""));
  if (kind == 5) {
    const std::string_view second = bytes.substr(std::min<std::size_t>(1, bytes.size()));
    const bool as_it_is = !bytes.empty() && bytes[0] % 2 != 0;
    folder.write("ticks-2.npy", as_it_is ? std::string(second) : log_of(bytes));
  }
  must_read_or_explain<kerf::RecordError>([] {
    const kerf::RecordSummary summary = kerf::summarise(folder.path());
    static_cast<void>(kerf::to_text(summary));
    static_cast<void>(kerf::to_json(summary));
  });
  must_read_or_explain<kerf::RecordError>(
      [] { static_cast<void>(kerf::kept_summary(folder.path())); });
  must_read_or_explain<kerf::RecordError>(
      [] { static_cast<void>(kerf::summarise(folder.path(), {}, 1)); });
  must_read_or_explain<kerf::RecordError>(
      [] { static_cast<void>(kerf::summarise(folder.path(), {.from = 1, .until = 1000})); });
  must_read_or_explain<kerf::RecordError>(
      [] { kerf::export_mcap(folder.path(), "/dev/null", kerf::McapWriter::Packing::lz4); });
  must_read_or_explain<kerf::RecordError>([] { kerf::export_csv(folder.path(), "/dev/null"); });
  return 0;
}
