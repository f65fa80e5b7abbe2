// SPDX-License-Identifier: Apache-2.0
// The bytes of an MCAP against its specification, read by hand; mcap_test.py has the readers of its
// project.
#include "record/export/mcap_file.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>
#include <zlib.h>

namespace kerf::mcap_file_test {
namespace {

struct Record {
  std::uint8_t opcode;
  std::uint64_t offset;  // of the opcode
  std::string_view content;
};

template <class Number>
Number number_at(std::string_view bytes, std::size_t at) {
  Number value{};
  REQUIRE(at + sizeof value <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// All records from `begin` on, to the end.
std::vector<Record> records_of(std::string_view bytes, std::size_t begin, std::size_t end) {
  std::vector<Record> records;
  for (std::size_t at = begin; at < end;) {
    const auto length = number_at<std::uint64_t>(bytes, at + 1);
    REQUIRE(at + 9 + length <= end);
    records.push_back({number_at<std::uint8_t>(bytes, at), at, bytes.substr(at + 9, length)});
    at += 9 + length;
  }
  return records;
}

std::string written(std::size_t messages, std::size_t bytes_each) {
  std::string file;
  McapWriter writer([&](std::string_view part) { file += part; }, "", "test",
                    McapWriter::Packing::none);
  const std::uint16_t first = writer.add({"/a", "A", "int32 x", "ros2msg", "cdr"});
  const std::uint16_t second = writer.add({"/b", "B", "int32 y", "ros2msg", "cdr"});
  for (std::size_t i = 0; i < messages; ++i) {
    writer.message(i % 3 == 0 ? second : first, 1000 + i, std::string(bytes_each, 'x'));
  }
  writer.close();
  return file;
}

constexpr std::size_t kMagicBytes = 8;

}  // namespace

TEST_CASE("each index of an MCAP leads to its chunk and its messages") {
  const std::string file = written(5000, 700);
  const std::string_view magic("\x89MCAP0\r\n", kMagicBytes);
  REQUIRE(file.substr(0, kMagicBytes) == magic);
  REQUIRE(file.substr(file.size() - kMagicBytes) == magic);
  const auto all = records_of(file, kMagicBytes, file.size() - kMagicBytes);
  std::map<std::uint64_t, Record> by_offset;
  for (const Record& record : all) by_offset.emplace(record.offset, record);
  REQUIRE(all.front().opcode == 0x01);
  REQUIRE(all.back().opcode == 0x02);

  std::size_t chunks = 0, messages = 0;
  for (const Record& index : all) {
    if (index.opcode != 0x08) continue;
    ++chunks;
    const auto at = number_at<std::uint64_t>(index.content, 16);
    const Record& chunk = by_offset.at(at);
    REQUIRE(chunk.opcode == 0x06);
    CHECK(number_at<std::uint64_t>(index.content, 24) == 9 + chunk.content.size());
    const std::string_view inside = chunk.content.substr(40);
    const auto crc =
        crc32(0, reinterpret_cast<const Bytef*>(inside.data()), static_cast<uInt>(inside.size()));
    CHECK(number_at<std::uint32_t>(chunk.content, 24) == crc);
    const auto map_bytes = number_at<std::uint32_t>(index.content, 32);
    for (std::size_t entry = 36; entry < 36 + map_bytes; entry += 10) {
      const auto channel = number_at<std::uint16_t>(index.content, entry);
      const Record& times = by_offset.at(number_at<std::uint64_t>(index.content, entry + 2));
      REQUIRE(times.opcode == 0x07);
      CHECK(number_at<std::uint16_t>(times.content, 0) == channel);
      const auto bytes = number_at<std::uint32_t>(times.content, 2);
      for (std::size_t pair = 6; pair < 6 + bytes; pair += 16) {
        const auto offset = number_at<std::uint64_t>(times.content, pair + 8);
        CHECK(number_at<std::uint8_t>(inside, offset) == 0x05);
        CHECK(number_at<std::uint16_t>(inside, offset + 9) == channel);
        CHECK(number_at<std::uint64_t>(inside, offset + 15) ==
              number_at<std::uint64_t>(times.content, pair));
        ++messages;
      }
    }
  }
  CHECK(chunks > 3);
  CHECK(messages == 5000);
}

TEST_CASE("the footer of an MCAP leads to its summary, whose checksum is right") {
  for (const std::size_t messages : {std::size_t{0}, std::size_t{1}, std::size_t{4000}}) {
    const std::string file = written(messages, 300);
    const std::string_view footer = std::string_view(file).substr(file.size() - kMagicBytes - 29);
    REQUIRE(number_at<std::uint8_t>(footer, 0) == 0x02);
    REQUIRE(number_at<std::uint64_t>(footer, 1) == 20);
    const auto summary = number_at<std::uint64_t>(footer, 9);
    const std::string_view summed =
        std::string_view(file).substr(summary, file.size() - kMagicBytes - 4 - summary);
    const auto crc =
        crc32(0, reinterpret_cast<const Bytef*>(summed.data()), static_cast<uInt>(summed.size()));
    CHECK(number_at<std::uint32_t>(footer, 25) == crc);
    const auto records = records_of(file, summary, file.size() - kMagicBytes);
    CHECK(records.front().opcode == 0x03);
    const auto statistics = std::ranges::find(records, 0x0b, &Record::opcode);
    REQUIRE(statistics != records.end());
    CHECK(number_at<std::uint64_t>(statistics->content, 0) == messages);

    // One group after the other, each with its offset record behind the last of them.
    const auto offsets = number_at<std::uint64_t>(footer, 17);
    std::uint64_t begin = summary;
    for (const Record& group : records_of(file, offsets, file.size() - kMagicBytes)) {
      if (group.opcode == 0x02) break;
      REQUIRE(group.opcode == 0x0e);
      REQUIRE(number_at<std::uint64_t>(group.content, 1) == begin);
      const auto end = begin + number_at<std::uint64_t>(group.content, 9);
      REQUIRE(end <= offsets);
      for (const Record& record : records_of(file, begin, end)) {
        CHECK(record.opcode == number_at<std::uint8_t>(group.content, 0));
      }
      begin = end;
    }
    CHECK(begin == offsets);
  }
}

TEST_CASE("the index of an MCAP leads to its attachments, whose checksums are right") {
  std::string file;
  McapWriter writer([&](std::string_view part) { file += part; }, "", "test",
                    McapWriter::Packing::lz4);
  const std::uint16_t channel = writer.add({"/a", "A", "int32 x", "ros2msg", "cdr"});
  writer.message(channel, 1234, "abcd");
  writer.attach("scene.json", "application/json", "{}");
  writer.attach("empty", "text/plain", "");
  writer.close();
  const auto all = records_of(file, kMagicBytes, file.size() - kMagicBytes);
  std::vector<std::string_view> contents;
  for (const Record& index : all) {
    if (index.opcode != 0x0a) continue;
    const auto at = number_at<std::uint64_t>(index.content, 0);
    const auto found = std::ranges::find(all, at, &Record::offset);
    REQUIRE(found != all.end());
    REQUIRE(found->opcode == 0x09);
    const std::string_view content = found->content;
    CHECK(number_at<std::uint64_t>(index.content, 8) == 9 + content.size());
    CHECK(number_at<std::uint64_t>(content, 0) == 1234);
    const auto name = number_at<std::uint32_t>(content, 16);
    const auto type = number_at<std::uint32_t>(content, 20 + name);
    const std::size_t data = 24 + name + type;
    const auto bytes = number_at<std::uint64_t>(content, data);
    CHECK(number_at<std::uint64_t>(index.content, 32) == bytes);
    const auto summed = content.substr(0, data + 8 + bytes);
    CHECK(content.size() == summed.size() + 4);
    CHECK(
        number_at<std::uint32_t>(content, summed.size()) ==
        crc32(0, reinterpret_cast<const Bytef*>(summed.data()), static_cast<uInt>(summed.size())));
    contents.push_back(content.substr(data + 8, bytes));
  }
  CHECK(contents == std::vector<std::string_view>{"{}", ""});
  const auto statistics = std::ranges::find(all, 0x0b, &Record::opcode);
  REQUIRE(statistics != all.end());
  CHECK(number_at<std::uint32_t>(statistics->content, 14) == 2);
}

}  // namespace kerf::mcap_file_test
