// SPDX-License-Identifier: Apache-2.0
#include "record/recorder.hpp"

#include "tests/record/record_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

struct Bench {
  Bench()
      : writer(SegmentWriter::create(spec_of(volume))), reader(SegmentReader::map(writer.fd())) {}
  void publish(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) publish_tick(writer, made_up_tick(++tick, 1000));
  }
  TestFolder folder;
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
  CHECK(recorder.lost() == 0);
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
  CHECK(recorder.lost() == 5);
  REQUIRE(recorder.gaps().size() == 1);
  CHECK(recorder.gaps()[0].first_index == 10);
  CHECK(recorder.gaps()[0].count == 5);
  CHECK(log.rows() == 10 + kStateSlots + 3);
}

TEST_CASE("ticks overwritten before the recorder came are not its loss") {
  Bench bench;
  bench.publish(kStateSlots + 7);
  TickLogWriter log(bench.folder / "ticks.npy");
  Recorder recorder(bench.reader, log);
  recorder.poll();
  CHECK(recorder.missed_before_start() == 7);
  CHECK(recorder.lost() == 0);
  CHECK(log.rows() == kStateSlots);
}
