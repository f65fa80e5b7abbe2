// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <variant>
#include <vector>

#include "bridge/wire/messages.hpp"

namespace kerf::bridge {

// Checked parsers for both directions. The bytes may be hostile: each count is checked before use,
// and a message cannot make a parser allocate more than a small multiple of `kMaxMessageBytes`.

/// A message is not valid. One line: field, value, expected value.
struct WireError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The first message of a server.
struct ParsedHello {
  HelloMessage head{};  ///< `build_id` is zero-terminated
  std::vector<VolumeDescriptor> volumes;
};

/// Viewer's side. Checks sizes, grids and poses. Does not check `abi_hash`: only viewers that read
/// records need the same one, and they call `require_same_layout`. Throws `WireError`.
[[nodiscard]] ParsedHello parse_hello(std::span<const std::byte> message);

/// Parses frames and unpacks their blocks.
class FrameParser {
 public:
  /// For frames of the run of `hello`.
  explicit FrameParser(const ParsedHello& hello);

  struct Block {
    std::uint32_t id;       ///< below `plan().count()`
    std::uint64_t version;  ///< even, not 0; `kConstantVersion` for text and labels
    std::span<const std::byte> bytes;
  };

  /// Viewer's side. `blocks()` is valid until the next call, and only as long as `message`. Throws
  /// `WireError`; `blocks()` is then empty.
  FrameHead parse(std::span<const std::byte> message);
  [[nodiscard]] std::span<const Block> blocks() const noexcept { return blocks_; }
  [[nodiscard]] const BlockPlan& plan() const noexcept { return plan_; }

 private:
  BlockPlan plan_;
  std::uint64_t session_;
  std::vector<Block> blocks_;
  std::array<std::byte, kMaxRawBytes> raw_;
};

/// Records of one ring, unpacked.
struct ParsedRecords {
  RecordsHead head;
  std::span<const std::byte> bytes;  ///< in `message` or in `scratch`
};

/// Viewer's side. Unpacks into `scratch` if needed. Throws `WireError`.
[[nodiscard]] ParsedRecords parse_records(std::span<const std::byte> message, std::uint64_t session,
                                          std::span<std::byte, kMaxRawBytes> scratch);

/// Viewer's side. Throws `WireError`.
[[nodiscard]] ReplyMessage parse_reply(std::span<const std::byte> message);

/// Viewer's side. The view may be none (`is_valid`). Throws `WireError`.
[[nodiscard]] ViewMessage parse_view(std::span<const std::byte> message);

/// First word of a message; 0 if it is shorter.
[[nodiscard]] std::uint32_t magic_of(std::span<const std::byte> message) noexcept;

/// Server's side: a viewer's message; nullopt if it is none. A view may be none (`is_valid`).
[[nodiscard]] std::optional<std::variant<AckMessage, CommandMessage, ViewMessage>> parse_up(
    std::span<const std::byte> message) noexcept;

}  // namespace kerf::bridge
