// SPDX-License-Identifier: Apache-2.0
// A server's look at a hostile viewer: each message is a length and that many bytes, and what it
// acknowledges goes to the stream of a viewer that is sent all it has credit for.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <variant>
#include <vector>

#include "bridge/stream/run_snapshot.hpp"
#include "bridge/stream/stream.hpp"
#include "bridge/wire/parse.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"
#include "tests/segment/segment_support.hpp"

namespace {

using namespace kerf;
using namespace kerf::bridge;

/// A run that does not change, and so no input depends on the one before it.
struct NearEnd {
  NearEnd()
      : writer(SegmentWriter::create(kerf::test::spec_of(kerf::test::NoiseVolume({40, 40, 40})))),
        reader(SegmentReader::map(writer.fd())) {
    for (Tick tick = 1; tick < 100; ++tick) {
      writer.begin_tick(tick);
      writer.publish_state({});
      writer.end_tick(tick);
    }
  }
  SegmentWriter writer;
  SegmentReader reader;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const NearEnd near;
  RunSnapshot snapshot(near.reader);
  snapshot.update(1, false);
  Stream stream(snapshot, 0);
  std::int64_t now_ns = 1'000'000;
  std::vector<std::byte> message;
  for (std::span<const std::uint8_t> rest(data, size); !rest.empty();) {
    now_ns += kSlotNs;
    stream.note_changes();
    stream.slot(now_ns, false);
    for (int i = 0; i < 64 && stream.next(now_ns, message); ++i) {
      if (message.size() > kMaxMessageBytes) std::abort();
    }
    const std::size_t length = std::min<std::size_t>(rest[0], rest.size() - 1);
    const auto said = parse_up(std::as_bytes(rest.subspan(1, length)));
    rest = rest.subspan(1 + length);
    if (!said) continue;
    if (const auto* const ack = std::get_if<AckMessage>(&*said)) {
      if (!stream.acked(*ack, now_ns)) return 0;  // such a viewer is closed
    } else if (const auto* const view = std::get_if<ViewMessage>(&*said)) {
      static_cast<void>(is_valid(view_in(*view)));
    } else {
      const auto& wish = std::get<CommandMessage>(*said);
      SegmentCommand command;
      command.kind = static_cast<CommandKind>(wish.kind);
      command.argument = wish.argument;
      static_cast<void>(is_valid(command, {.tools = 3}));
    }
  }
  return 0;
}
