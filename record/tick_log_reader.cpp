// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

#include "record/record_error.hpp"
#include "record/tick_log.hpp"
#include "shared/segment/hash.hpp"

namespace kerf {
namespace {

/// The row count of `header`; throws where it is not `tick_log_header` of that count.
[[nodiscard]] std::uint64_t rows_of(const std::string& header, const std::string& path) {
  constexpr std::string_view kShape = "'shape': (";
  const std::size_t at = header.find(kShape);
  std::uint64_t rows = 0;
  if (at != std::string::npos) {
    const char* const digits = header.data() + at + kShape.size();
    std::from_chars(digits, header.data() + header.size(), rows);
  }
  if (header != tick_log_header(rows)) {
    throw RecordError(path + ": not a tick log of this version; record it again");
  }
  return rows;
}

}  // namespace

TickLogReader::TickLogReader(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code fault;
  const bool is_file =
      std::filesystem::is_regular_file(path_, fault);  // a pipe would be waited for
  if (is_file) file_.open(path_, std::ios::binary);
  if (!file_.is_open()) {
    throw RecordError(path_.string() + ": cannot be read; give the folder of a recording");
  }
  std::string header(kTickLogHeaderBytes, '\0');
  file_.read(header.data(), static_cast<std::streamsize>(header.size()));
  const std::uint64_t counted = rows_of(header, path_.string());
  file_.clear();
  file_.seekg(0, std::ios::end);
  const auto bytes = static_cast<std::uint64_t>(file_.tellg());
  rows_ = bytes < kTickLogHeaderBytes ? 0 : (bytes - kTickLogHeaderBytes) / sizeof(TickRecord);
  if (rows_ < counted) {
    throw RecordError(path_.string() + ": " + std::to_string(rows_) + " rows of " +
                      std::to_string(counted) + "; the file was cut, copy it again");
  }
}

void TickLogReader::for_each(const std::function<void(const TickRecord&)>& visit) {
  constexpr std::size_t kChunkRows = 1024;
  std::vector<TickRecord> chunk(kChunkRows);
  file_.clear();
  file_.seekg(kTickLogHeaderBytes);
  for (std::uint64_t row = 0; row < rows_;) {
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(kChunkRows, rows_ - row));
    file_.read(reinterpret_cast<char*>(chunk.data()),
               static_cast<std::streamsize>(count * sizeof(TickRecord)));
    if (!file_) throw RecordError(path_.string() + ": cannot be read; copy it again");
    for (std::size_t i = 0; i < count; ++i, ++row) {
      if (tick_record_crc(chunk[i]) != chunk[i].crc32c) {
        throw RecordError(path_.string() + ": row " + std::to_string(row) +
                          " has a wrong checksum; copy it again");
      }
      visit(chunk[i]);
    }
  }
}

}  // namespace kerf
