// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "record/force_plot.hpp"

namespace kerf::envelope_test {

TEST_CASE("an envelope of few samples is the samples") {
  Envelope envelope(3, 4);
  envelope.add(0, 5);
  envelope.add(1, 2);
  envelope.add(2, 2);
  CHECK(envelope.points() == std::vector<Envelope::Point>{{0, 5}, {1, 2}, {2, 2}});
}

TEST_CASE("an envelope keeps the extremes, the order and the limit") {
  CHECK(rc::check([](const std::vector<int>& samples) {
    RC_PRE(!samples.empty());
    const auto limit = 2 * *rc::gen::inRange<std::size_t>(1, 20);
    Envelope envelope(samples.size(), limit);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      envelope.add(static_cast<double>(i), samples[i]);
    }
    const std::vector<Envelope::Point> points = envelope.points();
    RC_ASSERT(points.size() <= limit);
    RC_ASSERT(
        std::is_sorted(points.begin(), points.end(), [](auto a, auto b) { return a.x < b.x; }));
    double low = points[0].y;
    double high = points[0].y;
    for (const Envelope::Point& p : points) {
      RC_ASSERT(p.y == samples[static_cast<std::size_t>(p.x)]);
      low = std::min(low, p.y);
      high = std::max(high, p.y);
    }
    RC_ASSERT(low == *std::min_element(samples.begin(), samples.end()));
    RC_ASSERT(high == *std::max_element(samples.begin(), samples.end()));
  }));
}

}  // namespace kerf::envelope_test
