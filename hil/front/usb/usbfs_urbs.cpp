// SPDX-License-Identifier: Apache-2.0
// The transfers of a UsbfsNode: from SUBMITURB to REAPURBNDELAY.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include <linux/usbdevice_fs.h>

#include "hil/front/fuse/caller_memory.hpp"
#include "hil/front/fuse/fuse_channel.hpp"
#include "hil/front/usb/usbfs_node.hpp"

namespace kerf {
namespace {

constexpr std::int32_t kLongestTransfer = 4096;

}  // namespace

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

int UsbfsNode::submit(Open& open, FuseOpen id, const FuseIoctl& call) {
  auto urb = read_urb(call);
  if (!urb) return -EFAULT;
  if (urb->buffer_bytes < 0 || urb->buffer_bytes > kLongestTransfer) return -EINVAL;
  if (urb->type == USBDEVFS_URB_TYPE_CONTROL) {
    return submit_control(open, std::move(*urb), call.thread);
  }
  if (urb->type != USBDEVFS_URB_TYPE_BULK) return -EINVAL;
  if (claimed_by_ && claimed_by_ != id) return -EBUSY;
  claimed_by_ = id;  // the kernel claims for those who forgot, and warns
  return submit_bulk(open, std::move(*urb), call.thread);
}

int UsbfsNode::submit_control(Open& open, Urb urb, pid_t thread) {
  std::array<std::uint8_t, UsbSetup::kBytes> setup{};
  if (urb.buffer_bytes < static_cast<int>(UsbSetup::kBytes)) return -EINVAL;
  if (read_caller(thread, urb.buffer, setup) != setup.size()) return -EFAULT;
  auto said = plug_.control(setup_of(setup));
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
  while (!plug_.deaf() && !open.writes.empty()) {
    Urb urb = std::move(open.writes.front());
    open.writes.pop_front();
    plug_.out(urb.data);
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
