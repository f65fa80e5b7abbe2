// SPDX-License-Identifier: Apache-2.0
// Either end of the real WebSocket, over loopback, against a peer that sends any frames: messages
// in fragments, control frames between them, bytes after a refusal or a close, in any number of
// writes. With KERF_FUZZ_JOIN the end under test is join, else serve. Both are not instrumented:
// what chance and the corpus do not find, it does not look for.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ostream>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <sys/socket.h>
#include <unistd.h>

#include "bridge/wire/messages.hpp"
#include "tests/bridge/join_words.hpp"
#include "tests/bridge/local_port.hpp"
#include "tests/bridge/server_bench.hpp"
#include "tests/bridge/websocket_bytes.hpp"

namespace {

using namespace kerf;
using namespace kerf::bridge;
using namespace kerf::test;

/// The writes of an input. A frame is a byte with its opcode, whether it is the last (16), and what
/// is to be done (the two highest bits), a length, and so many bytes.
std::vector<std::string> writes_of(std::span<const std::uint8_t> rest, bool masked) {
  std::vector<std::string> writes(1);
  while (rest.size() >= 2) {
    const unsigned head = rest[0], action = head >> 6;
    const std::size_t length = std::min<std::size_t>(rest[1], rest.size() - 2);
    const std::string payload(reinterpret_cast<const char*>(rest.data() + 2), length);
    rest = rest.subspan(2 + length);
    // A known opcode in most frames, else nearly all would end the connection.
    const unsigned known[] = {0, 0, 1, 2, 2, 8, 9, 10};
    const unsigned opcode = (head & 8U) != 0 && (head & 32U) != 0 ? head & 15U : known[head & 7U];
    writes.back() +=
        action == 2 ? payload : websocket_frame(opcode, payload, (head & 16U) != 0, masked);
    if (action == 1) writes.emplace_back();
    if (action == 3) {
      const AckMessage ack{kAckMagic, 0, 1, 0};
      const std::string_view bytes(reinterpret_cast<const char*>(&ack), sizeof ack);
      writes.back() += websocket_frame(2, bytes, true, masked);
    }
  }
  return writes;
}

#ifdef KERF_FUZZ_JOIN
void fuzz(unsigned, std::span<const std::uint8_t> data) {
  use_own_sockets();
  LocalPort port;
  listen(port.fd(), 4);
  std::atomic<bool> stop{false};
  std::thread server([&] {
    const int fd = accept4(port.fd(), nullptr, nullptr, SOCK_CLOEXEC);
    std::string request;
    char part[4096];
    for (ssize_t bytes = 1; bytes > 0 && request.find("\r\n\r\n") == std::string::npos;) {
      bytes = recv(fd, part, sizeof part, 0);
      if (bytes > 0) request.append(part, static_cast<std::size_t>(bytes));
    }
    std::string welcome = websocket_welcome(request);
    for (const std::string& bytes : writes_of(data, false)) {
      const std::string all = welcome + bytes;
      send(fd, all.data(), all.size(), MSG_NOSIGNAL);
      welcome.clear();
    }
    shutdown(fd, SHUT_WR);
    while (recv(fd, part, sizeof part, 0) > 0) {
    }
    close(fd);
    stop = true;
  });
  OnWords words([](const std::string&) {});
  std::ostream said(&words);
  JoinOptions options;
  options.name = "fuzz-join";
  options.address = "ws://" + port.place();
  try {
    run_join(options, stop, said);
  } catch (const BridgeError&) {
  }
  server.join();
}
#else
void fuzz(unsigned visitor, std::span<const std::uint8_t> data) {
  static const TestController controller;
  static const TestBridge bridge;
  static unsigned inputs = 0;
  const std::string token = (visitor & 7U) == 7 ? kLook + "x" : kLook;
  RawClient hostile(bridge.port());
  if ((visitor & 24U) == 24) {
    hostile.upgrade("/foxglove?token=" + token, "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n");
  } else {
    hostile.upgrade("/bridge?token=" + token);
  }
  for (const std::string& bytes : writes_of(data, true)) {
    if (!hostile.send_bytes(bytes)) break;
  }
  hostile.end_sending();
  while (!hostile.receive(1 << 16).empty()) {
  }
  if (++inputs % 64 != 0) return;
  TestViewer good(bridge.port());
  if (good.until_whole()) return;
  std::fprintf(stderr, "a sound viewer got: %s\nand close code %d\n", good.answer.c_str(),
               good.client.close_code);
  std::abort();
}
#endif

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) fuzz(data[0], {data + 1, size - 1});
  return 0;
}
