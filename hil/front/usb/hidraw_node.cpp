// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/hidraw_node.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <string_view>

#include <linux/hidraw.h>
#include <linux/input.h>
#include <poll.h>

#include "hil/front/fuse/fuse_channel.hpp"

namespace kerf {
namespace {

constexpr std::size_t kMostReportBytes = 16384;  // HID_MAX_BUFFER_SIZE

}  // namespace

void HidrawNode::open(FileHandle open, int /*file*/) {
  arm_.catch_up(*this);
  opens_[open];
}

FuseReply HidrawNode::take(Open& open, std::size_t size) {
  taken_ = std::move(open.waiting.front());
  open.waiting.pop_front();
  if (open.waiting.empty()) open.announced = false;
  return {.bytes = std::span<const std::uint8_t>(taken_).first(std::min(size, taken_.size()))};
}

/// O_NONBLOCK does not reach a FUSE server, so a read of nothing sleeps: hidapi polls before.
std::optional<FuseReply> HidrawNode::read(FileHandle id, FuseRequest request,
                                          std::uint64_t /*offset*/, std::size_t size) {
  arm_.catch_up(*this);
  deliver();
  Open& open = opens_.at(id);
  if (!open.waiting.empty()) return take(open, size);
  if (open.gone) return FuseReply::fail(EIO);
  open.parked.push_back({request, size});
  return std::nullopt;
}

std::optional<FuseReply> HidrawNode::write(FileHandle id, FuseRequest request,
                                           std::span<const std::uint8_t> bytes) {
  arm_.catch_up(*this);
  deliver();
  if (opens_.at(id).gone) return FuseReply::fail(ENODEV);
  if (bytes.size() < 2 || bytes.size() > kMostReportBytes) return FuseReply::fail(EINVAL);
  used_ = true;
  if (arm_.naks()) {
    opens_.at(id).writes.push_back({request, {bytes.begin(), bytes.end()}});
    return std::nullopt;
  }
  arm_.out(bytes);
  return FuseReply{.result = static_cast<std::int32_t>(bytes.size())};
}

void HidrawNode::take_writes(Open& open) {
  while (!open.writes.empty() && (open.gone || !arm_.naks())) {
    const Open::ParkedWrite write = std::move(open.writes.front());
    open.writes.pop_front();
    if (open.gone) {
      replies_->answer(write.request, FuseReply::fail(ENODEV));
      continue;
    }
    arm_.out(write.report);
    const auto bytes = static_cast<std::int32_t>(write.report.size());
    replies_->answer(write.request, {.result = bytes});
  }
}

std::optional<FuseReply> HidrawNode::ioctl(FileHandle id, const FuseIoctl& call) {
  if (opens_.at(id).gone) return FuseReply::fail(ENODEV);
  const auto say = [this](const auto& value) {
    const auto bytes = fuse_bytes(value);
    answer_.assign(bytes.begin(), bytes.end());
    return FuseReply{.bytes = answer_};
  };
  const auto say_text = [&](std::string_view text) {
    answer_.assign(text.begin(), text.end());
    answer_.push_back(0);
    answer_.resize(std::min(answer_.size(), call.output_bytes));
    return FuseReply{.result = static_cast<std::int32_t>(answer_.size()), .bytes = answer_};
  };
  const auto descriptor = arm_.report_descriptor();
  if (call.command == HIDIOCGRDESCSIZE) return say(static_cast<std::int32_t>(descriptor.size()));
  if (call.command == HIDIOCGRDESC) {
    hidraw_report_descriptor answer{};
    answer.size = static_cast<std::uint32_t>(descriptor.size());
    std::ranges::copy(descriptor, answer.value);
    return say(answer);
  }
  if (call.command == HIDIOCGRAWINFO) {
    return say(hidraw_devinfo{BUS_USB, static_cast<std::int16_t>(arm_.vendor_id()),
                              static_cast<std::int16_t>(arm_.product_id())});
  }
  if (_IOC_TYPE(call.command) != 'H') return FuseReply::fail(EINVAL);
  switch (_IOC_NR(call.command)) {
    case _IOC_NR(HIDIOCGRAWNAME(0)):
      return say_text(WoodenHid::name());
    case _IOC_NR(HIDIOCGRAWPHYS(0)):
      return say_text(WoodenHid::place());
    case _IOC_NR(HIDIOCGRAWUNIQ(0)):
      return say_text(arm_.serial());
    case _IOC_NR(HIDIOCGFEATURE(0)):
    case _IOC_NR(HIDIOCSFEATURE(0)):
      return FuseReply::fail(EPIPE);  // the firmware stalls them
    default:
      return FuseReply::fail(ENOTTY);
  }
}

std::uint32_t HidrawNode::poll(FileHandle id, bool /*sleeps*/) {
  arm_.catch_up(*this);
  Open& open = opens_.at(id);
  deliver();
  std::uint32_t now = POLLOUT | POLLWRNORM;
  if (open.gone) now |= POLLERR | POLLHUP;
  if (open.waiting.empty()) {
    open.announced = open.gone;
  } else {
    now |= POLLIN | POLLRDNORM;
  }
  return now;
}

void HidrawNode::interrupted(FuseRequest request) {
  for (auto& [id, open] : opens_) {
    const auto is_it = [request](const Open::ParkedWrite& write) {
      return write.request == request;
    };
    if (std::erase_if(open.writes, is_it) > 0) {
      return replies_->answer(request, FuseReply::fail(EINTR));
    }
  }
  OpenFilesNode::interrupted(request);
}

std::int64_t HidrawNode::next_wake_ns() const noexcept {
  return opens_.empty() ? std::numeric_limits<std::int64_t>::max() : arm_.time().next_frame_ns();
}

void HidrawNode::wake() {
  arm_.catch_up(*this);
  deliver();
}

void HidrawNode::on_report(std::span<const std::uint8_t> report) {
  for (auto& [id, open] : opens_) {
    if (open.gone) continue;
    if (open.waiting.size() < kWaitingReports) {
      open.waiting.emplace_back(report.begin(), report.end());
    } else {
      ++lost_;
    }
  }
}

void HidrawNode::plugged(bool in) {
  if (in) return;  // an open from before stays gone
  for (auto& [id, open] : opens_) {
    open.gone = true;
    open.announced = false;
  }
}

/// Answers reads that wait for a report, and wakes clients that poll for one.
void HidrawNode::deliver() {
  for (auto& entry : opens_) {
    auto& open = entry.second;
    take_writes(open);
    deliver_to(
        entry.first, open, [&] { return !open.waiting.empty() || open.gone; },
        [&](std::size_t size) {
          return open.waiting.empty() ? FuseReply::fail(EIO) : take(open, size);
        });
  }
}

}  // namespace kerf
