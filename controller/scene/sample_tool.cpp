// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/sample_tool.hpp"

#include <numeric>

namespace kerf {
namespace {

/// The golden section of `count`, or the next number without a common divisor: steps of it visit
/// every index once, and consecutive ones lie far apart.
std::size_t scattering_step(std::size_t count) {
  auto step = static_cast<std::size_t>(0.618 * static_cast<double>(count)) + 1;
  while (std::gcd(step, count) != 1) ++step;
  return step;
}

}  // namespace

SampleTool::SampleTool(std::span<const ToolOffset> offsets, SampleOrder order)
    : count_(static_cast<std::int32_t>(offsets.size())) {
  const std::size_t step =
      order == SampleOrder::scattered && !offsets.empty() ? scattering_step(offsets.size()) : 1;
  const auto group = static_cast<std::size_t>(kSampleGroup);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<std::int32_t>& along = offset_[axis];
    along.reserve((offsets.size() + group - 1) / group * group);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      along.push_back(offsets[i * step % offsets.size()][axis]);
    }
    while (along.size() % group != 0) along.push_back(along.back());
  }
}

SampleTable SampleTool::table() const noexcept {
  return {{offset_[0].data(), offset_[1].data(), offset_[2].data()}, count_};
}

std::size_t SampleTool::bytes() const noexcept {
  return 3 * offset_[0].size() * sizeof(std::int32_t);
}

void SplatMemory::hold(const std::array<std::size_t, 3>& width_vox, std::size_t samples) {
  const auto cells = [&](std::size_t axis) {
    return static_cast<std::int32_t>(width_vox[axis]) - 1;
  };
  const VoxelIndex size{cells(0), cells(1), cells(2)};
  const SplatScratchSize need = splat_scratch_size(size, samples);
  const auto grow = [](auto& memory, std::size_t entries) {
    if (memory.size() < entries) memory.resize(entries);
  };
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

std::size_t SplatMemory::bytes() const {
  std::size_t sum = 0;
  for (const ArrayBytes& array : arrays()) sum += array.bytes;
  return sum;
}

}  // namespace kerf
