// SPDX-License-Identifier: Apache-2.0
#include "controller/device/inverse3/web_socket.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/inverse3.hpp"

namespace kerf::inverse3 {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr std::int64_t kNsPerMs = 1'000'000;

/// One operation of asio at a time, with a deadline. Blocking calls have none: a timeout of the
/// socket does not free them, since asio repeats them for ever.
class Waiter {
 public:
  explicit Waiter(asio::io_context& io) noexcept : io_(io) {}

  /// Runs handlers until `done`, or until the time is over: false then.
  template <class Done>
  bool until(std::int64_t until_ns, const Done& done) {
    for (int late = 0; !done();) {
      if (io_.stopped()) io_.restart();
      const std::int64_t left_ns = until_ns - monotonic_ns();
      if (left_ns <= 0) {
        // What is ready counts, but a peer that never stops does not.
        constexpr int kMostLate = 64;
        if (io_.poll_one() == 0 || ++late == kMostLate) return done();
      } else {
        io_.run_one_for(std::chrono::nanoseconds(left_ns));
      }
    }
    return true;
  }

 private:
  asio::io_context& io_;
};

std::int64_t after_ms(int timeout_ms) noexcept {
  return monotonic_ns() + timeout_ms * kNsPerMs;
}

/// Until when an operation may take, and what ends it before.
struct Limit {
  std::int64_t until_ns;
  const std::atomic<bool>& stop;
};

/// Starts an operation with a handler of one error, and waits for it. Throws std::runtime_error.
template <class Start>
void await(asio::io_context& io, tcp::socket& socket, const Limit& limit, const char* what,
           const Start& start) {
  constexpr std::int64_t kLookNs = 20 * kNsPerMs;
  std::optional<ErrorCode> result;
  start([&](ErrorCode error, auto&&...) { result = error; });
  Waiter waiter(io);
  const auto is_done = [&] { return result.has_value(); };
  bool has_come = false;
  do {
    has_come = waiter.until(std::min(limit.until_ns, monotonic_ns() + kLookNs), is_done);
  } while (!has_come && !limit.stop && monotonic_ns() < limit.until_ns);
  if (!has_come) {
    ErrorCode ignored;
    socket.close(ignored);  // ends the operation, which must not outlive `result`
    while (!result) {
      if (io.stopped()) io.restart();
      io.run_one();
    }
    throw std::runtime_error((limit.stop ? "asked to end before an answer to " : "no answer to ") +
                             std::string(what));
  }
  if (*result) throw std::runtime_error(std::string(what) + ": " + result->message());
}

void connect(asio::io_context& io, tcp::socket& socket, const HostPort& where, const Limit& limit) {
  ErrorCode error;
  tcp::resolver resolver(io);
  const auto found = resolver.resolve(where.host, std::to_string(where.port), error);
  if (error) throw std::runtime_error("no address of " + where.host + ": " + error.message());
  await(io, socket, limit, "the connection",
        [&](auto done) { asio::async_connect(socket, found, done); });
  socket.set_option(tcp::no_delay(true));
}

std::string host_header(const HostPort& where) {
  const bool is_v6 = where.host.find(':') != std::string::npos;
  return (is_v6 ? "[" + where.host + "]" : where.host) + ":" + std::to_string(where.port);
}

}  // namespace

HttpAnswer http_get(const HostPort& where, const std::string& path, int timeout_ms,
                    const std::atomic<bool>& stop) {
  const Limit limit{after_ms(timeout_ms), stop};
  asio::io_context io(1);
  tcp::socket socket(io);
  connect(io, socket, where, limit);
  http::request<http::empty_body> request(http::verb::get, path, 11);
  request.set(http::field::host, host_header(where));
  request.set(http::field::connection, "close");
  await(io, socket, limit, "GET", [&](auto done) { http::async_write(socket, request, done); });
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMostMessageBytes);
  await(io, socket, limit, "GET",
        [&](auto done) { http::async_read(socket, buffer, parser, done); });
  return {parser.get().result_int(), parser.get().body()};
}

struct WebSocket::Connection {
  asio::io_context io{1};
  websocket::stream<tcp::socket, false> stream{io};  // false: no compression
  beast::flat_buffer buffer;
  bool is_reading = false;
  std::optional<ErrorCode> read;  ///< how the last reading ended

  void begin_reading() {
    buffer.clear();
    read.reset();
    is_reading = true;
    stream.async_read(buffer, [this](ErrorCode error, std::size_t) {
      read = error;
      is_reading = false;
    });
  }
};

WebSocket::WebSocket(const HostPort& where, int timeout_ms, const std::atomic<bool>& stop)
    : connection_(std::make_unique<Connection>()) {
  const Limit limit{after_ms(timeout_ms), stop};
  Connection& c = *connection_;
  connect(c.io, c.stream.next_layer(), where, limit);
  c.stream.read_message_max(kMostMessageBytes);
  c.stream.auto_fragment(false);
  c.stream.text(true);
  await(c.io, c.stream.next_layer(), limit, "the upgrade to a WebSocket",
        [&](auto done) { c.stream.async_handshake(host_header(where), "/", done); });
  c.begin_reading();
}

WebSocket::~WebSocket() = default;

bool WebSocket::send(std::string_view text, int timeout_ms) noexcept {
  Connection& c = *connection_;
  try {
    // Shared: after the time is over the operation may end later than this call.
    const auto sent = std::make_shared<std::optional<ErrorCode>>();
    c.stream.async_write(asio::buffer(text.data(), text.size()),
                         [sent](ErrorCode error, std::size_t) { *sent = error; });
    Waiter waiter(c.io);
    if (waiter.until(after_ms(timeout_ms), [&] { return sent->has_value(); })) return !**sent;
    ErrorCode ignored;
    c.stream.next_layer().close(ignored);
    return false;
  } catch (...) {
    return false;
  }
}

WebSocket::Got WebSocket::receive(std::int64_t until_ns) noexcept {
  Connection& c = *connection_;
  try {
    if (!c.is_reading) {
      if (c.read && *c.read) return Got::lost;
      c.begin_reading();
    }
    Waiter waiter(c.io);
    if (!waiter.until(until_ns, [&] { return !c.is_reading; })) return Got::nothing;
    if (*c.read) return Got::lost;
    return c.stream.got_text() ? Got::text : Got::binary;
  } catch (...) {
    return Got::lost;
  }
}

std::string_view WebSocket::message() const noexcept {
  const auto bytes = connection_->buffer.cdata();
  return {static_cast<const char*>(bytes.data()), bytes.size()};
}

void WebSocket::close(int timeout_ms) noexcept {
  Connection& c = *connection_;
  try {
    const std::int64_t until_ns = after_ms(timeout_ms);
    auto closed = std::make_shared<bool>(false);
    c.stream.async_close(websocket::close_code::normal, [closed](ErrorCode) { *closed = true; });
    Waiter waiter(c.io);
    waiter.until(until_ns, [&] { return *closed; });
  } catch (...) {  // the destructor ends the connection
  }
}

}  // namespace kerf::inverse3
