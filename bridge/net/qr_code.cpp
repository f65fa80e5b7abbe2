// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/qr_code.hpp"

#ifdef KERF_QRENCODE
#include <memory>

#include <qrencode.h>
#endif

namespace kerf::bridge {

#ifdef KERF_QRENCODE
namespace {

constexpr int kMargin = 4;  // that the standard asks for
constexpr const char* kBlackOnWhite = "\033[30;107m";
constexpr const char* kUsual = "\033[0m\n";

}  // namespace

std::string qr_code(const std::string& text) {
  const std::unique_ptr<QRcode, void (*)(QRcode*)> code(
      QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L), QRcode_free);
  if (code == nullptr) return "no QR code: the address is too long for one\n";
  const auto is_black = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= code->width || y >= code->width) return false;
    return (code->data[y * code->width + x] & 1) != 0;
  };
  std::string lines;
  for (int y = -kMargin; y < code->width + kMargin; y += 2) {
    lines += kBlackOnWhite;
    for (int x = -kMargin; x < code->width + kMargin; ++x) {
      const bool above = is_black(x, y), below = is_black(x, y + 1);
      lines += above ? (below ? "\u2588" : "\u2580") : (below ? "\u2584" : " ");
    }
    lines += kUsual;
  }
  return lines;
}
#else
std::string qr_code(const std::string&) {
  return "no QR code: this kerf-bridge was built without libqrencode-dev\n";
}
#endif

}  // namespace kerf::bridge
