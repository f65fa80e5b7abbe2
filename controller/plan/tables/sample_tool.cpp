// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/sample_tool.hpp"

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

}  // namespace kerf
