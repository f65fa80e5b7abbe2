// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf::bridge {

/// `text` as a QR code for a terminal of any colours: black on white, two modules a character, four
/// of white around it. A line that says why not where libqrencode was missing when kerf was built,
/// or `text` is too long for a code.
[[nodiscard]] std::string qr_code(const std::string& text);

}  // namespace kerf::bridge
