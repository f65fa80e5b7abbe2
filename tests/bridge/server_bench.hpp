// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "bridge/serve/server.hpp"
#include "shared/segment/server.hpp"
#include "tests/bridge/far_side.hpp"
#include "tests/bridge/raw_client.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::test {

inline const std::string kLook = "look-0123456789abcdef";
inline const std::string kCommand = "command-0123456789abcdef";

/// Sockets of this process's controllers go into a folder of its own.
inline void use_own_sockets() {
  static const RuntimeFolder folder;
}

/// A controller of a small volume that does nothing by itself.
struct TestController {
  explicit TestController(std::uint32_t seed = 1, std::uint32_t arms = 1)
      : volume({50, 41, 33}, seed),
        writer(SegmentWriter::create(spec(arms))),
        server((use_own_sockets(), "bridge-test"), writer, CommandLimits{2, arms}) {
    writer.set_lifecycle(Lifecycle::run);
  }
  [[nodiscard]] SegmentSpec spec(std::size_t arms) const {
    SegmentSpec out = spec_of(volume);
    out.arms = arms;
    return out;
  }
  NoiseVolume volume;
  SegmentWriter writer;
  SegmentServer server;
};

/// A bridge that serves in a thread of its own.
struct TestBridge {
  explicit TestBridge(bridge::ServerSetup setup = {}) : server(prepared(std::move(setup))) {
    thread = std::thread([this] { server.run(stop); });
  }
  ~TestBridge() {
    stop = true;
    thread.join();
  }
  TestBridge(const TestBridge&) = delete;
  TestBridge& operator=(const TestBridge&) = delete;

  static bridge::ServerSetup prepared(bridge::ServerSetup setup) {
    use_own_sockets();
    if (setup.port == bridge::ServerSetup{}.port) setup.port = 0;
    setup.name = "bridge-test";
    setup.tokens.add(kLook, bridge::Right::look);
    setup.tokens.add(kCommand, bridge::Right::command);
    if (setup.wrong_token_ns == bridge::ServerSetup{}.wrong_token_ns) {
      setup.wrong_token_ns = 1'000'000;  // no test waits for it
    }
    return setup;
  }
  [[nodiscard]] std::uint16_t port() const { return server.port(); }

  bridge::Server server;
  std::atomic<bool> stop{false};
  std::thread thread;
};

/// A viewer over a socket.
struct TestViewer {
  explicit TestViewer(std::uint16_t port, const std::string& token = kLook) : client(port) {
    answer = client.upgrade("/bridge?token=" + token);
  }
  /// Takes messages and acknowledges frames until `done`; false where the connection ended before.
  template <class Done>
  bool follow(Done done) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!done() && std::chrono::steady_clock::now() < until) {
      const auto message = client.message();
      if (!message) return false;
      if (far.take(*message) && !client.send_value(far.ack())) return false;
    }
    return done();
  }
  bool until_whole() {
    return follow([this] { return far.passes > 0 && far.is_whole(); });
  }
  RawClient client;
  std::string answer;
  FarSide far;
};

}  // namespace kerf::test
