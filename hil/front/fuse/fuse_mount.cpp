// SPDX-License-Identifier: Apache-2.0
#include "hil/front/fuse/fuse_mount.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <linux/fuse.h>
#include <poll.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kStopCheckNs = 100'000'000;
constexpr std::uint32_t kMinorVersion = 31;
constexpr std::uint64_t kFirstInode = 2;  // 1 is the folder

/// `T` from the first bytes; nothing when there are too few.
template <class T>
std::optional<T> taken(std::span<const std::uint8_t> bytes) noexcept {
  T value{};
  if (bytes.size() < sizeof value) return std::nullopt;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

template <class T>
std::span<const std::uint8_t> bytes_of(const T& value) noexcept {
  return {reinterpret_cast<const std::uint8_t*>(&value), sizeof value};
}

fuse_attr attributes(std::uint64_t inode) noexcept {
  fuse_attr attr{};
  attr.ino = inode;
  attr.mode = inode == FUSE_ROOT_ID ? S_IFDIR | 0700 : S_IFREG | 0600;
  attr.nlink = 1;
  attr.uid = getuid();
  attr.gid = getgid();
  attr.blksize = 4096;
  return attr;
}

std::string reason() {
  return std::generic_category().message(errno);
}

}  // namespace

/// One message of the kernel.
struct FuseMount::Request {
  fuse_in_header header{};
  std::span<const std::uint8_t> body;

  [[nodiscard]] FuseRequest id() const noexcept { return header.unique; }
};

FuseMount::FuseMount(std::string folder) : folder_(std::move(folder)) {
  struct stat file {};
  if (stat(folder_.c_str(), &file) != 0 && errno == ENOTCONN) {
    umount2(folder_.c_str(), MNT_DETACH);  // what an emulator that was killed has left
  }
  if (stat(folder_.c_str(), &file) != 0 || !S_ISDIR(file.st_mode)) {
    throw HilError("--mount: " + folder_ + " is no folder; make one");
  }
  fd_ = ::open("/dev/fuse", O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) {
    throw HilError("--front fuse: /dev/fuse cannot be opened (" + reason() +
                   "); run as root, or use --front socket");
  }
  const std::string options = "fd=" + std::to_string(fd_) +
                              ",rootmode=40000,user_id=" + std::to_string(getuid()) +
                              ",group_id=" + std::to_string(getgid());
  if (mount("kerf-hil", folder_.c_str(), "fuse.kerf", MS_NOSUID | MS_NODEV | MS_NOEXEC,
            options.c_str()) != 0) {
    const std::string why = reason();
    close(fd_);
    throw HilError("--mount: " + folder_ + " cannot be mounted (" + why +
                   "); run as root or under unshare -Urm, or use --front socket");
  }
}

FuseMount::~FuseMount() {
  if (!gone_) umount2(folder_.c_str(), MNT_DETACH);
  close(fd_);  // clients that are still inside get ENOTCONN
}

void FuseMount::add(std::string name, FuseNode& node) {
  nodes_.push_back({std::move(name), &node});
  node.attach(*this);
}

void FuseMount::serve(const std::function<bool()>& goes_on) {
  while (!gone_ && wait(goes_on)) serve_one();
}

/// Wakes nodes when they are due, until a request is there; false when it does not go on.
bool FuseMount::wait(const std::function<bool()>& goes_on) {
  while (goes_on()) {
    const std::int64_t now_ns = monotonic_ns();
    std::int64_t next_ns = now_ns + kStopCheckNs;
    for (const Named& named : nodes_) {
      const std::int64_t due_ns = named.node->next_wake_ns();
      if (due_ns <= now_ns) {
        lateness_.record(now_ns - due_ns);
        named.node->wake();
      }
      next_ns = std::min(next_ns, std::max(named.node->next_wake_ns(), now_ns));
    }
    const timespec patience{0, next_ns - now_ns};
    pollfd watched{fd_, POLLIN, 0};
    if (ppoll(&watched, 1, &patience, nullptr) > 0) return true;
  }
  return false;
}

void FuseMount::serve_one() {
  const ssize_t size = ::read(fd_, buffer_.data(), buffer_.size());
  if (size < 0) {
    // ENOENT: the client was killed before we saw its request.
    gone_ = errno != EAGAIN && errno != EINTR && errno != ENOENT;
    return;
  }
  const std::span<const std::uint8_t> message(buffer_.data(), static_cast<std::size_t>(size));
  const auto header = taken<fuse_in_header>(message);
  if (!header) return;
  ++requests_;
  dispatch({*header, message.subspan(sizeof *header)});
}

void FuseMount::dispatch(const Request& request) {
  switch (request.header.opcode) {
    case FUSE_INIT: {
      fuse_init_out out{};
      out.major = FUSE_KERNEL_VERSION;
      out.minor = kMinorVersion;
      out.max_write = kMaxWrite;
      out.max_background = 12;
      out.congestion_threshold = 9;
      return reply_with(request.id(), out);
    }
    case FUSE_LOOKUP:
      return look_up(request);
    case FUSE_GETATTR:
    case FUSE_SETATTR: {  // O_TRUNC and chmod change nothing, as on a device
      fuse_attr_out out{};
      out.attr = attributes(request.header.nodeid);
      return reply_with(request.id(), out);
    }
    case FUSE_OPENDIR:
      return reply_with(request.id(), fuse_open_out{});
    case FUSE_READDIR:
      return list(request);
    case FUSE_OPEN:
      return open(request);
    case FUSE_RELEASE:
      return release(request);
    case FUSE_READ:
      return read(request);
    case FUSE_WRITE:
      return write(request);
    case FUSE_IOCTL:
      return ioctl(request);
    case FUSE_POLL:
      return poll(request);
    case FUSE_INTERRUPT:
      return interrupt(request);
    case FUSE_RELEASEDIR:
    case FUSE_ACCESS:
    case FUSE_FLUSH:
      return reply(request.id(), 0);
    case FUSE_FORGET:
    case FUSE_BATCH_FORGET:
      return;  // no answer is expected
    default:
      return reply(request.id(), ENOSYS);
  }
}

void FuseMount::look_up(const Request& request) noexcept {
  const auto* text = reinterpret_cast<const char*>(request.body.data());
  const std::string_view name(text, strnlen(text, request.body.size()));
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].name != name || !nodes_[i].node->present()) continue;
    fuse_entry_out out{};
    out.nodeid = kFirstInode + i;
    out.attr = attributes(out.nodeid);
    return reply_with(request.id(), out);  // no time of validity: a node may vanish
  }
  reply(request.id(), ENOENT);
}

void FuseMount::list(const Request& request) {
  const auto in = taken<fuse_read_in>(request.body);
  if (!in) return reply(request.id(), EINVAL);
  std::vector<std::uint8_t> out;
  for (std::size_t i = in->offset; i < nodes_.size(); ++i) {
    if (!nodes_[i].node->present()) continue;
    fuse_dirent entry{};
    entry.ino = kFirstInode + i;
    entry.off = i + 1;
    entry.namelen = static_cast<std::uint32_t>(nodes_[i].name.size());
    entry.type = S_IFREG >> 12;
    const std::size_t begin = out.size();
    const std::size_t size = FUSE_DIRENT_ALIGN(FUSE_NAME_OFFSET + entry.namelen);
    if (begin + size > in->size) break;
    out.resize(begin + size);
    std::memcpy(&out[begin], &entry, FUSE_NAME_OFFSET);
    std::memcpy(&out[begin + FUSE_NAME_OFFSET], nodes_[i].name.data(), entry.namelen);
  }
  reply(request.id(), 0, out);
}

void FuseMount::open(const Request& request) {
  const std::uint64_t i = request.header.nodeid - kFirstInode;
  if (i >= nodes_.size() || !nodes_[i].node->present()) return reply(request.id(), ENOENT);
  fuse_open_out out{};
  out.fh = ++last_open_;
  out.open_flags = FOPEN_DIRECT_IO | FOPEN_NONSEEKABLE | FOPEN_STREAM;
  opens_[out.fh] = nodes_[i].node;
  nodes_[i].node->open(out.fh);
  reply_with(request.id(), out);
}

void FuseMount::release(const Request& request) {
  const auto in = taken<fuse_release_in>(request.body);
  if (FuseNode* node = in ? node_of(in->fh) : nullptr) {
    node->release(in->fh);
    opens_.erase(in->fh);
    pollers_.erase(in->fh);
  }
  reply(request.id(), 0);
}

void FuseMount::read(const Request& request) {
  const auto in = taken<fuse_read_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return reply(request.id(), EBADF);
  settle(request, Kind::read, *node, node->read(in->fh, request.id(), in->size));
}

void FuseMount::write(const Request& request) {
  const auto in = taken<fuse_write_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return reply(request.id(), EBADF);
  const auto data = request.body.subspan(sizeof *in);
  const auto bytes = data.first(std::min<std::size_t>(data.size(), in->size));
  settle(request, Kind::write, *node, node->write(in->fh, request.id(), bytes));
}

void FuseMount::ioctl(const Request& request) {
  const auto in = taken<fuse_ioctl_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return reply(request.id(), ENOTTY);
  const auto data = request.body.subspan(sizeof *in);
  const FuseIoctl call{.request = request.id(),
                       .thread = static_cast<pid_t>(request.header.pid),
                       .command = in->cmd,
                       .argument = in->arg,
                       .input = data.first(std::min<std::size_t>(data.size(), in->in_size)),
                       .output_bytes = in->out_size};
  settle(request, Kind::ioctl, *node, node->ioctl(in->fh, call));
}

void FuseMount::poll(const Request& request) {
  const auto in = taken<fuse_poll_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return reply(request.id(), EBADF);
  const bool sleeps = (in->flags & FUSE_POLL_SCHEDULE_NOTIFY) != 0;
  if (sleeps) pollers_[in->fh] = in->kh;
  fuse_poll_out out{};
  out.revents = node->poll(in->fh, sleeps);
  reply_with(request.id(), out);
}

void FuseMount::interrupt(const Request& request) {
  const auto in = taken<fuse_interrupt_in>(request.body);
  if (!in) return;
  // The answer may be on its way: then there is nothing to interrupt.
  if (const auto found = parked_.find(in->unique); found != parked_.end()) {
    found->second.node->interrupted(in->unique);
  }
}

void FuseMount::settle(const Request& request, Kind kind, FuseNode& node,
                       const std::optional<FuseAnswer>& answer) {
  if (answer) return respond(request.id(), kind, *answer);
  parked_[request.id()] = {kind, &node};
}

void FuseMount::answer(FuseRequest request, const FuseAnswer& answer) noexcept {
  const auto found = parked_.find(request);
  if (found == parked_.end()) return;
  const Kind kind = found->second.kind;
  parked_.erase(found);
  respond(request, kind, answer);
}

void FuseMount::wake_pollers(FuseOpen open) noexcept {
  const auto found = pollers_.find(open);
  if (found == pollers_.end()) return;
  const fuse_notify_poll_wakeup_out out{found->second};
  pollers_.erase(found);
  // A notification is a reply to nobody whose error is a positive code.
  reply(0, -FUSE_NOTIFY_POLL, bytes_of(out));
}

void FuseMount::respond(FuseRequest id, Kind kind, const FuseAnswer& answer) noexcept {
  if (answer.error != 0) return reply(id, answer.error);
  switch (kind) {
    case Kind::read:
      return reply(id, 0, answer.bytes);
    case Kind::write: {
      fuse_write_out out{};
      out.size = static_cast<std::uint32_t>(answer.result);
      return reply_with(id, out);
    }
    case Kind::ioctl: {
      fuse_ioctl_out out{};
      out.result = answer.result;
      return reply_with(id, out, answer.bytes);
    }
  }
}

void FuseMount::reply(FuseRequest id, int error, std::span<const std::uint8_t> head,
                      std::span<const std::uint8_t> rest) noexcept {
  fuse_out_header header{};
  header.len = static_cast<std::uint32_t>(sizeof header + head.size() + rest.size());
  header.error = -error;
  header.unique = id;
  // writev() takes what it only reads as iovec, whose pointer is not const.
  const std::array<iovec, 3> parts{{{&header, sizeof header},
                                    {const_cast<std::uint8_t*>(head.data()), head.size()},
                                    {const_cast<std::uint8_t*>(rest.data()), rest.size()}}};
  // ENOENT: the client was killed meanwhile.
  static_cast<void>(writev(fd_, parts.data(), static_cast<int>(parts.size())));
}

template <class Body>
void FuseMount::reply_with(FuseRequest id, const Body& body,
                           std::span<const std::uint8_t> rest) noexcept {
  reply(id, 0, bytes_of(body), rest);
}

FuseNode* FuseMount::node_of(FuseOpen open) const noexcept {
  const auto found = opens_.find(open);
  return found == opens_.end() ? nullptr : found->second;
}

}  // namespace kerf
