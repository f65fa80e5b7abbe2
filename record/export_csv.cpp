// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>

#include "record/manifest.hpp"
#include "record/summary.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/run_files.hpp"
#include "shared/segment/layout_table.hpp"

namespace kerf {
namespace {

template <class Number>
void append(std::string& line, const std::byte* at) {
  Number value{};
  std::memcpy(&value, at, sizeof value);
  char text[32];  // the longest double has 24 characters
  line.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void append_element(std::string& line, std::string_view type, const std::byte* at) {
  if (type == "u64") append<std::uint64_t>(line, at);
  if (type == "i64") append<std::int64_t>(line, at);
  if (type == "u32") append<std::uint32_t>(line, at);
  if (type == "i32") append<std::int32_t>(line, at);
  if (type == "u16") append<std::uint16_t>(line, at);
  if (type == "i16") append<std::int16_t>(line, at);
  if (type == "f64") append<double>(line, at);
  if (type == "f32") append<float>(line, at);
}

/// Calls `visit(field, element)` for each number of a tick record in order.
template <class Visit>
void for_each_number(Visit visit) {
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != "TickRecord") continue;
    for (std::uint32_t i = 0; i < field.count; ++i) visit(field, i);
  }
}

}  // namespace

void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv) {
  check_outputs(recording_files(folder), {{"--csv", csv, ".csv"}});
  NewFile file(csv);
  TickLogReader log(folder / kTickLogName);
  std::string line;
  const auto end_line = [&] {
    line.back() = '\n';  // the last comma
    file.write(line.data(), line.size());
    line.clear();
  };
  for_each_number([&](const LayoutField& field, std::uint32_t i) {
    line += field.name;
    if (field.count > 1) line += "_" + std::to_string(i);
    line += ',';
  });
  end_line();
  log.for_each([&](const TickRecord& record) {
    const auto* const bytes = reinterpret_cast<const std::byte*>(&record);
    for_each_number([&](const LayoutField& field, std::uint32_t i) {
      append_element(line, field.type, bytes + field.offset + i * type_bytes(field.type));
      line += ',';
    });
    end_line();
  });
  file.close();
  file.commit();
}

}  // namespace kerf
