// SPDX-License-Identifier: Apache-2.0
// A server's look at a hostile client of Foxglove's protocol: each line is a message, a binary one
// if it begins with '!'. A tick is published after each, and the client takes all that it can get.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "bridge/foxglove/foxglove_session.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"
#include "shared/text/json.hpp"
#include "tests/segment/segment_support.hpp"

namespace {

using namespace kerf;
using namespace kerf::bridge;

struct NearEnd {
  SegmentWriter writer =
      SegmentWriter::create(kerf::test::spec_of(kerf::test::NoiseVolume({8, 8, 8})));
  SegmentReader reader = SegmentReader::map(writer.fd());
  Tick tick = 0;

  void publish() {
    TickRecord record{};
    record.tick = ++tick;
    writer.begin_tick(tick);
    writer.publish_state(record);
    writer.end_tick(tick);
  }
};

void drain(FoxgloveSession& session, const SegmentReader* run) {
  constexpr int kMost = 1000;  // answers, and the parts of 133 ticks
  constexpr std::size_t kMostBytes = 16 * 1024;
  FoxgloveMessage message;
  int sent = 0;
  while (session.next(1, run, false, message)) {
    if (++sent > kMost || message.bytes.size() > kMostBytes) std::abort();
    if (message.is_text) static_cast<void>(Json::parse(message.bytes));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static NearEnd near;
  FoxgloveSession session("fuzz");
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(line.size() < rest.size() ? line.size() + 1 : line.size());
    const bool is_binary = line.starts_with('!');
    if (line.size() <= kMaxFoxgloveUpBytes)
      session.hear(!is_binary, line.substr(is_binary ? 1 : 0));
    near.publish();
    if (rest.size() % 4 != 0) drain(session, &near.reader);
  }
  drain(session, nullptr);
  return 0;
}
