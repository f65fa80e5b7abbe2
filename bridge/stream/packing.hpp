// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bridge/stream/pack_choice.hpp"

namespace kerf::bridge {

/// Appends `raw` to `out`, packed where that pays on a link of `bytes_per_s` and makes it smaller.
/// Returns whether it did.
bool append_payload(std::span<const std::byte> raw, double bytes_per_s, PackChoice& choice,
                    std::vector<std::byte>& out);

}  // namespace kerf::bridge
