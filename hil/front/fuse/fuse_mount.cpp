// SPDX-License-Identifier: Apache-2.0
#include "hil/front/fuse/fuse_mount.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include <linux/fuse.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hil/front/serving.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

constexpr std::uint32_t kMinorVersion = 31;
constexpr std::uint64_t kFirstInode = 2;  // 1 is the folder

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

}  // namespace

void FuseMount::add(std::string name, FuseNode& node, int file) {
  nodes_.push_back({std::move(name), &node, file});
  node.attach(*this);
}

void FuseMount::serve(const std::function<bool()>& goes_on) {
  while (!channel_.gone() && wait(goes_on)) serve_one();
  for (const Named& named : nodes_) named.node->wake();  // packets on their way arrive
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
    if (channel_.wait(next_ns - now_ns)) return true;
  }
  return false;
}

void FuseMount::serve_one() {
  if (const auto request = channel_.receive()) {
    ++requests_;
    dispatch(*request);
  }
}

void FuseMount::dispatch(const FuseMessage& request) {
  switch (request.header.opcode) {
    case FUSE_INIT: {
      fuse_init_out out{};
      out.major = FUSE_KERNEL_VERSION;
      out.minor = kMinorVersion;
      out.max_write = FuseChannel::kMaxWrite;
      out.max_background = 12;
      out.congestion_threshold = 9;
      return channel_.reply_with(request.id(), out);
    }
    case FUSE_LOOKUP:
      return look_up(request);
    case FUSE_GETATTR:
    case FUSE_SETATTR: {  // O_TRUNC and chmod change nothing, as on a device
      fuse_attr_out out{};
      out.attr = attributes(request.header.nodeid);
      return channel_.reply_with(request.id(), out);
    }
    case FUSE_OPENDIR:
      return channel_.reply_with(request.id(), fuse_open_out{});
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
      return channel_.reply(request.id(), 0);
    case FUSE_FORGET:
    case FUSE_BATCH_FORGET:
      return;  // no answer is expected
    default:
      return channel_.reply(request.id(), ENOSYS);
  }
}

void FuseMount::look_up(const FuseMessage& request) noexcept {
  const auto* text = reinterpret_cast<const char*>(request.body.data());
  const std::string_view name(text, strnlen(text, request.body.size()));
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].name != name || !nodes_[i].node->present(nodes_[i].file)) continue;
    fuse_entry_out out{};
    out.nodeid = kFirstInode + i;
    out.attr = attributes(out.nodeid);
    return channel_.reply_with(request.id(), out);  // no time of validity: a node may vanish
  }
  channel_.reply(request.id(), ENOENT);
}

void FuseMount::list(const FuseMessage& request) {
  const auto in = fuse_body<fuse_read_in>(request.body);
  if (!in) return channel_.reply(request.id(), EINVAL);
  std::vector<std::uint8_t> out;
  for (std::size_t i = in->offset; i < nodes_.size(); ++i) {
    if (!nodes_[i].node->present(nodes_[i].file)) continue;
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
  channel_.reply(request.id(), 0, out);
}

void FuseMount::open(const FuseMessage& request) {
  const std::uint64_t i = request.header.nodeid - kFirstInode;
  if (i >= nodes_.size() || !nodes_[i].node->present(nodes_[i].file))
    return channel_.reply(request.id(), ENOENT);
  fuse_open_out out{};
  out.fh = ++last_open_;
  out.open_flags = FOPEN_DIRECT_IO;
  if (!nodes_[i].node->seekable()) out.open_flags |= FOPEN_NONSEEKABLE | FOPEN_STREAM;
  opens_[out.fh] = nodes_[i].node;
  nodes_[i].node->open(out.fh, nodes_[i].file);
  channel_.reply_with(request.id(), out);
}

void FuseMount::release(const FuseMessage& request) {
  const auto in = fuse_body<fuse_release_in>(request.body);
  if (FuseNode* node = in ? node_of(in->fh) : nullptr) {
    node->release(in->fh);
    opens_.erase(in->fh);
    pollers_.erase(in->fh);
  }
  channel_.reply(request.id(), 0);
}

void FuseMount::read(const FuseMessage& request) {
  const auto in = fuse_body<fuse_read_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return channel_.reply(request.id(), EBADF);
  reply_or_defer(request, Kind::read, *node,
                 node->read(in->fh, request.id(), in->offset, in->size));
}

void FuseMount::write(const FuseMessage& request) {
  const auto in = fuse_body<fuse_write_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return channel_.reply(request.id(), EBADF);
  const auto data = request.body.subspan(sizeof *in);
  const auto bytes = data.first(std::min<std::size_t>(data.size(), in->size));
  reply_or_defer(request, Kind::write, *node, node->write(in->fh, request.id(), bytes));
}

void FuseMount::ioctl(const FuseMessage& request) {
  const auto in = fuse_body<fuse_ioctl_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return channel_.reply(request.id(), ENOTTY);
  const auto data = request.body.subspan(sizeof *in);
  const FuseIoctl call{.request = request.id(),
                       .thread = static_cast<pid_t>(request.header.pid),
                       .command = in->cmd,
                       .argument = in->arg,
                       .input = data.first(std::min<std::size_t>(data.size(), in->in_size)),
                       .output_bytes = in->out_size};
  reply_or_defer(request, Kind::ioctl, *node, node->ioctl(in->fh, call));
}

void FuseMount::poll(const FuseMessage& request) {
  const auto in = fuse_body<fuse_poll_in>(request.body);
  FuseNode* node = in ? node_of(in->fh) : nullptr;
  if (!node) return channel_.reply(request.id(), EBADF);
  const bool sleeps = (in->flags & FUSE_POLL_SCHEDULE_NOTIFY) != 0;
  if (sleeps) pollers_[in->fh] = in->kh;
  fuse_poll_out out{};
  out.revents = node->poll(in->fh, sleeps);
  channel_.reply_with(request.id(), out);
}

void FuseMount::interrupt(const FuseMessage& request) {
  const auto in = fuse_body<fuse_interrupt_in>(request.body);
  if (!in) return;
  // The answer may be on its way: then there is nothing to interrupt.
  if (const auto found = parked_.find(in->unique); found != parked_.end()) {
    found->second.node->interrupted(in->unique);
  }
}

void FuseMount::reply_or_defer(const FuseMessage& request, Kind kind, FuseNode& node,
                               const std::optional<FuseReply>& answer) {
  if (answer) return respond(request.id(), kind, *answer);
  parked_[request.id()] = {kind, &node};
}

void FuseMount::answer(FuseRequest request, const FuseReply& answer) noexcept {
  const auto found = parked_.find(request);
  if (found == parked_.end()) return;
  const Kind kind = found->second.kind;
  parked_.erase(found);
  respond(request, kind, answer);
}

void FuseMount::wake_pollers(FileHandle open) noexcept {
  const auto found = pollers_.find(open);
  if (found == pollers_.end()) return;
  const fuse_notify_poll_wakeup_out out{found->second};
  pollers_.erase(found);
  channel_.notify(FUSE_NOTIFY_POLL, fuse_bytes(out));
}

void FuseMount::respond(FuseRequest id, Kind kind, const FuseReply& answer) noexcept {
  if (answer.error != 0) return channel_.reply(id, answer.error);
  switch (kind) {
    case Kind::read:
      return channel_.reply(id, 0, answer.bytes);
    case Kind::write: {
      fuse_write_out out{};
      out.size = static_cast<std::uint32_t>(answer.result);
      return channel_.reply_with(id, out);
    }
    case Kind::ioctl: {
      fuse_ioctl_out out{};
      out.result = answer.result;
      return channel_.reply_with(id, out, answer.bytes);
    }
  }
}

FuseNode* FuseMount::node_of(FileHandle open) const noexcept {
  const auto found = opens_.find(open);
  return found == opens_.end() ? nullptr : found->second;
}

}  // namespace kerf
