// SPDX-License-Identifier: Apache-2.0
#include "bridge/stream/stream.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "bridge/stream/run_snapshot.hpp"
#include "bridge/wire/compression.hpp"
#include "tests/bridge/far_side.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::stream_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

constexpr VoxelGrid kGrid{50, 41, 33};  // 7 x 6 x 5 bricks

/// A controller, and a bridge with streams to far sides; time is a number.
struct Bench {
  NoiseVolume volume{kGrid};
  SegmentWriter writer;
  SegmentReader reader;
  RunSnapshot snapshot;
  std::int64_t now_ns = 1'000'000'000;
  Tick tick = 0;
  std::mt19937 random{7};

  explicit Bench(NoiseVolume content = NoiseVolume(kGrid))
      : volume(std::move(content)),
        writer(SegmentWriter::create(spec_of(volume))),
        reader(SegmentReader::map(writer.fd())),
        snapshot(reader) {}

  void cut(std::int32_t edge) {
    cut_and_publish(writer, volume, ++tick, random_box(random, kGrid, edge));
  }
  template <class... Streams>
  void slot(Streams&... streams) {
    now_ns += kSlotNs;
    snapshot.update(now_ns, false);
    (streams.note_changes(), ...);
    (streams.slot(now_ns, false), ...);
  }
};

/// Takes all that there is to send, each frame acknowledged at once.
void drain(Stream& stream, FarSide& far, std::int64_t& now_ns) {
  std::vector<std::byte> message;
  while (stream.next(now_ns, message)) {
    now_ns += 10'000;
    CHECK(message.size() <= kMaxMessageBytes);
    if (far.take(message)) CHECK(stream.acked(far.ack(), now_ns));
  }
}

NoiseVolume with_labels() {
  NoiseVolume volume(kGrid);
  for (std::size_t i = 0; i < volume.density.size(); ++i) {
    volume.labels.push_back(static_cast<Label>(i * 7));
  }
  return volume;
}

}  // namespace

TEST_CASE("a viewer ends with text, volumes and labels as the controller has them") {
  NoiseVolume first = with_labels();
  const NoiseVolume second({9, 8, 1}, 5);
  SegmentSpec spec = spec_of(first);
  spec.volumes.push_back(second.spec());
  spec.volumes[1].spacing_mm = {0.1, 0.2, 0.3};
  spec.scene_json = std::string(2500, 'x') + "end";
  const SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentReader reader = SegmentReader::map(writer.fd());
  RunSnapshot snapshot(reader);
  Stream stream(snapshot, kMayCommand);
  FarSide far;
  std::int64_t now_ns = 5;
  snapshot.update(now_ns, false);
  stream.note_changes();
  stream.slot(now_ns, false);
  drain(stream, far, now_ns);
  REQUIRE(far.hello.has_value());
  CHECK(far.hello->head.flags == kMayCommand);
  CHECK(far.hello->head.session == reader.info().session_id);
  CHECK(far.hello->volumes[1].spacing_mm[2] == 0.3);
  CHECK(far.is_whole());
  CHECK(far.passes == 1);
  CHECK(far.last.tick == 0);
  CHECK(far.last.taken_ns == 5);
  CHECK(far.volume(0) == first.density);
  CHECK(far.volume(1) == second.density);
  CHECK(far.labels(0) == first.labels);
  std::string text;
  for (int i = 0; i < 3; ++i) {
    text.append(reinterpret_cast<const char*>(far.blocks[static_cast<std::size_t>(i)].data()),
                1024);
  }
  CHECK(text.substr(0, spec.scene_json.size()) == spec.scene_json);
  CHECK(std::all_of(text.begin() + 2503, text.end(), [](char c) { return c == 0; }));
}

TEST_CASE("each whole pass is the volume of its tick, though it changes meanwhile") {
  Bench bench;
  std::map<Tick, std::vector<Density>> history{{0, bench.volume.density}};
  auto slow = std::make_unique<Stream>(bench.snapshot, 0);
  Stream fast(bench.snapshot, 0);
  FarSide far_slow, far_fast;
  std::deque<AckMessage> late;
  std::vector<std::byte> message;
  std::uint64_t whole = 0;
  for (int i = 0; i < 400; ++i) {
    bench.cut(i % 50 == 0 ? 60 : 12);
    history.emplace(bench.tick, bench.volume.density);
    bench.slot(*slow, fast);
    drain(fast, far_fast, bench.now_ns);
    CHECK(far_fast.is_whole());
    CHECK(far_fast.last.tick == bench.tick);
    // Two messages a slot, acknowledged three slots later: a pass takes many.
    for (int k = 0; k < 2 && slow->next(bench.now_ns, message); ++k) {
      if (far_slow.take(message)) late.push_back(far_slow.ack());
      if (bench.random() % 4 != 0 && far_slow.is_whole() && far_slow.passes > whole) {
        whole = far_slow.passes;
        REQUIRE(history.contains(far_slow.last.tick));
        CHECK(far_slow.volume(0) == history[far_slow.last.tick]);
      }
    }
    if (late.size() > 3 || (i % 7 == 0 && !late.empty())) {
      CHECK(slow->acked(late.back(), bench.now_ns));  // of all before it
      late.clear();
    }
  }
  CHECK(far_fast.volume(0) == bench.volume.density);
  CHECK(whole > 3);
  CHECK(bench.snapshot.kept() > 0);
  slow.reset();
  CHECK(bench.snapshot.kept() == 0);
}

TEST_CASE("no more frames are under way than there is credit, and no ack comes too early") {
  Bench bench;
  Stream stream(bench.snapshot, 0);
  FarSide far;
  std::vector<std::byte> message;
  bench.slot(stream);
  while (stream.next(bench.now_ns, message)) far.take(message);
  CHECK(far.frames == LinkRate::kLeastFrames);
  AckMessage ack = far.ack();
  ack.frame += 1;
  CHECK(!stream.acked(ack, bench.now_ns));
  ack.session ^= 1;  // of another run
  CHECK(stream.acked(ack, bench.now_ns));
  CHECK(!stream.next(bench.now_ns, message));
  CHECK(stream.acked(far.ack(), bench.now_ns));
  CHECK(stream.next(bench.now_ns, message));
}

TEST_CASE("a segment at rest sends one empty frame a slot, the sign of life") {
  Bench bench;
  Stream stream(bench.snapshot, 0);
  FarSide far;
  bench.slot(stream);
  drain(stream, far, bench.now_ns);
  const std::uint64_t before = far.frames;
  for (int i = 0; i < 10; ++i) {
    bench.slot(stream);
    const std::int64_t taken_ns = bench.now_ns;
    drain(stream, far, bench.now_ns);
    CHECK(far.last.blocks == 0);
    CHECK(far.last.taken_ns == taken_ns);
    CHECK(far.is_whole());
  }
  CHECK(far.frames == before + 10);
}

TEST_CASE("while bricks wait in the controller there is life but no new state") {
  Bench bench(NoiseVolume({200, 200, 200}));
  NoiseVolume& volume = bench.volume;
  Stream stream(bench.snapshot, 0);
  FarSide far;
  bench.slot(stream);
  drain(stream, far, bench.now_ns);
  cut_and_publish(bench.writer, volume, ++bench.tick, volume.grid.box());
  REQUIRE(bench.writer.waiting_bricks() > 0);
  bench.slot(stream);
  drain(stream, far, bench.now_ns);
  CHECK(far.last.tick == 0);
  CHECK(far.last.blocks == 0);
  while (bench.writer.waiting_bricks() > 0) {
    bench.writer.begin_tick(++bench.tick);
    bench.writer.end_tick(1);
  }
  bench.slot(stream);
  drain(stream, far, bench.now_ns);
  CHECK(far.last.tick == bench.tick);
  CHECK(far.is_whole());
  CHECK(far.volume(0) == volume.density);
}

TEST_CASE("what a controller left half published is shown once it has gone") {
  Bench bench(NoiseVolume({200, 200, 200}));
  cut_and_publish(bench.writer, bench.volume, ++bench.tick, bench.volume.grid.box());
  Stream stream(bench.snapshot, 0);
  FarSide far;
  bench.slot(stream);
  drain(stream, far, bench.now_ns);
  CHECK(far.frames == 0);
  bench.snapshot.update(bench.now_ns, true);
  stream.note_changes();
  stream.slot(bench.now_ns, true);
  drain(stream, far, bench.now_ns);
  CHECK(far.is_whole());
  CHECK((far.last.flags & kRunEnded) != 0);
  CHECK(far.last.tick == 0);
}

TEST_CASE("a fast link carries every record, from the newest at the start on") {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.cut(3);
  Stream stream(bench.snapshot, 0);
  FarSide far;
  for (int i = 0; i < 60; ++i) {
    bench.slot(stream);
    drain(stream, far, bench.now_ns);
    for (int k = 0; k < 17; ++k) bench.cut(3);
  }
  REQUIRE(far.ticks.size() == 1 + 59 * 17);
  for (std::size_t i = 0; i < far.ticks.size(); ++i) CHECK(far.ticks[i].tick == 5 + i);
  CHECK(far.dirty.size() == far.ticks.size());
  CHECK(far.widest_stride == 1);
}

TEST_CASE("a servo of 8 kHz loses no record, though the bridge is late by a few slots") {
  NoiseVolume volume({1, 1, 1});  // and a scene without text
  SegmentSpec spec = spec_of(volume);
  spec.scene_json.clear();
  spec.tick_ns = 125'000;
  SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentReader reader = SegmentReader::map(writer.fd());
  RunSnapshot snapshot(reader);
  Stream stream(snapshot, 0);
  FarSide far;
  std::int64_t now_ns = 1;
  Tick tick = 0;
  for (const int slots : {1, 1, 5, 1, 8, 1}) {
    for (int k = 0; k < 133 * slots; ++k) cut_and_publish(writer, volume, ++tick, {{}, {1, 1, 1}});
    now_ns += slots * kSlotNs;
    snapshot.update(now_ns, false);
    stream.note_changes();
    stream.slot(now_ns, false);
    drain(stream, far, now_ns);
  }
  CHECK(far.volume(0) == volume.density);
  CHECK(far.widest_stride == 1);
  CHECK(far.ticks.back().tick == tick);
  CHECK(far.ticks.size() == 1 + tick - far.ticks.front().tick);
}

TEST_CASE("a link of 4 Mbit/s gives records a quarter, thinned, and always the newest") {
  Bench bench(NoiseVolume({200, 200, 200}));
  Stream stream(bench.snapshot, 0);
  FarSide far;
  bench.now_ns += kSlotNs;
  constexpr double kBytesPerNs = 4e6 / 8 * 1e-9;
  std::vector<std::byte> message;
  std::int64_t free_ns = bench.now_ns;
  std::size_t record_bytes = 0, all_bytes = 0;
  std::deque<std::pair<std::int64_t, AckMessage>> acks;
  for (int slot = 0; slot < 300; ++slot) {
    for (int k = 0; k < 17; ++k) bench.cut(3);
    bench.slot(stream);
    while (free_ns < bench.now_ns + kSlotNs) {
      const std::int64_t at = std::max(free_ns, bench.now_ns);
      for (; !acks.empty() && acks.front().first <= at; acks.pop_front()) {
        CHECK(stream.acked(acks.front().second, at));
      }
      if (!stream.next(at, message)) {
        if (acks.empty()) break;
        free_ns = std::max(at, acks.front().first);
        continue;
      }
      free_ns = at + static_cast<std::int64_t>(static_cast<double>(message.size()) / kBytesPerNs);
      const bool frame = far.take(message);
      if (frame) acks.emplace_back(free_ns, far.ack());
      if (slot < 60) continue;  // until the rate is known
      all_bytes += message.size();
      if (!frame) record_bytes += message.size();
    }
  }
  CHECK(far.passes == 0);  // still in the first
  CHECK(far.widest_stride > 1);
  CHECK(record_bytes < all_bytes * 3 / 10);
  CHECK(record_bytes > all_bytes / 10);             // they pack well
  CHECK(far.ticks.back().tick + 120 > bench.tick);  // behind two frames of 33 ms
  const auto rising = [](const TickRecord& a, const TickRecord& b) { return a.tick < b.tick; };
  CHECK(std::is_sorted(far.ticks.begin(), far.ticks.end(), rising));
}

TEST_CASE("the window is twice what the link holds, and a frame") {
  LinkRate link;
  link.set_round_trip(40'000'000);
  CHECK(link.window() == kMaxRawBytes);
  CHECK(link.bytes_per_s() == 0);
  // A frame of 1000 bytes leaves every 10 ms and is acknowledged 40 ms later: 100 a second.
  std::int64_t now_ns = 0;
  for (std::uint64_t frame = 1; frame <= 100; ++frame) {
    now_ns += 10'000'000;
    if (frame > 4) link.acked(frame - 4, now_ns);
    link.sent_frame(frame, 1000, now_ns);
  }
  CHECK(link.bytes_per_s() == doctest::Approx(100'000).epsilon(0.01));
  CHECK(link.window() == doctest::Approx(kMaxRawBytes + 2 * (4000 + 100)).epsilon(0.001));
  link.set_round_trip(0);  // the programs take their turns all the same
  CHECK(link.window() == doctest::Approx(kMaxRawBytes + 2 * 100).epsilon(0.001));
  link.set_round_trip(std::int64_t{1} << 40);
  CHECK(link.window() == LinkRate::kMostBytes);
  for (std::uint64_t frame = 101; frame <= 100 + LinkRate::kSamples; ++frame) {
    now_ns += 1'000'000'000;
    link.sent_frame(frame, 1000, now_ns);
    link.acked(frame, now_ns);
  }
  CHECK(link.bytes_per_s() < 20'000);  // the fast ones are forgotten
}

TEST_CASE("small frames are more under way than large ones, and two always") {
  for (const std::size_t bytes : std::vector<std::size_t>{1'000, 4'000, 16'000, 20'000}) {
    LinkRate link;
    std::uint64_t frames = 0;
    for (; link.has_credit(); ++frames) link.sent_frame(frames + 1, bytes, 1);
    CHECK(frames == std::max(LinkRate::kLeastFrames, (kMaxRawBytes + bytes - 1) / bytes));
    CHECK(link.waits_for_ack());
    link.acked(frames, 2);
    CHECK(link.has_credit());
    CHECK(!link.waits_for_ack());
  }
}

TEST_CASE("packing pays on links slower than speed (1 - 1 / ratio)") {
  PackChoice choice;
  for (int i = 0; i < 200; ++i) choice.saw(1000, 250, 2000);  // 500 MB/s, 4 to 1
  CHECK(choice.ratio() == doctest::Approx(4));
  CHECK(choice.pays(370e6));
  CHECK(!choice.pays(380e6));
  for (int i = 0; i < 200; ++i) choice.saw(1000, 1004, 2000);  // noise
  CHECK(!choice.pays(1000));
  int tried = 0;
  for (int i = 0; i < 320; ++i) tried += choice.pays(1e9) ? 1 : 0;
  CHECK(tried == 10);
}

}  // namespace kerf::stream_test
