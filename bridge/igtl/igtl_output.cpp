// SPDX-License-Identifier: Apache-2.0

#include "bridge/igtl/igtl_output.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridge/igtl/igtl_messages.hpp"
#include "shared/segment/connection.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf::bridge {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// Of one call, so that a large image holds up no other client for long.
constexpr std::size_t kBytesAtOnce = std::size_t{1} << 20;
constexpr int kReadsAtOnce = 16;

bool must_wait(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

/// One client: its socket, what waits for it, and what it does not have yet. Never blocks.
///
/// At most one image waits, and as many messages of other kinds as the caller adds while none of
/// those waits, so its memory is bounded by the largest volume.
class IgtlClient {
 public:
  enum class Kind : std::uint8_t { image, pose };

  /// Takes over `socket`, which does not block.
  explicit IgtlClient(int socket) noexcept : socket_(socket) {}
  ~IgtlClient();
  IgtlClient(const IgtlClient&) = delete;
  IgtlClient& operator=(const IgtlClient&) = delete;

  [[nodiscard]] int socket() const noexcept { return socket_; }
  [[nodiscard]] bool waits() const noexcept { return !queue_.empty(); }
  /// A message of this kind waits, or is being sent.
  [[nodiscard]] bool waits(Kind kind) const noexcept;
  void add(IgtlBytes message, Kind kind);

  /// Sends what the socket takes, and throws away what came. False if the client has gone, or
  /// has taken nothing for `patience` while something waited.
  [[nodiscard]] bool serve(std::chrono::milliseconds patience);

  std::vector<VoxelBox> lacks;     ///< by volume; the caller's
  std::vector<bool> lacks_labels;  ///< by volume; the caller's

 private:
  struct Waiting {
    IgtlBytes message;
    Kind kind;
  };

  [[nodiscard]] bool throw_away() const;
  [[nodiscard]] bool send_some();

  int socket_;
  std::deque<Waiting> queue_;
  std::size_t sent_ = 0;  ///< of the first message
  Clock::time_point last_progress_ = Clock::now();
};

IgtlClient::~IgtlClient() {
  close(socket_);
}

bool IgtlClient::waits(Kind kind) const noexcept {
  return std::any_of(queue_.begin(), queue_.end(),
                     [&](const Waiting& waiting) { return waiting.kind == kind; });
}

void IgtlClient::add(IgtlBytes message, Kind kind) {
  if (queue_.empty()) last_progress_ = Clock::now();
  queue_.push_back({std::move(message), kind});
}

bool IgtlClient::serve(std::chrono::milliseconds patience) {
  if (!throw_away() || !send_some()) return false;
  return queue_.empty() || Clock::now() - last_progress_ <= patience;
}

bool IgtlClient::throw_away() const {
  std::array<char, 4096> unread;
  for (int reads = 0; reads < kReadsAtOnce; ++reads) {
    const ssize_t got = recv(socket_, unread.data(), unread.size(), MSG_DONTWAIT);
    if (got == 0) return false;
    if (got < 0) return must_wait(errno);
  }
  return true;
}

bool IgtlClient::send_some() {
  for (std::size_t left = kBytesAtOnce; left > 0 && !queue_.empty();) {
    const std::vector<std::byte>& message = *queue_.front().message;
    const std::size_t piece = std::min(left, message.size() - sent_);
    const ssize_t took = send(socket_, message.data() + sent_, piece, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (took < 0) return must_wait(errno);
    last_progress_ = Clock::now();
    sent_ += static_cast<std::size_t>(took);
    left -= static_cast<std::size_t>(took);
    if (sent_ < message.size()) continue;
    queue_.pop_front();
    sent_ = 0;
  }
  return true;
}

constexpr auto kPosePeriod = std::chrono::microseconds(1'000'000 / 60);
constexpr auto kImagePeriod = milliseconds(50);
constexpr auto kAttachPeriod = milliseconds(200);
constexpr auto kLongestWait = milliseconds(100);  ///< until an end is noticed

[[noreturn]] void refuse(const IgtlOptions& options, const std::string& why, const char* way_out) {
  throw std::runtime_error("--openigtlink " + std::to_string(options.port) + " at " + options.host +
                           ": " + why + "; " + way_out);
}

/// A socket that listens; a port that was in use a moment ago may be used again.
int listen_at(const IgtlOptions& options) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const std::string port = std::to_string(options.port);
  if (const int error = getaddrinfo(options.host.c_str(), port.c_str(), &hints, &found)) {
    refuse(options, gai_strerror(error), "name an address of this machine");
  }
  const int fd = socket(found->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int yes = 1;
  const bool listens = fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
                       bind(fd, found->ai_addr, found->ai_addrlen) == 0 && listen(fd, 16) == 0;
  const int error = errno;
  freeaddrinfo(found);
  if (listens) return fd;
  if (fd >= 0) close(fd);
  refuse(options, std::strerror(error),
         error == EADDRINUSE ? "name another port" : "name an address and a port of this machine");
}

std::uint16_t port_of(int fd) {
  sockaddr_storage address{};
  socklen_t length = sizeof address;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) != 0) return 0;
  return ntohs(address.ss_family == AF_INET6
                   ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                   : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

/// True once in a period; periods that were missed are not caught up.
bool is_due(Clock::time_point& next, Clock::duration period) {
  const auto now = Clock::now();
  if (now < next) return false;
  next = now < next + period ? next + period : now + period;
  return true;
}

/// One run of a controller, and the volumes as they were read last.
struct Run {
  explicit Run(SegmentConnection to)
      : connection(std::move(to)),
        names(device_names(reader().info())),
        labels(label_names(names)),
        snapshots(names.size()) {}

  [[nodiscard]] const SegmentReader& reader() const { return connection.reader(); }
  [[nodiscard]] const SegmentVolumeInfo& volume(std::size_t v) const {
    return reader().info().volumes[v];
  }
  /// A client that has nothing.
  void lacks_all(IgtlClient& client) const {
    client.lacks.clear();
    client.lacks_labels.clear();
    for (const SegmentVolumeInfo& volume : reader().info().volumes) {
      const bool fits = fits_an_image(volume.grid);
      client.lacks.push_back(fits ? volume.grid.box() : VoxelBox{});
      client.lacks_labels.push_back(fits && volume.has_labels);
    }
  }
  /// Reads what changed; the boxes around it.
  std::vector<VoxelBox> update() {
    std::vector<VoxelBox> changed(snapshots.size());
    for (std::size_t v = 0; v < snapshots.size(); ++v) {
      if (!fits_an_image(volume(v).grid)) continue;
      reader().update(v, snapshots[v]);
      changed[v] = snapshots[v].changed.bounds(volume(v).bricks);
    }
    return changed;
  }

  SegmentConnection connection;
  std::vector<std::string> names, labels;
  std::vector<VolumeSnapshot> snapshots;
};

}  // namespace

struct IgtlOutput::State {
  State(const IgtlOptions& from, int fd) : options(from), listener(fd), port(port_of(fd)) {}
  ~State() {
    stop = true;
    if (thread.joinable()) thread.join();
    close(listener);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void follow();
  void attach();
  void wait();
  void accept_all();
  void send_poses();
  void send_images();

  IgtlOptions options;
  int listener;
  std::uint16_t port;
  std::atomic<bool> stop{false};
  // Of the thread alone:
  std::optional<Run> run;
  std::vector<std::unique_ptr<IgtlClient>> clients;
  Clock::time_point next_attach{}, next_poses{}, next_images{};
  std::thread thread;
};

void IgtlOutput::State::follow() {
  while (!stop.load(std::memory_order_relaxed)) {
    wait();
    accept_all();
    if (!clients.empty()) {
      attach();
      if (run && is_due(next_poses, kPosePeriod)) send_poses();
      if (run && is_due(next_images, kImagePeriod)) send_images();
    } else {
      run.reset();  // no client: no memory, and no work
    }
    std::erase_if(clients, [&](const auto& client) { return !client->serve(options.patience); });
  }
  clients.clear();
}

/// Until a client or a period asks for something.
void IgtlOutput::State::wait() {
  std::vector<pollfd> asked{{listener, POLLIN, 0}};
  for (const auto& client : clients) {
    const auto events = static_cast<short>(client->waits() ? POLLIN | POLLOUT : POLLIN);
    asked.push_back({client->socket(), events, 0});
  }
  auto left = Clock::duration(kLongestWait);
  if (!clients.empty()) {
    left = (run ? std::min(next_poses, next_images) : next_attach) - Clock::now();
  }
  const auto ms = std::chrono::ceil<milliseconds>(left).count();
  static_cast<void>(poll(asked.data(), asked.size(),
                         static_cast<int>(std::clamp<long>(ms, 0, kLongestWait.count()))));
}

void IgtlOutput::State::accept_all() {
  for (;;) {
    const int fd = accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (clients.size() >= kMaxClients) {
      close(fd);
      continue;
    }
    const int yes = 1;
    static_cast<void>(setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes));
    clients.push_back(std::make_unique<IgtlClient>(fd));
    if (run) run->lacks_all(*clients.back());
  }
}

void IgtlOutput::State::attach() {
  if (run && run->connection.alive()) return;
  if (!is_due(next_attach, kAttachPeriod)) return;
  try {
    run.emplace(connect_segment(options.name));
    for (auto& client : clients) run->lacks_all(*client);
  } catch (const SegmentError&) {
    // None yet, or none any more: its last picture stays.
  }
}

void IgtlOutput::State::send_poses() {
  const auto tick = run->reader().latest();
  if (!tick) return;
  std::vector<IgtlBytes> messages;
  const auto add = [&](const TickRecord& record, std::size_t arm) {
    if (const auto tool = tool_message(record, arm)) messages.push_back(*tool);
    messages.push_back(force_message(record, arm));
  };
  add(*tick, 0);
  if (const auto second = run->reader().second_of(*tick)) add(*second, 1);
  for (auto& client : clients) {
    if (client->waits(IgtlClient::Kind::pose)) continue;
    for (const IgtlBytes& message : messages) client->add(message, IgtlClient::Kind::pose);
  }
}

/// To each client one part of the first volume that it lacks something of; labels go out between
/// the whole of a volume and what changes of it. Clients that lack the same share the message.
void IgtlOutput::State::send_images() {
  const std::vector<VoxelBox> changed = run->update();
  for (auto& client : clients) {
    for (std::size_t v = 0; v < changed.size(); ++v) {
      client->lacks[v] = client->lacks[v].united(changed[v]);
    }
  }
  for (std::size_t v = 0; v < changed.size(); ++v) {
    VoxelBox part;
    IgtlBytes message, labels;
    for (auto& client : clients) {
      VoxelBox& lacks = client->lacks[v];
      if (client->lacks_labels[v] && !(lacks == run->volume(v).grid.box()) &&
          !client->waits(IgtlClient::Kind::image)) {
        if (!labels)
          labels = label_message(run->labels[v], run->volume(v), run->reader().labels(v));
        client->add(labels, IgtlClient::Kind::image);
        client->lacks_labels[v] = false;
      }
      if (lacks.empty() || client->waits(IgtlClient::Kind::image)) continue;
      if (message == nullptr || !(part == lacks)) {
        part = lacks;
        message = image_message(run->names[v], run->volume(v), run->snapshots[v].density, part);
      }
      client->add(message, IgtlClient::Kind::image);
      lacks = {};
    }
  }
}

IgtlOutput::IgtlOutput(const IgtlOptions& options)
    : state_(std::make_unique<State>(options, listen_at(options))) {
  state_->thread = std::thread([this] { state_->follow(); });
}

IgtlOutput::~IgtlOutput() = default;

std::uint16_t IgtlOutput::port() const noexcept {
  return state_->port;
}

}  // namespace kerf::bridge
