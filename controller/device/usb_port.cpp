// SPDX-License-Identifier: Apache-2.0
#include "controller/device/usb_port.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>
#include <vector>

#include <libusb-1.0/libusb.h>
#include <unistd.h>

#include "shared/posix/cores.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

// Above the servo on its core: a packet comes first, and costs some microseconds.
constexpr int kPriority = 81;
constexpr std::int64_t kLookNs = 50'000;
constexpr std::int64_t kReplyNs = 2'000'000;   // after that the servo has nothing to say
constexpr std::int64_t kEventsNs = 2'000'000;  // a chip that is well ends a transfer each ms
constexpr std::int64_t kCloseNs = 500'000'000;
constexpr int kMostFailures = 100;
constexpr int kLastPacketMs = 20;

}  // namespace

UsbPort::UsbPort(const UsbOptions& options, int patience_ms, const std::atomic<bool>& stop) {
  std::vector<std::uint8_t> firmware;
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
  try {
    if (!options.firmware.empty()) firmware = read_firmware(options.firmware);
  } catch (const std::runtime_error& error) {
    refuse_usb(options.where, error.what());
  }
  while (!(device_ = UsbFalcon::open(options.where))) {
    if (stop || std::chrono::steady_clock::now() >= give_up) {
      refuse_usb(options.where,
                 "no Falcon (0403:cb48) is there; connect one, or try ./kerf demo --device falcon "
                 "--port usb");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  try {
    start_falcon(*device_, firmware);
  } catch (const std::runtime_error& error) {
    refuse_usb(options.where, error.what());
  }
  const auto prepare = [this](Transfer& transfer, std::uint8_t endpoint) {
    transfer.port = this;
    transfer.usb = libusb_alloc_transfer(0);
    libusb_fill_bulk_transfer(
        transfer.usb, device_->handle(), endpoint, transfer.bytes.data(),
        static_cast<int>(transfer.bytes.size()),
        [](libusb_transfer* usb) {
          auto& done = *static_cast<Transfer*>(usb->user_data);
          done.port->finished(done);
        },
        &transfer, 0);
  };
  for (Transfer& read : reads_) prepare(read, falcon::kEndpointIn);
  for (Transfer& write : writes_) prepare(write, falcon::kEndpointOut);
  thread_ = std::thread([this] { run(); });
}

UsbPort::~UsbPort() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  for (Transfer& transfer : transfers_) {
    if (!transfer.busy) libusb_free_transfer(transfer.usb);
  }
}

bool UsbPort::send_last(std::span<const std::uint8_t> packet) noexcept {
  if (gettid() == thread_id_) return false;  // nobody is left to send it
  return outbox_.send_and_wait([&] { return send(packet); }, kLastPacketMs);
}

bool UsbPort::wait(int milliseconds) noexcept {
  const std::int64_t until_ns = monotonic_ns() + std::int64_t{milliseconds} * 1'000'000;
  while (inbox_.empty() && !closed()) {
    const std::int64_t now_ns = monotonic_ns();
    if (now_ns >= until_ns) return false;
    sleep_until_ns(std::min(until_ns, now_ns + kLookNs));
  }
  return !inbox_.empty();
}

UsbLinkStats UsbPort::stats() const noexcept {
  return {packets_, overflow_, strays_, commands_, failures_};
}

void UsbPort::run() noexcept {
  thread_id_ = gettid();
  // Without the right to either, packets come later; the servo's own start tells the user.
  static_cast<void>(pin_to_core(allowed_cores().back()));
  static_cast<void>(set_fifo(kPriority));
  for (Transfer& read : reads_) submit(read);
  while (!closed()) {
    send_waiting();
    if (stop_ && outbox_.empty() && !any_busy(writes_)) break;
    const std::int64_t now_ns = monotonic_ns();
    if (now_ns < reply_due_ns_) {
      sleep_until_ns(now_ns + kLookNs);
    } else {
      handle_events(kEventsNs);
      repair();
    }
  }
  stop_ = true;
  const std::int64_t until_ns = monotonic_ns() + kCloseNs;
  for (Transfer& transfer : transfers_) libusb_cancel_transfer(transfer.usb);
  while (any_busy(transfers_) && monotonic_ns() < until_ns) {
    handle_events(kEventsNs);
  }
}

void UsbPort::submit(Transfer& transfer) noexcept {
  const int error = libusb_submit_transfer(transfer.usb);
  transfer.busy = error == 0;
  transfer.halted = false;
  if (error == LIBUSB_ERROR_NO_DEVICE) closed_ = true;
  if (error != 0) {
    transfer.halted = true;
    ++failures_;
    if (++failures_in_a_row_ > kMostFailures) closed_ = true;
  }
}

void UsbPort::send_waiting() noexcept {
  if (outbox_.empty()) return;
  for (Transfer& write : writes_) {
    if (write.busy) continue;
    const std::size_t size = outbox_.take(write.bytes);
    if (size == 0) break;
    write.usb->length = static_cast<int>(size);
    submit(write);
    reply_due_ns_ = 0;
  }
  outbox_.set_on_its_way(any_busy(writes_));
}

void UsbPort::finished(Transfer& transfer) noexcept {
  transfer.busy = false;
  const bool is_read = transfer.usb->endpoint == falcon::kEndpointIn;
  switch (transfer.usb->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      failures_in_a_row_ = 0;
      if (is_read) {
        hear(
            std::span(transfer.bytes).first(static_cast<std::size_t>(transfer.usb->actual_length)));
      } else {
        ++commands_;
      }
      break;
    case LIBUSB_TRANSFER_CANCELLED:
      break;
    case LIBUSB_TRANSFER_NO_DEVICE:
      closed_ = true;
      break;
    default:
      transfer.halted = true;
      ++failures_;
      if (++failures_in_a_row_ > kMostFailures) closed_ = true;
  }
  if (is_read && !transfer.halted && !stop_ && !closed()) submit(transfer);
  if (!is_read) outbox_.set_on_its_way(any_busy(writes_));
}

/// One packet of the chip: two bytes of status, then what came over the serial line.
void UsbPort::hear(std::span<const std::uint8_t> bytes) noexcept {
  for (std::size_t i = falcon::kFtdiStatusBytes; i < bytes.size(); ++i) {
    if (!framer_.take(bytes[i])) continue;
    ++(inbox_.put(framer_.packet()) ? packets_ : overflow_);
    reply_due_ns_ = monotonic_ns() + kReplyNs;
  }
  strays_ = framer_.strays();
}

/// A stalled endpoint is freed, and read from again; a packet that was lost there is not repeated.
void UsbPort::repair() noexcept {
  const auto clear = [this](Transfer& transfer) {
    if (transfer.halted) libusb_clear_halt(device_->handle(), transfer.usb->endpoint);
    return std::exchange(transfer.halted, false);
  };
  for (Transfer& write : writes_) clear(write);
  for (Transfer& read : reads_) {
    if (clear(read)) submit(read);
  }
}

void UsbPort::handle_events(std::int64_t ns) noexcept {
  timeval patience{0, static_cast<suseconds_t>(ns / 1000)};
  libusb_handle_events_timeout_completed(device_->context(), &patience, nullptr);
}

bool UsbPort::any_busy(std::span<const Transfer> transfers) const noexcept {
  return std::ranges::any_of(transfers, &Transfer::busy);
}

}  // namespace kerf
