// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/hil/fuse/plain_client.hpp"

namespace kerf::test {

inline constexpr std::uint32_t kTransmit = FW_CDEV_ISO_CONTEXT_TRANSMIT;
inline constexpr std::uint32_t kReceive = FW_CDEV_ISO_CONTEXT_RECEIVE;
inline constexpr std::uint32_t kSkip = FW_CDEV_ISO_SKIP;
inline constexpr std::uint32_t kSixteen = FW_CDEV_ISO_HEADER_LENGTH(16U);
inline constexpr std::uint64_t kControl = 0x1087;

/// Nodes in lock-step: a flush of a received stream lets 8 cycles pass, or a second.
struct Bench {
  explicit Bench(FirewireSettings settings = {}) : mounted(settings), client(mounted.path()) {}

  /// Makes the device stream on channel 2; an open that receives it, started.
  void stream() {
    for (const auto& [offset, value] : {std::pair{0x1000, 1}, {0x1001, 2}, {0x1087, 8}}) {
      client.write_byte(static_cast<std::uint64_t>(offset), static_cast<std::uint8_t>(value));
      static_cast<void>(client.event());
    }
  }
  PlainClient& receiver(std::uint32_t packets = 64, std::uint32_t tags = 15) {
    stream();
    opened = std::make_unique<PlainClient>(mounted.path());
    opened->create(kReceive, 2);
    for (std::uint32_t i = 0; i < packets / 4; ++i) opened->queue({room_for(4)});
    if (packets % 4 != 0) opened->queue({room_for(packets % 4)});
    opened->start(tags);
    return *opened;
  }
  /// Lets `flushes` steps pass: by a stream of its own, on a channel without packets.
  void pass(int flushes) {
    if (!watch) {
      watch = std::make_unique<PlainClient>(mounted.path());
      watch->create(kReceive, 60);
    }
    for (int i = 0; i < flushes; ++i) watch->flush();
  }

  MountedNode mounted;
  PlainClient client;
  std::unique_ptr<PlainClient> opened, watch;
};

[[nodiscard]] inline std::uint32_t rcode_of(const PlainClient& client) {
  return client.event().as<fw_cdev_event_response>().rcode;
}

/// A number at `at` in the order of the bus.
[[nodiscard]] inline std::uint32_t quadlet(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at] << 24 | bytes[at + 1] << 16 | bytes[at + 2] << 8 |
                                    bytes[at + 3]);
}

/// One line of a table of conformance with the kernel's firewire-cdev.
struct Check {
  const char* name;
  std::int64_t expected;
  std::int64_t (*run)(Bench& bench);
  FirewireSettings (*settings)() = [] { return FirewireSettings{}; };
};

/// Each on a node of its own.
inline void run(std::span<const Check> checks) {
  for (const Check& check : checks) {
    const std::string name = check.name;
    CAPTURE(name);
    Bench bench(check.settings());
    REQUIRE(bench.client.fd() >= 0);
    CHECK(check.run(bench) == check.expected);
  }
  MESSAGE(checks.size(), " checks");
}

}  // namespace kerf::test
