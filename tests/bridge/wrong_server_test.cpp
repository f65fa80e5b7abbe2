// SPDX-License-Identifier: Apache-2.0
// What `join` reports of servers that are no kerf-bridge serve, or of another build.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridge/wire/messages.hpp"
#include "tests/bridge/join_words.hpp"
#include "tests/bridge/local_port.hpp"
#include "tests/bridge/websocket_bytes.hpp"

namespace kerf::wrong_server_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

/// Answers the first client, with text as it is, or over a WebSocket with a message or with frames,
/// and waits until it goes. The destructor waits for that too.
class WrongServer {
 public:
  enum class Kind { text, message, frames };

  WrongServer(Kind kind, const std::string& answer) {
    listen(port_.fd(), 1);
    thread_ = std::thread([this, kind, answer] {
      const int fd = accept4(port_.fd(), nullptr, nullptr, SOCK_CLOEXEC);
      char part[4096];
      std::string request;
      const auto receive = [&] {
        const ssize_t bytes = recv(fd, part, sizeof part, 0);
        if (bytes > 0) request.append(part, static_cast<std::size_t>(bytes));
        return bytes > 0;
      };
      while (request.find("\r\n\r\n") == std::string::npos && receive()) {
      }
      const std::string bytes =
          kind == Kind::text ? answer
          : kind == Kind::message
              ? websocket_welcome(request) + websocket_frame(2, answer, true, false)
              : websocket_welcome(request) + answer;
      send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      while (receive()) {
      }
      close(fd);
    });
  }
  ~WrongServer() { thread_.join(); }
  WrongServer(const WrongServer&) = delete;
  WrongServer& operator=(const WrongServer&) = delete;
  [[nodiscard]] std::string place() const { return port_.place(); }

 private:
  LocalPort port_;
  std::thread thread_;
};

/// What a join says of it first.
std::string words_of(WrongServer::Kind kind, const std::string& answer) {
  const WrongServer server(kind, answer);
  JoinOptions options;
  options.name = "wrong-server-test";
  options.address = "ws://" + server.place();
  const std::string line = first_words(options);
  CHECK(line.starts_with(server.place() + ": "));
  return line.substr(server.place().size() + 2);
}

std::string words_of_answer(const std::string& status_line) {
  return words_of(WrongServer::Kind::text, status_line + "\r\nContent-Length: 0\r\n\r\n");
}

template <class Head>
std::string words_of_message(const Head& head) {
  const auto bytes = std::as_bytes(std::span(&head, 1));
  return words_of(WrongServer::Kind::message,
                  {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

TEST_SUITE_BEGIN("network");

TEST_CASE("join ends at a server of another kind, and tries again where that may change") {
  const std::string which = "; is it a kerf-bridge serve?";
  CHECK(words_of_answer("HTTP/1.1 200 OK") == "answers 200" + which);
  CHECK(words_of_answer("HTTP/1.1 301 Moved\r\nLocation: https://elsewhere/") ==
        "answers 301" + which);
  CHECK(words_of_answer("HTTP/1.1 403 Forbidden") == "answers 403" + which);
  CHECK(words_of_answer("HTTP/1.1 503 Busy") == "answers 503" + which + "; trying again");
  CHECK(words_of_answer("HTTP/1.1 429 Slowly") == "answers 429" + which + "; trying again");
  CHECK(words_of(WrongServer::Kind::text, "SSH-2.0-OpenSSH_9.2\r\n") ==
        "speaks no HTTP; take the port of a kerf-bridge serve");
  CHECK(words_of(WrongServer::Kind::text, "220 mail ESMTP\r\n") ==
        "speaks no HTTP; take the port of a kerf-bridge serve");
}

TEST_CASE("join ends at a greeting that cannot be, or of another build") {
  HelloMessage hello{};
  hello.magic = kHelloMagic;
  hello.protocol = kProtocol + 1;
  CHECK(words_of_message(hello) == "message: protocol = 2; expected 1");
  hello.protocol = kProtocol;
  CHECK(words_of_message(hello) == "message: volumes = 0; expected 1 to 8");
  CHECK(words_of_message(std::uint32_t{0x12345678}) ==
        "message: of no kind that is known here; use programs of one build");
}

TEST_CASE("join outlives whatever frames a server sends before, in and after its refusal") {
  const auto frame = [](unsigned opcode, const std::string& payload, bool last = true) {
    return websocket_frame(opcode, payload, last, false);
  };
  const std::string ping = frame(9, std::string(125, 'p'));
  const std::string parts =
      frame(2, "KB", false) + frame(0, "A1", false) + frame(9, "") + frame(0, std::string(20, 'x'));
  const std::string full = frame(8, std::string{'\x0f', '\xa4'});  // 4004: too many viewers
  const auto words = [](const std::string& frames) {
    return words_of(WrongServer::Kind::frames, frames);
  };
  const std::string unknown = "message: of no kind that is known here; use programs of one build";
  CHECK(words(parts + parts) == unknown);
  CHECK(words(frame(2, "garbage!garbage") + parts) == unknown);
  CHECK(words(frame(2, "KB", false) + ping + full + parts) ==
        "has as many viewers as it takes; trying again");
  CHECK(words(full + full + ping) == "has as many viewers as it takes; trying again");
  CHECK(words(frame(8, "x") + parts).ends_with("; trying again"));  // a close of one byte
  CHECK(words(frame(9, std::string(126, 'p'))).ends_with("; trying again"));
  CHECK(words(frame(0, "no message before")).ends_with("; trying again"));
  CHECK(words(websocket_frame(2, "masked", true, true)).ends_with("; trying again"));
}

TEST_SUITE_END();

}  // namespace kerf::wrong_server_test
