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
  std::uint16_t port = 7400;       ///< 0: one that is free
  std::string name;                ///< of the controller
  Tokens tokens;
  Tls tls;                                  ///< empty: plain, on loopback only
  std::vector<std::string> host_names;      ///< names that a browser may use, beside addresses
  std::optional<BridgeAddress> public_url;  ///< of a reverse proxy in front of it
  std::size_t max_viewers = 32;
  bool dedicated_link = false;
  std::function<void(const std::string&)> on_page_token;  ///< called with each new one-time token
  std::int64_t silence_ns = 5'000'000'000;      ///< a viewer that acknowledges nothing is dropped
  std::int64_t handshake_ns = 5'000'000'000;    ///< for TLS, and for each request
  std::int64_t wrong_token_ns = 1'000'000'000;  ///< before a wrong token or cookie is answered
};

/// One port for the page and for viewers. It reads the segment of one controller, which may be
/// absent, end and start again. From the network only commands reach the controller, only those of
/// viewers with the right to command, and the controller checks them again.
class Server {
 public:
  /// Listens. Throws `BridgeError` if it cannot.
  explicit Server(ServerSetup setup);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept;
  /// The address at which it listens: what the host was resolved to.
  [[nodiscard]] std::string address() const;
  /// A token that opens the page in one browser, with the right of the first token.
  [[nodiscard]] const std::string& page_token() const noexcept;
  /// Serves until `stop`.
  void run(const std::atomic<bool>& stop);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf::bridge
