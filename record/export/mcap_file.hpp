// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

// The container format MCAP, version 0 (https://mcap.dev/spec): chunks with an index behind them,
// so that tools seek in a file of any length.

namespace kerf {

/// Bytes of records: little-endian numbers, texts behind their length.
class McapBytes {
 public:
  template <class Number>
  void number(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  /// Its length as 32 bits, then it.
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
  }
  void raw(std::string_view value) { bytes_ += value; }
  /// Begins a record; `end` of what this returns writes its length.
  [[nodiscard]] std::size_t begin(std::uint8_t opcode);
  void end(std::size_t begun);

  [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }
  void clear() noexcept { bytes_.clear(); }

 private:
  std::string bytes_;
};

/// Takes the bytes of a file, in order.
using ByteSink = std::function<void(std::string_view)>;

/// Writes one file: channels first, then messages with times that do not fall, then `close`. Memory
/// grows by some hundred bytes for each chunk of kMcapChunkBytes. What `sink` throws ends it.
class McapWriter {
 public:
  enum class Packing : std::uint8_t { none, lz4 };

  /// `profile`: as "ros2", or empty.
  McapWriter(ByteSink sink, std::string_view profile, std::string_view library, Packing packing);

  struct Channel {
    std::string topic;
    std::string schema;      ///< its name
    std::string definition;  ///< in `schema_encoding`
    std::string schema_encoding, encoding;
    std::map<std::string, std::string> metadata{};
  };
  /// Returns the channel's number. Each channel has a schema of its own.
  std::uint16_t add(const Channel& channel);

  void message(std::uint16_t channel, std::uint64_t time_ns, std::string_view data);

  /// A file beside the messages, after the last of them; of the time of the first one.
  void attach(std::string_view name, std::string_view media_type, std::string_view data);

  /// The last chunk, the index and the end.
  void close();

 private:
  struct IndexedChunk {
    std::uint64_t first_ns, last_ns, offset, bytes, packed, unpacked, index_bytes;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };
  struct IndexedAttachment {
    std::uint64_t offset, bytes, data_bytes;
    std::string name, media_type;
  };
  void put(std::string_view bytes);
  void end_chunk();
  [[nodiscard]] std::string packed() const;
  // Of the summary at the file's end:
  [[nodiscard]] std::string statistics_record() const;
  [[nodiscard]] std::string chunk_records() const;       ///< one for each chunk
  [[nodiscard]] std::string attachment_records() const;  ///< one for each attachment
  [[nodiscard]] std::string_view packing_name() const noexcept;

  ByteSink sink_;
  Packing packing_;
  std::uint64_t written_ = 0;
  McapBytes chunk_;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;  ///< of the chunk
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index_;  ///< of it
  std::vector<IndexedChunk> chunks_;
  std::vector<IndexedAttachment> attachments_;
  std::string schemas_, channels_;  ///< their records
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::uint64_t begin_ns_ = 0, end_ns_ = 0;
};

inline constexpr std::size_t kMcapChunkBytes = std::size_t{1} << 20;

}  // namespace kerf
