// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace kerf {

/// One field of one record. The stated part is what `kAbiHash` covers and the recorder writes; the
/// actual part is the compiler's.
struct LayoutField {
  std::string_view record;
  std::string_view name;
  std::uint32_t offset;
  std::string_view type;  ///< u8 u16 u32 u64 i16 i32 i64 f32 f64 char
  std::uint32_t count;    ///< elements; 1 for a scalar
  std::uint32_t actual_offset;
  std::uint32_t actual_bytes;
  std::string_view actual_type;
};

namespace layout_detail {

template <class T>
[[nodiscard]] constexpr std::string_view type_text() noexcept {
  using E = std::remove_all_extents_t<T>;
  if constexpr (std::is_same_v<E, char>) return "char";
  if constexpr (std::is_same_v<E, std::uint8_t>) return "u8";
  if constexpr (std::is_same_v<E, std::uint16_t>) return "u16";
  if constexpr (std::is_same_v<E, std::uint32_t>) return "u32";
  if constexpr (std::is_same_v<E, std::uint64_t>) return "u64";
  if constexpr (std::is_same_v<E, std::int16_t>) return "i16";
  if constexpr (std::is_same_v<E, std::int32_t>) return "i32";
  if constexpr (std::is_same_v<E, std::int64_t>) return "i64";
  if constexpr (std::is_same_v<E, float>) return "f32";
  if constexpr (std::is_same_v<E, double>) return "f64";
  return "?";
}

}  // namespace layout_detail

/// Bytes of one element of type `type`, e.g. "u32"; 0 if it is unknown.
[[nodiscard]] constexpr std::uint32_t type_bytes(std::string_view type) noexcept {
  if (type == "char" || type == "u8") return 1;
  if (type == "u16" || type == "i16") return 2;
  if (type == "u32" || type == "i32" || type == "f32") return 4;
  if (type == "u64" || type == "i64" || type == "f64") return 8;
  return 0;
}

// The stated numbers are the contract, which layout_table.hpp compares with the compiler's. Only a
// macro can pass a field's name to offsetof.
// clang-format off
#define KERF_FIELD(RECORD, NAME, OFFSET, TYPE, COUNT)                                  \
  LayoutField{#RECORD, #NAME, OFFSET, TYPE, COUNT, offsetof(RECORD, NAME),             \
              sizeof(RECORD::NAME), layout_detail::type_text<decltype(RECORD::NAME)>()}
// clang-format on

}  // namespace kerf
