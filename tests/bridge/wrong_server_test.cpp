// SPDX-License-Identifier: Apache-2.0
// What `join` says of servers that are no kerf-bridge serve, or of another build.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <thread>
#include <utility>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <doctest/doctest.h>

#include "bridge/wire/messages.hpp"
#include "tests/bridge/join_words.hpp"

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using boost::asio::ip::tcp;

/// Answers the first who comes, with text as it is or with a message over a WebSocket, and waits
/// until he goes. Its end waits for that too.
class WrongServer {
 public:
  enum class Kind { text, message };

  WrongServer(Kind kind, std::string answer) : answer_(std::move(answer)) {
    thread_ = std::thread([this, kind] { kind == Kind::text ? say_text() : say_message(); });
  }
  ~WrongServer() { thread_.join(); }
  WrongServer(const WrongServer&) = delete;
  WrongServer& operator=(const WrongServer&) = delete;

  [[nodiscard]] std::string place() const {
    return "127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port());
  }

 private:
  void say_text() {
    tcp::socket socket = acceptor_.accept();
    std::array<char, 4096> heard;
    boost::system::error_code error;
    socket.read_some(asio::buffer(heard), error);
    asio::write(socket, asio::buffer(answer_), error);
    while (!error) socket.read_some(asio::buffer(heard), error);
  }
  void say_message() {
    beast::websocket::stream<tcp::socket> ws(acceptor_.accept());
    boost::system::error_code error;
    ws.accept(error);
    ws.binary(true);
    if (!error) ws.write(asio::buffer(answer_), error);
    for (beast::flat_buffer heard; !error; heard.clear()) ws.read(heard, error);
  }

  asio::io_context io_;
  tcp::acceptor acceptor_{io_, {asio::ip::address_v4::loopback(), 0}};
  std::string answer_;
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
