// SPDX-License-Identifier: Apache-2.0
#include "bridge/stream/packing.hpp"

#include <cstdint>

#include "bridge/wire/lz4_block.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf::bridge {

bool append_payload(std::span<const std::byte> raw, double bytes_per_s, PackChoice& choice,
                    std::vector<std::byte>& out) {
  const std::size_t at = out.size();
  if (!raw.empty() && choice.pays(bytes_per_s)) {
    out.resize(at + packed_bound(raw.size()));
    const std::int64_t begin_ns = monotonic_ns();
    const std::size_t packed = pack(raw, std::span(out).subspan(at));
    choice.saw(raw.size(), packed, monotonic_ns() - begin_ns);
    if (packed < raw.size()) {
      out.resize(at + packed);
      return true;
    }
    out.resize(at);
  }
  out.insert(out.end(), raw.begin(), raw.end());
  return false;
}

}  // namespace kerf::bridge
