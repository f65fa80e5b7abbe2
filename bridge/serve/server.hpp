// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/net/address.hpp"
#include "bridge/net/certificate.hpp"
#include "bridge/net/tokens.hpp"

namespace kerf::bridge {

/// The settings of a server.
struct ServerSetup {
  std::string host = "127.0.0.1";  ///< address or name to listen on
  std::uint16_t port = 7400;       ///< 0: any free port
  std::string name;                ///< of the controller
  Tokens tokens;
  Tls tls;                                  ///< empty: no TLS, on loopback only
  std::vector<std::string> host_names;      ///< names that requests may use, besides addresses
  std::optional<BridgeAddress> public_url;  ///< of a reverse proxy in front of it
  std::size_t max_viewers = 32;
  bool dedicated_link = false;                            ///< no other traffic on the link
  std::function<void(const std::string&)> on_page_token;  ///< called with each new page token
  std::int64_t silence_ns = 5'000'000'000;                ///< longest wait for an ack of a viewer
  std::int64_t handshake_ns = 5'000'000'000;    ///< limit of the TLS handshake, and of each request
  std::int64_t wrong_token_ns = 1'000'000'000;  ///< delay of the reply to a wrong token or cookie
};

/// Serves the page and the viewers on one port. Reads the segment of one controller, which may be
/// absent, end and start again. The network can send the controller nothing but commands of viewers
/// with the right to command; the controller checks them too.
class Server {
 public:
  /// Listens. Throws `BridgeError` if that fails.
  explicit Server(ServerSetup setup);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept;
  /// The address on which it listens: the host, resolved.
  [[nodiscard]] std::string address() const;
  /// The current one-time token. It opens the page in one browser, with the right of the first
  /// token.
  [[nodiscard]] const std::string& page_token() const noexcept;
  /// Serves until `stop`.
  void run(const std::atomic<bool>& stop);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf::bridge
