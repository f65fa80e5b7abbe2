// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// Where the mouse is, in pixels of the picture from its upper left corner, and its left button.
struct Pointer {
  double x = -1.0, y = -1.0;  ///< outside at first
  bool down = false;
  friend bool operator==(const Pointer&, const Pointer&) noexcept = default;
};

}  // namespace kerf
