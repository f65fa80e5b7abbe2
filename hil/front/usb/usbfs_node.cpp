// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/usbfs_node.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <limits>

#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <sys/ioctl.h>

#include "hil/front/fuse/fuse_channel.hpp"

namespace kerf {
namespace {

constexpr std::uint32_t kCapabilities =
    USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
constexpr int kFullSpeed = 2;  // enum usb_device_speed

std::uint64_t address_of(const void* pointer) noexcept {
  return reinterpret_cast<std::uintptr_t>(pointer);  // of another process: never followed here
}

/// A structure that the number of the ioctl does not let travel, as the kernel's usbfs reads it.
template <class T>
std::optional<T> argument(const FuseIoctl& call) noexcept {
  T value{};
  std::span<std::uint8_t> bytes(reinterpret_cast<std::uint8_t*>(&value), sizeof value);
  if (read_caller(call.thread, call.argument, bytes) != sizeof value) return std::nullopt;
  return value;
}

constexpr std::int32_t kLongestTransfer = 4096;

}  // namespace

void UsbfsNode::open(FileHandle open, int /*file*/) {
  catch_up();
  opens_[open];
}

void UsbfsNode::release(FileHandle open) {
  if (claimed_by_ == open) claimed_by_.reset();
  OpenFilesNode::release(open);
}

std::optional<FuseReply> UsbfsNode::read(FileHandle open, FuseRequest /*request*/,
                                         std::uint64_t offset, std::size_t size) {
  if (opens_.at(open).gone) return FuseReply::fail(ENODEV);
  const auto all = FtdiFalcon::descriptors();
  const auto rest = all.subspan(std::min<std::size_t>(offset, all.size()));
  return FuseReply{.bytes = rest.first(std::min(size, rest.size()))};
}

std::optional<FuseReply> UsbfsNode::ioctl(FileHandle id, const FuseIoctl& call) {
  catch_up();
  Open& open = opens_.at(id);
  const auto answer = [this](int result) {
    deliver();
    return result < 0 ? FuseReply::fail(-result) : FuseReply{.result = result};
  };
  if (call.command == USBDEVFS_REAPURBNDELAY) return answer(reap(open, call));
  if (open.gone) return FuseReply::fail(ENODEV);
  switch (call.command) {
    case USBDEVFS_SUBMITURB:
      return answer(submit(open, id, call));
    case USBDEVFS_DISCARDURB:
      return answer(discard(open, call.argument));
    case USBDEVFS_CONTROL:
      return control(call);
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:  // no driver of the kernel is there to be disconnected
      return answer(claim(id, call));
    case USBDEVFS_RELEASEINTERFACE:
      return answer(give_up_interface(id));
    case USBDEVFS_CLEAR_HALT:
      return answer(clear_halt(call));
    case USBDEVFS_SETINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_RESET:
      return answer(0);
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:
      return answer(-ENODATA);  // no driver is bound
    case USBDEVFS_GET_SPEED:
      return answer(kFullSpeed);
    case USBDEVFS_CONNECTINFO:
      return answer(connect_info(call));
    case USBDEVFS_GET_CAPABILITIES:
      return FuseReply{.bytes = fuse_bytes(kCapabilities)};
    default:
      return answer(-ENOTTY);
  }
}

int UsbfsNode::connect_info(const FuseIoctl& call) {
  const usbdevfs_connectinfo info{.devnum = 2, .slow = 0};
  return write_caller(call.thread, call.argument, fuse_bytes(info)) ? 0 : -EFAULT;
}

FuseReply UsbfsNode::control(const FuseIoctl& call) {
  const auto request = fuse_body<usbdevfs_ctrltransfer>(call.input);
  if (!request) return FuseReply::fail(EINVAL);
  const auto said = falcon_.control({request->bRequestType, request->bRequest, request->wValue,
                                     request->wIndex, request->wLength});
  if (!said) return FuseReply::fail(EPIPE);
  if (!said->empty() && !write_caller(call.thread, address_of(request->data), *said)) {
    return FuseReply::fail(EFAULT);
  }
  return {.result = static_cast<std::int32_t>(said->size())};
}

int UsbfsNode::claim(FileHandle id, const FuseIoctl& call) {
  const auto interface = argument<std::uint32_t>(call);  // the first word of either structure
  if (!interface) return -EFAULT;
  if (*interface != 0) return -ENOENT;
  if (claimed_by_ && claimed_by_ != id) return -EBUSY;
  claimed_by_ = id;
  return 0;
}

int UsbfsNode::give_up_interface(FileHandle id) {
  if (claimed_by_ != id) return -EINVAL;
  claimed_by_.reset();
  end_transfers(opens_.at(id), -ENOENT);
  return 0;
}

int UsbfsNode::clear_halt(const FuseIoctl& call) {
  const auto endpoint = argument<std::uint32_t>(call);
  if (!endpoint) return -EFAULT;
  if (*endpoint == falcon::kEndpointIn && reader()) ++rash_clears_;
  return falcon_.clear_halt(*endpoint) ? 0 : -ENOENT;
}

std::uint32_t UsbfsNode::poll(FileHandle id, bool /*sleeps*/) {
  catch_up();
  Open& open = opens_.at(id);
  deliver();
  std::uint32_t now = 0;
  if (open.gone) now |= POLLHUP | POLLERR;
  if (open.done.empty()) {
    open.announced = open.gone;
  } else {
    now |= POLLOUT | POLLWRNORM;
  }
  return now;
}

std::int64_t UsbfsNode::next_wake_ns() const noexcept {
  return opens_.empty() ? std::numeric_limits<std::int64_t>::max() : chip().time().next_frame_ns();
}

void UsbfsNode::wake() {
  catch_up();
  deliver();
}

void UsbfsNode::catch_up() {
  falcon_.catch_up(*this);
  for (auto& [id, open] : opens_) take_writes(open);
}

void UsbfsNode::plugged(bool in) {
  if (in) return;  // an open from before stays gone
  claimed_by_.reset();
  for (auto& [id, open] : opens_) {
    open.gone = true;
    open.announced = false;
    end_transfers(open, -ESHUTDOWN);
  }
}

void UsbfsNode::deliver() {
  for (auto& entry : opens_) {
    auto& open = entry.second;
    deliver_to(
        entry.first, open, [&] { return !open.done.empty() || open.gone; },
        [](std::size_t) { return FuseReply{}; });  // no read sleeps here
  }
}

// ---- transfers, from SUBMITURB to REAPURBNDELAY ----

std::optional<UsbfsNode::Urb> UsbfsNode::read_urb(const FuseIoctl& call) noexcept {
  std::array<std::uint8_t, sizeof(usbdevfs_urb)> bytes{};  // it ends in an array without a size
  if (read_caller(call.thread, call.argument, bytes) != bytes.size()) return std::nullopt;
  const auto get = [&](auto& value, std::size_t offset) {
    std::memcpy(&value, &bytes[offset], sizeof value);
  };
  Urb urb;
  urb.address = call.argument;
  get(urb.type, offsetof(usbdevfs_urb, type));
  get(urb.endpoint, offsetof(usbdevfs_urb, endpoint));
  get(urb.buffer, offsetof(usbdevfs_urb, buffer));
  get(urb.buffer_bytes, offsetof(usbdevfs_urb, buffer_length));
  return urb;
}

int UsbfsNode::submit(Open& open, FileHandle id, const FuseIoctl& call) {
  auto urb = read_urb(call);
  if (!urb) return -EFAULT;
  if (urb->buffer_bytes < 0 || urb->buffer_bytes > kLongestTransfer) return -EINVAL;
  if (urb->type == USBDEVFS_URB_TYPE_CONTROL) {
    return submit_control(open, std::move(*urb), call.thread);
  }
  if (urb->type != USBDEVFS_URB_TYPE_BULK) return -EINVAL;
  if (claimed_by_ && claimed_by_ != id) return -EBUSY;
  claimed_by_ = id;  // the kernel claims for a client that did not, and warns
  return submit_bulk(open, std::move(*urb), call.thread);
}

int UsbfsNode::submit_control(Open& open, Urb urb, pid_t thread) {
  std::array<std::uint8_t, UsbSetup::kBytes> setup{};
  if (urb.buffer_bytes < static_cast<int>(UsbSetup::kBytes)) return -EINVAL;
  if (read_caller(thread, urb.buffer, setup) != setup.size()) return -EFAULT;
  auto said = falcon_.control(setup_of(setup));
  if (said) urb.data = std::move(*said);
  urb.data_offset = UsbSetup::kBytes;
  urb.actual_bytes = static_cast<int>(urb.data.size());
  finish(open, std::move(urb), said ? 0 : -EPIPE);
  return 0;
}

int UsbfsNode::submit_bulk(Open& open, Urb urb, pid_t thread) {
  if (urb.endpoint == falcon::kEndpointIn) {
    open.reads.push_back(std::move(urb));
    return 0;
  }
  if (urb.endpoint != falcon::kEndpointOut) return -ENOENT;
  urb.data.resize(static_cast<std::size_t>(urb.buffer_bytes));
  if (read_caller(thread, urb.buffer, urb.data) != urb.data.size()) return -EFAULT;
  used_ = true;
  open.writes.push_back(std::move(urb));
  take_writes(open);
  return 0;
}

void UsbfsNode::take_writes(Open& open) {
  while (!falcon_.naks() && !open.writes.empty()) {
    Urb urb = std::move(open.writes.front());
    open.writes.pop_front();
    falcon_.out(urb.data);
    urb.data.clear();  // nothing comes back
    urb.actual_bytes = urb.buffer_bytes;
    finish(open, std::move(urb), 0);
  }
}

void UsbfsNode::finish(Open& open, Urb urb, int status) {
  urb.status = status;
  open.done.push_back(std::move(urb));
}

int UsbfsNode::reap(Open& open, const FuseIoctl& call) {
  if (open.done.empty()) return open.gone ? -ENODEV : -EAGAIN;
  const Urb urb = std::move(open.done.front());
  open.done.pop_front();
  const auto put = [&](std::uint64_t address, std::span<const std::uint8_t> bytes) {
    return bytes.empty() || write_caller(call.thread, address, bytes);
  };
  const bool written =
      put(urb.buffer + urb.data_offset, urb.data) &&
      put(urb.address + offsetof(usbdevfs_urb, status), fuse_bytes(urb.status)) &&
      put(urb.address + offsetof(usbdevfs_urb, actual_length), fuse_bytes(urb.actual_bytes)) &&
      put(call.argument, fuse_bytes(urb.address));
  return written ? 0 : -EFAULT;
}

int UsbfsNode::discard(Open& open, std::uint64_t address) {
  for (std::deque<Urb>* const urbs : {&open.reads, &open.writes}) {
    const auto found = std::ranges::find(*urbs, address, &Urb::address);
    if (found == urbs->end()) continue;
    Urb urb = std::move(*found);
    urbs->erase(found);
    urb.data.clear();
    finish(open, std::move(urb), -ENOENT);
    return 0;
  }
  return -EINVAL;
}

void UsbfsNode::end_transfers(Open& open, int status) {
  for (std::deque<Urb>* const urbs : {&open.reads, &open.writes}) {
    for (; !urbs->empty(); urbs->pop_front()) {
      urbs->front().data.clear();
      finish(open, std::move(urbs->front()), status);
    }
  }
}

UsbfsNode::Open* UsbfsNode::reader() {
  for (auto& [id, open] : opens_) {
    if (!open.reads.empty()) return &open;
  }
  return nullptr;
}

std::optional<std::size_t> UsbfsNode::room() {
  const Open* open = reader();
  if (!open) return std::nullopt;
  return static_cast<std::size_t>(open->reads.front().buffer_bytes);
}

void UsbfsNode::complete_read(int status, std::span<const std::uint8_t> bytes) {
  Open& open = *reader();
  Urb urb = std::move(open.reads.front());
  open.reads.pop_front();
  urb.data.assign(bytes.begin(), bytes.end());
  urb.actual_bytes = static_cast<int>(bytes.size());
  finish(open, std::move(urb), status);
}

}  // namespace kerf
