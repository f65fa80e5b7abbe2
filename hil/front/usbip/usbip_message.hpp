// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// The messages of a USB/IP connection after its set-up (Documentation/usb/usbip_protocol.rst of
/// the kernel): 48 bytes of big-endian words, then the bytes of the transfer in one direction.
namespace kerf::usbip {

inline constexpr std::size_t kHeaderBytes = 48;
inline constexpr std::size_t kSetupAt = 40;
using Header = std::array<std::uint8_t, kHeaderBytes>;

/// First word of a message: two that the host sends, and their answers.
enum class Command : std::uint32_t { submit = 1, unlink = 2, submitted = 3, unlinked = 4 };

/// What the host asks.
struct Request {
  Command command{};
  std::uint32_t sequence = 0;
  bool to_host = false;
  std::uint32_t endpoint = 0;  ///< its number, without the direction
  std::uint32_t bytes = 0;     ///< of the transfer; of a submit
  std::uint32_t unlinks = 0;   ///< sequence of the transfer to give up; of an unlink
  std::array<std::uint8_t, 8> setup{};
};

namespace detail {

inline std::uint32_t word(std::span<const std::uint8_t> in, std::size_t at) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | in[at + i];
  return value;
}
inline void put_word(Header& out, std::size_t at, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < 4; ++i)
    out[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}
/// An answer has neither device, direction nor endpoint, and begins its own part at byte 20.
inline Header answer(Command command, std::uint32_t sequence, int status) noexcept {
  Header out{};
  put_word(out, 0, static_cast<std::uint32_t>(command));
  put_word(out, 4, sequence);
  put_word(out, 20, static_cast<std::uint32_t>(status));
  return out;
}

}  // namespace detail

[[nodiscard]] inline Request decode(std::span<const std::uint8_t, kHeaderBytes> in) noexcept {
  Request request;
  request.command = static_cast<Command>(detail::word(in, 0));
  request.sequence = detail::word(in, 4);
  request.to_host = detail::word(in, 12) != 0;
  request.endpoint = detail::word(in, 16);
  if (request.command == Command::unlink) {
    request.unlinks = detail::word(in, 20);
  } else {
    request.bytes = detail::word(in, 24);
    for (std::size_t i = 0; i < request.setup.size(); ++i) request.setup[i] = in[kSetupAt + i];
  }
  return request;
}

/// The end of a transfer: `status` 0 or a negative errno; to the host, its bytes follow.
[[nodiscard]] inline Header submitted(std::uint32_t sequence, int status,
                                      std::uint32_t bytes) noexcept {
  Header out = detail::answer(Command::submitted, sequence, status);
  detail::put_word(out, 24, bytes);
  return out;
}
/// The answer to an unlink: -ECONNRESET where the transfer was given up, 0 where it was over.
[[nodiscard]] inline Header unlinked(std::uint32_t sequence, int status) noexcept {
  return detail::answer(Command::unlinked, sequence, status);
}

}  // namespace kerf::usbip
