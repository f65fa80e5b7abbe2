// SPDX-License-Identifier: Apache-2.0

#include "bridge/join/join.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <utility>  // before Boost 1.74's awaitable, which needs it

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/steady_timer.hpp>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include "bridge/net/address.hpp"
#include "bridge/net/certificate.hpp"
#include "bridge/net/link.hpp"
#include "bridge/net/tcp_socket.hpp"
#include "bridge/net/tokens.hpp"
#include "bridge/stream/mirror.hpp"
#include "bridge/wire/messages.hpp"
#include "bridge/wire/parse.hpp"
#include "shared/numeric/statistics.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/text.hpp"

namespace kerf::bridge {

namespace {

namespace websocket = beast::websocket;
using namespace std::chrono_literals;

/// Another try cannot help: ends the program, unless a connection has worked before.
struct Hopeless : BridgeError {
  using BridgeError::BridgeError;
};

/// The server knows its token or its pinned certificate no more, and will not again: ends the
/// program, also after a connection that worked.
struct Outdated : Hopeless {
  using Hopeless::Hopeless;
};

// Every operation ends in an error code: with exceptions beside it all of Beast is compiled twice.
void throw_if(const ErrorCode& error) {
  if (error) throw boost::system::system_error(error);
}

constexpr auto kConnectPatience = 1500ms;  // a lost SYN comes again after 1 s
constexpr auto kGreetingPatience = 10s;    // TLS and HTTP over a slow link

[[noreturn]] void throw_no_tls(const CertificateCheck& check, const ErrorCode& error) {
  if (const std::string& reason = check.refusal(); !reason.empty()) {
    if (check.is_pinned()) throw Outdated(reason);
    throw Hopeless(reason);
  }
  if (error.category() == asio::error::get_ssl_category()) {
    throw Hopeless("no TLS 1.3 there; is it a kerf-bridge serve, and off loopback?");
  }
  throw boost::system::system_error(error);
}

/// True if the answer is not HTTP; false if the connection broke.
[[nodiscard]] bool is_no_http(const ErrorCode& error) {
  using Http = beast::http::error;
  return error == Http::bad_version || error == Http::bad_line_ending ||
         error == Http::bad_status || error == Http::bad_reason || error == Http::bad_field ||
         error == Http::bad_value;
}

/// The server refuses the client's certificate in TLS 1.3 after the handshake, by an alert.
void throw_no_certificate(const ErrorCode& error) {
  if (error.category() != asio::error::get_ssl_category()) return;
  const int alert =
      ERR_GET_REASON(static_cast<unsigned long>(error.value())) - SSL_AD_REASON_OFFSET;
  if (alert == SSL_AD_CERTIFICATE_REQUIRED) {
    throw Hopeless("asks for a certificate that its --client-ca has signed; give --cert and --key");
  }
  if (alert < SSL_AD_BAD_CERTIFICATE || alert > SSL_AD_UNKNOWN_CA) return;
  throw Hopeless("refuses the certificate of --cert (" + error.message() +
                 "); give one that its --client-ca has signed");
}

[[noreturn]] void throw_no_welcome(const ErrorCode& error, unsigned status) {
  throw_no_certificate(error);
  if (is_no_http(error)) throw Hopeless("speaks no HTTP; take the port of a kerf-bridge serve");
  if (error != websocket::error::upgrade_declined) throw boost::system::system_error(error);
  if (status == 400) throw Hopeless("takes no unencrypted viewers; take wss://");
  if (status == 404) throw Hopeless("no kerf-bridge serve answers; take its port");
  if (status == 421) {
    throw Hopeless(
        "does not know itself by this name; take the address it prints, or give serve "
        "--public-url");
  }
  const std::string answer = "answers " + std::to_string(status) + "; is it a kerf-bridge serve?";
  // A gateway whose server is not up yet, or is overloaded: that may change.
  if (status >= 500 || status == 429) throw BridgeError(answer);
  throw Hopeless(answer);
}

/// Connects a new `ws`: TCP, TLS and the WebSocket's handshake. Throws `Hopeless`, or `BridgeError`
/// and Boost's system_error if another try may help.
asio::awaitable<void> dial(WebSocket& ws, const BridgeAddress& address, CertificateCheck& check) {
  Link& link = ws.next_layer();
  beast::tcp_stream& tcp_stream = link.next_layer();
  tcp::resolver resolver(ws.get_executor());
  ErrorCode error;
  const auto places = co_await resolver.async_resolve(address.host, address.port, quiet(error));
  throw_if(error);
  if (!link.is_tls()) {  // a name may resolve to any address
    for (const auto& place : places) {
      if (place.endpoint().address().is_loopback()) continue;
      throw Hopeless("is " + place.endpoint().address().to_string() +
                     ", and unencrypted is for loopback only; take wss://");
    }
  }
  tcp_stream.expires_after(kConnectPatience);
  co_await tcp_stream.async_connect(places, quiet(error));
  throw_if(error);
  tcp_stream.socket().set_option(tcp::no_delay(true));
  tcp_stream.expires_after(kGreetingPatience);
  if (link.is_tls()) {
    check.begin(link.tls().native_handle());
    co_await link.tls().async_handshake(asio::ssl::stream_base::client, quiet(error));
    if (error) throw_no_tls(check, error);
  }
  ws.read_message_max(kMaxMessageBytes);
  const std::string target =
      address.path + kBridgePath + (address.token.empty() ? "" : "?token=" + address.token);
  websocket::response_type response;
  co_await ws.async_handshake(response, address.host_and_port(), target, quiet(error));
  if (error) throw_no_welcome(error, response.result_int());
  tcp_stream.expires_never();
  ws.binary(true);
}

/// Throws the reason of a server's close code, 4001 and so on, as `dial` does.
[[noreturn]] void throw_closed(std::uint16_t code, bool had_token) {
  switch (static_cast<CloseCode>(code)) {
    case CloseCode::no_token:
      if (!had_token) {
        throw Outdated("asks for a token; take all of the wss:// address it prints, in quotes");
      }
      throw Outdated("it does not know the token; take the wss:// address it prints");
    case CloseCode::too_many:
      throw BridgeError("has as many viewers as it takes");
    case CloseCode::too_slow:
      throw BridgeError("had no answer from here for 5 s");
    case CloseCode::not_understood:
      throw BridgeError("does not understand this program; use programs of one build");
  }
  throw BridgeError("closed the connection");
}

// Of a server that has had a run, which sends at 60 Hz also once that has ended.
constexpr std::int64_t kSilenceNs = 2 * kNsPerSecond;
constexpr std::int64_t kLongWaitNs =
    10 * kNsPerSecond;                             // for the first run: until then it is still
constexpr std::int64_t kSayWaitNs = kNsPerSecond;  // before that is reported
constexpr const char* kNoRun = "has no controller yet";
constexpr const char* kEndless = "answers without end; is it a kerf-bridge serve?";
constexpr auto kFirstPause = 50ms, kLongestPause = 800ms;  // between two tries
constexpr auto kWatchPeriod = 20ms;
// Certificates and an HTTP head. Beast reads the body of a refusal to its end, however long.
constexpr std::uint64_t kMaxWelcomeBytes = 256 * 1024;

/// With the token of `--token-file`, if that is given.
[[nodiscard]] BridgeAddress address_in(const JoinOptions& options) {
  BridgeAddress out = parse_address(options.address);
  if (options.token_file.empty()) return out;
  const std::string location = "--token-file " + options.token_file.string() + ": ";
  if (!out.token.empty()) throw BridgeError(location + "the address has a token; give one of both");
  Tokens tokens;
  tokens.add_file(options.token_file, "--token-file", Right::look);
  out.token = tokens.first();
  return out;
}

/// With the certificate of `--cert`, if that is given; empty for an address without TLS.
[[nodiscard]] Tls tls_of(const JoinOptions& options, bool secure, CertificateCheck& check) {
  Tls tls = new_tls();
  if (!secure) return tls;
  check.apply_to(tls.get());
  if (!options.certificate.empty()) {
    show_certificate(tls.get(), options.certificate, options.key);
  }
  return tls;
}

class Joiner {
 public:
  Joiner(const JoinOptions& options, const std::atomic<bool>& stop, std::ostream& out)
      : address_(address_in(options)),
        name_(options.name),
        wait_s_(options.wait_s),
        check_(address_.host, options.ca, options.fingerprint),
        tls_(context_of(tls_of(options, address_.secure, check_))),
        stop_(stop),
        out_(out),
        mirror_(options.name, options.most_mib << 20,
                [this](const SegmentCommand& command) { return remote_.request(command); }),
        views_(options.name) {}

  int run() {
    std::exception_ptr failure;
    const auto ended = [&](const std::exception_ptr& error) {
      failure = error;
      io_.stop();
    };
    asio::co_spawn(io_, stay_joined(), ended);
    asio::co_spawn(io_, watch(), ended);
    for (bool over = false; !over;) {
      try {
        io_.run();
        over = true;
      } catch (const std::bad_alloc&) {
        // Beast allocates whatever length an answer announces. The attempt ended with its handler.
        if (link_ == nullptr || connected_) throw;
        lost(kEndless);
        link_ = nullptr;
        asio::co_spawn(io_, stay_joined(), ended);
      }
    }
    remote_.set_link(RemoteCommand::Link::down);
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

  /// A reason is printed once, not with every try.
  void lost(const std::string& reason) {
    if (std::exchange(last_reason_, reason) != reason) {
      say(location() + reason + "; trying again");
    }
  }

  asio::awaitable<void> stay_joined() {
    for (auto pause = kFirstPause; !stop_; pause = std::min(pause * 2, kLongestPause)) {
      const unsigned joins_before = joins_;
      since_ns_ = monotonic_ns();
      try {
        co_await follow(WebSocket(tcp::socket(io_), address_.secure ? &tls_ : nullptr));
      } catch (const Outdated& error) {
        throw BridgeError(location() + error.what());
      } catch (const Hopeless& error) {
        if (joins_ == 0) throw BridgeError(location() + error.what());
        lost(error.what());
      } catch (const WireError& error) {  // another try would receive the same
        if (joins_ == 0) throw BridgeError(location() + error.what());
        lost(error.what());
      } catch (const SegmentError&) {
        if (joins_ == 0) throw;
        lost(last_error());
      } catch (const std::exception&) {
        lost(why_closed_.empty() ? last_error() : why_closed_);
      }
      remote_.set_link(RemoteCommand::Link::down);
      presenter_.reset();
      presents_ = false;
      if (joins_ != joins_before) pause = kFirstPause;
      asio::steady_timer timer(io_, pause);
      ErrorCode ignored;
      co_await timer.async_wait(quiet(ignored));
    }
  }

  /// One connection to its end; throws the reason of the end.
  asio::awaitable<void> follow(WebSocket ws) {
    why_closed_.clear();
    greeted_ = false;
    waited_here_ = 0;
    connected_ = false;
    heard_ns_ = monotonic_ns();
    beast::tcp_stream& link = ws.next_layer().next_layer();
    struct Watched {  // `watch` may close it meanwhile
      Joiner& joiner;
      explicit Watched(Joiner& j, beast::tcp_stream& watched) : joiner(j) { j.link_ = &watched; }
      ~Watched() { joiner.link_ = nullptr; }
    } const watched(*this, link);
    co_await dial(ws, address_, check_);
    connected_ = true;
    opened_ns_ = heard_ns_ = monotonic_ns();
    beast::flat_buffer in;
    for (;;) {
      in.clear();
      ErrorCode error;
      co_await ws.async_read(in, quiet(error));
      // A close reason counts, however the connection ended after it.
      const std::uint16_t reason = ws.reason().code;
      if (error && reason != websocket::close_code::none)
        throw_closed(reason, !address_.token.empty());
      throw_if(error);
      heard_ns_ = monotonic_ns();
      const std::span message(static_cast<const std::byte*>(in.data().data()), in.size());
      if (const auto ack = take(message, link.socket().native_handle())) {
        co_await ws.async_write(asio::buffer(&*ack, sizeof *ack), quiet(error));
        throw_if(error);
      }
      if (const auto view = news_of_views()) {
        co_await ws.async_write(asio::buffer(&*view, sizeof *view), quiet(error));
        throw_if(error);
      }
      if (const auto command = remote_.take()) {
        co_await ws.async_write(asio::buffer(&*command, sizeof *command), quiet(error));
        throw_if(error);
      }
    }
  }

  [[nodiscard]] std::string location() const { return address_.host_and_port() + ": "; }

  /// Handles one message of the server. Returns the ack to send, if any.
  std::optional<AckMessage> take(std::span<const std::byte> message, int socket) {
    const LinkFigures figures = link_figures(socket);
    switch (magic_of(message)) {
      case kHelloMagic: {
        const HelloMessage& hello = mirror_.hello(message, heard_ns_, figures.least_round_trip_ns);
        // The server was waiting for a run: the time of joining begins with the run.
        const std::int64_t waited_ns = heard_ns_ - opened_ns_ - figures.least_round_trip_ns;
        if (greeted_ || waited_ns > kNsPerSecond / 2) since_ns_ = heard_ns_;
        remote_.set_link((hello.flags & kMayCommand) != 0 ? RemoteCommand::Link::open
                                                          : RemoteCommand::Link::read_only);
        may_command_ = (hello.flags & kMayCommand) != 0;
        if (session_ != 0 && session_ != hello.session) say("a new run");
        session_ = hello.session;
        greeted_ = true;
        return std::nullopt;
      }
      case kFrameMagic: {
        const bool joined = mirror_.joined(), ended = mirror_.ended();
        const AckMessage ack = mirror_.frame(message, heard_ns_, figures.least_round_trip_ns);
        if (!joined && mirror_.joined()) report_joined();
        if (!ended && mirror_.ended()) say("the run has ended; waiting for the next");
        waited_ += figures.out_of_order - std::exchange(waited_here_, figures.out_of_order);
        return ack;
      }
      case kRecordsMagic:
        mirror_.records(message);
        return std::nullopt;
      case kReplyMagic:
        remote_.answer(parse_reply(message));
        return std::nullopt;
      case kViewMagic:
        take_view(parse_view(message));
        return std::nullopt;
      default:
        throw WireError("message: of no kind that is known here; use programs of one build");
    }
  }

  /// The presenter on the far side is this machine's too, for all who follow here.
  void take_view(const ViewMessage& message) {
    if (message.presenter != static_cast<std::uint32_t>(Presenter::another)) {
      presenter_.reset();
      return;
    }
    if (!is_valid(view_in(message))) {
      say_view("presents a view that is none; it is left out");
      return;
    }
    try {
      if (!presenter_) presenter_.emplace(name_);
      presenter_->show(view_in(message));
    } catch (const SegmentError& problem) {
      say_view(problem.what());
    }
  }
  /// What a presenter of this machine has to tell the far side.
  std::optional<ViewMessage> news_of_views() {
    if (!greeted_ || presenter_) return std::nullopt;  // the presenter is on the far side
    views_.poll();
    const bool presents = views_.presented();
    const bool changed = presents != presents_ || (presents && views_.count() != view_count_);
    if (!changed) return std::nullopt;
    presents_ = presents;
    view_count_ = views_.count();
    if (presents && !may_command_) say_view("takes no view of a token that may not command");
    const Presenter who = presents ? Presenter::another : Presenter::nobody;
    return view_message(who, views_.view());
  }
  void say_view(const std::string& line) {
    if (std::exchange(last_of_views_, line) != line) say(location() + line);
  }

  void report_joined() {
    const double seconds = static_cast<double>(monotonic_ns() - since_ns_) / kNsPerSecond;
    say(format("%s %s as %s in %.2f s", joins_++ == 0 ? "joined" : "joined again",
               address_.host_and_port().c_str(), name_.c_str(), seconds));
    last_reason_.clear();
  }

  /// Samples the age of the picture, and closes a connection that is silent or not wanted.
  asio::awaitable<void> watch() {
    asio::steady_timer timer(io_);
    const std::int64_t began_ns = monotonic_ns();
    for (;;) {
      timer.expires_after(kWatchPeriod);
      ErrorCode ignored;
      co_await timer.async_wait(quiet(ignored));
      const std::int64_t now_ns = monotonic_ns();
      if (stop_) {
        io_.stop();
        co_return;
      }
      if (joins_ == 0 && wait_s_ && static_cast<double>(now_ns - began_ns) > *wait_s_ * 1e9) {
        throw BridgeError(location() + (last_reason_.empty() ? "no picture" : last_reason_) +
                          format("; gave up after %g s (--wait)", *wait_s_));
      }
      if (link_ != nullptr && connected_ && !greeted_ && now_ns - heard_ns_ > kSayWaitNs) {
        lost(kNoRun);
      }
      if (link_ != nullptr && !connected_ &&
          link_figures(link_->socket().native_handle()).received_bytes > kMaxWelcomeBytes) {
        why_closed_ = kEndless;
        link_->socket().close(ignored);
        continue;
      }
      const bool running = greeted_ && !mirror_.ended();
      if (running && mirror_.joined()) age_.record(now_ns - mirror_.taken_ns());
      if (link_ == nullptr || now_ns - heard_ns_ < (greeted_ ? kSilenceNs : kLongWaitNs)) continue;
      why_closed_ =
          connected_ && !greeted_
              ? kNoRun
              : "silent for " + std::to_string((now_ns - heard_ns_) / kNsPerSecond) + " s";
      link_->socket().close(ignored);
    }
  }

  [[nodiscard]] static std::string last_error() {
    try {
      throw;
    } catch (const boost::system::system_error& error) {
      if (error.code() == beast::error::timeout) return "no answer";
      if (error.code() == beast::http::error::body_limit) return kEndless;
      return error.code().message();
    } catch (const std::exception& error) {
      return error.what();
    }
  }

  asio::io_context io_{1};
  BridgeAddress address_;
  std::string name_;
  std::optional<double> wait_s_;
  CertificateCheck check_;
  asio::ssl::context tls_;
  const std::atomic<bool>& stop_;
  std::ostream& out_;
  RemoteCommand remote_;
  Mirror mirror_;
  ViewFollower views_;
  std::optional<ViewPresenter> presenter_;  // on behalf of one on the far side
  bool presents_ = false, may_command_ = false;
  std::uint64_t view_count_ = 0;
  std::string last_of_views_;

  beast::tcp_stream* link_ = nullptr;  // of the open connection
  bool connected_ = false, greeted_ = false;
  std::int64_t heard_ns_ = 0, opened_ns_ = 0, since_ns_ = 0;
  std::string why_closed_, last_reason_;
  std::uint64_t session_ = 0;  // of the run that was shown last
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
