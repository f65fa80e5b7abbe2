// SPDX-License-Identifier: Apache-2.0
#include "replay/tick_stages.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "shared/segment/tick_table.hpp"

namespace kerf {
namespace {

/// The fields that a replay compares, in the order in which the servo step makes them.
constexpr auto compared_fields() {
  constexpr auto is_compared = [](const TickField& field) {
    return field.made.stage != TickStage::given;
  };
  std::array<const TickField*, std::ranges::count_if(kTickFields, is_compared)> fields{};
  auto* to = fields.data();
  for (const TickField& field : kTickFields) {
    if (is_compared(field)) *to++ = &field;
  }
  std::ranges::sort(fields, {}, [](const TickField* field) {
    return std::pair(field->made.stage, field->made.order);
  });
  return fields;
}
constexpr auto kCompared = compared_fields();

template <class T>
std::string text_of(const std::byte* at) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  char text[32];  // the longest double has 24 characters
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string value_text(std::string_view type, const std::byte* at) {
  if (type == "f64") return text_of<double>(at);
  if (type == "f32") return text_of<float>(at);
  if (type == "u64") return text_of<std::uint64_t>(at);
  if (type == "i64") return text_of<std::int64_t>(at);
  if (type == "u32") return text_of<std::uint32_t>(at);
  if (type == "i32") return text_of<std::int32_t>(at);
  return type == "u16" ? text_of<std::uint16_t>(at) : text_of<std::int16_t>(at);
}

}  // namespace

std::optional<TickDifference> first_difference(const TickRecord& recorded,
                                               const TickRecord& replayed) {
  const auto* const a = reinterpret_cast<const std::byte*>(&recorded);
  const auto* const b = reinterpret_cast<const std::byte*>(&replayed);
  if (std::memcmp(a, b, sizeof recorded) == 0) return std::nullopt;  // as most are
  for (const TickField* const compared : kCompared) {
    const LayoutField& field = compared->layout;
    const std::uint32_t bytes = type_bytes(field.type);
    for (std::uint32_t i = 0; i < field.count; ++i) {
      const std::size_t at = field.offset + std::size_t{i} * bytes;
      if (std::memcmp(a + at, b + at, bytes) == 0) continue;
      const std::string element = field.count > 1 ? "[" + std::to_string(i) + "]" : "";
      return TickDifference{kTickStageWords[static_cast<std::size_t>(compared->made.stage)],
                            std::string(field.name) + element, value_text(field.type, a + at),
                            value_text(field.type, b + at)};
    }
  }
  return std::nullopt;
}

}  // namespace kerf
