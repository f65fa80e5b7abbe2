// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "tests/bridge/websocket_bytes.hpp"

namespace kerf::test {

/// A peer of the bridge that can also misbehave: sockets and bytes, no library that would refuse to
/// send something wrong. Every read gives up after 10 s.
class RawClient {
 public:
  /// From the machine's own address that ends with `last`: 127.0.0.`last`.
  explicit RawClient(std::uint16_t port, std::uint32_t last = 1)
      : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + last);
    if (last != 1) bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    const timeval timeout{10, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
  }
  ~RawClient() {
    if (ssl_ != nullptr) SSL_free(ssl_);
    if (tls_ != nullptr) SSL_CTX_free(tls_);
    if (fd_ >= 0) close(fd_);
  }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  /// TLS up to `highest`; with `ca` the certificate has to hold for `host`.
  bool start_tls(int highest = TLS1_3_VERSION, const char* ca = nullptr,
                 const char* host = "127.0.0.1") {
    tls_ = SSL_CTX_new(TLS_client_method());
    SSL_CTX_set_max_proto_version(tls_, highest);
    if (ca != nullptr) {
      SSL_CTX_set_verify(tls_, SSL_VERIFY_PEER, nullptr);
      if (SSL_CTX_load_verify_locations(tls_, ca, nullptr) != 1) return false;
    }
    ssl_ = SSL_new(tls_);
    if (ca != nullptr) X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl_), host);
    SSL_set_fd(ssl_, fd_);
    return SSL_connect(ssl_) == 1;
  }

  bool send_bytes(std::string_view bytes) {
    while (!bytes.empty()) {
      const long sent = ssl_ != nullptr
                            ? SSL_write(ssl_, bytes.data(), static_cast<int>(bytes.size()))
                            : ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent < 0 && ssl_ == nullptr && errno == EINTR) continue;
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }

  /// Empty at the end of the connection.
  std::string receive(std::size_t most) {
    std::string bytes(most, 0);
    long got = 0;
    do {  // a call with a time limit is interrupted by signals, as by the fuzzers' clock
      got = ssl_ != nullptr ? SSL_read(ssl_, bytes.data(), static_cast<int>(most))
                            : recv(fd_, bytes.data(), most, 0);
    } while (got < 0 && ssl_ == nullptr && errno == EINTR);
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }
  std::string receive_all(std::size_t bytes) {
    std::string out;
    while (out.size() < bytes) {
      const std::string part = receive(bytes - out.size());
      if (part.empty()) return {};
      out += part;
    }
    return out;
  }

  /// Head and body of the answer to a request; the host is 127.0.0.1 unless `head` has one.
  std::string ask(const std::string& target, const std::string& head = "",
                  const std::string& method = "GET") {
    std::string request = method + " " + target + " HTTP/1.1\r\n" + head;
    if (head.find("Host:") == std::string::npos) request += "Host: 127.0.0.1\r\n";
    if (!send_bytes(request + "\r\n")) return {};
    std::string answer;
    while (!answer.ends_with("\r\n\r\n")) {
      const std::string part = receive(1);
      if (part.empty()) return answer;
      answer += part;
    }
    const std::size_t length = answer.find("Content-Length: ");
    if (length == std::string::npos || method == "HEAD") return answer;
    return answer + receive_all(std::stoul(answer.substr(length + 16)));
  }
  std::string upgrade(const std::string& target, const std::string& head = "") {
    return ask(target, head +
                           "Upgrade: websocket\r\nConnection: Upgrade\r\n"
                           "Sec-WebSocket-Version: 13\r\n"
                           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n");
  }

  bool send_frame(unsigned opcode, std::span<const std::byte> payload, bool last = true) {
    const std::string_view text(reinterpret_cast<const char*>(payload.data()), payload.size());
    return send_bytes(websocket_frame(opcode, text, last, true));
  }
  /// The peer sees the end of what this client sends, and may go on sending.
  void end_sending() const { shutdown(fd_, SHUT_WR); }
  template <class T>
  bool send_value(const T& value) {
    return send_frame(2, std::as_bytes(std::span(&value, 1)));
  }

  /// The next message; nothing at the end, and then `close_code` is what was said, else 0. Texts
  /// are passed over unless `with_text`; `is_text` is of the last message.
  std::optional<std::vector<std::byte>> message(bool with_text = false) {
    for (;;) {
      const std::string head = receive_all(2);
      if (head.empty()) return std::nullopt;
      std::size_t bytes = static_cast<unsigned char>(head[1]) & 127U;
      if (bytes >= 126) {
        const std::string wide = receive_all(bytes == 126 ? 2 : 8);
        bytes = 0;
        for (const char c : wide) bytes = bytes << 8 | static_cast<unsigned char>(c);
      }
      const std::string payload = bytes == 0 ? std::string() : receive_all(bytes);
      const unsigned opcode = static_cast<unsigned char>(head[0]) & 15U;
      if (opcode == 8) {
        if (payload.size() >= 2) {
          close_code =
              static_cast<unsigned char>(payload[0]) * 256 + static_cast<unsigned char>(payload[1]);
        }
        return std::nullopt;
      }
      is_text = opcode == 1;
      if (opcode != 2 && !(with_text && is_text)) continue;
      std::vector<std::byte> out(payload.size());
      std::memcpy(out.data(), payload.data(), payload.size());
      return out;
    }
  }

  [[nodiscard]] bool connected() const { return connected_; }
  int close_code = 0;
  bool is_text = false;

 private:
  int fd_;
  bool connected_ = false;
  SSL_CTX* tls_ = nullptr;
  SSL* ssl_ = nullptr;
};

}  // namespace kerf::test
