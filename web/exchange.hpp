// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstring>
#include <string_view>
#include <vector>

namespace kerf::web {

/// Text and messages between the module and its worker: `room` of exports.cpp.
inline std::vector<std::byte> exchange;

/// Leaves a text there; returns its length.
inline std::size_t leave(std::string_view text) {
  exchange.resize(text.size());
  std::memcpy(exchange.data(), text.data(), text.size());
  return text.size();
}

}  // namespace kerf::web
