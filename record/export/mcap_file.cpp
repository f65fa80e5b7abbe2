// SPDX-License-Identifier: Apache-2.0
#include "record/export/mcap_file.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <lz4frame.h>
#include <zlib.h>

namespace kerf {
namespace {

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel_record = 0x04,
  message_record = 0x05,
  chunk_record = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0a,
  statistics = 0x0b,
  summary_offset = 0x0e,
  data_end = 0x0f
};

std::uint32_t crc(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32(before, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

/// A map of integers, preceded by its length in bytes.
void put_map(McapBytes& out, const std::map<std::uint16_t, std::uint64_t>& map) {
  out.number(
      static_cast<std::uint32_t>(map.size() * (sizeof(std::uint16_t) + sizeof(std::uint64_t))));
  for (const auto& [key, value] : map) {
    out.number(key);
    out.number(value);
  }
}

}  // namespace

std::size_t McapBytes::begin(std::uint8_t opcode) {
  number(opcode);
  number(std::uint64_t{0});
  return bytes_.size();
}

void McapBytes::end(std::size_t begun) {
  const std::uint64_t length = bytes_.size() - begun;
  std::memcpy(bytes_.data() + begun - sizeof length, &length, sizeof length);
}

McapWriter::McapWriter(ByteSink sink, std::string_view profile, std::string_view library,
                       Packing packing)
    : sink_(std::move(sink)), packing_(packing) {
  McapBytes bytes;
  bytes.raw(kMagic);
  const std::size_t begun = bytes.begin(header);
  bytes.text(profile);
  bytes.text(library);
  bytes.end(begun);
  put(bytes.bytes());
}

void McapWriter::put(std::string_view bytes) {
  sink_(bytes);
  written_ += bytes.size();
}

std::uint16_t McapWriter::add(const Channel& channel) {
  const auto id = static_cast<std::uint16_t>(counts_.size() + 1);
  McapBytes bytes;
  std::size_t begun = bytes.begin(schema);
  bytes.number(id);
  bytes.text(channel.schema);
  bytes.text(channel.schema_encoding);
  bytes.text(channel.definition);
  bytes.end(begun);
  schemas_ += bytes.bytes();
  bytes.clear();
  begun = bytes.begin(channel_record);
  bytes.number(id);
  bytes.number(id);  // of the schema
  bytes.text(channel.topic);
  bytes.text(channel.encoding);
  McapBytes metadata;
  for (const auto& [key, value] : channel.metadata) {
    metadata.text(key);
    metadata.text(value);
  }
  bytes.text(metadata.bytes());  // a map, preceded by its length in bytes
  bytes.end(begun);
  channels_ += bytes.bytes();
  counts_[id] = 0;
  return id;
}

void McapWriter::message(std::uint16_t channel, std::uint64_t time_ns, std::string_view data) {
  if (chunk_.size() == 0) {
    chunk_.raw(chunks_.empty() ? schemas_ + channels_ : std::string());
    first_ns_ = time_ns;
    if (chunks_.empty()) begin_ns_ = time_ns;
  }
  last_ns_ = end_ns_ = time_ns;
  index_[channel].emplace_back(time_ns, chunk_.size());
  const std::size_t begun = chunk_.begin(message_record);
  chunk_.number(channel);
  chunk_.number(static_cast<std::uint32_t>(counts_[channel]++));
  chunk_.number(time_ns);
  chunk_.number(time_ns);  // published when logged
  chunk_.raw(data);
  chunk_.end(begun);
  if (chunk_.size() >= kMcapChunkBytes) end_chunk();
}

std::string_view McapWriter::packing_name() const noexcept {
  return packing_ == Packing::lz4 ? "lz4" : "";
}

std::string McapWriter::packed() const {
  if (packing_ == Packing::none) return chunk_.bytes();
  std::string out(LZ4F_compressFrameBound(chunk_.size(), nullptr), '\0');
  const std::size_t size =
      LZ4F_compressFrame(out.data(), out.size(), chunk_.bytes().data(), chunk_.size(), nullptr);
  if (LZ4F_isError(size) != 0) throw std::runtime_error("lz4: a chunk cannot be packed");
  out.resize(size);
  return out;
}

void McapWriter::end_chunk() {
  if (chunk_.size() == 0) return;
  const std::string records = packed();
  IndexedChunk indexed{first_ns_, last_ns_, written_, 0, records.size(), chunk_.size(), 0, {}};
  McapBytes bytes;
  std::size_t begun = bytes.begin(chunk_record);
  bytes.number(first_ns_);
  bytes.number(last_ns_);
  bytes.number(std::uint64_t{chunk_.size()});
  bytes.number(crc(chunk_.bytes()));
  bytes.text(packing_name());
  bytes.number(std::uint64_t{records.size()});
  bytes.raw(records);
  bytes.end(begun);
  put(bytes.bytes());
  indexed.bytes = bytes.size();
  bytes.clear();
  for (const auto& [channel, messages] : index_) {
    indexed.index_offsets[channel] = written_ + bytes.size();
    begun = bytes.begin(message_index);
    bytes.number(channel);
    bytes.number(static_cast<std::uint32_t>(messages.size() * 2 * sizeof(std::uint64_t)));
    for (const auto& [time_ns, offset] : messages) {
      bytes.number(time_ns);
      bytes.number(offset);
    }
    bytes.end(begun);
  }
  put(bytes.bytes());
  indexed.index_bytes = bytes.size();
  chunks_.push_back(std::move(indexed));
  chunk_.clear();
  index_.clear();
}

void McapWriter::attach(std::string_view name, std::string_view media_type, std::string_view data) {
  end_chunk();
  McapBytes bytes;
  const std::size_t begun = bytes.begin(attachment);
  bytes.number(begin_ns_);  // logged
  bytes.number(begin_ns_);  // created
  bytes.text(name);
  bytes.text(media_type);
  bytes.number(std::uint64_t{data.size()});
  bytes.raw(data);
  bytes.number(crc(std::string_view(bytes.bytes()).substr(begun)));
  bytes.end(begun);
  attachments_.push_back(
      {written_, bytes.size(), data.size(), std::string(name), std::string(media_type)});
  put(bytes.bytes());
}

std::string McapWriter::statistics_record() const {
  McapBytes bytes;
  const std::size_t begun = bytes.begin(statistics);
  std::uint64_t messages = 0;
  for (const auto& [id, count] : counts_) messages += count;
  bytes.number(messages);
  bytes.number(static_cast<std::uint16_t>(counts_.size()));  // schemas
  bytes.number(static_cast<std::uint32_t>(counts_.size()));  // channels
  bytes.number(static_cast<std::uint32_t>(attachments_.size()));
  bytes.number(std::uint32_t{0});  // metadata
  bytes.number(static_cast<std::uint32_t>(chunks_.size()));
  bytes.number(begin_ns_);
  bytes.number(end_ns_);
  put_map(bytes, counts_);
  bytes.end(begun);
  return bytes.bytes();
}

std::string McapWriter::chunk_records() const {
  McapBytes bytes;
  for (const IndexedChunk& chunk : chunks_) {
    const std::size_t begun = bytes.begin(chunk_index);
    bytes.number(chunk.first_ns);
    bytes.number(chunk.last_ns);
    bytes.number(chunk.offset);
    bytes.number(chunk.bytes);
    put_map(bytes, chunk.index_offsets);
    bytes.number(chunk.index_bytes);
    bytes.text(packing_name());
    bytes.number(chunk.packed);
    bytes.number(chunk.unpacked);
    bytes.end(begun);
  }
  return bytes.bytes();
}

std::string McapWriter::attachment_records() const {
  McapBytes bytes;
  for (const IndexedAttachment& one : attachments_) {
    const std::size_t begun = bytes.begin(attachment_index);
    bytes.number(one.offset);
    bytes.number(one.bytes);
    bytes.number(begin_ns_);
    bytes.number(begin_ns_);
    bytes.number(one.data_bytes);
    bytes.text(one.name);
    bytes.text(one.media_type);
    bytes.end(begun);
  }
  return bytes.bytes();
}

void McapWriter::close() {
  end_chunk();
  McapBytes bytes;
  const std::size_t begun = bytes.begin(data_end);
  bytes.number(std::uint32_t{0});  // no checksum over all of the data: each chunk has its own
  bytes.end(begun);
  put(bytes.bytes());

  // The summary: groups of records, and where each group begins.
  const std::uint64_t summary = written_;
  McapBytes offsets;
  bytes.clear();
  const auto add_group = [&](std::uint8_t opcode, std::string_view records) {
    if (records.empty()) return;
    const std::size_t start = offsets.begin(summary_offset);
    offsets.number(opcode);
    offsets.number(summary + bytes.size());
    offsets.number(std::uint64_t{records.size()});
    offsets.end(start);
    bytes.raw(records);
  };
  add_group(schema, schemas_);
  add_group(channel_record, channels_);
  add_group(statistics, statistics_record());
  add_group(chunk_index, chunk_records());
  add_group(attachment_index, attachment_records());

  const std::uint64_t offsets_at = summary + bytes.size();
  bytes.raw(offsets.bytes());
  bytes.number(footer);
  bytes.number(std::uint64_t{2 * sizeof(std::uint64_t) + sizeof(std::uint32_t)});
  bytes.number(summary);
  bytes.number(offsets_at);
  bytes.number(crc(bytes.bytes()));  // over the summary and the footer up to here
  put(bytes.bytes());
  put(kMagic);
}

}  // namespace kerf
