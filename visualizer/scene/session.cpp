// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/session.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {

namespace {

MaterialRule rule_of(const SceneView& scene) {
  std::vector<double> isos;
  for (const MaterialView& material : scene.materials) isos.push_back(material.iso);
  return MaterialRule(isos);
}

}  // namespace

RemovedVolume::RemovedVolume(const SceneView& scene, std::span<const VolumeContent> contents)
    : rule_(rule_of(scene)) {
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const VolumeView& view = scene.volumes[v];
    const auto& [density, labels] = contents[v];
    Volume& volume = volumes_.emplace_back();
    volume.bricks = view.bricks;
    volume.iso = view.iso;
    volume.voxel_mm3 = std::abs(glm::determinant(glm::dmat3(view.world_from_voxel)));
    volume.fullest.assign(density.begin(), density.end());
    volume.labels.assign(labels.begin(), labels.end());
    volume.gone.resize(volume.bricks.count() * rule_.count());
    volume.removed.resize(rule_.count());
  }
}

void RemovedVolume::update(std::size_t volume, std::span<const Density> density,
                           const ChangedBricks& changed) {
  for (const ChangedBrick& brick : changed) count(volumes_[volume], density, brick.id);
}

void RemovedVolume::count(Volume& volume, std::span<const Density> density,
                          std::uint32_t brick) const {
  const std::size_t materials = rule_.count();
  std::uint32_t* const gone = &volume.gone[brick * materials];
  for (std::size_t m = 0; m < materials; ++m) volume.removed[m] -= gone[m];
  std::fill_n(gone, materials, 0U);
  const VoxelBox box = volume.bricks.voxels(brick);
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const std::size_t row = volume.bricks.grid.index(box.lo.x, y, z);
      const auto wide = static_cast<std::size_t>(box.hi.x - box.lo.x);
      for (std::size_t i = row; i < row + wide; ++i) {
        Density& fullest = volume.fullest[i];
        fullest = std::max(fullest, density[i]);
        const Label label = volume.labels.empty() ? Label{0} : volume.labels[i];
        const std::uint32_t part =
            solid_gone(fullest, density[i], rule_.solid_from(label, volume.iso));
        if (part > 0) gone[rule_.of(label, fullest)] += part;
      }
    }
  }
  for (std::size_t m = 0; m < materials; ++m) volume.removed[m] += gone[m];
}

std::vector<double> RemovedVolume::removed_mm3() const {
  std::vector<double> sums(rule_.count());
  for (const Volume& volume : volumes_) {
    for (std::size_t m = 0; m < sums.size(); ++m) {
      sums[m] += static_cast<double>(volume.removed[m]) / kDensityMax * volume.voxel_mm3;
    }
  }
  return sums;
}

namespace {

constexpr auto kAttachPause = std::chrono::milliseconds(20);
constexpr std::uint64_t kRateSpan = 500;  // ticks; half a second at 1 kHz

double now_ns() {
  return static_cast<double>(monotonic_ns());
}

}  // namespace

Session::Session(std::string_view name)
    : connection_(connect_segment(name)),
      scene_(scene_view(connection_.reader().info())),
      cut_before_(connection_.reader().dirty_head() != 0),
      snapshots_(scene_.volumes.size()),
      removed_volume_(removed_since_now()),
      pulp_(scene_.pulp) {
  poll();
  on_the_way_.clear();
  oldest_removal_ns_.reset();
  attach_ms_ = began_.wall_ms();
}

Session Session::attach(std::string_view name, std::chrono::duration<double> wait) {
  const auto start = std::chrono::steady_clock::now();
  while (true) {
    try {
      return Session(name);
    } catch (const SegmentAbsent&) {
      if (stop_requested() || std::chrono::steady_clock::now() - start >= wait) throw;
    }
    std::this_thread::sleep_for(kAttachPause);
  }
}

RemovedVolume Session::removed_since_now() {
  for (std::size_t v = 0; v < snapshots_.size(); ++v) {
    connection_.reader().update(v, snapshots_[v]);
  }
  return {scene_, contents()};
}

void Session::poll() {
  read_states();
  read_removals();
  for (std::size_t v = 0; v < snapshots_.size(); ++v) {
    connection_.reader().update(v, snapshots_[v]);
    removed_volume_.update(v, snapshots_[v].density, snapshots_[v].changed);
  }
  note_arrivals();
}

void Session::read_states() {
  const SegmentReader& reader = connection_.reader();
  const std::uint64_t head = reader.state_head();
  const std::uint64_t slots = reader.info().state_slots;
  if (head - next_state_ > slots) next_state_ = head - slots;
  TickRecord record;
  for (; next_state_ < head; ++next_state_) {
    if (reader.state_at(next_state_, record) != ReadState::ok) continue;
    std::uint32_t flags = record.flags;  // of all arms
    const auto second = reader.second_of(record);
    if (second) flags |= second->flags;
    if (!armed_ && (flags & kFlagStarted) != 0) armed_ = record.tick;
    if ((flags & kFlagReset) != 0) forbidden_ticks_ = 0;
    if ((flags & kFlagForbidden) != 0) ++forbidden_ticks_;
    if (!pulp_) continue;
    if ((flags & kFlagReset) != 0) pulp_->restart();
    pulp_->add(record.spindle_load, record.spindle_ratio);
    if (second) pulp_->add(second->spindle_load, second->spindle_ratio);
    pulp_->advance();
  }
  const auto newest = reader.latest();
  if (!newest) return;
  const auto second = reader.second_of(*newest);
  if (!second && reader.info().arms > 1) return;  // overwritten meanwhile: both stay of one tick
  latest_ = newest;
  second_ = second;
}

void Session::read_removals() {
  const SegmentReader& reader = connection_.reader();
  const std::uint64_t head = reader.dirty_head();
  const std::uint64_t slots = reader.info().dirty_slots;
  if (head - next_removal_ > slots) next_removal_ = head - slots;
  DirtyRecord record;
  for (; next_removal_ < head; ++next_removal_) {
    if (reader.dirty_at(next_removal_, record) != ReadState::ok) continue;  // overrun meanwhile
    if (record.volume >= scene_.volumes.size()) continue;
    if (record.cause == static_cast<std::uint16_t>(DirtyCause::undo)) continue;
    if (record.removed > 0) on_the_way_.push_back(record);
  }
}

// The record itself carries the end of the tick before; that of the tick's state, if it is still
// there, its start.
std::uint64_t Session::began_ns(const DirtyRecord& removal) const {
  const SegmentReader& reader = connection_.reader();
  if (reader.info().start_ns == 0) return removal.time_ns;  // lock-step: ticks have no such time
  const std::uint64_t head = reader.state_head();
  TickRecord state;
  if (head == 0 || reader.state_at(head - 1, state) != ReadState::ok) return removal.time_ns;
  const std::uint64_t ago = state.tick - removal.tick;
  if (ago >= head || reader.state_at(head - 1 - ago, state) != ReadState::ok) {
    return removal.time_ns;
  }
  return state.tick == removal.tick ? state.start_ns : removal.time_ns;
}

// A record may be out before its bricks are in the mirror.
void Session::note_arrivals() {
  std::erase_if(on_the_way_, [&](const DirtyRecord& removal) {
    const VolumeSnapshot& snapshot = snapshots_[removal.volume];
    if (!snapshot.consistent || snapshot.tick < removal.tick) return false;
    const std::uint64_t began_ns = this->began_ns(removal);
    oldest_removal_ns_ = std::min(oldest_removal_ns_.value_or(began_ns), began_ns);
    return true;
  });
}

std::optional<std::chrono::steady_clock::time_point> Session::take_oldest_removal() {
  const auto taken_ns = std::exchange(oldest_removal_ns_, std::nullopt);
  if (!taken_ns) return std::nullopt;
  return std::chrono::steady_clock::time_point(std::chrono::nanoseconds(*taken_ns));
}

std::vector<VolumeContent> Session::contents() const {
  std::vector<VolumeContent> contents;
  for (std::size_t v = 0; v < snapshots_.size(); ++v) {
    contents.push_back({snapshots_[v].density, connection_.reader().labels(v)});
  }
  return contents;
}

const VolumeSnapshot& Session::snapshot(std::size_t volume) const {
  return snapshots_[volume];
}

std::optional<std::uint64_t> Session::ticks_since_armed() const noexcept {
  if (!armed_ || !latest_ || latest_->tick < *armed_) return std::nullopt;
  return latest_->tick - *armed_;
}

std::optional<double> Session::tick_rate_hz() const {
  const SegmentReader& reader = connection_.reader();
  const std::uint64_t head = reader.state_head();
  TickRecord earlier;
  if (!latest_ || head <= kRateSpan) return std::nullopt;
  if (reader.state_at(head - 1 - kRateSpan, earlier) != ReadState::ok) return std::nullopt;
  if (latest_->start_ns <= earlier.start_ns) return std::nullopt;
  constexpr double kNsPerS = 1e9;
  return static_cast<double>(latest_->tick - earlier.tick) * kNsPerS /
         static_cast<double>(latest_->start_ns - earlier.start_ns);
}

double Session::forbidden_ms() const noexcept {
  constexpr double kMsPerNs = 1e-6;
  return static_cast<double>(forbidden_ticks_) * tick_ns() * kMsPerNs;
}

std::optional<double> Session::data_age_ms() const {
  const std::uint64_t heartbeat_ns = connection_.reader().heartbeat_ns();
  if (heartbeat_ns == 0) return std::nullopt;
  constexpr double kNsPerMs = 1e6;
  return std::max(0.0, (now_ns() - static_cast<double>(heartbeat_ns)) / kNsPerMs);
}

std::uint32_t Session::tick_ns() const noexcept {
  return connection_.reader().info().tick_ns;
}

double Session::servo_s() const noexcept {
  constexpr double kSPerNs = 1e-9;
  return latest_ ? static_cast<double>(latest_->tick) * tick_ns() * kSPerNs : 0.0;
}

double Session::record_age_s() const noexcept {
  constexpr double kSPerNs = 1e-9;
  if (!latest_) return 0.0;
  const SegmentReader& reader = connection_.reader();
  const bool is_lockstep = reader.info().start_ns == 0;
  const std::uint64_t began_ns = is_lockstep ? reader.heartbeat_ns() : latest_->start_ns;
  return (now_ns() - static_cast<double>(began_ns)) * kSPerNs;
}

bool Session::ended() const noexcept {
  return connection_.reader().lifecycle() >= Lifecycle::clean_end || !connection_.alive();
}

bool Session::is_held() const noexcept {
  return connection_.reader().lifecycle() == Lifecycle::hold;
}

bool Session::ended_cleanly() const noexcept {
  return connection_.reader().lifecycle() == Lifecycle::clean_end;
}

bool Session::send(CommandKind kind, std::uint32_t argument) {
  try {
    const SegmentCommand command{.kind = kind, .index = 0, .argument = argument};
    return connection_.send(command).status == ReplyStatus::accepted;
  } catch (const SegmentError&) {
    return false;  // it has gone; the picture reports it
  }
}

}  // namespace kerf
