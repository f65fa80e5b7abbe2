// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <doctest/doctest.h>

#include "record/check/recording_check.hpp"
#include "record/input_rows.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/replica_writer.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::test {

[[nodiscard]] inline std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// What a call threw, or "".
template <class Call>
[[nodiscard]] std::string error_of(Call call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

/// A tick of a made-up run: a slow press with a spike, cutting for the second half.
[[nodiscard]] inline TickRecord made_up_tick(Tick tick, Tick ticks) {
  TickRecord record{};
  record.seq = 2 * tick;
  record.tick = tick;
  const double phase = static_cast<double>(tick) / static_cast<double>(ticks);
  const float press = static_cast<float>(2.0 * phase * (1.0 - phase) * 4.0);
  record.contact_force_n[1] = press;
  record.modification_force_n[0] = phase > 0.5 ? 0.3F : 0.0F;
  record.commanded_force_n[1] = tick == ticks / 4 ? 3.0F : press;
  record.penetration_mm = press / 4;
  record.removed = phase > 0.5 ? 65535 : 0;
  record.dirty_volumes = phase > 0.5 ? 1 : 0;
  record.port_energy_j = 1e-3 * phase;
  record.port_minimum_j = -2e-3 * phase;
  record.energy_spring = static_cast<std::int64_t>(2 * kEnergyStepsPerMj * phase);
  record.energy_leak = record.energy_spring / -2;
  record.flags = press > 0.01F ? kFlagContact : 0;
  return record;
}

/// Calls `visit` for each tick from 1 to `last` in order, with the inputs of each of `arms` that
/// the recording in `folder` has. Throws `RecordError` at a missing or damaged file, after `visit`
/// was called for the ticks before it.
template <class Visit>
void for_each_input(const std::filesystem::path& folder, Tick last, std::size_t arms, Visit visit) {
  InputReader reader(folder, last, arms);
  for (auto tick = reader.next(); !tick.empty(); tick = reader.next()) visit(tick);
}

/// A run of another machine, with a volume of one brick.
[[nodiscard]] inline MirrorSpec mirror_spec(std::uint32_t arms = 1) {
  VolumeDescriptor volume{};
  volume.nx = volume.ny = volume.nz = 8;
  volume.log2_brick = kBrickLog2;
  volume.bits_per_voxel = 16;
  volume.bricks_x = volume.bricks_y = volume.bricks_z = volume.brick_count = 1;
  for (double& mm : volume.spacing_mm) mm = 0.1;
  volume.orientation[3] = 1;
  MirrorSpec spec;
  spec.arms = arms;
  spec.session_id = 1;
  spec.tick_ns = 1'000'000;
  spec.volumes = {volume};
  return spec;
}

inline void publish_tick(SegmentWriter& writer, const TickRecord& record) {
  writer.begin_tick(record.tick);
  writer.publish_state(record);
  writer.end_tick(record.tick * 1'000'000);
}

}  // namespace kerf::test
