// SPDX-License-Identifier: Apache-2.0
// Both ends of a bridge without a network between them: a segment that is milled, what the near end
// sends, and the segment that the far end makes of it.
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "bridge/stream/mirror.hpp"
#include "bridge/stream/run_snapshot.hpp"
#include "bridge/stream/stream.hpp"
#include "bridge/wire/parse.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::loop_test {

using namespace kerf::bridge;
using kerf::test::NoiseVolume;
using kerf::test::RuntimeFolder;

namespace {

constexpr std::uint64_t kEnough = 1 << 30;

/// A milled segment of two volumes, one of them with labels, and one viewer's stream of it.
struct NearEnd {
  NearEnd() : tooth({40, 33, 17}), jaw({24, 8, 8}, 2) {
    tooth.labels.resize(tooth.density.size());
    for (Label& label : tooth.labels) label = static_cast<Label>(random());
    SegmentSpec spec = kerf::test::spec_of(tooth);
    spec.volumes.push_back(jaw.spec());
    spec.scene_json.assign(3000, 'x');
    writer.emplace(SegmentWriter::create(spec));
    reader.emplace(SegmentReader::map(writer->fd()));
    snapshot.emplace(*reader);
    connect();
  }
  void connect() {
    stream.reset();
    stream = std::make_unique<Stream>(*snapshot, 0);
    sent.clear();
  }

  void mill() {
    writer->begin_tick(++tick);
    const VoxelBox box = kerf::test::random_box(random, tooth.grid, 9);
    tooth.cut(box);
    writer->publish_box(0, tooth.density, box, 1);
    if (tick % 5 == 0) {
      jaw.cut(jaw.grid.box());
      writer->publish_box(1, jaw.density, jaw.grid.box(), 1);
    }
    TickRecord record{};
    record.tick = tick;
    record.start_ns = tick * 1'000'000;
    writer->publish_state(record);
    writer->end_tick(tick * 1'000'000);
    hashes[tick] = density_hash(tooth.density) ^ density_hash(jaw.density);
  }

  /// One slot: what the stream has credit for is on its way.
  void slot(bool ended = false) {
    now_ns += kSlotNs;
    snapshot->update(now_ns, ended);
    stream->note_changes();
    stream->slot(now_ns, ended);
    send();
  }
  void send() {
    for (std::vector<std::byte> message; stream->next(now_ns, message);) sent.push_back(message);
  }

  std::mt19937 random{4};
  NoiseVolume tooth, jaw;
  std::optional<SegmentWriter> writer;
  std::optional<SegmentReader> reader;
  std::optional<RunSnapshot> snapshot;
  std::unique_ptr<Stream> stream;
  std::deque<std::vector<std::byte>> sent;
  std::map<Tick, std::uint64_t> hashes;  // of both volumes, by tick
  Tick tick = 0;
  std::int64_t now_ns = 1'000'000'000;
};

/// Takes at most `count` messages off the line and answers them.
void deliver(NearEnd& near, Mirror& mirror, std::size_t count) {
  for (; count != 0 && !near.sent.empty(); --count) {
    const std::vector<std::byte> message = near.sent.front();
    near.sent.pop_front();
    switch (magic_of(message)) {
      case kHelloMagic:
        mirror.hello(message, near.now_ns, 0);
        break;
      case kFrameMagic:
        REQUIRE(near.stream->acked(mirror.frame(message, near.now_ns, 0), near.now_ns));
        break;
      default:
        mirror.records(message);
    }
    near.send();
  }
}

/// What a reader of the far segment has; its volumes are of one tick, or the test fails.
struct FarPicture {
  Tick tick = 0;
  std::uint64_t hash = 0;
};
FarPicture far_picture(const SegmentReader& reader) {
  VolumeSnapshot tooth, jaw;
  reader.update(0, tooth);
  reader.update(1, jaw);
  REQUIRE(tooth.consistent);
  REQUIRE(jaw.consistent);
  REQUIRE(tooth.tick == jaw.tick);
  return {tooth.tick, density_hash(tooth.density) ^ density_hash(jaw.density)};
}

}  // namespace

TEST_CASE("at every moment the far segment is the near one's of one tick, however slow the link") {
  const RuntimeFolder folder;
  NearEnd near;
  Mirror mirror("far", kEnough, [](const SegmentCommand&) { return Reply{}; });
  std::optional<SegmentConnection> far;
  int seen = 0;
  for (int slot = 0; slot < 400; ++slot) {
    for (int i = 0; i < 16; ++i) near.mill();
    near.slot();
    deliver(near, mirror, near.random() % 4);  // of about as many as come
    if (!mirror.joined()) continue;
    if (!far) far = connect_segment("far");
    const FarPicture picture = far_picture(far->reader());
    if (picture.tick == 0) continue;
    ++seen;
    CHECK(picture.hash == near.hashes[picture.tick]);
    CHECK(picture.tick <= near.tick);
  }
  CHECK(seen > 100);
  const Tick last = near.tick;
  for (int slot = 0; slot < 20; ++slot) {
    near.slot();
    deliver(near, mirror, 1000);
  }
  CHECK(far_picture(far->reader()).tick == last);
  CHECK(far_picture(far->reader()).hash == near.hashes[last]);
  CHECK(far->reader().info().scene_json == std::string(3000, 'x'));
  const auto labels = far->reader().labels(0);
  CHECK(std::vector<Label>(labels.begin(), labels.end()) == near.tooth.labels);
  REQUIRE(far->reader().latest());
  CHECK(far->reader().latest()->tick == last);
}

TEST_CASE("connections that are cut at any moment end in the same volume") {
  const RuntimeFolder folder;
  NearEnd near;
  Mirror mirror("far", kEnough, [](const SegmentCommand&) { return Reply{}; });
  std::optional<SegmentConnection> far;
  for (int slot = 0; slot < 600; ++slot) {
    near.mill();
    near.slot();
    deliver(near, mirror, 1 + near.random() % 8);
    if (near.random() % 10 == 0) near.connect();  // what was on its way is lost
    if (!far && mirror.joined()) far = connect_segment("far");
    if (!far) continue;
    const FarPicture picture = far_picture(far->reader());
    if (picture.tick != 0) CHECK(picture.hash == near.hashes[picture.tick]);
  }
  for (int slot = 0; slot < 20; ++slot) {
    near.slot();
    deliver(near, mirror, 1000);
  }
  REQUIRE(far);
  CHECK(far->alive());  // the same segment all along
  CHECK(far_picture(far->reader()).tick == near.tick);
  CHECK(far_picture(far->reader()).hash == near.hashes[near.tick]);
}

TEST_CASE("the end of a run arrives with its last volume") {
  const RuntimeFolder folder;
  NearEnd near;
  Mirror mirror("far", kEnough, [](const SegmentCommand&) { return Reply{}; });
  for (int i = 0; i < 50; ++i) {
    near.mill();
    near.slot();
    deliver(near, mirror, 1000);
  }
  const SegmentConnection far = connect_segment("far");
  near.mill();
  near.writer->set_lifecycle(Lifecycle::clean_end);
  for (int i = 0; i < 5; ++i) {
    near.slot(true);
    deliver(near, mirror, 1000);
  }
  CHECK(mirror.ended());
  CHECK(!far.alive());
  CHECK(far.reader().lifecycle() == Lifecycle::clean_end);
  CHECK(far_picture(far.reader()).hash == near.hashes[near.tick]);
  CHECK(far.reader().latest()->tick == near.tick);
}

}  // namespace kerf::loop_test
