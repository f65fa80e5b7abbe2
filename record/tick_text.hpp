// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "shared/segment/layout.hpp"
#include "shared/segment/tick_table.hpp"

// The numbers of a tick record as text, column by column.

namespace kerf {

/// Calls `visit(field)` for each column of a log, in order.
template <class Visit>
void for_each_column(Visit visit) {
  for (const TickField& field : kTickFields) visit(field.layout);
}

/// Calls `use` with one number of a column, in its own type.
template <class Use>
void visit_number(const TickRecord& record, const LayoutField& field, std::uint32_t element,
                  Use use) {
  const auto* const at =
      reinterpret_cast<const std::byte*>(&record) + field.offset + element * type_bytes(field.type);
  const auto as = [&]<class Number>(Number value) {
    std::memcpy(&value, at, sizeof value);
    use(value);
  };
  if (field.type == "u64") as(std::uint64_t{});
  if (field.type == "i64") as(std::int64_t{});
  if (field.type == "u32") as(std::uint32_t{});
  if (field.type == "i32") as(std::int32_t{});
  if (field.type == "u16") as(std::uint16_t{});
  if (field.type == "i16") as(std::int16_t{});
  if (field.type == "f64") as(double{});
  if (field.type == "f32") as(float{});
}

/// Appends the shortest text that reads back as the same number.
template <class Number>
void append_number(Number value, std::string& text) {
  char digits[32];  // the longest double has 24 characters
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}
inline void append_number(const TickRecord& record, const LayoutField& field, std::uint32_t element,
                          std::string& text) {
  visit_number(record, field, element, [&](auto value) { append_number(value, text); });
}

/// Whether the number is neither NaN nor infinite.
[[nodiscard]] inline bool is_finite(const TickRecord& record, const LayoutField& field,
                                    std::uint32_t element) {
  bool finite = true;
  visit_number(record, field, element, [&](auto value) {
    if constexpr (std::is_floating_point_v<decltype(value)>) finite = std::isfinite(value);
  });
  return finite;
}

}  // namespace kerf
