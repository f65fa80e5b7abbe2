// SPDX-License-Identifier: Apache-2.0
#include "replay/tick_stages.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "shared/segment/layout_table.hpp"

namespace kerf {
namespace {

struct StageField {
  std::string_view stage, field;
};

// In the order in which the servo step computes them.
constexpr auto kFields = std::to_array<StageField>({
    {"pose", "encoder_counts"},
    {"pose", "position_mm"},
    {"pose", "orientation"},
    {"pose", "velocity_mm_per_s"},
    {"safety", "phase"},
    {"safety", "fault"},
    {"safety", "flags"},
    {"contact", "active_tool"},
    {"contact", "proxy_offset_mm"},
    {"contact", "plane_count"},
    {"contact", "plane_normal"},
    {"contact", "plane_arm_mm"},
    {"contact", "plane_load_n"},
    {"contact", "contact_force_n"},
    {"contact", "tip_torque_n_mm"},
    {"contact", "penetration_mm"},
    {"force", "modification_force_n"},
    {"force", "commanded_force_n"},
    {"force", "joint_torque_n_mm"},
    {"force", "dac_counts"},
    {"cut", "press_n"},
    {"cut", "spindle_ratio"},
    {"cut", "spindle_load"},
    {"cut", "removed"},
    {"cut", "dirty_volumes"},
    {"cut", "dirty_lo"},
    {"cut", "dirty_hi"},
    {"cut", "volume_hash"},
    {"energy", "port_energy_j"},
    {"energy", "port_minimum_j"},
    {"energy", "energy_spring"},
    {"energy", "energy_damping"},
    {"energy", "energy_friction"},
    {"energy", "energy_cutting"},
    {"energy", "energy_limits"},
    {"energy", "energy_hold"},
    {"energy", "energy_leak"},
    {"energy", "energy_stabiliser"},
    {"output", "output_hash"},
});

// What a replay is given, and what belongs to the machine of the run.
constexpr auto kGiven = std::to_array<std::string_view>(
    {"seq", "tick", "start_ns", "period_error_ns", "execution_ns", "missed_deadlines",
     "refused_packets", "lost_packets", "last_command", "raw", "stale", "command",
     "command_argument", "crc32c"});

constexpr bool is_compared(std::string_view name) {
  return std::ranges::find(kFields, name, &StageField::field) != kFields.end();
}

/// Each column is compared or given.
constexpr bool covers_all() {
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != "TickRecord") continue;
    const bool given = std::ranges::find(kGiven, field.name) != kGiven.end();
    if (given == is_compared(field.name)) return false;
  }
  return true;
}
static_assert(covers_all(), "tick_stages.cpp: each field of TickRecord is compared or given");

constexpr const LayoutField& layout_of(std::string_view name) {
  return *std::ranges::find_if(kLayoutTable, [&](const LayoutField& field) {
    return field.record == "TickRecord" && field.name == name;
  });
}

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
  for (const auto& [stage, name] : kFields) {
    const LayoutField& field = layout_of(name);
    const std::uint32_t bytes = type_bytes(field.type);
    for (std::uint32_t i = 0; i < field.count; ++i) {
      const std::size_t at = field.offset + std::size_t{i} * bytes;
      if (std::memcmp(a + at, b + at, bytes) == 0) continue;
      const std::string element = field.count > 1 ? "[" + std::to_string(i) + "]" : "";
      return TickDifference{stage, std::string(name) + element, value_text(field.type, a + at),
                            value_text(field.type, b + at)};
    }
  }
  return std::nullopt;
}

}  // namespace kerf
