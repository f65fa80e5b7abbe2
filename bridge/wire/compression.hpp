// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace kerf::bridge {

/// Most bytes that `pack` writes for `raw` bytes.
[[nodiscard]] std::size_t packed_bound(std::size_t raw) noexcept;

/// Compresses `raw`, at most `kMaxRawBytes`, into one LZ4 block in `out`, which has `packed_bound`
/// bytes. Returns the length of the block.
[[nodiscard]] std::size_t pack(std::span<const std::byte> raw, std::span<std::byte> out) noexcept;

/// Decodes an LZ4 block into `out`. True if it gives exactly as many bytes as `out` has. Safe with
/// any input.
[[nodiscard]] bool unpack(std::span<const std::byte> packed, std::span<std::byte> out) noexcept;

/// Decides whether to pack the next message.
///
/// Plain, n bytes take n / rate on the link; packed, they take n / speed + n / (ratio rate). So
/// packing is faster if rate < speed (1 - 1 / ratio). Speed and ratio are averages over recent
/// messages. Every 32nd message is packed in any case, so that the averages follow the content.
class PackChoice {
 public:
  /// True if the next message should be packed, on a link of `bytes_per_s`. 0: unknown, treated as
  /// slow.
  [[nodiscard]] bool pays(double bytes_per_s) noexcept {
    if (++asked_ % 32 == 0) return true;
    return bytes_per_s * ns_per_byte_ * 1e-9 < 1 - 1 / ratio_;
  }
  /// Updates the averages: packing `raw` bytes into `packed` bytes took `ns`.
  void saw(std::size_t raw, std::size_t packed, std::int64_t ns) noexcept {
    const auto bytes = static_cast<double>(raw);
    ratio_ += kNewestWeight * (bytes / static_cast<double>(packed) - ratio_);
    ns_per_byte_ += kNewestWeight * (static_cast<double>(ns) / bytes - ns_per_byte_);
  }
  /// Raw bytes per packed byte.
  [[nodiscard]] double ratio() const noexcept { return ratio_; }

 private:
  static constexpr double kNewestWeight = 0.1;  // of the newest value in an average

  double ratio_ = 2, ns_per_byte_ = 2;  // start values: LZ4 on densities, 500 MB/s
  std::uint32_t asked_ = 0;
};

/// Appends `raw` to `out`, packed if `choice` says so for a link of `bytes_per_s` and it gets
/// smaller. Returns true if it is packed.
bool append_payload(std::span<const std::byte> raw, double bytes_per_s, PackChoice& choice,
                    std::vector<std::byte>& out);

}  // namespace kerf::bridge
