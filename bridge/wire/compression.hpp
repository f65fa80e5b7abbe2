// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace kerf::bridge {

/// Most bytes that `pack` writes for `raw` ones.
[[nodiscard]] std::size_t packed_bound(std::size_t raw) noexcept;

/// Writes `raw`, at most `kMaxRawBytes`, as one LZ4 block to `out` of `packed_bound` bytes; returns
/// its length.
[[nodiscard]] std::size_t pack(std::span<const std::byte> raw, std::span<std::byte> out) noexcept;

/// True if `packed` decodes to exactly as many bytes as `out` has. Safe for any bytes.
[[nodiscard]] bool unpack(std::span<const std::byte> packed, std::span<std::byte> out) noexcept;

/// Decides whether the next message is packed.
///
/// n bytes take n / rate on the link, and packed n / speed + n / (ratio rate): packing is faster
/// if rate < speed (1 - 1 / ratio). Speed and ratio are averages of recent messages; every 32nd
/// message is packed in any case, so that they follow the content.
class PackChoice {
 public:
  /// `bytes_per_s`: the rate of the link; 0: unknown, treated as slow.
  [[nodiscard]] bool pays(double bytes_per_s) noexcept {
    if (++asked_ % 32 == 0) return true;
    return bytes_per_s * ns_per_byte_ * 1e-9 < 1 - 1 / ratio_;
  }
  /// `raw` bytes became `packed` ones within `ns`.
  void saw(std::size_t raw, std::size_t packed, std::int64_t ns) noexcept {
    const auto bytes = static_cast<double>(raw);
    ratio_ += kNewestWeight * (bytes / static_cast<double>(packed) - ratio_);
    ns_per_byte_ += kNewestWeight * (static_cast<double>(ns) / bytes - ns_per_byte_);
  }
  /// Raw bytes per packed one.
  [[nodiscard]] double ratio() const noexcept { return ratio_; }

 private:
  static constexpr double kNewestWeight = 0.1;  // of the newest in the average

  double ratio_ = 2, ns_per_byte_ = 2;  // LZ4 on densities, 500 MB/s
  std::uint32_t asked_ = 0;
};

/// Appends `raw` to `out`, packed if that pays on a link of `bytes_per_s` and makes it smaller.
/// Returns whether it did.
bool append_payload(std::span<const std::byte> raw, double bytes_per_s, PackChoice& choice,
                    std::vector<std::byte>& out);

}  // namespace kerf::bridge
