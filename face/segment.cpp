// SPDX-License-Identifier: Apache-2.0
#include "kerf/segment.hpp"

#include <utility>

#include "face/loaded.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"

namespace kerf {
namespace {

/// What a reader may ask for; none: the loop alone gives it.
std::optional<CommandKind> kind_of(ServoCommand::Kind kind) noexcept {
  using Kind = ServoCommand::Kind;
  switch (kind) {
    case Kind::select_tool:
      return CommandKind::select_tool;
    case Kind::hold:
      return CommandKind::hold;
    case Kind::reset:
      return CommandKind::reset;
    case Kind::undo:
      return CommandKind::undo;
    case Kind::redo:
      return CommandKind::redo;
    case Kind::mark:
      return CommandKind::mark;
    case Kind::none:
    case Kind::fade_in:
    case Kind::missed:
      break;
  }
  return std::nullopt;
}

}  // namespace

struct Segment::Parts {
  explicit Parts(std::string_view name)
      : connection(connect_segment(name)), volumes(connection.reader().info().volumes.size()) {}

  [[nodiscard]] const SegmentReader& reader() const noexcept { return connection.reader(); }

  SegmentConnection connection;
  std::vector<VolumeSnapshot> volumes;
};

Segment::Segment(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}
Segment::~Segment() = default;
Segment::Segment(Segment&&) noexcept = default;
Segment& Segment::operator=(Segment&&) noexcept = default;

Segment Segment::open(std::string_view name) {
  return or_error([&] { return Segment(std::make_unique<Parts>(name)); });
}

bool Segment::alive() const noexcept {
  return parts_->connection.alive();
}

std::size_t Segment::arms() const noexcept {
  return parts_->reader().info().arms;
}

double Segment::period_s() const noexcept {
  return 1e-9 * parts_->reader().info().tick_ns;
}

const std::string& Segment::scene_json() const noexcept {
  return parts_->reader().info().scene_json;
}

std::optional<TickRecord> Segment::latest(std::size_t arm) const noexcept {
  return parts_->reader().latest(arm);
}

std::uint64_t Segment::count() const noexcept {
  return parts_->reader().state_head();
}

std::uint64_t Segment::since(std::uint64_t from, std::vector<TickRecord>& out,
                             std::size_t arm) const {
  const SegmentReader& reader = parts_->reader();
  const std::uint64_t head = reader.state_head(arm), slots = reader.info().state_slots;
  const std::uint64_t oldest = head > slots ? head - slots : 0;
  std::uint64_t lost = 0;
  for (std::uint64_t index = from; index < head; ++index) {
    if (index < oldest) {
      lost += oldest - index;
      index = oldest;
    }
    TickRecord record;
    const ReadState state = reader.state_at(index, record, arm);
    if (state == ReadState::ok) {
      out.push_back(record);
    } else {
      ++lost;
    }
  }
  return lost;
}

VoxelView Segment::volume(std::size_t number, std::size_t* changed_bricks) {
  if (number >= parts_->volumes.size()) {
    throw Error("volume " + std::to_string(number) + ": the controller has " +
                std::to_string(parts_->volumes.size()) + "; they count from 0");
  }
  VolumeSnapshot& snapshot = parts_->volumes[number];
  or_error([&] { parts_->reader().update(number, snapshot); });
  if (changed_bricks != nullptr) *changed_bricks = snapshot.changed.size();
  const SegmentVolumeInfo& info = parts_->reader().info().volumes[number];
  return {.size = {info.grid.nx, info.grid.ny, info.grid.nz},
          .spacing_mm = info.spacing_mm,
          .origin_mm = info.origin_mm,
          .orientation = {info.orientation[0], info.orientation[1], info.orientation[2],
                          info.orientation[3]},
          .density = snapshot.density};
}

std::uint32_t Segment::send(const ServoCommand& command) {
  const auto kind = kind_of(command.kind);
  if (!kind) return 0;
  return or_error([&] {
    SegmentCommand asked;
    asked.kind = *kind;
    asked.argument = command.argument;
    asked.arm = command.arm;
    const Reply reply = parts_->connection.send(asked);
    return reply.status == ReplyStatus::accepted ? reply.index : 0;
  });
}

}  // namespace kerf
