// SPDX-License-Identifier: Apache-2.0
#include "lab/bridge/far_viewer.hpp"

#include <optional>
#include <utility>

#include "lab/bridge/bridge_pair.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/volume/density_hash.hpp"

namespace kerf::two_machines {
namespace {

constexpr std::int64_t kLookNs = 2'000'000;

/// Polls `holds` until it does, or `patience` is over.
template <class Condition>
[[nodiscard]] bool holds_within(std::chrono::milliseconds patience, Condition holds) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    pause(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace

FarViewer::FarViewer(std::string name, const MilledVolume& source)
    : name_(std::move(name)), source_(source), thread_([this] { run(); }) {}

FarViewer::~FarViewer() {
  stop_ = true;
  thread_.join();
}

bool FarViewer::joins_within(std::chrono::milliseconds patience) const {
  return holds_within(patience, [this] {
    const std::lock_guard lock(mutex_);
    return seen_;
  });
}

bool FarViewer::equals_within(std::uint64_t density_hash,
                              std::chrono::milliseconds patience) const {
  Tick looked_at = 0;
  return holds_within(patience, [&] {
    const std::lock_guard lock(mutex_);
    if (!snapshot_.consistent || std::exchange(looked_at, snapshot_.tick) == snapshot_.tick) {
      return false;
    }
    return kerf::density_hash(snapshot_.density) == density_hash;
  });
}

void FarViewer::begin_ages() {
  const std::lock_guard lock(mutex_);
  ages_ = {};
  counts_ = true;
}

Histogram FarViewer::take_ages() {
  const std::lock_guard lock(mutex_);
  counts_ = false;
  return ages_;
}

void FarViewer::run() {
  std::optional<SegmentConnection> connection;
  for (std::int64_t at_ns = monotonic_ns(); !stop_; at_ns += kLookNs) {
    sleep_until_ns(at_ns);
    try {  // what was seen stays until there is something newer
      if (!connection || !connection->alive()) connection = connect_segment(name_);
    } catch (const SegmentError&) {  // not there yet, or just now replaced
    }
    const std::lock_guard lock(mutex_);
    if (connection && connection->reader().info().session_id == source_.session_id()) {
      connection->reader().update(0, snapshot_);
      if (snapshot_.consistent) {
        newest_ = snapshot_.tick;
        seen_ = true;
      }
    }
    if (counts_ && seen_) ages_.record(monotonic_ns() - source_.time_of(newest_));
  }
}

}  // namespace kerf::two_machines
