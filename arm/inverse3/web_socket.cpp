// SPDX-License-Identifier: Apache-2.0
#include "arm/inverse3/web_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>

#include <boost/asio/buffers_iterator.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <poll.h>
#include <sys/socket.h>

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

namespace {

/// A text message as one masked frame (RFC 6455, 5.2).
std::string frame_of(std::string_view text, std::uint32_t mask) {
  constexpr char kWholeText = '\x81';
  constexpr std::size_t kMask = 0x80, kShort = 126;
  std::string frame{kWholeText};
  if (text.size() < kShort) {
    frame += static_cast<char>(kMask | text.size());
  } else {
    frame += static_cast<char>(kMask | kShort);
    frame += static_cast<char>(text.size() >> 8);
    frame += static_cast<char>(text.size() & 0xff);
  }
  std::array<char, 4> key;
  std::memcpy(key.data(), &mask, key.size());
  frame.append(key.data(), key.size());
  for (std::size_t i = 0; i < text.size(); ++i) frame += static_cast<char>(text[i] ^ key[i % 4]);
  return frame;
}

/// The socket under the stream. Text messages leave by `send`, whole, so that at any moment the
/// next byte is that of a new frame; the stream writes its handshake and control frames. Before the
/// first closing frame of these the last word leaves.
class Line {
 public:
  using next_layer_type = tcp::socket;
  using executor_type = tcp::socket::executor_type;
  explicit Line(asio::io_context& io) : socket_(io) {}

  [[nodiscard]] tcp::socket& next_layer() noexcept { return socket_; }
  [[nodiscard]] const tcp::socket& next_layer() const noexcept { return socket_; }
  [[nodiscard]] executor_type get_executor() noexcept { return socket_.get_executor(); }
  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return socket_.async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    constexpr char kClosing = '\x88';
    const auto first = asio::buffers_begin(buffers);
    if (first != asio::buffers_end(buffers) && *first == kClosing) say_last_word();
    return socket_.async_write_some(buffers, std::forward<Handler>(handler));
  }

  void set_last_word(std::string_view text) {
    last_word_ = text.empty() ? std::string() : frame_of(text, static_cast<std::uint32_t>(mask_()));
  }
  [[nodiscard]] std::string_view last_word() const noexcept { return last_word_; }
  [[nodiscard]] bool has_ended() const noexcept { return has_ended_; }
  void say_last_word() noexcept {
    if (std::exchange(has_ended_, true) || last_word_.empty()) return;
    // One call: a socket that does not take these bytes at once cannot carry them any more.
    static_cast<void>(::send(socket_.native_handle(), last_word_.data(), last_word_.size(),
                             MSG_DONTWAIT | MSG_NOSIGNAL));
  }
  bool send(std::string_view text, std::int64_t until_ns) {
    if (has_ended_) return false;
    const std::string frame = frame_of(text, static_cast<std::uint32_t>(mask_()));
    for (std::string_view left = frame; !left.empty();) {
      const ssize_t size =
          ::send(socket_.native_handle(), left.data(), left.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (size > 0) {
        left.remove_prefix(static_cast<std::size_t>(size));
        continue;
      }
      const std::int64_t left_ms = (until_ns - monotonic_ns()) / kNsPerMs;
      if ((errno != EAGAIN && errno != EINTR) || left_ms <= 0) {
        has_ended_ = true;  // in the midst of a frame
        return false;
      }
      pollfd room{socket_.native_handle(), POLLOUT, 0};
      poll(&room, 1, static_cast<int>(left_ms));
    }
    return true;
  }

 private:
  tcp::socket socket_;
  std::mt19937 mask_{std::random_device{}()};
  std::string last_word_;   ///< as a frame
  bool has_ended_ = false;  ///< no message leaves any more
};

template <class Handler>
void async_teardown(beast::role_type role, Line& line, Handler&& handler) {
  websocket::async_teardown(role, line.next_layer(), std::forward<Handler>(handler));
}

}  // namespace

struct WebSocket::Connection {
  asio::io_context io{1};
  websocket::stream<Line, false> stream{io};  // false: no compression
  beast::flat_buffer buffer;
  bool is_reading = false;
  std::optional<ErrorCode> read;  ///< how the last reading ended

  Line& line() noexcept { return stream.next_layer(); }
  void begin_reading() {
    buffer.clear();
    read.reset();
    is_reading = true;
    stream.async_read(buffer, [this](ErrorCode error, std::size_t) {
      if (error) line().say_last_word();  // the peer has ended its side
      read = error;
      is_reading = false;
    });
  }
};

WebSocket::WebSocket(const HostPort& where, int timeout_ms, const std::atomic<bool>& stop)
    : connection_(std::make_unique<Connection>()) {
  const Limit limit{after_ms(timeout_ms), stop};
  Connection& c = *connection_;
  connect(c.io, c.line().next_layer(), where, limit);
  c.stream.read_message_max(kMostMessageBytes);
  websocket::response_type answer;
  ErrorCode error;  // alone says whether there is an answer: Boost sets a status of its own before
  try {
    await(c.io, c.line().next_layer(), limit, "the upgrade to a WebSocket", [&](auto done) {
      c.stream.async_handshake(answer, host_header(where), "/", [&error, done](ErrorCode result) {
        error = result;
        done(result);
      });
    });
  } catch (const std::runtime_error&) {
    if (error != websocket::error::upgrade_declined) throw;
    throw UpgradeRefused({answer.result_int(), answer.body()});
  }
  c.begin_reading();
}

WebSocket::~WebSocket() {
  say_last_word();
}

void WebSocket::set_last_word(std::string_view text) {
  connection_->line().set_last_word(text);
}

int WebSocket::handle() const noexcept {
  return connection_->line().next_layer().native_handle();
}

std::string_view WebSocket::last_word_bytes() const noexcept {
  return connection_->line().last_word();
}

void WebSocket::say_last_word() noexcept {
  connection_->line().say_last_word();
}

bool WebSocket::send(std::string_view text, int timeout_ms) noexcept {
  try {
    return connection_->line().send(text, after_ms(timeout_ms));
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
    const auto is_over = [&] { return !c.is_reading || c.line().has_ended(); };
    if (!waiter.until(until_ns, is_over)) return Got::nothing;
    if (c.is_reading || *c.read) return Got::lost;
    return c.stream.got_text() ? Got::text : Got::binary;
  } catch (...) {
    return Got::lost;
  }
}

std::string_view WebSocket::message() const noexcept {
  const auto bytes = connection_->buffer.cdata();
  return {static_cast<const char*>(bytes.data()), bytes.size()};
}

void WebSocket::close(Why why, int timeout_ms) noexcept {
  Connection& c = *connection_;
  try {
    const std::int64_t until_ns = after_ms(timeout_ms);
    say_last_word();
    auto closed = std::make_shared<bool>(false);
    c.stream.async_close(static_cast<websocket::close_code>(why),
                         [closed](ErrorCode) { *closed = true; });
    Waiter waiter(c.io);
    waiter.until(until_ns, [&] { return *closed; });
  } catch (...) {  // the destructor ends the connection
  }
}

}  // namespace kerf::inverse3
