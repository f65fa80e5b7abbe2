// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/usbfs_node.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <limits>

#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <sys/ioctl.h>

#include "hil/front/fuse/caller_memory.hpp"
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

}  // namespace

void UsbfsNode::open(FuseOpen open) {
  catch_up();
  opens_[open];
}

void UsbfsNode::release(FuseOpen open) {
  if (claimed_by_ == open) claimed_by_.reset();
  opens_.erase(open);
}

std::optional<FuseAnswer> UsbfsNode::read(FuseOpen open, FuseRequest /*request*/,
                                          std::uint64_t offset, std::size_t size) {
  if (opens_.at(open).gone) return FuseAnswer::fail(ENODEV);
  const auto all = FtdiFalcon::descriptors();
  const auto rest = all.subspan(std::min<std::size_t>(offset, all.size()));
  return FuseAnswer{.bytes = rest.first(std::min(size, rest.size()))};
}

std::optional<FuseAnswer> UsbfsNode::ioctl(FuseOpen id, const FuseIoctl& call) {
  catch_up();
  Open& open = opens_.at(id);
  const auto answer = [this](int result) {
    deliver();
    return result < 0 ? FuseAnswer::fail(-result) : FuseAnswer{.result = result};
  };
  if (call.command == USBDEVFS_REAPURBNDELAY) return answer(reap(open, call));
  if (open.gone) return FuseAnswer::fail(ENODEV);
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
      return FuseAnswer{.bytes = fuse_bytes(kCapabilities)};
    default:
      return answer(-ENOTTY);
  }
}

int UsbfsNode::connect_info(const FuseIoctl& call) {
  const usbdevfs_connectinfo info{.devnum = 2, .slow = 0};
  return write_caller(call.thread, call.argument, fuse_bytes(info)) ? 0 : -EFAULT;
}

FuseAnswer UsbfsNode::control(const FuseIoctl& call) {
  const auto request = fuse_body<usbdevfs_ctrltransfer>(call.input);
  if (!request) return FuseAnswer::fail(EINVAL);
  const auto said = plug_.control({request->bRequestType, request->bRequest, request->wValue,
                                   request->wIndex, request->wLength});
  if (!said) return FuseAnswer::fail(EPIPE);
  if (!said->empty() && !write_caller(call.thread, address_of(request->data), *said)) {
    return FuseAnswer::fail(EFAULT);
  }
  return {.result = static_cast<std::int32_t>(said->size())};
}

int UsbfsNode::claim(FuseOpen id, const FuseIoctl& call) {
  const auto interface = argument<std::uint32_t>(call);  // the first word of either structure
  if (!interface) return -EFAULT;
  if (*interface != 0) return -ENOENT;
  if (claimed_by_ && claimed_by_ != id) return -EBUSY;
  claimed_by_ = id;
  return 0;
}

int UsbfsNode::give_up_interface(FuseOpen id) {
  if (claimed_by_ != id) return -EINVAL;
  claimed_by_.reset();
  end_transfers(opens_.at(id), -ENOENT);
  return 0;
}

int UsbfsNode::clear_halt(const FuseIoctl& call) {
  const auto endpoint = argument<std::uint32_t>(call);
  if (!endpoint) return -EFAULT;
  if (*endpoint == falcon::kEndpointIn && reader()) ++rash_clears_;
  return plug_.clear_halt(*endpoint) ? 0 : -ENOENT;
}

std::uint32_t UsbfsNode::poll(FuseOpen id, bool /*sleeps*/) {
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
  plug_.catch_up(*this);
  for (auto& [id, open] : opens_) take_writes(open);
}

void UsbfsNode::plugged(bool in) {
  if (in) return;  // whoever had it open finds it gone all the same
  claimed_by_.reset();
  for (auto& [id, open] : opens_) {
    open.gone = true;
    open.announced = false;
    end_transfers(open, -ESHUTDOWN);
  }
}

void UsbfsNode::deliver() {
  for (auto& [id, open] : opens_) {
    if (open.announced || (open.done.empty() && !open.gone)) continue;
    open.announced = true;
    replies_->wake_pollers(id);
  }
}

}  // namespace kerf
