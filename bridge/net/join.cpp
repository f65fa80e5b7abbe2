// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/join.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <ostream>
#include <span>
#include <type_traits>
#include <utility>  // before the coroutines of Boost 1.74, which need it

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>

#include "bridge/mirror/command_desk.hpp"
#include "bridge/mirror/mirror.hpp"
#include "bridge/net/address.hpp"
#include "bridge/net/bridge_error.hpp"
#include "bridge/net/link_figures.hpp"
#include "bridge/net/server_trust.hpp"
#include "shared/numeric/histogram.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/format.hpp"

namespace kerf::bridge {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace ssl = asio::ssl;
namespace websocket = beast::websocket;
using asio::use_awaitable;
using asio::ip::tcp;
using Plain = websocket::stream<beast::tcp_stream>;
using Secure = websocket::stream<beast::ssl_stream<beast::tcp_stream>>;
using namespace std::chrono_literals;

constexpr std::int64_t kSilenceNs = 2 * kNsPerSecond;      // of a run: it has a sign of life, 60 Hz
constexpr std::int64_t kLongWaitNs = 10 * kNsPerSecond;    // for a run: the server has none
constexpr auto kConnectPatience = 1500ms;                  // a lost SYN comes again after 1 s
constexpr auto kGreetingPatience = 10s;                    // TLS and HTTP over a slow link
constexpr auto kFirstPause = 50ms, kLongestPause = 800ms;  // between two tries
constexpr auto kWatchPeriod = 20ms;

/// Ends a connection that cannot get better by trying again, unless it once worked.
struct Hopeless : BridgeError {
  using BridgeError::BridgeError;
};

class Joiner {
 public:
  Joiner(const JoinOptions& options, const std::atomic<bool>& stop, std::ostream& out)
      : address_(parse_address(options.address)),
        name_(options.name),
        trust_(address_.host, options.ca, options.fingerprint),
        stop_(stop),
        out_(out),
        mirror_(options.name, options.most_mib << 20,
                [this](const Command& command) { return desk_.ask(command); }) {
    if (address_.secure) trust_.apply_to(tls_.native_handle());
  }

  int run() {
    std::exception_ptr failure;
    const auto ended = [&](const std::exception_ptr& error) {
      failure = error;
      io_.stop();
    };
    asio::co_spawn(io_, stay_joined(), ended);
    asio::co_spawn(io_, watch(), ended);
    io_.run();
    desk_.set_link(CommandDesk::Link::down);
    if (failure) std::rethrow_exception(failure);
    if (age_.count() != 0) {
      say(format(
          "age of the picture p50 %.1f, p99 %.1f, max %.1f ms; %llu states, joined %u times, "
          "%llu packets waited for a lost one",
          age_.percentile_us(0.5) / 1e3, age_.percentile_us(0.99) / 1e3, age_.max_us() / 1e3,
          static_cast<unsigned long long>(mirror_.passes()), joins_,
          static_cast<unsigned long long>(waited_)));
    }
    return 0;
  }

 private:
  void say(const std::string& line) { out_ << "kerf-bridge: " << line << std::endl; }

  /// A reason is told once, not with every try.
  void lost(const std::string& reason) {
    if (std::exchange(last_reason_, reason) != reason) {
      say(place() + reason + "; trying again");
    }
  }

  asio::awaitable<void> stay_joined() {
    for (auto pause = kFirstPause; !stop_; pause = std::min(pause * 2, kLongestPause)) {
      const unsigned joins_before = joins_;
      since_ns_ = monotonic_ns();
      try {
        if (address_.secure) {
          co_await follow(Secure(io_, tls_));
        } else {
          co_await follow(Plain(io_));
        }
      } catch (const Hopeless& error) {
        if (joins_ == 0) throw BridgeError(place() + error.what());
        lost(error.what());
      } catch (const SegmentError&) {
        if (joins_ == 0) throw;
        lost(last_error());
      } catch (const std::exception&) {
        lost(why_closed_.empty() ? last_error() : why_closed_);
      }
      desk_.set_link(CommandDesk::Link::down);
      if (joins_ != joins_before) pause = kFirstPause;
      asio::steady_timer timer(io_, pause);
      co_await timer.async_wait(use_awaitable);
    }
  }

  /// One connection, from its first packet to whatever ends it, which it throws.
  template <class Stream>
  asio::awaitable<void> follow(Stream stream) {
    why_closed_.clear();
    greeted_ = false;
    waited_here_ = 0;
    heard_ns_ = monotonic_ns();
    beast::tcp_stream& link = beast::get_lowest_layer(stream);
    struct Watched {  // the watch may close it while it lives
      Joiner& joiner;
      explicit Watched(Joiner& j, beast::tcp_stream& watched) : joiner(j) { j.link_ = &watched; }
      ~Watched() { joiner.link_ = nullptr; }
    } const watched(*this, link);
    co_await connect(stream, link);
    beast::flat_buffer in;
    for (;;) {
      in.clear();
      boost::system::error_code error;
      co_await stream.async_read(in, asio::redirect_error(use_awaitable, error));
      // A reason that came counts, however the connection ended after it.
      const unsigned reason = stream.reason().code;
      if (error && reason != websocket::close_code::none) throw_closed(reason);
      if (error) throw boost::system::system_error(error);
      heard_ns_ = monotonic_ns();
      const std::span message(static_cast<const std::byte*>(in.data().data()), in.size());
      if (const auto ack = take(message, link.socket().native_handle())) {
        co_await stream.async_write(asio::buffer(&*ack, sizeof *ack), use_awaitable);
      }
      if (const auto command = desk_.take()) {
        co_await stream.async_write(asio::buffer(&*command, sizeof *command), use_awaitable);
      }
    }
  }

  template <class Stream>
  asio::awaitable<void> connect(Stream& stream, beast::tcp_stream& link) {
    tcp::resolver resolver(io_);
    const auto places =
        co_await resolver.async_resolve(address_.host, address_.port, use_awaitable);
    link.expires_after(kConnectPatience);
    co_await link.async_connect(places, use_awaitable);
    link.socket().set_option(tcp::no_delay(true));
    link.expires_after(kGreetingPatience);
    if constexpr (std::is_same_v<Stream, Secure>) {
      trust_.begin(stream.next_layer().native_handle());
      boost::system::error_code error;
      co_await stream.next_layer().async_handshake(ssl::stream_base::client,
                                                   asio::redirect_error(use_awaitable, error));
      if (error) throw_no_trust(error);
    }
    stream.read_message_max(kMaxMessageBytes);
    const std::string target =
        kBridgePath + (address_.token.empty() ? std::string() : "?token=" + address_.token);
    websocket::response_type response;
    boost::system::error_code error;
    co_await stream.async_handshake(response, address_.host_and_port(), target,
                                    asio::redirect_error(use_awaitable, error));
    if (error) throw_no_welcome(error, response.result_int());
    link.expires_never();
    stream.binary(true);
  }

  [[noreturn]] void throw_no_trust(const boost::system::error_code& error) const {
    if (const std::string reason = trust_.refusal(); !reason.empty()) {
      throw Hopeless(reason);
    }
    if (error.category() == asio::error::get_ssl_category()) {
      throw Hopeless("no TLS 1.3 there; is it a kerf-bridge serve, and off loopback?");
    }
    throw boost::system::system_error(error);
  }

  [[noreturn]] void throw_no_welcome(const boost::system::error_code& error,
                                     unsigned status) const {
    if (error != websocket::error::upgrade_declined) throw boost::system::system_error(error);
    if (status == 400) throw Hopeless("takes no unencrypted viewers; take wss://");
    if (status == 404) throw Hopeless("no kerf-bridge serve answers; take its port");
    if (status == 421) {
      throw Hopeless("does not know itself by this name; take the address it prints");
    }
    throw BridgeError("answers " + std::to_string(status) + "; is it a kerf-bridge serve?");
  }

  [[noreturn]] void throw_closed(unsigned code) const {
    switch (static_cast<CloseCode>(code)) {
      case CloseCode::no_token:
        throw Hopeless("the token is not one of its own; take the address it prints");
      case CloseCode::too_many:
        throw BridgeError("has as many viewers as it takes");
      case CloseCode::too_slow:
        throw BridgeError("had no answer from here for 5 s");
      case CloseCode::not_understood:
        throw BridgeError("does not understand this program; use programs of one build");
    }
    throw BridgeError("closed the connection");
  }

  [[nodiscard]] std::string place() const { return address_.host_and_port() + ": "; }

  /// One message of the server; what is to be answered.
  std::optional<AckMessage> take(std::span<const std::byte> message, int socket) {
    const LinkFigures figures = link_figures(socket);
    switch (magic_of(message)) {
      case kHelloMagic: {
        const HelloMessage& hello = mirror_.hello(message, heard_ns_, figures.least_round_trip_ns);
        desk_.set_link((hello.flags & kMayCommand) != 0 ? CommandDesk::Link::open
                                                        : CommandDesk::Link::read_only);
        greeted_ = true;
        return std::nullopt;
      }
      case kFrameMagic: {
        const bool joined = mirror_.joined(), ended = mirror_.ended();
        const AckMessage ack = mirror_.frame(message, heard_ns_, figures.least_round_trip_ns);
        if (!joined && mirror_.joined()) tell_joined();
        if (!ended && mirror_.ended()) say("the run has ended; waiting for the next");
        waited_ += figures.out_of_order - std::exchange(waited_here_, figures.out_of_order);
        return ack;
      }
      case kRecordsMagic:
        mirror_.records(message);
        return std::nullopt;
      case kReplyMagic:
        desk_.answer(parse_reply(message));
        return std::nullopt;
      default:
        throw WireError("message: of no kind that is known here; use programs of one build");
    }
  }

  void tell_joined() {
    const double seconds = static_cast<double>(monotonic_ns() - since_ns_) / kNsPerSecond;
    say(format("%s %s as %s in %.2f s", joins_++ == 0 ? "joined" : "joined again",
               address_.host_and_port().c_str(), name_.c_str(), seconds));
    last_reason_.clear();
  }

  /// Samples the age, and ends a connection that is silent or that nobody wants any more.
  asio::awaitable<void> watch() {
    asio::steady_timer timer(io_);
    for (;;) {
      timer.expires_after(kWatchPeriod);
      co_await timer.async_wait(use_awaitable);
      const std::int64_t now_ns = monotonic_ns();
      if (stop_) {
        io_.stop();
        co_return;
      }
      const bool running = greeted_ && !mirror_.ended();
      if (running && mirror_.joined()) age_.record(now_ns - mirror_.taken_ns());
      if (link_ == nullptr || now_ns - heard_ns_ < (running ? kSilenceNs : kLongWaitNs)) continue;
      why_closed_ = "silent for " + std::to_string((now_ns - heard_ns_) / kNsPerSecond) + " s";
      boost::system::error_code ignored;
      link_->socket().close(ignored);
    }
  }

  [[nodiscard]] static std::string last_error() {
    try {
      throw;
    } catch (const boost::system::system_error& error) {
      return error.code().message();
    } catch (const std::exception& error) {
      return error.what();
    }
  }

  asio::io_context io_{1};
  ssl::context tls_{ssl::context::tlsv13_client};
  BridgeAddress address_;
  std::string name_;
  ServerTrust trust_;
  const std::atomic<bool>& stop_;
  std::ostream& out_;
  CommandDesk desk_;
  Mirror mirror_;

  beast::tcp_stream* link_ = nullptr;  // of the connection that lives
  bool greeted_ = false;
  std::int64_t heard_ns_ = 0, since_ns_ = 0;
  std::string why_closed_, last_reason_;
  unsigned joins_ = 0;
  std::uint32_t waited_here_ = 0;
  std::uint64_t waited_ = 0;
  Histogram age_;
};

}  // namespace

int run_join(const JoinOptions& options, const std::atomic<bool>& stop, std::ostream& out) {
  return Joiner(options, stop, out).run();
}

}  // namespace kerf::bridge
