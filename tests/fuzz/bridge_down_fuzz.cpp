// SPDX-License-Identifier: Apache-2.0
// A viewer's look at a hostile server: greeting, frames (LZ4 too) and records, alone and applied to
// a segment. The first byte of an input says how the rest is meant.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <stdexcept>
#include <vector>

#include <stdlib.h>

#include "bridge/stream/mirror.hpp"
#include "bridge/wire/parse.hpp"
#include "tests/bridge/sender.hpp"

namespace {

using namespace kerf;
using namespace kerf::bridge;
using kerf::bridge::test::Message;
using kerf::bridge::test::Sender;

constexpr std::size_t kPatchBytes = 6;
constexpr std::uint64_t kMostBytes = 8U << 20;
constexpr std::uint64_t kSession = 7;

/// A run with labels, whose segment is made once.
struct FarEnd {
  FarEnd() : mirror("fuzz", kMostBytes, [](const SegmentCommand&) { return Reply{}; }) {}
  Sender sender{kSession, 9, 100, true};
  Mirror mirror;
};

FarEnd& far_end() {
  static const bool folder = [] {
    char path[] = "/tmp/kerf-fuzz-XXXXXX";
    return mkdtemp(path) != nullptr && setenv("XDG_RUNTIME_DIR", path, 1) == 0;
  }();
  if (!folder) std::abort();
  static FarEnd out;
  return out;
}

template <class Act>
void allowed_to_refuse(Act act) {
  try {
    act();
  } catch (const WireError&) {
  } catch (const StreamOutOfSync&) {
  } catch (const SegmentError&) {
  }
}

/// Each parser with the bytes as they are.
void parse_all(std::span<const std::byte> message) {
  static const ParsedHello good = parse_hello(Sender(kSession, 9, 100, true).greeting());
  std::array<std::byte, kMaxRawBytes> scratch;
  allowed_to_refuse([&] {
    const ParsedHello hello = parse_hello(message);
    static_cast<void>(FrameParser(hello));
  });
  allowed_to_refuse([&] {
    FrameParser parser(good);
    static_cast<void>(parser.parse(message));
    for (const auto& block : parser.blocks()) {
      if (block.id >= parser.plan().count()) std::abort();
    }
  });
  allowed_to_refuse([&] { static_cast<void>(parse_records(message, kSession, scratch)); });
  allowed_to_refuse([&] { static_cast<void>(parse_reply(message)); });
}

/// Places of two bytes, each with four bytes of content.
void patch(Message& message, std::span<const std::byte> patches) {
  for (; patches.size() >= kPatchBytes; patches = patches.subspan(kPatchBytes)) {
    std::uint16_t place = 0;
    std::memcpy(&place, patches.data(), sizeof place);
    std::memcpy(&message[place % (message.size() - 4)], patches.data() + 2, 4);
  }
}

/// One spoilt message amid good ones; after it, whatever it was, a good run must still come
/// through.
void apply(std::uint8_t which, std::span<const std::byte> rest) {
  FarEnd& far = far_end();
  Sender& sender = far.sender;
  sender.packed = (which & 8) != 0;
  const auto greet = [&](bool spoilt) {
    Message hello = sender.greeting();
    if (spoilt) patch(hello, rest);
    far.mirror.hello(hello, 1000, 0);
  };
  allowed_to_refuse([&] {
    greet((which & 7) == 0);
    auto pass = sender.whole_pass(3, (which & 16) != 0 ? kRunEnded : 0);
    if ((which & 7) == 1) patch(pass[0], rest);
    for (const Message& message : pass) far.mirror.frame(message, 1000, 0);
    Message records = sender.record(5, 7);
    if ((which & 7) == 2) patch(records, rest);
    far.mirror.records(records);
    if ((which & 7) == 3) {  // an LZ4 block for what a frame of two blocks holds
      Message frame = sender.frame_of({{1, 20}, {2, 20}}, 9, kLastOfPass);
      FrameHead head;
      std::memcpy(&head, frame.data(), sizeof head);
      frame.resize(frame.size() - head.payload_bytes);
      frame.insert(frame.end(), rest.begin(), rest.end());
      head.flags |= kPacked;
      head.payload_bytes = static_cast<std::uint32_t>(rest.size());
      std::memcpy(frame.data(), &head, sizeof head);
      far.mirror.frame(frame, 1000, 0);
    }
  });
  greet(false);
  for (const Message& message : sender.whole_pass(4)) far.mirror.frame(message, 1000, 0);
  if (!far.mirror.joined()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto rest = std::as_bytes(std::span(data, size)).subspan(1);
  if (data[0] >= 128) {
    parse_all(rest);
  } else {
    apply(data[0], rest);
  }
  return 0;
}
