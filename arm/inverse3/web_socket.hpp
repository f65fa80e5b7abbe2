// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

// A small client of HTTP and WebSocket. Only its source file includes Boost.Beast.

namespace kerf::inverse3 {

/// A TCP port of a host.
struct HostPort {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
};

/// The answer to a GET; its body has at most 64 KiB.
struct HttpAnswer {
  unsigned status = 0;
  std::string body;
};

/// One GET on a connection of its own. Throws std::runtime_error with the reason (refused, timeout,
/// not HTTP) but without the address, or within 20 ms after `stop` is set. Name resolution alone
/// has no timeout.
[[nodiscard]] HttpAnswer http_get(const HostPort& where, const std::string& path, int timeout_ms,
                                  const std::atomic<bool>& stop);

/// An upgrade that was answered with another status than 101.
class UpgradeRefused : public std::runtime_error {
 public:
  explicit UpgradeRefused(HttpAnswer answer)
      : std::runtime_error("the upgrade to a WebSocket: HTTP " + std::to_string(answer.status)),
        answer_(std::move(answer)) {}
  [[nodiscard]] const HttpAnswer& answer() const noexcept { return answer_; }

 private:
  HttpAnswer answer_;
};

/// One connection, text messages in both directions. It sends no pings, compresses nothing, and
/// sends small packets at once (TCP_NODELAY). One thread. A message above `kMostMessageBytes` ends
/// the connection.
class WebSocket {
 public:
  /// Connects and upgrades. Throws std::runtime_error as `http_get`, or UpgradeRefused.
  WebSocket(const HostPort& where, int timeout_ms, const std::atomic<bool>& stop);
  /// Ends the connection at once after its last word, without a closing frame unless `close` was
  /// called.
  ~WebSocket();
  WebSocket(const WebSocket&) = delete;
  WebSocket& operator=(const WebSocket&) = delete;

  /// The message that leaves before this end of the connection does, whoever ends it and why:
  /// before the closing frame that answers the peer's, or that follows a message that breaks the
  /// protocol; when the peer has ended its side (FIN), whose other side may still read; before
  /// `close` and the destructor. It is given to the kernel without waiting. None, if it is empty,
  /// as before the first call. At most 400 bytes.
  void set_last_word(std::string_view text);
  /// Says it now: nothing else leaves after it but the closing frame.
  void say_last_word() noexcept;

  /// The socket, and the last word as the bytes that leave through it: for another process, which
  /// says it when this one cannot any more.
  [[nodiscard]] int handle() const noexcept;
  [[nodiscard]] std::string_view last_word_bytes() const noexcept;

  /// False if the message has not left within the time, or the last word has; the connection is
  /// useless then.
  [[nodiscard]] bool send(std::string_view text, int timeout_ms) noexcept;

  enum class Got : std::uint8_t { text, binary, nothing, lost };
  /// Waits for a message until `until_ns` of CLOCK_MONOTONIC; `message` then returns it. If
  /// `until_ns` is in the past, takes only a message that has already arrived.
  [[nodiscard]] Got receive(std::int64_t until_ns) noexcept;
  /// The last one, until the next `receive`.
  [[nodiscard]] std::string_view message() const noexcept;

  /// Closes and waits so long for the peer to agree. Code 1000 ends the session in order; 1002 says
  /// that the peer has not kept to the protocol.
  enum class Why : std::uint16_t { in_order = 1000, protocol = 1002 };
  void close(Why why, int timeout_ms) noexcept;

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

}  // namespace kerf::inverse3
