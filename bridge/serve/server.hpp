// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bridge/net/certificate.hpp"
#include "bridge/net/tokens.hpp"

namespace kerf::bridge {

/// All that a server is made from.
struct ServerSetup {
  std::string host = "127.0.0.1";  ///< address or name to listen on
  std::uint16_t port = 7400;       ///< 0: one that is free
  std::string name;                ///< of the controller
  Tokens tokens;
  Tls tls;                              ///< empty: plain, on loopback only
  std::vector<std::string> host_names;  ///< by which browsers may call it, beside addresses
  std::size_t max_viewers = 32;
  bool dedicated_link = false;
  std::function<void(const std::string& pass)> on_pass;  ///< the pass was taken: this is the next
  std::int64_t silence_ns = 5'000'000'000;      ///< a viewer that acknowledges nothing is dropped
  std::int64_t handshake_ns = 5'000'000'000;    ///< for TLS, and for each request
  std::int64_t wrong_token_ns = 1'000'000'000;  ///< before a wrong token or cookie is answered
};

/// One port for the page and for viewers; one more reader of the segment of one controller, which
/// may be absent, go and come back. Nothing from the network reaches the controller but commands of
/// those who may command, checked again by the controller.
class Server {
 public:
  /// Listens. Throws `BridgeError` if that is not to be had.
  explicit Server(ServerSetup setup);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept;
  /// That it listens at, as text: what the host stood for.
  [[nodiscard]] std::string address() const;
  /// A token that opens the page for one browser, which looks as the first of the tokens does.
  [[nodiscard]] const std::string& pass() const noexcept;
  /// Serves until `stop`.
  void run(const std::atomic<bool>& stop);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf::bridge
