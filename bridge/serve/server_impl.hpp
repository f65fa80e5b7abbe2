// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>  // before Boost 1.74's awaitable, which needs it

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/http.hpp>

#include "bridge/foxglove/foxglove_session.hpp"
#include "bridge/net/link.hpp"
#include "bridge/serve/server.hpp"
#include "bridge/stream/stream.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/presented_view.hpp"

namespace kerf::bridge {

/// One viewer: its socket, its right, and its stream while there is a run. Or a Foxglove client,
/// which has a session instead of a stream.
struct Viewer {
  Viewer(std::unique_ptr<WebSocket> socket, Right its_right)
      : ws(std::move(socket)), wake(ws->get_executor()), right(its_right) {}

  std::unique_ptr<WebSocket> ws;
  asio::steady_timer wake;  ///< cancelled to wake the writer
  Right right;
  std::unique_ptr<Stream> stream;
  std::optional<FoxgloveSession> foxglove;
  std::deque<ReplyMessage> replies;
  std::uint64_t view_sent = 0;  ///< the last `view_changes_` that it was sent
  std::int64_t heard_ns = 0;
  std::int64_t measured_ns = 0;      ///< when the round trip was last read
  int message_credit = 0;            ///< messages that the viewer may still send
  std::int64_t byte_credit = 0;      ///< bytes that it may still send, including TLS
  std::uint64_t received_bytes = 0;  ///< received when `byte_credit` was last updated
  bool commanding = false;           ///< one of its commands waits for the controller
  bool writing = false;              ///< a message to a Foxglove client is being sent
  bool reading = false;              ///< `read_viewer` runs, so Beast reads the socket
  bool gone = false;                 ///< the socket is closed
  std::optional<CloseCode> closing;  ///< it will be closed with this code
  std::int64_t close_by_ns = 0;      ///< latest time to close the socket then

  [[nodiscard]] int fd() { return ws->next_layer().next_layer().socket().native_handle(); }
};

using Request = beast::http::request<beast::http::empty_body>;

/// All in one thread, except calls that may wait for the controller: these run on `helper_`.
class Server::Impl {
 public:
  explicit Impl(ServerSetup setup);
  ~Impl();
  [[nodiscard]] std::uint16_t port() const { return acceptor_.local_endpoint().port(); }
  [[nodiscard]] const std::string& page_token() const { return page_token_.token(); }
  [[nodiscard]] std::string address() const {
    return acceptor_.local_endpoint().address().to_string();
  }
  void run(const std::atomic<bool>& stop);

 private:
  using Void = asio::awaitable<void>;
  class HandshakeSlot;
  /// The right of a request, and where it comes from.
  struct Credentials {
    Right right = Right::none;
    bool secret = false;    ///< the request has a token or a cookie, valid or not
    bool one_time = false;  ///< the right comes from the one-time token
    std::string cookie;     ///< to set in the browser; empty: none
  };
  /// The reply to a request that is refused.
  struct Refusal {
    int status;
    std::string_view why;  ///< a constant text
  };

  // server.cpp
  Void accept_all();
  [[nodiscard]] bool make_room(const asio::ip::address& newcomer);
  Void clock(const std::atomic<bool>& stop);
  void on_clock();
  void watch_controller(std::int64_t now_ns);
  void begin_run(std::unique_ptr<SegmentConnection> connection);
  void say_once(const std::string& text);

  // server_http.cpp
  Void connection(tcp::socket socket);
  Void handshake(WebSocket& ws, beast::flat_buffer& in, bool& done);
  Void talk_http(std::unique_ptr<WebSocket> ws, beast::flat_buffer& in);
  [[nodiscard]] std::optional<Refusal> refusal_of(const Request& request) const;
  Void refuse(Link& link, int status, std::string_view text, bool head_only);
  void say_at_most_once_a_second(const std::string& text);
  /// Includes the port, because browsers do not separate cookies by port.
  [[nodiscard]] std::string cookie_name() const { return "kerf" + std::to_string(port()); }
  [[nodiscard]] Credentials credentials_of(const Request& request) const;
  [[nodiscard]] std::string_view route_of(const Request& request) const;
  [[nodiscard]] bool is_foxglove(const Request& request) const;
  [[nodiscard]] bool is_public(const Request& request) const;
  [[nodiscard]] std::string page_text(const Request& request, const Credentials& shown);

  // server_viewer.cpp
  /// `foxglove`: the agreed subprotocol; empty for a viewer of kerf.
  Void view(std::unique_ptr<WebSocket> ws, const Request& request, Right right,
            std::string_view foxglove, HandshakeSlot& slot);
  Void read_viewer(std::shared_ptr<Viewer> viewer);
  Void write_viewer(std::shared_ptr<Viewer> viewer);
  Void say_goodbye(Viewer& viewer);
  [[nodiscard]] bool handle_message(const std::shared_ptr<Viewer>& viewer, bool is_binary,
                                    std::span<const std::byte> message);
  void command(const std::shared_ptr<Viewer>& viewer, const CommandMessage& message);

  // server_views.cpp
  /// A viewer presents its view, or no longer.
  void take_view(const std::shared_ptr<Viewer>& viewer, const ViewMessage& message);
  /// Each clock tick: follows who presents the controller's views.
  void watch_views();
  [[nodiscard]] ViewMessage view_for(const Viewer& viewer) const;
  static void answer(Viewer& viewer, std::uint32_t sequence, const Reply& reply);
  void open_stream(Viewer& viewer);
  [[nodiscard]] bool next_of_foxglove(Viewer& viewer, FoxgloveMessage& out);
  void update_viewer(Viewer& viewer, std::int64_t now_ns);
  static void drop(Viewer& viewer, CloseCode code);

  ServerSetup setup_;
  OneTimeToken page_token_;
  // Coroutines of `io_` use it, so it must outlive `io_`.
  std::list<HandshakeSlot*> handshakes_;  // oldest first
  asio::io_context io_{1};
  std::optional<asio::ssl::context> tls_;
  tcp::acceptor acceptor_;
  asio::thread_pool helper_{1};

  std::unique_ptr<SegmentConnection> connection_;
  std::unique_ptr<RunSnapshot> snapshot_;
  std::optional<SegmentConnection> command_link_;  // used by `helper_` only
  bool connecting_ = false;
  bool ended_ = true;  ///< at the last clock tick there was no live controller
  std::int64_t next_try_ns_ = 0, bbr_restarted_ns_ = 0, warned_ns_ = 0;
  std::string said_;

  std::list<std::shared_ptr<Viewer>> viewers_;

  ViewFollower views_;
  std::uint64_t view_changes_ = 0, view_count_ = 0;
  bool presented_ = false;
  std::optional<ViewPresenter> presenter_;  ///< on behalf of `presenting_`
  std::weak_ptr<Viewer> presenting_;
};

/// One of the limited slots for connections that are not viewers yet. The stream outlives it.
class Server::Impl::HandshakeSlot {
 public:
  HandshakeSlot(Impl& server, beast::tcp_stream& stream) : server_(server), stream_(stream) {
    ErrorCode error;
    from_ = stream.socket().remote_endpoint(error).address();
    server_.handshakes_.push_back(this);
  }
  HandshakeSlot(const HandshakeSlot&) = delete;
  HandshakeSlot& operator=(const HandshakeSlot&) = delete;
  ~HandshakeSlot() { release(); }
  void release() { server_.handshakes_.remove(this); }
  void evict() {
    release();
    stream_.close();  // ends its coroutine with an error
  }
  [[nodiscard]] const asio::ip::address& from() const { return from_; }

  bool is_guess = false;  ///< the client waits for the reply to a wrong token

 private:
  Impl& server_;
  beast::tcp_stream& stream_;
  asio::ip::address from_;
};

}  // namespace kerf::bridge
