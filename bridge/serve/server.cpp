// SPDX-License-Identifier: Apache-2.0

#include "bridge/serve/server.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <iostream>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>

#include "bridge/net/address.hpp"
#include "bridge/net/tcp_socket.hpp"
#include "bridge/serve/server_impl.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/text.hpp"

namespace kerf::bridge {
namespace {

// Limits for connections that are not viewers yet, in all and per host: enough for several browser
// windows with six connections each, but one host cannot take all.
constexpr std::size_t kMaxHandshakes = 128;
constexpr std::ptrdiff_t kMaxHandshakesOfOne = 32;
constexpr std::int64_t kRetryNs = kNsPerSecond / 10;
constexpr std::int64_t kBbrRestartNs = 5 * kNsPerSecond;

tcp::endpoint resolve(asio::io_context& io, const std::string& host, std::uint16_t port) {
  const std::string location = "--listen " + host + ":" + std::to_string(port) + ": ";
  ErrorCode error;
  const auto found = tcp::resolver(io).resolve(
      host, std::to_string(port), tcp::resolver::passive | tcp::resolver::numeric_service, error);
  if (error || found.empty()) {
    throw BridgeError(location + error.message() +
                      "; give an address of this machine (ip address)");
  }
  // The machine's own name may resolve to loopback too, so another address is preferred.
  const auto outside = std::find_if(found.begin(), found.end(), [](const auto& one) {
    return !one.endpoint().address().is_loopback();
  });
  const tcp::endpoint at = (outside == found.end() ? found.begin() : outside)->endpoint();
  if (at.address().is_loopback() && !is_loopback(host)) {
    throw BridgeError(location + "is " + at.address().to_string() +
                      ", which no other machine reaches; give an address of this machine (ip "
                      "address), or localhost");
  }
  return at;
}

tcp::acceptor listen_at(asio::io_context& io, const ServerSetup& setup) {
  const tcp::endpoint at = resolve(io, setup.host, setup.port);
  const std::string location = "--listen " + setup.host + ":" + std::to_string(setup.port) + ": ";
  if (!setup.tls && !at.address().is_loopback()) {
    throw BridgeError(location + "is " + at.address().to_string() +
                      ", no loopback address; off loopback there is TLS only");
  }
  tcp::acceptor acceptor(io);
  ErrorCode error;
  acceptor.open(at.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(at, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (!error) return acceptor;
  const char* way = "take another address";
  if (error == asio::error::address_in_use) way = "another program has it; take another port";
  if (error == asio::error::access_denied) way = "take a port from 1024 on";
  if (error == boost::system::errc::address_not_available) {
    way = "give an address of this machine (ip address)";
  }
  throw BridgeError(location + error.message() + "; " + remedy_for(error.value(), way));
}

}  // namespace

Server::Impl::Impl(ServerSetup setup)
    : setup_(std::move(setup)), acceptor_(listen_at(io_, setup_)), views_(setup_.name) {
  if (setup_.public_url) setup_.host_names.push_back(setup_.public_url->host);
  if (setup_.tls) tls_.emplace(context_of(setup_.tls));
  const std::string why = why_no_bbr(acceptor_.native_handle());
  if (!why.empty()) {
    std::cerr << "kerf-bridge: no BBR: " << why << "; over links that lose packets it is slow\n";
  }
}

Server::Impl::~Impl() {
  helper_.join();
  // `io_` keeps viewers alive after the snapshot is destroyed, so their streams must end first.
  for (const std::shared_ptr<Viewer>& viewer : viewers_) viewer->stream.reset();
}

void Server::Impl::run(const std::atomic<bool>& stop) {
  const auto raise = [](const std::exception_ptr& error) {
    if (error) std::rethrow_exception(error);
  };
  asio::co_spawn(io_, accept_all(), raise);
  asio::co_spawn(io_, clock(stop), raise);
  io_.run();
}

asio::awaitable<void> Server::Impl::accept_all() {
  asio::steady_timer pause(io_);
  for (;;) {
    ErrorCode error;
    tcp::socket socket = co_await acceptor_.async_accept(quiet(error));
    if (error) {  // no free descriptor, or the peer has already closed
      pause.expires_after(std::chrono::milliseconds(50));
      co_await pause.async_wait(quiet(error));
      continue;
    }
    const asio::ip::address from = socket.remote_endpoint(error).address();
    if (error || !make_room(from)) continue;
    asio::co_spawn(io_, connection(std::move(socket)), asio::detached);
  }
}

namespace {

/// Identifies a host for the limits: its IPv4 address, or the first 64 bits of its IPv6 address,
/// because one machine may use all addresses of such a network.
asio::ip::address_v6::bytes_type host_of(const asio::ip::address& address) {
  asio::ip::address_v6::bytes_type bytes{};
  if (address.is_v4())
    return asio::ip::make_address_v6(asio::ip::v4_mapped, address.to_v4()).to_bytes();
  bytes = address.to_v6().to_bytes();
  constexpr std::ptrdiff_t kNetworkBytes = 8;
  if (!address.to_v6().is_v4_mapped())
    std::fill(bytes.begin() + kNetworkBytes, bytes.end(), std::uint8_t{0});
  return bytes;
}

}  // namespace

/// Returns false if the newcomer must be refused. If all slots are taken, closes the oldest
/// connection of the host that has the most, so that a host with many idle connections does not
/// keep others out; if the newcomer's host has its maximum, closes the oldest of that host. A
/// connection that waits for the reply to a wrong token is closed last, and
/// never in favour of its own host: so each slot of a host tries at most one token per second.
bool Server::Impl::make_room(const asio::ip::address& newcomer) {
  const auto held_by = [&](const asio::ip::address& address) {
    return std::ranges::count(handshakes_, host_of(address),
                              [](const HandshakeSlot* one) { return host_of(one->from()); });
  };
  const bool of_one = held_by(newcomer) >= kMaxHandshakesOfOne;
  if (!of_one && handshakes_.size() < kMaxHandshakes) return true;
  HandshakeSlot* oldest = nullptr;
  const auto goes_before = [&](const HandshakeSlot* one) {
    if (oldest == nullptr) return true;
    if (one->is_guess != oldest->is_guess) return oldest->is_guess;
    return held_by(one->from()) > held_by(oldest->from());
  };
  for (HandshakeSlot* one : handshakes_) {
    if (of_one && (one->is_guess || host_of(one->from()) != host_of(newcomer))) continue;
    if (goes_before(one)) oldest = one;
  }
  if (oldest == nullptr) return false;
  say_at_most_once_a_second(oldest->from().to_string() + " holds " +
                            std::to_string(held_by(oldest->from())) +
                            " connections that are no viewers; the oldest are closed");
  oldest->evict();
  return true;
}

asio::awaitable<void> Server::Impl::clock(const std::atomic<bool>& stop) {
  using Clock = std::chrono::steady_clock;
  asio::steady_timer timer(io_);
  for (auto at = Clock::now(); !stop; at += std::chrono::nanoseconds(kSlotNs)) {
    at = std::max(at, Clock::now() - std::chrono::nanoseconds(kSlotNs));  // no burst after a sleep
    timer.expires_at(at);
    ErrorCode error;
    co_await timer.async_wait(quiet(error));
    on_clock();
  }
  io_.stop();
}

void Server::Impl::on_clock() {
  const std::int64_t now_ns = monotonic_ns();
  watch_controller(now_ns);
  const bool restart = setup_.dedicated_link && now_ns - bbr_restarted_ns_ >= kBbrRestartNs;
  if (restart) bbr_restarted_ns_ = now_ns;
  ended_ = connection_ == nullptr || !connection_->alive();
  if (snapshot_ && !viewers_.empty()) snapshot_->update(now_ns, ended_);
  watch_views();
  for (const std::shared_ptr<Viewer>& viewer : viewers_) {
    if (viewer->stream) {
      viewer->stream->note_changes();
      viewer->stream->slot(now_ns, ended_);
    }
    if (restart && !viewer->gone) restart_bbr(viewer->fd());
    update_viewer(*viewer, now_ns);
    viewer->wake.cancel();
  }
}

void Server::Impl::watch_controller(std::int64_t now_ns) {
  if (connecting_ || now_ns < next_try_ns_ || (connection_ && connection_->alive())) return;
  connecting_ = true;
  asio::post(helper_, [this] {
    std::unique_ptr<SegmentConnection> found;
    std::string why;
    try {
      found = std::make_unique<SegmentConnection>(connect_segment(setup_.name));
    } catch (const SegmentAbsent&) {
      why = "waiting for controller \"" + setup_.name + "\"";
    } catch (...) {
      why = failure_text();
    }
    asio::post(io_, [this, why, found = std::move(found)]() mutable {
      connecting_ = false;
      next_try_ns_ = monotonic_ns() + kRetryNs;
      if (found) {
        begin_run(std::move(found));
      } else {
        say_once(why);
      }
    });
  });
}

void Server::Impl::begin_run(std::unique_ptr<SegmentConnection> connection) {
  for (const std::shared_ptr<Viewer>& viewer : viewers_) viewer->stream.reset();
  snapshot_.reset();
  connection_ = std::move(connection);
  ended_ = false;
  said_.clear();
  say_once("controller \"" + setup_.name + "\", run " +
           hex64(connection_->reader().info().session_id));
  for (const std::shared_ptr<Viewer>& viewer : viewers_) open_stream(*viewer);
}

void Server::Impl::say_once(const std::string& text) {
  if (text == said_) return;
  said_ = text;
  std::cerr << "kerf-bridge: " << escaped(text) << '\n';
}

Server::Server(ServerSetup setup) : impl_(std::make_unique<Impl>(std::move(setup))) {}
Server::~Server() = default;
std::uint16_t Server::port() const noexcept {
  return impl_->port();
}
std::string Server::address() const {
  return impl_->address();
}
const std::string& Server::page_token() const noexcept {
  return impl_->page_token();
}
void Server::run(const std::atomic<bool>& stop) {
  impl_->run(stop);
}

}  // namespace kerf::bridge
