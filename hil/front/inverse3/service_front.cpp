// SPDX-License-Identifier: Apache-2.0
#include "hil/front/inverse3/service_front.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <deque>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "hil/hil_error.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/sockets.hpp"

namespace kerf {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;
using Stream = websocket::stream<tcp::socket, false>;  // false: no compression

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kMaxBehindNs = 100 * kNsPerMs;  // beyond this the past is not made up for
constexpr std::int64_t kComesBackNs = 3000 * kNsPerMs;
constexpr std::size_t kMostClientBytes = std::size_t{64} << 10;

/// At `port`, which the option --ws-events gave, or else at that of `where`.
tcp::acceptor listen_at(asio::io_context& io, const std::string& where,
                        std::optional<std::uint16_t> port) {
  UdpAddress address = resolve_udp(where);  // the text is the same for TCP
  const auto refuse = [&](const std::string& why) {
    if (port) {
      throw HilError("--ws-events: " + std::to_string(*port) + ": " + why +
                     "; use a free port, or 0 for any");
    }
    throw HilError("--ws: " + where + ": " + why +
                   "; use [ADDRESS:]PORT with an address of this machine and a free port");
  };
  if (!address.error.empty()) refuse(address.error);
  tcp::endpoint end;
  std::memcpy(end.data(), &address.storage, address.bytes);
  end.resize(address.bytes);
  if (port) end.port(*port);
  try {
    return {io, end, true};
  } catch (const boost::system::system_error& error) {
    refuse(error.code().message());
    throw;
  }
}

/// A WebSocket whose messages leave one after another. Shared by its handlers.
struct Client : std::enable_shared_from_this<Client> {
  explicit Client(tcp::socket socket) : stream(std::move(socket)) {}

  void send(ServiceMessage message) {
    outgoing.push_back(std::move(message));
    if (outgoing.size() == 1) write();
  }
  void write() {
    stream.binary(outgoing.front().is_binary);
    stream.async_write(asio::buffer(outgoing.front().text),
                       [self = shared_from_this()](ErrorCode error, std::size_t) {
                         self->outgoing.pop_front();
                         if (error) return;
                         if (!self->outgoing.empty()) self->write();
                       });
  }

  Stream stream;
  beast::flat_buffer buffer;
  std::deque<ServiceMessage> outgoing;
  std::size_t number = 0;  ///< of its record
};

/// One request of HTTP.
struct Request {
  explicit Request(tcp::socket its) : socket(std::move(its)) {}
  tcp::socket socket;
  beast::flat_buffer buffer;
  http::request<http::string_body> request;
  http::response<http::string_body> answer;
};

}  // namespace

struct ServiceFront::State {
  State(const ServicePlace& place, const ServiceSettings& its, PacketDevice& behind,
        std::function<void()> again)
      : settings(its),
        device(behind),
        renew(std::move(again)),
        acceptor(listen_at(io, place.where, {})) {
    if (place.event_port) event_acceptor.emplace(listen_at(io, place.where, place.event_port));
    service.emplace(settings, device);
    accept();
    if (event_acceptor) accept_events();
  }

  void accept() {
    acceptor.async_accept([this](ErrorCode error, tcp::socket socket) {
      if (!error) read_request(std::move(socket));
      accept();
    });
  }
  void accept_events() {
    event_acceptor->async_accept([this](ErrorCode error, tcp::socket socket) {
      if (!error) {
        auto client = std::make_shared<Client>(std::move(socket));
        client->stream.async_accept([this, client](ErrorCode failed) {
          if (failed) return;
          readers.push_back(client);
          read_events(client);
        });
      }
      accept_events();
    });
  }
  /// What a reader of events sends is dropped; it closes in order, too.
  void read_events(const std::shared_ptr<Client>& client) {
    client->stream.async_read(client->buffer, [this, client](ErrorCode error, std::size_t) {
      client->buffer.clear();
      if (error) return static_cast<void>(std::erase(readers, client));
      read_events(client);
    });
  }

  void read_request(tcp::socket socket) {
    ErrorCode ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    auto its = std::make_shared<Request>(std::move(socket));
    http::async_read(its->socket, its->buffer, its->request,
                     [this, its](ErrorCode error, std::size_t) {
                       if (!error) answer(its);
                     });
  }

  void answer(const std::shared_ptr<Request>& its) {
    const auto respond = [&](http::status status, std::string body) {
      its->answer = {status, its->request.version()};
      its->answer.set(http::field::content_type, "application/json");
      its->answer.keep_alive(false);
      its->answer.body() = std::move(body);
      its->answer.prepare_payload();
      http::async_write(its->socket, its->answer, [its](ErrorCode, std::size_t) {
        ErrorCode ignored;
        its->socket.shutdown(tcp::socket::shutdown_send, ignored);
      });
    };
    if (!websocket::is_upgrade(its->request)) {
      const auto target = its->request.target();
      const auto body = service->get({target.data(), target.size()});
      if (!body) return respond(http::status::not_found, R"({"ok":false,"error":"not found"})");
      return respond(http::status::ok, *body);
    }
    if (!service->has_web_socket()) {
      return respond(http::status::not_found, R"({"ok":false,"error":"not found"})");
    }
    if (client) {
      return respond(http::status::service_unavailable, R"({"ok":false,"error":"in use"})");
    }
    client = std::make_shared<Client>(std::move(its->socket));
    client->stream.read_message_max(kMostClientBytes);
    client->stream.auto_fragment(false);
    client->stream.async_accept(its->request, [this, its, who = client](ErrorCode error) {
      if (client != who) return;
      if (error) return lose();
      begin();
    });
  }

  void begin() {
    if (has_left) {  // the last one has ended its session
      renew();
      past_cycles += service->cycles();
      service.emplace(settings, device);
      began_ns = 0;
    }
    has_left = false;
    if (began_ns == 0) began_ns = monotonic_ns();
    catch_up();
    client->number = records.size();
    records.emplace_back();
    client->send({service->greet()});
    read(client);
  }

  void read(const std::shared_ptr<Client>& who) {
    who->stream.async_read(who->buffer, [this, who](ErrorCode error, std::size_t) {
      const bool is_ended = std::ranges::find(ended, who) != ended.end();
      if (client != who && !is_ended) return;
      if (error) {
        std::erase(ended, who);
        if (client != who) return;
        const bool in_order = error == websocket::error::closed &&
                              who->stream.reason().code == websocket::close_code::normal;
        has_left = has_left || in_order;
        return lose();
      }
      const auto bytes = who->buffer.cdata();
      catch_up();
      service->receive({static_cast<const char*>(bytes.data()), bytes.size()});
      who->buffer.clear();
      ClientRecord& its = records[who->number];
      its.pushes_at_end = service->is_pushed();
      if (its.pushes_at_end) its.let_go_ns = 0;
      if (!its.pushes_at_end && its.failed_ns != 0 && its.let_go_ns == 0) {
        its.let_go_ns = monotonic_ns();
      }
      while (is_ended && service->next_reply()) {
      }  // no reply on a side that has ended
      flush();
      read(who);
    });
  }

  void flush() {
    while (client) {
      auto reply = service->next_reply();
      if (!reply) break;
      if (reply->is_broken) note_failure(*client);
      client->send(std::move(*reply));
      ++sent;
    }
    while (const auto event = service->take_event()) {
      for (const auto& reader : readers) reader->send({*event});
    }
    if (const auto fault = service->take_link_fault()) break_link(*fault);
    if (client && service->hung_up()) break_link(ServiceFault::close);
  }

  void note_failure(const Client& who) {
    std::int64_t& failed_ns = records[who.number].failed_ns;
    if (failed_ns == 0) failed_ns = monotonic_ns();
  }

  void break_link(ServiceFault fault) {
    if (!client) return;
    const std::shared_ptr<Client> who = client;
    note_failure(*who);
    ErrorCode ignored;
    tcp::socket& socket = who->stream.next_layer();
    switch (fault) {
      case ServiceFault::half_open:
        silent.push_back(who);
        break;
      case ServiceFault::close:
      case ServiceFault::going_away: {
        // Not by the stream, which would not read on.
        const bool in_order = fault == ServiceFault::close;
        const std::array<std::uint8_t, 4> frame{0x88, 2, 0x03,
                                                static_cast<std::uint8_t>(in_order ? 0xE8 : 0xE9)};
        asio::write(socket, asio::buffer(frame), ignored);
        ended.push_back(who);
        break;
      }
      case ServiceFault::half_close:
        socket.shutdown(tcp::socket::shutdown_send, ignored);
        ended.push_back(who);
        break;
      case ServiceFault::fin:
        socket.close(ignored);
        break;
      default:
        socket.set_option(tcp::socket::linger(true, 0), ignored);
        socket.close(ignored);
        break;
    }
    lose();
  }

  void lose() {
    client.reset();
    lost_ns = monotonic_ns();
  }

  /// Brings the device to the present of the machine's clock.
  void catch_up() {
    if (settings.lockstep || began_ns == 0) return;
    const std::int64_t now_ns = monotonic_ns();
    std::int64_t behind = (now_ns - began_ns) / kNsPerCycle - service->cycles();
    if (behind * kNsPerCycle > kMaxBehindNs) {
      began_ns += behind * kNsPerCycle;
      ++resyncs;
      behind = 0;
    }
    while (behind-- > 0) service->advance(1);
  }

  ServiceSettings settings;
  PacketDevice& device;
  std::function<void()> renew;
  asio::io_context io{1};
  tcp::acceptor acceptor;
  std::optional<tcp::acceptor> event_acceptor;
  std::optional<ServiceDevice> service;
  std::shared_ptr<Client> client;
  std::vector<std::shared_ptr<Client>> readers;  ///< of events
  std::vector<std::shared_ptr<Client>> silent;   ///< half-open: theirs stay open
  std::vector<std::shared_ptr<Client>> ended;    ///< the service's side has ended; it reads on
  std::vector<ClientRecord> records;
  bool has_left = false;      ///< the last client, in order
  std::int64_t began_ns = 0;  ///< cycle 0 of `service`; 0: no client yet
  std::int64_t lost_ns = 0;
  std::int64_t past_cycles = 0;  ///< of services before this one
  std::uint64_t sent = 0, resyncs = 0;
};

ServiceFront::ServiceFront(const ServicePlace& place, const ServiceSettings& settings,
                           PacketDevice& device, std::function<void()> renew)
    : state_(std::make_unique<State>(place, settings, device, std::move(renew))) {}

ServiceFront::~ServiceFront() = default;

std::uint16_t ServiceFront::port() const noexcept {
  ErrorCode ignored;
  return state_->acceptor.local_endpoint(ignored).port();
}

std::optional<std::uint16_t> ServiceFront::event_port() const noexcept {
  ErrorCode ignored;
  if (!state_->event_acceptor) return std::nullopt;
  return state_->event_acceptor->local_endpoint(ignored).port();
}

const std::vector<ClientRecord>& ServiceFront::records() const noexcept {
  return state_->records;
}

void ServiceFront::serve(const ServeLimits& limits, bool stay, FrontStats& stats) {
  State& s = *state_;
  std::int64_t idle_since_ns = monotonic_ns();
  for (;;) {
    s.io.run_for(std::chrono::milliseconds(1));
    s.catch_up();
    s.flush();
    stats.cycles = s.past_cycles + s.service->cycles();
    stats.sent = s.sent;
    stats.resyncs = s.resyncs;
    if (limits.reached(stats.cycles)) return;
    const std::int64_t now_ns = monotonic_ns();
    if (s.client) idle_since_ns = now_ns;
    if (now_ns - idle_since_ns > limits.left_ns(stats.cycles)) return;
    if (stay || s.client || s.began_ns == 0) continue;
    if (s.has_left || now_ns - s.lost_ns > kComesBackNs) return;
  }
}

}  // namespace kerf
