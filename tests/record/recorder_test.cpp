// SPDX-License-Identifier: Apache-2.0
#include "record/recorder.hpp"

#include "tests/record/record_support.hpp"

namespace kerf::recorder_test {

using namespace kerf::test;

namespace {

struct Bench {
  Bench()
      : writer(SegmentWriter::create(spec_of(volume))), reader(SegmentReader::map(writer.fd())) {}
  void publish(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) publish_tick(writer, made_up_tick(++tick, 1000));
  }
  RuntimeFolder folder;
  NoiseVolume volume{{8, 8, 8}};
  SegmentWriter writer;
  SegmentReader reader;
  Tick tick = 0;
};

}  // namespace

TEST_CASE("a recorder that keeps up has every tick once and in order") {
  Bench bench;
  TickLogWriter log(bench.folder / "ticks.npy");
  Recorder recorder(bench.reader, log);
  for (std::uint64_t burst = 0; burst < 200; ++burst) {
    bench.publish(burst);
    CHECK(recorder.poll() == burst);
  }
  recorder.drain();
  log.sync();
  CHECK(recorder.losses().lost == 0);
  CHECK(recorder.largest_lag() == 199);
  Tick expected = 1;
  TickLogReader(bench.folder / "ticks.npy").for_each([&](const TickRecord& record) {
    CHECK(record.tick == expected++);
  });
  CHECK(expected == bench.tick + 1);
}

TEST_CASE("a recorder that slept counts the overwritten ticks exactly") {
  Bench bench;
  TickLogWriter log(bench.folder / "ticks.npy");
  Recorder recorder(bench.reader, log);
  bench.publish(10);
  recorder.poll();
  bench.publish(kStateSlots + 5);
  recorder.poll();
  bench.publish(3);
  recorder.poll();
  CHECK(recorder.losses().lost == 5);
  REQUIRE(recorder.losses().gaps.size() == 1);
  CHECK(recorder.losses().gaps[0].first_index == 10);
  CHECK(recorder.losses().gaps[0].count == 5);
  CHECK(log.rows() == 10 + kStateSlots + 3);
}

TEST_CASE("ticks overwritten before the recorder came are not its loss") {
  Bench bench;
  bench.publish(kStateSlots + 7);
  TickLogWriter log(bench.folder / "ticks.npy");
  Recorder recorder(bench.reader, log);
  recorder.poll();
  CHECK(recorder.losses().missed_before_start == 7);
  CHECK(recorder.losses().lost == 0);
  CHECK(log.rows() == kStateSlots);
}

TEST_CASE("of another machine's run a recorder takes what came, and counts what did not as lost") {
  ReplicaWriter mirror = ReplicaWriter::create(mirror_spec());
  const auto come = [&mirror](std::uint64_t index) {
    mirror.put_record(index, made_up_tick(index + 1, 1000));
  };
  come(2000);  // joined long after the start, though the ring has room for more
  come(2001);
  const SegmentReader reader = SegmentReader::map(mirror.fd());
  const RuntimeFolder folder;
  TickLogWriter log(folder / "ticks.npy");
  Recorder recorder(reader, log);
  CHECK(recorder.losses().missed_before_start == 2000);
  CHECK(recorder.poll() == 2);
  come(2002);
  come(2005);
  CHECK(recorder.poll() == 2);
  CHECK(recorder.losses().lost == 2);
  REQUIRE(recorder.losses().gaps.size() == 1);
  CHECK(recorder.losses().gaps[0].first_index == 2003);
  CHECK(recorder.losses().gaps[0].count == 2);
}

}  // namespace kerf::recorder_test
