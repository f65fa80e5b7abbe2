// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/tick_memory.hpp"

namespace kerf {
namespace {

void grow(auto& memory, std::size_t entries) {
  if (memory.size() < entries) memory.resize(entries);
}

}  // namespace

std::uint64_t total_bytes(const std::vector<ArrayBytes>& arrays) {
  std::uint64_t sum = 0;
  for (const ArrayBytes& array : arrays) sum += array.bytes;
  return sum;
}

void BoxMemory::hold(VoxelIndex tool_size, bool mills) {
  const BoxScratchSize need = box_scratch_size(tool_size);
  grow(box_, need.box);
  grow(inside_, need.inside);
  if (!mills) return;
  grow(ratio_, need.ratio);
  grow(filter_, need.filter);
  grow(live_, need.live);
}

BoxScratch BoxMemory::view() noexcept {
  return {box_.data(), ratio_.data(), filter_.data(), inside_.data(), live_.data()};
}

std::vector<ArrayBytes> BoxMemory::arrays() const {
  const auto named = [](const char* name, const auto& memory) {
    return ArrayBytes{name, memory.size() * sizeof(memory[0]), true};
  };
  return {named("box", box_), named("columns inside", inside_), named("overlap ratios", ratio_),
          named("filtered rows", filter_), named("live rows", live_)};
}

void SplatMemory::hold(const std::array<std::size_t, 3>& width_vox, std::size_t samples) {
  const auto cells = [&](std::size_t axis) {
    return static_cast<std::int32_t>(width_vox[axis]) - 1;
  };
  const VoxelIndex size{cells(0), cells(1), cells(2)};
  const SplatScratchSize need = splat_scratch_size(size, samples);
  tick_.hold(size, true);
  for (auto& along : place_) grow(along, need.place);
  grow(sums_, need.sums);
  for (auto& part : rest_) grow(part, need.rest);
  grow(rest_live_, need.rest_live);
}

SplatScratch SplatMemory::view() noexcept {
  return {.tick = tick_.view(),
          .place = {place_[0].data(), place_[1].data(), place_[2].data()},
          .sums = sums_.data(),
          .rest = {rest_[0].data(), rest_[1].data()},
          .rest_live = rest_live_.data()};
}

std::vector<ArrayBytes> SplatMemory::arrays() const {
  std::vector<ArrayBytes> list = tick_.arrays();
  const auto add = [&](const char* name, const auto& memory, std::size_t times) {
    list.push_back({name, times * memory.size() * sizeof(memory[0]), true});
  };
  add("sample places", place_[0], 3);
  add("overlap sums", sums_, 1);
  add("rest rows", rest_[0], 2);
  add("live rest rows", rest_live_, 1);
  return list;
}

}  // namespace kerf
