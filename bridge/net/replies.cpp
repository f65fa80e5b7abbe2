// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/replies.hpp"

namespace kerf::bridge {
namespace {

std::string_view reason(int status) noexcept {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 421:
      return "Misdirected Request";
    default:
      return "Error";
  }
}

constexpr std::string_view kHeaders =
    "Cache-Control: no-store\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; worker-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Permissions-Policy: camera=(), microphone=(), geolocation=(), usb=(), serial=(), hid=()\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "X-Frame-Options: DENY\r\n";

}  // namespace

std::string http_text(const HttpReply& reply) {
  std::string text = "HTTP/1.1 " + std::to_string(reply.status) + " ";
  text += reason(reply.status);
  text += "\r\nContent-Type: ";
  text += reply.content_type;
  text += "\r\nContent-Length: " + std::to_string(reply.body.size()) + "\r\n";
  text += kHeaders;
  if (reply.status == 405) text += "Allow: GET, HEAD\r\n";
  if (!reply.cookie.empty()) text += "Set-Cookie: " + reply.cookie + "\r\n";
  text += reply.keep_alive ? "\r\n" : "Connection: close\r\n\r\n";
  if (!reply.head_only) text += reply.body;
  return text;
}

}  // namespace kerf::bridge
