// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <linux/firewire-constants.h>

namespace kerf {

// Configuration ROMs (IEEE 1212): quadlets in the order of this machine, as GET_INFO hands them
// out.

inline constexpr std::uint64_t kCsrBegin = 0xFFFF'F000'0000;
inline constexpr std::uint64_t kRomBegin = kCsrBegin + 0x400;

/// CRC-16 of IEEE 1212 over whole quadlets.
[[nodiscard]] constexpr std::uint32_t rom_crc(std::span<const std::uint32_t> quadlets) noexcept {
  std::uint32_t crc = 0;
  for (const std::uint32_t data : quadlets) {
    for (int shift = 28; shift >= 0; shift -= 4) {
      const std::uint32_t sum = (crc >> 12 ^ data >> shift) & 0xF;
      crc = (crc << 4 ^ sum << 12 ^ sum << 5 ^ sum) & 0xFFFF;
    }
  }
  return crc;
}

/// Whole ROM of a node: what it can do (the second quadlet of its information), its GUID, and the
/// entries of its root directory.
[[nodiscard]] inline std::vector<std::uint32_t> make_rom(std::uint32_t abilities,
                                                         std::uint32_t guid_high,
                                                         std::uint32_t guid_low,
                                                         std::span<const std::uint32_t> directory) {
  constexpr std::uint32_t kInfoQuadlets = 4;
  constexpr std::uint32_t kName = 0x3133'3934;  // "1394"
  std::vector<std::uint32_t> rom{0, kName, abilities, guid_high, guid_low, 0};
  rom.insert(rom.end(), directory.begin(), directory.end());
  rom[0] =
      kInfoQuadlets << 24 | kInfoQuadlets << 16 | rom_crc(std::span(rom).subspan(1, kInfoQuadlets));
  rom[5] = static_cast<std::uint32_t>(directory.size()) << 16 | rom_crc(directory);
  return rom;
}

/// A number in the order of the bus.
inline void put_quadlet(std::span<std::uint8_t> out, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}
[[nodiscard]] inline std::uint32_t get_quadlet(std::span<const std::uint8_t> in) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | in[i];
  return value;
}

/// A read of one quadlet; an RCODE of the bus.
[[nodiscard]] inline std::uint32_t read_rom(std::span<const std::uint32_t> rom,
                                            std::uint64_t offset, std::span<std::uint8_t> data) {
  const std::uint64_t in_rom = offset - kRomBegin;
  if (in_rom >= rom.size() * 4 || in_rom % 4 != 0) return RCODE_ADDRESS_ERROR;
  if (data.size() != 4) return RCODE_TYPE_ERROR;
  put_quadlet(data, rom[in_rom / 4]);
  return RCODE_COMPLETE;
}

}  // namespace kerf
