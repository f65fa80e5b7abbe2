// SPDX-License-Identifier: Apache-2.0

#include "bridge/stream/mirror.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "bridge/wire/messages.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/server.hpp"

namespace kerf::bridge {

Reply RemoteCommand::request(const SegmentCommand& command) noexcept {
  std::unique_lock lock(mutex_);
  if (link_ != Link::open) {
    return {link_ == Link::down ? ReplyStatus::busy : ReplyStatus::refused, 0};
  }
  const auto kind = static_cast<std::uint32_t>(command.kind);
  constexpr std::uint32_t kMost = 0xffff;  // fields of 16 bits; no kind or arm is above
  if (kind > kMost || command.arm > kMost) return {ReplyStatus::refused, 0};
  to_send_ = CommandMessage{kCommandMagic, static_cast<std::uint16_t>(kind),
                            static_cast<std::uint16_t>(command.arm), command.argument, ++sequence_};
  reply_.reset();
  answered_.wait_for(lock, kPatience, [this] { return reply_.has_value(); });
  to_send_.reset();
  return reply_.value_or(Reply{ReplyStatus::busy, 0});
}

std::optional<CommandMessage> RemoteCommand::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(to_send_, std::nullopt);
}

void RemoteCommand::answer(const ReplyMessage& reply) {
  const std::lock_guard lock(mutex_);
  if (reply.sequence != sequence_) return;  // of an earlier command: `request` gave up
  const bool known = reply.status <= static_cast<std::uint32_t>(ReplyStatus::refused);
  reply_ =
      Reply{known ? static_cast<ReplyStatus>(reply.status) : ReplyStatus::refused, reply.index};
  answered_.notify_one();
}

void RemoteCommand::set_link(Link link) {
  const std::lock_guard lock(mutex_);
  link_ = link;
  if (link == Link::open) return;
  reply_ = Reply{};  // no reply will come
  reply_->status = ReplyStatus::busy;
  answered_.notify_one();
}

namespace {

[[nodiscard]] std::size_t arms_of(const ParsedHello& hello) noexcept {
  return (hello.head.flags & kTwoArms) != 0 ? 2 : 1;
}

/// True if both are the same run of the same scene, so that its segment stays valid.
[[nodiscard]] bool same_run(const ParsedHello& a, const ParsedHello& b) noexcept {
  return a.head.session == b.head.session && a.head.scene_bytes == b.head.scene_bytes &&
         a.volumes.size() == b.volumes.size() && arms_of(a) == arms_of(b) &&
         std::memcmp(a.volumes.data(), b.volumes.data(),
                     a.volumes.size() * sizeof(VolumeDescriptor)) == 0;
}

/// Lock-step: the times of its ticks are of no clock.
[[nodiscard]] bool is_lockstep(const ParsedHello& hello) noexcept {
  return hello.head.start_ns == 0;
}

[[nodiscard]] MirrorSpec spec_of(const ParsedHello& hello, const ClockOffset& clock,
                                 std::uint64_t most_bytes) {
  return {.session_id = hello.head.session,
          .config_hash = hello.head.config_hash,
          // 0 would say lock-step. A run may be older than this machine, whose clock began later.
          .start_ns =
              is_lockstep(hello) ? 0 : std::max<std::uint64_t>(clock.local(hello.head.start_ns), 1),
          .tick_ns = hello.head.tick_ns,
          .scene_bytes = hello.head.scene_bytes,
          .build_id = hello.head.build_id,
          .arms = arms_of(hello),
          .volumes = hello.volumes,
          .most_bytes = most_bytes};
}

template <class Record>
[[nodiscard]] Record record_at(std::span<const std::byte> bytes, std::size_t index) noexcept {
  Record out;
  std::memcpy(&out, bytes.data() + index * sizeof out, sizeof out);
  return out;
}

}  // namespace

/// A local segment and the versions of its blocks.
struct Mirror::LocalSegment {
  LocalSegment(ParsedHello run, ReplicaWriter made)
      : hello(std::move(run)),
        plan(hello.head.scene_bytes, hello.volumes),
        writer(std::move(made)),
        versions(plan.count()) {}

  ParsedHello hello;
  BlockPlan plan;
  ReplicaWriter writer;
  std::vector<std::uint64_t> versions;  // per block, as written
  std::optional<SegmentServer> server;  // while readers can find it
};

Mirror::Mirror(std::string name, std::uint64_t most_bytes, SegmentServer::Answer answer)
    : name_(std::move(name)), most_bytes_(most_bytes), answer_(std::move(answer)) {
  static_cast<void>(segment_socket(name_));
  const NameLock free_now(name_);  // throws now if the name is taken
}

Mirror::~Mirror() = default;

const HelloMessage& Mirror::hello(std::span<const std::byte> message, std::int64_t now_ns,
                                  std::int64_t round_trip_ns) {
  ParsedHello hello = parse_hello(message);
  require_same_layout(hello.head.layout_major, hello.head.layout_minor, hello.head.abi_hash);
  clock_ = {};
  clock_.sample(hello.head.server_ns, now_ns, round_trip_ns);
  const bool shown = shown_ && same_run(shown_->hello, hello);
  if (shown || (next_ && !same_run(next_->hello, hello))) next_.reset();
  if (!shown && !next_) {
    next_ = std::make_unique<LocalSegment>(
        hello, ReplicaWriter::create(spec_of(hello, clock_, most_bytes_)));
  }
  parser_ = std::make_unique<FrameParser>(hello);
  held_.assign(parser_->plan().count(), 0);
  waiting_.clear();
  blocks_held_ = 0;
  blocks_waiting_ = 0;
  set_hash_ = last_frame_ = 0;
  joined_ = false;
  hello_ = std::move(hello);
  return hello_->head;
}

AckMessage Mirror::frame(std::span<const std::byte> message, std::int64_t now_ns,
                         std::int64_t round_trip_ns) {
  if (!parser_) throw StreamOutOfSync("frame: came before the greeting");
  const FrameHead head = parser_->parse(message);
  clock_.sample(head.sent_ns, now_ns, round_trip_ns);
  if (head.frame != last_frame_ + 1) {
    throw StreamOutOfSync("frame: " + std::to_string(head.frame) + " came after " +
                          std::to_string(last_frame_));
  }
  last_frame_ = head.frame;
  if (!next_ && !parser_->blocks().empty()) waiting_.emplace_back();
  for (const FrameParser::Block& block : parser_->blocks()) take(block);
  if (set_hash_ != head.set_hash) throw StreamOutOfSync("frame: the set hash is another");
  (next_ ? next_ : shown_)
      ->writer.beat(
          clock_.local(static_cast<std::uint64_t>(std::max<std::int64_t>(head.heartbeat_ns, 0))));
  if ((head.flags & kLastOfPass) != 0) publish(head);
  return {kAckMagic, 0, head.session, head.frame};
}

void Mirror::take(const FrameParser::Block& block) {
  std::uint64_t& held = held_[block.id];
  if (block.version <= held) {
    throw StreamOutOfSync("frame: block " + std::to_string(block.id) + " is not newer than before");
  }
  set_hash_ = with_block(set_hash_, block.id, held, block.version, hello_->head.session);
  if (held == 0) ++blocks_held_;
  held = block.version;
  LocalSegment& segment = next_ ? *next_ : *shown_;
  if (segment.versions[block.id] == block.version) return;  // from an earlier connection
  if (next_) return put(block.id, block.version, block.bytes);
  if (++blocks_waiting_ > held_.size()) throw StreamOutOfSync("frame: the pass never ends");
  Part& part = waiting_.back();
  part.blocks.push_back({block.id, block.version, part.bytes.size()});
  part.bytes.insert(part.bytes.end(), block.bytes.begin(), block.bytes.end());
}

void Mirror::put(std::uint32_t id, std::uint64_t version, std::span<const std::byte> bytes) {
  LocalSegment& segment = next_ ? *next_ : *shown_;
  const BlockPlane& plane = segment.plan.plane_of(id);
  const std::uint32_t index = id - plane.first;
  switch (plane.kind) {
    case BlockKind::text: {
      const std::size_t at = index * kTextBlockBytes;
      segment.writer.put_scene(
          at, bytes.first(std::min(kTextBlockBytes, segment.hello.head.scene_bytes - at)));
      break;
    }
    case BlockKind::density:
      segment.writer.put_brick(plane.volume, index, version, bytes);
      break;
    case BlockKind::labels:
      segment.writer.put_labels(plane.volume, index, bytes);
      break;
  }
  segment.versions[id] = version;
}

void Mirror::publish(const FrameHead& head) {
  if (blocks_held_ != held_.size()) {
    throw StreamOutOfSync("frame: the pass ends with " + std::to_string(blocks_held_) + " of " +
                          std::to_string(held_.size()) + " blocks");
  }
  ReplicaWriter& writer = (next_ ? next_ : shown_)->writer;
  if (!waiting_.empty()) writer.begin_pass(head.tick);
  for (const Part& part : waiting_) {
    for (const Waiting& block : part.blocks) {
      const std::size_t size = parser_->plan().plane_of(block.id).block_bytes();
      put(block.id, block.version, std::span(part.bytes).subspan(block.at, size));
    }
  }
  writer.end_pass(head.tick);
  std::vector<Part>().swap(waiting_);  // frees the memory of a long pass
  blocks_waiting_ = 0;
  writer.set_lifecycle(head.lifecycle <= static_cast<std::uint32_t>(Lifecycle::fault)
                           ? static_cast<Lifecycle>(head.lifecycle)
                           : Lifecycle::fault);
  taken_ns_ = clock_.local(head.taken_ns);
  joined_ = true;
  ++passes_;
  if (next_) {  // the earlier run releases the name before the new one takes it
    shown_.reset();
    shown_ = std::move(next_);
  }
  ended_ = (head.flags & kRunEnded) != 0;
  if (ended_) {
    shown_->server.reset();  // as when a controller ends: readers keep what they have
  } else if (!shown_->server) {
    shown_->server.emplace(name_, shown_->writer.fd(), shown_->writer.session_id(), answer_);
  }
}

void Mirror::records(std::span<const std::byte> message) {
  if (!hello_) throw StreamOutOfSync("records: came before the greeting");
  const ParsedRecords in = parse_records(message, hello_->head.session, scratch_);
  ReplicaWriter& writer = (next_ ? next_ : shown_)->writer;
  const auto ring = static_cast<Ring>(in.head.ring);
  const std::size_t arms = ring == Ring::pairs ? 2 : 1;
  if (ring != Ring::dirty && arms != arms_of(*hello_)) {
    throw StreamOutOfSync("records: of " + std::to_string(arms) + " arms, and the greeting had " +
                          std::to_string(arms_of(*hello_)));
  }
  for (std::uint32_t i = 0; i < in.head.count; ++i) {
    const std::uint64_t index = in.head.first + std::uint64_t{i} * in.head.stride;
    if (ring == Ring::dirty) {
      auto record = record_at<DirtyRecord>(in.bytes, i);
      record.time_ns = clock_.local(record.time_ns);
      writer.put_record(index, record);
      continue;
    }
    for (std::size_t arm = arms; arm-- > 0;) {  // the second arm first, as a controller does
      auto record = record_at<TickRecord>(in.bytes, i * arms + arm);
      if (!is_lockstep(*hello_)) record.start_ns = clock_.local(record.start_ns);
      writer.put_record(index, record, arm);
    }
  }
}

}  // namespace kerf::bridge
