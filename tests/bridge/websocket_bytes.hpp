// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <openssl/evp.h>
#include <openssl/sha.h>

namespace kerf::test {

/// One WebSocket frame (RFC 6455, 5.2): a client's, masked with zeros, or a server's.
inline std::string websocket_frame(unsigned opcode, std::string_view payload, bool last,
                                   bool masked) {
  constexpr std::size_t kShort = 126;  // from here on the length has two bytes of its own
  const unsigned mask = masked ? 0x80U : 0U;
  std::string frame{static_cast<char>((last ? 0x80U : 0U) | opcode)};
  if (payload.size() < kShort) {
    frame += static_cast<char>(mask | payload.size());
  } else {
    frame += static_cast<char>(mask | kShort);
    frame += static_cast<char>(payload.size() >> 8);
    frame += static_cast<char>(payload.size() & 255);
  }
  if (masked) frame += std::string(4, 0);
  return frame.append(payload);
}

/// The head with which a server opens the WebSocket that a client's request asks for.
inline std::string websocket_welcome(const std::string& request) {
  const std::string name = "Sec-WebSocket-Key: ";
  const std::size_t at = request.find(name) + name.size();
  const std::string key =
      request.substr(at, request.find("\r\n", at) - at) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
  unsigned char digest[SHA_DIGEST_LENGTH], text[64];
  SHA1(reinterpret_cast<const unsigned char*>(key.data()), key.size(), digest);
  EVP_EncodeBlock(text, digest, SHA_DIGEST_LENGTH);
  return "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Accept: " +
         std::string(reinterpret_cast<const char*>(text)) + "\r\n\r\n";
}

}  // namespace kerf::test
