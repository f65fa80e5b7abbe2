// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "bridge/net/address.hpp"
#include "bridge/wire/messages.hpp"
#include "tests/bridge/server_bench.hpp"

namespace kerf::server_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

bool has(const std::string& answer, const std::string& part) {
  return answer.find(part) != std::string::npos;
}

/// What the server says when it closes this connection.
int code_of(RawClient& client) {
  while (client.message()) {
  }
  return client.close_code;
}

}  // namespace

TEST_SUITE_BEGIN("network");

TEST_CASE("a viewer holds the volume, and what is cut while it looks") {
  TestController controller;
  const TestBridge bridge;
  TestViewer viewer(bridge.port());
  CHECK(has(viewer.answer, "101 "));
  REQUIRE(viewer.until_whole());
  CHECK(viewer.far.volume(0) == controller.volume.density);
  CHECK(viewer.far.hello->head.flags == 0);
  for (Tick tick = 1; tick <= 50; ++tick) {
    cut_and_publish(controller.writer, controller.volume, tick, {{3, 3, 3}, {20, 9, 8}});
  }
  REQUIRE(viewer.follow([&] { return viewer.far.last.tick == 50 && viewer.far.is_whole(); }));
  CHECK(viewer.far.volume(0) == controller.volume.density);
  // Ticks may come after the state of the last one, and in several parts.
  const auto& ticks = viewer.far.ticks;
  CHECK(viewer.follow([&] { return !ticks.empty() && ticks.back().tick == 50; }));
}

TEST_CASE("a bridge waits for its controller, and greets anew where another one starts") {
  const TestBridge bridge;
  TestViewer viewer(bridge.port());
  CHECK(has(viewer.answer, "101 "));
  auto first = std::make_unique<TestController>(1);
  REQUIRE(viewer.until_whole());
  CHECK(viewer.far.volume(0) == first->volume.density);
  first.reset();
  REQUIRE(viewer.follow([&] { return (viewer.far.last.flags & kRunEnded) != 0; }));
  const TestController second(2);
  REQUIRE(viewer.follow([&] {
    return viewer.far.hello->head.session == second.writer.session_id() && viewer.far.passes > 0;
  }));
  CHECK(viewer.far.volume(0) == second.volume.density);
}

TEST_CASE("a page needs a token, once; then a cookie that no script sees") {
  const TestBridge bridge;
  RawClient client(bridge.port());
  CHECK(has(client.ask("/"), "401 "));
  CHECK(has(client.ask("/?token=wrong"), "401 "));
  CHECK(has(client.ask("/?token="), "needs a token"));
  CHECK(has(client.ask("/?token=wrong"), "opened before, or is of another start"));
  const std::string page = client.ask("/?token=" + kLook);
  CHECK(has(page, "200 OK"));
  CHECK(has(page, "Content-Security-Policy: default-src 'none'"));
  CHECK(has(page, "HttpOnly; SameSite=Strict"));
  const std::string name = "kerf" + std::to_string(bridge.port()) + "=";
  const std::string cookie = name + bridge::cookie_for(kLook);
  CHECK(has(page, cookie));
  CHECK(!has(page, kLook));
  CHECK(has(client.ask("/", "Cookie: " + name + kLook + "\r\n"), "401 "));
  CHECK(has(client.ask("/?token=" + bridge::cookie_for(kLook)), "401 "));
  CHECK(has(client.ask("/index.html", "Cookie: other=1; " + cookie + "\r\n"), "200 OK"));
  CHECK(has(client.ask("/", "Cookie: x" + cookie + "\r\n"), "401 "));
  CHECK(has(client.ask("/?token=wrong", "Cookie: " + cookie + "\r\n"), "200 OK"));
  CHECK(has(client.ask("/secret?token=" + kLook), "404 "));
  CHECK(has(client.ask("/../etc/passwd?token=" + kLook), "404 "));
  const std::string head = client.ask("/?token=" + kLook, "", "HEAD");
  CHECK(has(head, "200 OK"));
  CHECK(head.ends_with("\r\n\r\n"));
}

TEST_CASE("the printed address opens the page for one browser, and the next one gets another") {
  const TestController controller;
  ServerSetup setup;
  std::vector<std::string> passes;
  setup.on_page_token = [&passes](const std::string& pass) { passes.push_back(pass); };
  const TestBridge bridge(setup);
  const std::string first = bridge.server.page_token();
  const auto open = [&](const std::string& token, const std::string& head = "",
                        const std::string& method = "GET") {
    return RawClient(bridge.port()).ask("/?token=" + token, head, method);
  };
  const std::string cookie =
      "Cookie: kerf" + std::to_string(bridge.port()) + "=" + bridge::cookie_for(kLook) + "\r\n";
  CHECK(has(open(first, "", "HEAD"), "200 OK"));  // a preview of the link takes nothing
  CHECK(has(open(first, cookie), "200 OK"));      // nor does who has been here
  RawClient viewer(bridge.port());
  viewer.upgrade("/bridge?token=" + first);
  CHECK(code_of(viewer) == static_cast<int>(CloseCode::no_token));
  CHECK(passes.empty());
  const std::string page = open(first);
  CHECK(has(page, "200 OK"));
  CHECK(has(page, bridge::cookie_for(kLook)));
  REQUIRE(passes.size() == 1);
  CHECK(passes[0] != first);
  CHECK(has(open(first), "401 "));
  CHECK(has(open(first, cookie), "200 OK"));
  CHECK(has(open(passes[0]), "200 OK"));
  CHECK(has(open(passes[0]), "401 "));
  CHECK(passes.size() == 2);
}

TEST_CASE("who guesses waits, in the address and in the cookie") {
  ServerSetup setup;
  setup.wrong_token_ns = 150'000'000;
  const TestBridge bridge(setup);
  const std::string cookie =
      "Cookie: kerf" + std::to_string(bridge.port()) + "=guess-0123456789\r\n";
  const auto waits = [&](const std::string& target, const std::string& head) {
    RawClient client(bridge.port());
    const auto began = std::chrono::steady_clock::now();
    CHECK(has(client.ask(target, head), "401 "));
    return std::chrono::steady_clock::now() - began >= std::chrono::milliseconds(150);
  };
  CHECK(waits("/?token=guess-0123456789", ""));
  CHECK(waits("/", cookie));
  CHECK(waits("/bridge", cookie));
  RawClient socket(bridge.port());
  const auto began = std::chrono::steady_clock::now();
  CHECK(has(socket.upgrade("/bridge", cookie), "101 "));
  CHECK(std::chrono::steady_clock::now() - began >= std::chrono::milliseconds(150));
  CHECK(code_of(socket) == static_cast<int>(CloseCode::no_token));
}

TEST_CASE("another method, another host and no HTTP are refused") {
  const TestBridge bridge;
  const auto ask = [&bridge](const std::string& head, const std::string& method = "GET") {
    return RawClient(bridge.port()).ask("/?token=" + kLook, head, method);
  };
  CHECK(has(ask("", "POST"), "405 "));
  CHECK(has(ask("", "DELETE"), "405 "));
  CHECK(has(ask("Host: evil.example\r\n"), "421 "));
  CHECK(has(ask("Host: 127.0.0.1.evil.example:7400\r\n"), "421 "));
  CHECK(has(ask("Host: \r\n"), "421 "));
  CHECK(has(ask("Host: 127.0.0.1:80@evil.example\r\n"), "421 "));
  CHECK(has(ask("Host: 127.0.0.1\r\nHost: evil.example\r\n"), "400 "));
  CHECK(has(ask("Origin: http://127.0.0.1\r\nOrigin: http://evil.example\r\n"), "400 "));
  CHECK(has(ask("Host: localhost:7400\r\n"), "200 OK"));
  CHECK(has(ask("Host: [::1]:7400\r\n"), "200 OK"));
  CHECK(has(ask("Content-Length: 5\r\n"), "400 "));
  CHECK(has(ask("X: " + std::string(9000, 'x') + "\r\n"), "400 "));
  RawClient garbage(bridge.port());
  garbage.send_bytes(std::string("\x16\x03\x01\0\xff\r\n\r\n", 9));
  CHECK(has(garbage.receive(4096), "400 "));
}

TEST_CASE("a page from elsewhere cannot open the socket, and who has no token is told so") {
  const TestController controller;
  const TestBridge bridge;
  const std::string own = "127.0.0.1:" + std::to_string(bridge.port());
  const std::string host = "Host: " + own + "\r\n";
  const auto open = [&](const std::string& origin) {
    return RawClient(bridge.port())
        .upgrade("/bridge?token=" + kLook, host + "Origin: " + origin + "\r\n");
  };
  CHECK(has(open("http://" + own), "101 "));
  CHECK(has(open("https://" + own), "403 "));
  CHECK(has(open("http://evil.example"), "403 "));
  CHECK(has(open("null"), "403 "));
  RawClient wrong(bridge.port());
  CHECK(has(wrong.upgrade("/bridge?token=" + kLook + "x"), "101 "));
  CHECK(code_of(wrong) == static_cast<int>(CloseCode::no_token));
  RawClient none(bridge.port());
  none.upgrade("/bridge");
  CHECK(code_of(none) == static_cast<int>(CloseCode::no_token));
  RawClient cookie(bridge.port());
  cookie.upgrade("/bridge", "Cookie: kerf" + std::to_string(bridge.port()) + "=" +
                                bridge::cookie_for(kLook) + "\r\n");
  CHECK(cookie.message().has_value());
}

TEST_CASE(
    "behind a proxy the address of --public-url is its own, whatever the proxy removes of it") {
  const TestController controller;
  ServerSetup setup;
  setup.public_url = parse_public_url("https://Lab.example/rooms/kerf");
  const TestBridge bridge(setup);
  const auto ask = [&](const std::string& target, const std::string& head) {
    return RawClient(bridge.port()).ask(target, head);
  };
  const std::string kept = "Host: lab.example\r\n", rewritten = "Host: 127.0.0.1:7400\r\n";
  const std::string token = "?token=" + kLook;
  for (const char* path : {"/", "/rooms/kerf/"}) {  // the proxy removes its path, or not
    CHECK(has(ask(path + token, kept), "HttpOnly; SameSite=Strict; Secure\r\n"));
    CHECK(has(ask(path + token, rewritten), "HttpOnly; SameSite=Strict\r\n"));
    CHECK(has(ask(path + std::string("kerf.js") + token, kept), "200 OK"));
    for (const std::string& host : {kept, rewritten}) {
      const auto open = [&](const std::string& origin) {
        return RawClient(bridge.port())
            .upgrade(path + ("bridge" + token), host + "Origin: " + origin + "\r\n");
      };
      CHECK(has(open("https://lab.example"), "101 "));
      CHECK(has(open("https://lab.example:444"), "403 "));
      CHECK(has(open("https://evil.example"), "403 "));
    }
  }
  const std::string moved = ask("/rooms/kerf" + token, kept);
  CHECK(has(moved, "308 "));
  CHECK(has(moved, "\r\nLocation: /rooms/kerf/" + token + "\r\n"));
  CHECK(has(ask("/rooms/kerfuffle" + token, kept), "404 "));
  CHECK(has(ask("/kerf/" + token, kept), "404 "));
  CHECK(has(ask("/" + token, "Host: other.example\r\n"), "421 "));
}

TEST_CASE("what a viewer may not say ends its connection and no other") {
  const TestController controller;
  const TestBridge bridge;
  TestViewer good(bridge.port());
  REQUIRE(good.until_whole());
  const auto ends = [&](auto&& misbehave) {
    TestViewer bad(bridge.port());
    misbehave(bad.client);
    return code_of(bad.client);
  };
  const int not_understood = static_cast<int>(CloseCode::not_understood);
  const std::array<std::byte, 300> zeros{};
  CHECK(ends([&](RawClient& c) { c.send_frame(2, std::span(zeros).first(24)); }) == not_understood);
  CHECK(ends([&](RawClient& c) { c.send_frame(2, {}); }) == not_understood);
  CHECK(ends([&](RawClient& c) { c.send_frame(1, std::span(zeros).first(24)); }) == not_understood);
  CHECK(ends([&](RawClient& c) { c.send_frame(2, zeros); }) == 1009);  // too big
  CHECK(ends([&](RawClient& c) { c.send_frame(3, {}); }) == 1002);     // no such frame
  CHECK(ends([&](RawClient& c) {
          for (int i = 0; i < 400 && c.send_frame(9, {}); ++i) {
          }
        }) == not_understood);
  CHECK(ends([&](RawClient& c) {
          for (int i = 0; i < 400 && c.send_value(AckMessage{kAckMagic, 0, 1, 0}); ++i) {
          }
        }) == not_understood);
  CHECK(ends([&](RawClient& c) {  // a message that never ends
          for (int i = 0; i < 400 && c.send_frame(i == 0 ? 2 : 0, std::span(zeros).first(8), false);
               ++i) {
          }
        }) == 1009);
  CHECK(good.follow([&, frames = good.far.frames] { return good.far.frames > frames + 5; }));
}

TEST_CASE("nothing that a viewer sends after its refusal is looked at") {
  const TestController controller;
  const TestBridge bridge;
  TestViewer good(bridge.port());
  REQUIRE(good.until_whole());
  const auto frame = [](unsigned opcode, std::string_view payload, bool last) {
    return websocket_frame(opcode, payload, last, true);
  };
  // Beast's own close would read the last fragment of a message that its reader has begun.
  const std::string tail = frame(2, "KB", false) + frame(0, "A1", false) + frame(9, "", true) +
                           frame(0, std::string(20, 'x'), true);
  const std::string refused = frame(2, "garbage!garbage", true);
  const std::vector<std::string> ends = {
      refused + tail,
      refused + tail + tail + frame(8, "", true) + tail,
      refused + frame(10, "late", true) + frame(2, "KB", false).substr(0, 3),
      refused + frame(9, std::string(125, 'p'), true) + frame(3, "", true),
      refused + frame(8, "\x0f", true) + refused,
  };
  for (int i = 0; i < 20; ++i) {
    for (const std::string& bytes : ends) {
      TestViewer bad(bridge.port());
      bad.client.send_bytes(bytes);
      CHECK(code_of(bad.client) == static_cast<int>(CloseCode::not_understood));
    }
  }
  // The refusal comes from the bridge's clock, amid a message.
  TestViewer flood(bridge.port());
  std::string many;
  for (int i = 0; i < 150'000; ++i) many += frame(i == 0 ? 2 : 0, "", false);
  flood.client.send_bytes(many + frame(9, "", true) + tail.substr(8));
  CHECK(code_of(flood.client) == static_cast<int>(CloseCode::not_understood));
  TestViewer stranger(bridge.port(), kLook + "x");
  stranger.client.send_bytes(tail + refused);
  CHECK(code_of(stranger.client) == static_cast<int>(CloseCode::no_token));
  CHECK(good.follow([&, frames = good.far.frames] { return good.far.frames > frames + 5; }));
}

TEST_CASE("fragments without payload end a connection long before its silence does") {
  const TestController controller;
  ServerSetup setup;
  setup.silence_ns = 3'600'000'000'000;
  const TestBridge bridge(setup);
  TestViewer good(bridge.port());
  REQUIRE(good.until_whole());
  TestViewer bad(bridge.port());
  bad.client.send_frame(2, {}, false);
  std::string fragment{'\0', static_cast<char>(0x80U)}, many;
  fragment += std::string(4, 0);
  for (int i = 0; i < 1000; ++i) many += fragment;
  for (int i = 0; i < 350; ++i) bad.client.send_bytes(many);  // 2.1 MB
  CHECK(code_of(bad.client) == static_cast<int>(CloseCode::not_understood));
  CHECK(good.follow([&, frames = good.far.frames] { return good.far.frames > frames + 5; }));
}

TEST_CASE("a viewer that acknowledges nothing is dropped, and no other") {
  const TestController controller;
  ServerSetup setup;
  setup.silence_ns = 200'000'000;
  const TestBridge bridge(setup);
  TestViewer good(bridge.port());
  TestViewer silent(bridge.port());
  REQUIRE(good.until_whole());
  good.follow([&, frames = good.far.frames] { return good.far.frames > frames + 30; });
  CHECK(code_of(silent.client) == static_cast<int>(CloseCode::too_slow));
  CHECK(good.follow([&, frames = good.far.frames] { return good.far.frames > frames + 5; }));
}

TEST_CASE("there are as many viewers as are allowed") {
  const TestController controller;
  ServerSetup setup;
  setup.max_viewers = 2;
  const TestBridge bridge(setup);
  auto first = std::make_unique<TestViewer>(bridge.port());
  TestViewer second(bridge.port());
  REQUIRE(first->until_whole());
  REQUIRE(second.until_whole());
  TestViewer third(bridge.port());
  CHECK(code_of(third.client) == static_cast<int>(CloseCode::too_many));
  first.reset();
  for (int i = 0; i < 100; ++i) {  // until it has seen that the first one has gone
    TestViewer fourth(bridge.port());
    if (fourth.until_whole()) return;
  }
  FAIL("no place became free");
}

TEST_CASE("only who may command reaches the controller, and with what is valid") {
  TestController controller;
  const TestBridge bridge;
  const auto say = [&](TestViewer& viewer, CommandKind kind, std::uint32_t argument) {
    const std::size_t before = viewer.far.replies.size();
    viewer.client.send_value(CommandMessage{kCommandMagic, static_cast<std::uint16_t>(kind), 0,
                                            argument, 40 + argument});
    REQUIRE(viewer.follow([&] { return viewer.far.replies.size() > before; }));
    CHECK(viewer.far.replies.back().sequence == 40 + argument);
    return static_cast<ReplyStatus>(viewer.far.replies.back().status);
  };
  TestViewer looker(bridge.port());
  REQUIRE(looker.until_whole());
  CHECK(say(looker, CommandKind::hold, 1) == ReplyStatus::refused);
  CHECK(!controller.server.take_command().has_value());
  TestViewer teacher(bridge.port(), kCommand);
  REQUIRE(teacher.until_whole());
  CHECK(teacher.far.hello->head.flags == kMayCommand);
  CHECK(say(teacher, CommandKind::select_tool, 1) == ReplyStatus::accepted);
  const std::optional<SegmentCommand> taken = controller.server.take_command();
  REQUIRE(taken.has_value());
  CHECK(taken->kind == CommandKind::select_tool);
  CHECK(taken->argument == 1);
  CHECK(say(teacher, CommandKind::select_tool, 2) == ReplyStatus::refused);
  CHECK(say(teacher, static_cast<CommandKind>(99), 0) == ReplyStatus::refused);
  CHECK(say(teacher, CommandKind::undo, 0) == ReplyStatus::refused);  // the local user's alone
  CHECK(!controller.server.take_command().has_value());
}

TEST_CASE("one viewer with the right to command presents its view to all others, here and there") {
  const TestController controller;
  const TestBridge bridge;
  TestViewer looker(bridge.port()), teacher(bridge.port(), kCommand);
  REQUIRE(looker.until_whole());
  REQUIRE(teacher.until_whole());
  const auto hears = [](TestViewer& viewer, Presenter presenter) {
    const std::size_t before = viewer.far.views.size();
    REQUIRE(viewer.follow([&] { return viewer.far.views.size() > before; }));
    CHECK(viewer.far.views.back().presenter == static_cast<std::uint32_t>(presenter));
    return view_in(viewer.far.views.back());
  };
  const auto presents = [](TestViewer& viewer, const PresentedView& view,
                           Presenter who = Presenter::another) {
    viewer.client.send_value(view_message(who, view));
  };
  const PresentedView first{{9, 8, 7}, {1, 2, 3}, {0, 1, 0}},
      second{{5, 8, 7}, {1, 2, 3}, {0, 1, 0}};
  CHECK(looker.far.views.empty());
  presents(looker, second);                              // has no right to
  presents(teacher, {{1, 2, 3}, {1, 2, 3}, {0, 1, 0}});  // is none
  presents(teacher, first);
  CHECK(hears(looker, Presenter::another) == first);
  CHECK(hears(teacher, Presenter::receiver) == first);
  ViewFollower local("bridge-test");
  local.poll();
  CHECK(local.presented());
  CHECK(local.view() == first);
  CHECK_THROWS_AS(ViewPresenter("bridge-test"), SegmentError);
  std::optional<TestViewer> other(std::in_place, bridge.port(), kCommand);
  CHECK(hears(*other, Presenter::another) == first);  // who comes later
  presents(*other, second);
  CHECK(hears(*other, Presenter::another) == first);  // one presents
  presents(teacher, first, Presenter::nobody);
  CHECK(hears(looker, Presenter::nobody) == first);
  presents(*other, second);
  CHECK(hears(looker, Presenter::another) == second);
  other.reset();
  CHECK(hears(looker, Presenter::nobody) == second);
  ViewPresenter window("bridge-test");
  window.show(first);
  CHECK(hears(looker, Presenter::another) == first);
}

TEST_CASE(
    "a command for the second arm reaches the controller as such, for a third one it is refused") {
  TestController controller(1, 2);
  const TestBridge bridge;
  TestViewer teacher(bridge.port(), kCommand);
  REQUIRE(teacher.until_whole());
  CHECK(teacher.far.hello->head.flags == (kMayCommand | kTwoArms));
  for (const auto arm : std::initializer_list<std::uint16_t>{1, 0, 2}) {
    CAPTURE(arm);
    const std::size_t before = teacher.far.replies.size();
    teacher.client.send_value(CommandMessage{
        kCommandMagic, static_cast<std::uint16_t>(CommandKind::select_tool), arm, 1, 40U + arm});
    REQUIRE(teacher.follow([&] { return teacher.far.replies.size() > before; }));
    const std::optional<SegmentCommand> taken = controller.server.take_command();
    REQUIRE(taken.has_value() == (arm < 2));
    if (taken) CHECK(taken->arm == arm);
  }
}

TEST_CASE("connections that say nothing, or one letter a second, end by themselves") {
  const TestController controller;
  ServerSetup setup;
  setup.handshake_ns = 300'000'000;
  const TestBridge bridge(setup);
  TestViewer good(bridge.port());
  REQUIRE(good.until_whole());
  std::vector<std::unique_ptr<RawClient>> crowd;
  for (int i = 0; i < 300; ++i) {
    crowd.push_back(std::make_unique<RawClient>(bridge.port()));
    if (i % 2 == 0) crowd.back()->send_bytes("GET / HT");
  }
  for (int i = 0; i < 12; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    crowd.back()->send_bytes("T");
    CHECK(good.follow([&, frames = good.far.frames] { return good.far.frames > frames; }));
  }
  for (const auto& one : crowd) CHECK(!has(one->receive(4096), "200"));
  CHECK(has(RawClient(bridge.port()).ask("/?token=" + kLook), "200 OK"));
}

TEST_CASE("who holds every place for newcomers and says nothing keeps nobody out") {
  const TestController controller;
  ServerSetup setup;
  setup.handshake_ns = 60'000'000'000;
  const TestBridge bridge(setup);
  std::vector<std::unique_ptr<RawClient>> silent;
  for (std::uint32_t machine = 1; machine <= 5; ++machine) {
    for (int i = 0; i < 40; ++i) {
      silent.push_back(std::make_unique<RawClient>(bridge.port(), machine));
    }
  }
  CHECK(has(RawClient(bridge.port()).ask("/?token=" + kLook), "200 OK"));
  TestViewer late(bridge.port());
  CHECK(late.until_whole());
  CHECK(silent.front()->receive(4096).empty());  // it was closed; the newest is not
  silent.back()->send_bytes("GET /?token=" + kLook + " HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  CHECK(has(silent.back()->receive(4096), "200 OK"));
}

TEST_CASE("who fills every place for newcomers with wrong tokens keeps nobody out") {
  const TestController controller;
  ServerSetup setup;
  setup.wrong_token_ns = 60'000'000'000;
  const TestBridge bridge(setup);
  std::vector<std::unique_ptr<RawClient>> guessing;
  for (std::uint32_t machine = 2; machine <= 6; ++machine) {
    for (int i = 0; i < 32; ++i) {
      guessing.push_back(std::make_unique<RawClient>(bridge.port(), machine));
      guessing.back()->send_bytes("GET /?token=" + kLook + "x HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    }
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  CHECK(has(RawClient(bridge.port()).ask("/?token=" + kLook), "200 OK"));
  TestViewer late(bridge.port());
  CHECK(late.until_whole());
}

TEST_CASE("a port that is taken and an address of nobody are told in one line") {
  const TestBridge bridge;
  ServerSetup setup;
  setup.name = "bridge-test";
  setup.port = bridge.port();
  const auto why = [](const ServerSetup& refused) -> std::string {
    try {
      const Server server(refused);
    } catch (const BridgeError& error) {
      return error.what();
    }
    return "";
  };
  CHECK(has(why(setup), "another program has it"));
  setup.port = 0;
  setup.host = "192.0.2.1";
  CHECK(has(why(setup), "TLS only"));
  setup.host = "0x7f.1";  // as a machine's own name that stands for loopback
  CHECK(has(why(setup), "is 127.0.0.1, which no other machine reaches"));
  setup.tls = new_tls();
  CHECK(has(why(setup), "is 127.0.0.1, which no other machine reaches"));
  setup.host = "192.0.2.1";
  CHECK(has(why(setup), "give an address of this machine"));
  setup.host = "no such host";
  CHECK(has(why(setup), "give an address of this machine"));
}

TEST_SUITE_END();

}  // namespace kerf::server_test
