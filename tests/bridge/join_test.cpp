// SPDX-License-Identifier: Apache-2.0
// What `join` says where it cannot work: one line, at once.
#include "bridge/join/join.hpp"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <ostream>
#include <sstream>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "bridge/net/address.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/presented_view.hpp"
#include "tests/bridge/join_words.hpp"
#include "tests/bridge/local_port.hpp"
#include "tests/bridge/server_bench.hpp"

namespace kerf::join_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace fs = std::filesystem;

namespace {

/// Passes the bytes of the first client to a port and back, until it freezes: then both ends stay
/// connected and hear nothing.
class Relay {
 public:
  explicit Relay(std::uint16_t to) {
    listen(port_.fd(), 8);
    thread_ = std::thread([this, to] { pass(to); });
  }
  ~Relay() {
    end_ = true;
    thread_.join();
  }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;
  void freeze() { frozen_ = true; }
  [[nodiscard]] std::string place() const { return port_.place(); }

 private:
  void pass(std::uint16_t to) const {
    const OwnedFd client(accept4(port_.fd(), nullptr, nullptr, SOCK_CLOEXEC));
    const OwnedFd server(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(to);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(connect(server.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0);
    pollfd ends[] = {{client.get(), POLLIN, 0}, {server.get(), POLLIN, 0}};
    while (!end_) {
      constexpr int kPauseMs = 10;
      poll(ends, frozen_ ? 0 : 2, kPauseMs);
      for (int i = 0; i < 2 && !frozen_; ++i) {
        char bytes[4096];
        if ((ends[i].revents & POLLIN) == 0) continue;
        const ssize_t count = recv(ends[i].fd, bytes, sizeof bytes, 0);
        if (count <= 0) return;
        send(ends[1 - i].fd, bytes, static_cast<std::size_t>(count), MSG_NOSIGNAL);
      }
    }
  }

  LocalPort port_;
  std::atomic<bool> frozen_{false}, end_{false};
  std::thread thread_;
};

}  // namespace

TEST_SUITE_BEGIN("network");

TEST_CASE("join tells at once what keeps it from a picture, and gives up where it is asked to") {
  const TestBridge bridge;  // without a controller
  const std::string place = "127.0.0.1:" + std::to_string(bridge.port());
  const auto with = [&place](const std::string& token) {
    JoinOptions options;
    options.name = "join-test";
    options.address = "ws://" + place + token;
    return options;
  };
  CHECK(first_words(with("/?token=" + kLook)) == place + ": has no controller yet; trying again");
  CHECK(first_words(with("")) ==
        place + ": asks for a token; take all of the wss:// address it prints, in quotes");
  CHECK(first_words(with("/?token=wrong-0123456789")) ==
        place + ": it does not know the token; take the wss:// address it prints");
  JoinOptions patient = with("/?token=" + kLook);
  patient.wait_s = 0.1;
  CHECK(last_words(patient).ends_with("; gave up after 0.1 s (--wait)"));
  const LocalPort closed;  // taken, and no program listens
  JoinOptions dead = with("");
  dead.address = "ws://" + closed.place();
  CHECK(first_words(dead) == closed.place() + ": Connection refused; trying again");
  dead.wait_s = 0.2;
  CHECK(last_words(dead).ends_with("; gave up after 0.2 s (--wait)"));
}

TEST_CASE("join takes its token from a file that nobody else reads") {
  const TestController controller;
  const TestBridge bridge;
  const TemporaryFolder folder;
  JoinOptions options;
  options.name = "join-test";
  options.address = "ws://127.0.0.1:" + std::to_string(bridge.port());
  options.token_file = folder / "token";
  CHECK(first_words(options).starts_with("--token-file " + options.token_file.string() + ": "));
  std::ofstream(options.token_file) << "# of the lab\n" << kLook << '\n';
  fs::permissions(options.token_file, fs::perms(0644));
  CHECK(first_words(options).find("is open to other users; ") != std::string::npos);
  fs::permissions(options.token_file, fs::perms(0600));
  CHECK(first_words(options).starts_with("joined "));
  options.address += "/?token=" + kLook;
  CHECK(first_words(options).find("the address has a token; ") != std::string::npos);
}

TEST_CASE("a token that a restarted bridge does not know ends the join, also after a picture") {
  const TestController controller;
  ServerSetup setup;
  const std::string token = "only-of-the-first-bridge";
  setup.tokens.add(token, Right::look);
  auto bridge = std::make_unique<TestBridge>(setup);
  JoinOptions options;
  options.name = "join-test";
  const std::string place = "127.0.0.1:" + std::to_string(bridge->port());
  options.address = "ws://" + place + "/?token=" + token;
  bool restarted = false;
  OnWords words([&](const std::string& said) {
    if (restarted || said.find("joined ") == std::string::npos) return;
    restarted = true;
    ServerSetup anew;
    anew.port = bridge->port();
    bridge.reset();
    bridge = std::make_unique<TestBridge>(anew);
  });
  std::ostream said(&words);
  const std::atomic<bool> stop{false};
  std::string end = "no end";
  try {
    run_join(options, stop, said);
  } catch (const BridgeError& error) {
    end = error.what();
  }
  CHECK(restarted);
  CHECK(end == place + ": it does not know the token; take the wss:// address it prints");
}

TEST_CASE("a view that is presented on one machine is presented on the other, in both directions") {
  const TestController controller;
  const TestBridge bridge;
  JoinOptions options;
  options.name = "join-test";
  options.address = "ws://127.0.0.1:" + std::to_string(bridge.port()) + "/?token=" + kCommand;
  std::atomic<bool> stop{false};
  std::ostringstream said;
  std::thread join([&] { run_join(options, stop, said); });
  const PresentedView one{{9, 8, 7}, {1, 2, 3}, {0, 1, 0}}, two{{5, 8, 7}, {1, 2, 3}, {0, 1, 0}};
  const auto reaches = [](const char* name, bool presented, const PresentedView& view) {
    ViewFollower follower(name);
    for (int tries = 0; tries < 2000; ++tries) {
      follower.poll();
      if (follower.presented() == presented && (!presented || follower.view() == view)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  {
    ViewPresenter near("bridge-test");
    near.show(one);
    CHECK(reaches("join-test", true, one));
    near.show(two);
    CHECK(reaches("join-test", true, two));
    CHECK_THROWS_AS(ViewPresenter("join-test"), SegmentError);  // one presents, wherever it is
  }
  CHECK(reaches("join-test", false, two));
  {
    ViewPresenter far("join-test");
    far.show(one);
    CHECK(reaches("bridge-test", true, one));
    far.show(two);
    CHECK(reaches("bridge-test", true, two));
  }
  CHECK(reaches("bridge-test", false, two));
  stop = true;
  join.join();
}

TEST_CASE("between two runs a link that is silent for 2 s is given up too") {
  auto controller = std::make_unique<TestController>();
  const TestBridge bridge;
  Relay relay(bridge.port());
  JoinOptions options;
  options.name = "join-test";
  options.address = "ws://" + relay.place() + "/?token=" + kLook;
  std::atomic<bool> stop{false};
  std::string all;
  OnWords words([&](const std::string& said) {
    all = said;
    if (said.find("joined ") != std::string::npos) controller.reset();
    if (said.find("the run has ended") != std::string::npos) relay.freeze();
    stop = said.find("silent") != std::string::npos || said.find("again in") != std::string::npos;
  });
  std::ostream said(&words);
  CHECK(run_join(options, stop, said) == 0);
  CHECK(all.find("the run has ended; waiting for the next") != std::string::npos);
  CHECK(all.find(": silent for 2 s; trying again") != std::string::npos);
}

TEST_SUITE_END();

}  // namespace kerf::join_test
