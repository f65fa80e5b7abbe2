// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace kerf {

/// The messages of a reader, one packet each: this byte, then what the comment says. The other side
/// answers an offer with one byte, once its memory has the size that it agreed to.
enum class SandboxWord : std::uint8_t {
  at,         ///< the place that is read now
  offer,      ///< a header
  done,       ///< nothing; last
  refused,    ///< one line; last
  no_memory,  ///< nothing; last
};
inline constexpr std::size_t kLongestSandboxWord = 4096;  ///< bytes of a packet

/// What a reader of foreign bytes has in its sandbox: a way to hand over what it read.
class SandboxReader {
 public:
  SandboxReader(int channel, int memory) : channel_(channel), memory_(memory) {}

  /// Names the file that is read now, one of several. A crash is told of it.
  void at(const std::string& place) { say(SandboxWord::at, place); }

  /// Tells `header`, of less than kLongestSandboxWord bytes, and gives the memory that the other
  /// side found right for it, all zeros. Once. Does not return where the other side refuses.
  [[nodiscard]] std::span<std::byte> offer(std::span<const std::byte> header);

  /// One packet; `text` is cut to its size. What cannot be told ends the process.
  void say(SandboxWord word, std::string_view text = {});

 private:
  int channel_, memory_;
};

}  // namespace kerf
