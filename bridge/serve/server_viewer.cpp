// SPDX-License-Identifier: Apache-2.0

#include <chrono>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

#include "bridge/net/tcp_socket.hpp"
#include "bridge/serve/server_impl.hpp"
#include "bridge/wire/parse.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf::bridge {
namespace {

namespace websocket = beast::websocket;

/// True for the commands that viewers may send. Undo, redo and mark are for local readers only.
bool is_for_viewers(CommandKind kind) noexcept {
  return kind == CommandKind::select_tool || kind == CommandKind::hold ||
         kind == CommandKind::reset;
}

constexpr std::int64_t kGoodbyeNs = kNsPerSecond;
constexpr std::int64_t kMeasureNs = kNsPerSecond / 4;
constexpr int kMessageCredit = 64;  // besides one ack per frame: a second of commands or pings
// Plus the masked head of a WebSocket frame, and what TLS 1.3 adds to a record.
constexpr std::int64_t kMessageBytes = kMaxUpBytes + 14 + 22;
// Large, because after a stall of the link all acks come at once. It is the only limit on fragments
// without payload, which do not count as messages.
constexpr std::int64_t kByteCredit = 1 << 20;
constexpr std::size_t kMaxReplies = 16;

std::string_view words(CloseCode code) {
  switch (code) {
    case CloseCode::no_token:
      return "no token, or a wrong one";
    case CloseCode::too_slow:
      return "no answer for 5 s";
    case CloseCode::not_understood:
      return "not understood";
    case CloseCode::too_many:
      return "too many viewers";
  }
  return "";
}

/// A server's close frame (RFC 6455, 5.5.1). Its payload is shorter than 126 bytes.
std::string close_frame(CloseCode code) {
  const auto number = static_cast<std::uint16_t>(code);
  const std::string payload =
      std::string{static_cast<char>(number >> 8), static_cast<char>(number & 255)} +
      std::string(words(code));
  return std::string{static_cast<char>(0x88), static_cast<char>(payload.size())} + payload;
}

}  // namespace

asio::awaitable<void> Server::Impl::view(std::unique_ptr<WebSocket> ws, const Request& request,
                                         Right right, std::string_view foxglove,
                                         HandshakeSlot& slot) {
  auto& tcp_stream = ws->next_layer().next_layer();
  tcp_stream.expires_after(std::chrono::nanoseconds(setup_.handshake_ns));
  ws->read_message_max(foxglove.empty() ? kMaxUpBytes : kMaxFoxgloveUpBytes);
  ws->auto_fragment(false);
  tune_socket(tcp_stream.socket().native_handle());
  if (!foxglove.empty()) {
    ws->set_option(websocket::stream_base::decorator([foxglove](websocket::response_type& reply) {
      reply.set(beast::http::field::sec_websocket_protocol,
                beast::string_view(foxglove.data(), foxglove.size()));
    }));
  }
  ErrorCode error;
  co_await ws->async_accept(request, quiet(error));
  if (error) co_return;
  tcp_stream.expires_never();
  ws->binary(true);
  const auto viewer = std::make_shared<Viewer>(std::move(ws), right);
  if (right == Right::none) {
    drop(*viewer, CloseCode::no_token);
  } else if (viewers_.size() >= setup_.max_viewers) {
    drop(*viewer, CloseCode::too_many);
  }
  if (viewer->closing) {
    viewer->ws->next_layer().next_layer().expires_after(std::chrono::nanoseconds(kGoodbyeNs));
    co_await write_viewer(viewer);
    slot.release();  // before its TCP stream ends
    co_return;
  }
  slot.release();
  viewer->heard_ns = monotonic_ns();
  viewer->message_credit = kMessageCredit;
  viewer->byte_credit = kByteCredit;
  viewer->received_bytes = link_figures(viewer->fd()).received_bytes;
  viewer->ws->control_callback([watched = viewer.get()](websocket::frame_type, beast::string_view) {
    if (--watched->message_credit < 0) drop(*watched, CloseCode::not_understood);
  });
  viewers_.push_back(viewer);
  if (!foxglove.empty()) viewer->foxglove.emplace(setup_.name);
  if (connection_) open_stream(*viewer);
  viewer->reading = true;
  asio::co_spawn(io_, read_viewer(viewer), asio::detached);
  co_await write_viewer(viewer);
  viewers_.remove(viewer);
}

void Server::Impl::open_stream(Viewer& viewer) {
  if (viewer.foxglove) return;  // reads the ring of ticks only, without a stream
  if (!snapshot_) snapshot_ = std::make_unique<RunSnapshot>(connection_->reader());
  viewer.stream =
      std::make_unique<Stream>(*snapshot_, viewer.right == Right::command ? kMayCommand : 0);
  viewer.heard_ns = monotonic_ns();
  viewer.wake.cancel();
}

bool Server::Impl::next_of_foxglove(Viewer& viewer, FoxgloveMessage& out) {
  const SegmentReader* const run = connection_ ? &connection_->reader() : nullptr;
  return viewer.foxglove && viewer.foxglove->next(monotonic_ns(), run, ended_, out);
}

asio::awaitable<void> Server::Impl::write_viewer(std::shared_ptr<Viewer> viewer) {
  ErrorCode error;
  std::vector<std::byte> out;
  FoxgloveMessage message;
  while (!viewer->closing && viewer->reading && !error) {
    if (!viewer->replies.empty()) {
      const ReplyMessage reply = viewer->replies.front();
      viewer->replies.pop_front();
      co_await viewer->ws->async_write(asio::buffer(&reply, sizeof reply), quiet(error));
    } else if (viewer->stream && viewer->view_sent != view_changes_) {
      const ViewMessage view = view_for(*viewer);
      viewer->view_sent = view_changes_;
      co_await viewer->ws->async_write(asio::buffer(&view, sizeof view), quiet(error));
    } else if (viewer->stream && viewer->stream->next(monotonic_ns(), out)) {
      ++viewer->message_credit;
      viewer->byte_credit += kMessageBytes;
      co_await viewer->ws->async_write(asio::buffer(std::as_const(out)), quiet(error));
    } else if (next_of_foxglove(*viewer, message)) {
      viewer->ws->text(message.is_text);
      viewer->writing = true;
      co_await viewer->ws->async_write(asio::buffer(message.bytes), quiet(error));
      viewer->writing = false;
      viewer->heard_ns = monotonic_ns();
    } else {
      viewer->wake.expires_at(asio::steady_timer::time_point::max());
      ErrorCode woken;
      co_await viewer->wake.async_wait(quiet(woken));
    }
  }
  if (viewer->closing && !viewer->gone && !error) co_await say_goodbye(*viewer);
  viewer->gone = true;
  viewer->stream.reset();
  viewer->ws->next_layer().next_layer().socket().close(error);
}

/// Beast's `async_close` would read at the same time as `read_viewer`; a fragmented message then
/// triggers an assertion in Beast (1.74, `read_size_hint_pmd`). So this stops the reader first,
/// ignores what the viewer sends afterwards, and writes the close frame itself.
asio::awaitable<void> Server::Impl::say_goodbye(Viewer& viewer) {
  Link& link = viewer.ws->next_layer();
  ErrorCode error;
  link.stop_reading();
  while (viewer.reading) {
    viewer.wake.expires_at(asio::steady_timer::time_point::max());
    co_await viewer.wake.async_wait(quiet(error));
  }
  const std::string frame = close_frame(*viewer.closing);
  co_await asio::async_write(link, asio::buffer(frame), quiet(error));
  if (!error) co_await linger(link.next_layer());
}

asio::awaitable<void> Server::Impl::read_viewer(std::shared_ptr<Viewer> viewer) {
  ErrorCode error;
  beast::flat_buffer in;
  while (!error && !viewer->closing) {
    in.clear();
    co_await viewer->ws->async_read(in, quiet(error));
    if (error || viewer->closing) break;
    const std::span message(static_cast<const std::byte*>(in.data().data()), in.data().size());
    if (--viewer->message_credit < 0 ||
        !handle_message(viewer, viewer->ws->got_binary(), message)) {
      drop(*viewer, CloseCode::not_understood);
    }
    viewer->wake.cancel();
  }
  viewer->reading = false;
  viewer->wake.cancel();
}

bool Server::Impl::handle_message(const std::shared_ptr<Viewer>& viewer, bool is_binary,
                                  std::span<const std::byte> message) {
  if (viewer->foxglove) {
    viewer->foxglove->hear(!is_binary,
                           {reinterpret_cast<const char*>(message.data()), message.size()});
    return true;
  }
  if (!is_binary) return false;
  const auto up = parse_up(message);
  if (!up) return false;
  if (const auto* const wish = std::get_if<CommandMessage>(&*up)) {
    command(viewer, *wish);
    return true;
  }
  if (const auto* const view = std::get_if<ViewMessage>(&*up)) {
    take_view(viewer, *view);
    return true;
  }
  if (!viewer->stream) return true;  // the run has just ended
  const std::int64_t now_ns = monotonic_ns();
  viewer->heard_ns = now_ns;
  if (now_ns - viewer->measured_ns >= kMeasureNs) {
    viewer->measured_ns = now_ns;
    viewer->stream->set_round_trip(link_figures(viewer->fd()).least_round_trip_ns);
  }
  return viewer->stream->acked(std::get<AckMessage>(*up), now_ns);
}

void Server::Impl::answer(Viewer& viewer, std::uint32_t sequence, const Reply& reply) {
  if (viewer.replies.size() >= kMaxReplies) return;  // the viewer does not read them
  viewer.replies.push_back(
      {kReplyMagic, sequence, static_cast<std::uint32_t>(reply.status), reply.index});
  viewer.wake.cancel();
}

void Server::Impl::command(const std::shared_ptr<Viewer>& viewer, const CommandMessage& message) {
  const std::uint32_t sequence = message.sequence;
  const auto kind = static_cast<CommandKind>(message.kind);
  if (viewer->right != Right::command || !is_for_viewers(kind)) {
    return answer(*viewer, sequence, {ReplyStatus::refused, 0});
  }
  if (viewer->commanding) return answer(*viewer, sequence, {ReplyStatus::busy, 0});
  viewer->commanding = true;
  SegmentCommand wish;
  wish.kind = kind;
  wish.argument = message.argument;
  wish.arm = message.arm;
  asio::post(helper_, [this, wish, sequence, from = std::weak_ptr(viewer)] {
    Reply reply{ReplyStatus::busy, 0};
    try {
      if (!command_link_ || !command_link_->alive()) command_link_ = connect_segment(setup_.name);
      reply = command_link_->send(wish);
    } catch (const SegmentError&) {
      command_link_.reset();  // without a controller the reply is busy
    }
    asio::post(io_, [from, sequence, reply] {
      const std::shared_ptr<Viewer> back = from.lock();
      if (!back) return;
      back->commanding = false;
      answer(*back, sequence, reply);
    });
  });
}

void Server::Impl::update_viewer(Viewer& viewer, std::int64_t now_ns) {
  viewer.message_credit =
      std::max(viewer.message_credit, std::min(viewer.message_credit + 1, kMessageCredit));
  if (!viewer.gone) {
    const std::uint64_t received = link_figures(viewer.fd()).received_bytes;
    viewer.byte_credit -= static_cast<std::int64_t>(received - viewer.received_bytes);
    viewer.received_bytes = received;
    if (viewer.byte_credit < 0) drop(viewer, CloseCode::not_understood);
    viewer.byte_credit = std::min(viewer.byte_credit + kMessageBytes, kByteCredit);
  }
  const bool waits = viewer.stream ? viewer.stream->link().waits_for_ack() : viewer.writing;
  if (!waits) viewer.heard_ns = now_ns;
  if (!viewer.closing && now_ns - viewer.heard_ns > setup_.silence_ns)
    drop(viewer, CloseCode::too_slow);
  if (viewer.closing && !viewer.gone && now_ns > viewer.close_by_ns) {
    ErrorCode error;
    viewer.ws->next_layer().next_layer().socket().close(error);
    viewer.gone = true;
  }
}

void Server::Impl::drop(Viewer& viewer, CloseCode code) {
  if (viewer.closing) return;
  viewer.closing = code;
  viewer.close_by_ns = monotonic_ns() + kGoodbyeNs;
}

}  // namespace kerf::bridge
