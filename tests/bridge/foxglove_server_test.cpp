// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "tests/bridge/server_bench.hpp"

namespace kerf::foxglove_server_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

const std::string kOffer = "Sec-WebSocket-Protocol: foxglove.sdk.v1, foxglove.websocket.v1\r\n";
const std::string kPlace = "/foxglove?token=" + kLook;

bool has(const std::string& answer, const std::string& part) {
  return answer.find(part) != std::string::npos;
}

bool say(RawClient& client, std::string_view text) {
  return client.send_frame(1, std::as_bytes(std::span(text)));
}

constexpr const char* kSubscribe = R"({"op":"subscribe","subscriptions":[{"id":5,"channelId":1}]})";

/// The next message, as text.
std::string next(RawClient& client) {
  const auto message = client.message(true);
  if (!message) return {};
  return {reinterpret_cast<const char*>(message->data()), message->size()};
}

/// A client that has been greeted.
std::unique_ptr<RawClient> opened(std::uint16_t port) {
  auto client = std::make_unique<RawClient>(port);
  if (!has(client->upgrade(kPlace, kOffer), "101 ")) return nullptr;
  const bool greeted = has(next(*client), "serverInfo") && has(next(*client), "advertise");
  return greeted ? std::move(client) : nullptr;
}

void publish(TestController& controller, Tick from, Tick to) {
  for (Tick tick = from; tick <= to; ++tick) {
    cut_and_publish(controller.writer, controller.volume, tick, {{3, 3, 3}, {4, 4, 4}});
  }
}

}  // namespace

TEST_SUITE_BEGIN("network");

TEST_CASE("Foxglove's socket needs a token in its address, and no origin or cookie counts") {
  const TestBridge bridge;
  const auto answer = [&bridge](const std::string& target, const std::string& head) {
    return RawClient(bridge.port()).upgrade(target, head);
  };
  CHECK(has(answer("/foxglove", kOffer), "401 "));
  CHECK(has(answer("/foxglove", kOffer), "Foxglove needs a token"));
  CHECK(has(answer("/foxglove?token=wrong", kOffer), "401 "));
  CHECK(has(answer("/foxglove?token=" + bridge.server.page_token(), kOffer), "401 "));
  const std::string page = RawClient(bridge.port()).ask("/?token=" + kLook);
  const std::size_t at = page.find("Set-Cookie: ") + 12;
  const std::string cookie = "Cookie: " + page.substr(at, page.find(';', at) - at) + "\r\n";
  CHECK(has(answer("/bridge", cookie), "101 "));
  CHECK(has(answer("/foxglove", cookie + kOffer), "401 "));
  CHECK(has(answer(kPlace, kOffer + "Origin: https://foxglove.example\r\n"), "101 "));
  CHECK(has(answer(kPlace, kOffer + "Host: elsewhere.example\r\n"), "421 "));
  CHECK(has(RawClient(bridge.port()).ask(kPlace), "404 "));
}

TEST_CASE("Foxglove's sub-protocol is agreed on by the client's order") {
  const TestBridge bridge;
  const auto answer = [&bridge](const std::string& head) {
    return RawClient(bridge.port()).upgrade(kPlace, head);
  };
  const std::string name = "Sec-WebSocket-Protocol: ";
  CHECK(has(answer(kOffer), name + "foxglove.sdk.v1\r\n"));
  CHECK(has(answer(name + "foxglove.websocket.v1,foxglove.sdk.v1\r\n"),
            name + "foxglove.websocket.v1\r\n"));
  CHECK(
      has(answer(name + "chat\r\n" + name + "foxglove.sdk.v1\r\n"), name + "foxglove.sdk.v1\r\n"));
  CHECK(has(answer(""), "400 "));
  CHECK(has(answer(name + "chat\r\n"), "has to offer foxglove.sdk.v1"));
  CHECK_FALSE(has(RawClient(bridge.port()).upgrade("/bridge?token=" + kLook, kOffer), name));
}

TEST_CASE("a Foxglove client follows the ticks beside a viewer, and its end changes nothing") {
  TestController controller;
  const TestBridge bridge;
  TestViewer viewer(bridge.port());
  REQUIRE(viewer.until_whole());
  auto stays = opened(bridge.port()), leaves = opened(bridge.port());
  REQUIRE((stays && leaves));
  REQUIRE((say(*stays, kSubscribe) && say(*leaves, kSubscribe)));
  // Once a wrong message is answered, what was said before it is in force.
  for (RawClient* client : {stays.get(), leaves.get()}) {
    say(*client, "{");
    CHECK(has(next(*client), "no JSON"));
  }
  publish(controller, 1, 50);
  leaves.reset();
  publish(controller, 51, 100);
  for (Tick tick = 1; tick <= 100; ++tick) {
    CAPTURE(tick);
    CHECK(next(*stays)[0] == 2);
    const std::string message = next(*stays);
    REQUIRE(message.size() > 13 + 4 + 16);
    CHECK(message[0] == 1);
    CHECK(message[1] == 5);
    CHECK(static_cast<unsigned char>(message[13 + 4 + 8]) == tick);  // its second column
  }
  CHECK(viewer.follow([&] { return viewer.far.last.tick == 100 && viewer.far.is_whole(); }));
  CHECK(viewer.far.volume(0) == controller.volume.density);
}

TEST_CASE("Foxglove clients count as viewers") {
  ServerSetup setup;
  setup.max_viewers = 1;
  const TestController controller;
  const TestBridge bridge(setup);
  const auto first = opened(bridge.port());
  REQUIRE(first);
  RawClient second(bridge.port());
  second.upgrade(kPlace, kOffer);
  CHECK_FALSE(second.message(true));
  CHECK(second.close_code == static_cast<int>(CloseCode::too_many));
}

TEST_CASE("a Foxglove client that takes nothing is dropped, and the others go on") {
  ServerSetup setup;
  setup.silence_ns = 300'000'000;
  TestController controller;
  const TestBridge bridge(setup);
  const auto stopped = opened(bridge.port()), good = opened(bridge.port());
  REQUIRE((stopped && good));
  say(*stopped, kSubscribe);
  say(*good, kSubscribe);
  std::atomic<bool> done{false}, ended{false};
  std::thread reads([&] {
    while (!done && !ended) ended = next(*good).empty();
  });
  // Several MB, more than the sockets hold.
  bool dropped = false;
  Tick tick = 0;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!dropped && std::chrono::steady_clock::now() < until) {
    publish(controller, tick + 1, tick + 100);
    tick += 100;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (tick % 5000 == 0)
      dropped = !say(*stopped, "{");  // rarely: who says much is closed for that
  }
  done = true;
  publish(controller, tick + 1, tick + 100);  // so that its wait ends
  reads.join();
  CHECK(dropped);
  CHECK_FALSE(ended);
}

TEST_CASE("a Foxglove client that sends too much or too often is closed") {
  const TestController controller;
  const TestBridge bridge;
  const auto large = opened(bridge.port()), often = opened(bridge.port());
  REQUIRE((large && often));
  const std::string text(5000, ' ');
  CHECK(say(*large, text));
  while (large->message(true)) {
  }
  CHECK(large->close_code == 1009);
  for (int i = 0; i < 1000; ++i) {
    if (!say(*often, "{")) break;
  }
  while (often->message(true)) {
  }
  CHECK(often->close_code == static_cast<int>(CloseCode::not_understood));
  CHECK(opened(bridge.port()));
}

TEST_SUITE_END();

}  // namespace kerf::foxglove_server_test
