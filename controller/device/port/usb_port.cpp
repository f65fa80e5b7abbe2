// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/usb_port.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>
#include <vector>

#include <libusb-1.0/libusb.h>
#include <unistd.h>

#include "controller/device/port/packet_port.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

// Above the servo on its core: a packet comes first, and costs some microseconds.
constexpr std::int64_t kLookNs = 50'000;
constexpr std::int64_t kReplyNs = 2'000'000;   // after that the servo has nothing to say
constexpr std::int64_t kEventsNs = 2'000'000;  // a chip that is well ends a transfer each ms
constexpr std::int64_t kCloseNs = 500'000'000;
constexpr int kMostFailures = 100;
constexpr int kLastPacketMs = 20;
constexpr SoughtDevice kSought{
    .name = "Falcon (0403:cb48)", .port = "usb", .emulation = "--device falcon --port usb"};

}  // namespace

UsbPort::UsbPort(const UsbOptions& options, int patience_ms, const std::atomic<bool>& stop,
                 IoThread io)
    : io_(io) {
  std::vector<std::uint8_t> firmware;
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
  try {
    if (!options.firmware.empty()) firmware = read_firmware(options.firmware);
  } catch (const std::runtime_error& error) {
    refuse_usb(options.where, error.what());
  }
  while (!(device_ = UsbFalcon::open(options.where))) {
    if (stop || std::chrono::steady_clock::now() >= give_up) {
      refuse_usb(options.where, absent_text(kSought, options.where));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  try {
    start_falcon(*device_, firmware);
  } catch (const std::runtime_error& error) {
    refuse_usb(options.where, error.what());
  }
  for (Transfer& read : reads_) prepare(read, falcon::kEndpointIn);
  prepare(write_, falcon::kEndpointOut);
  thread_ = std::thread([this] { run(); });
}

void UsbPort::prepare(Transfer& transfer, std::uint8_t endpoint) {
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
}

UsbPort::~UsbPort() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  const auto free = [](const Transfer& transfer) {
    if (!transfer.busy) libusb_free_transfer(transfer.usb);
  };
  std::ranges::for_each(reads_, free);
  free(write_);
}

bool UsbPort::send_now(std::span<const std::uint8_t> packet) noexcept {
  const bool is_put = send(packet);
  hurry_ = true;
  return is_put;
}

bool UsbPort::send_last(std::span<const std::uint8_t> packet) noexcept {
  if (gettid() == thread_id_) return false;  // nobody is left to send it
  return outbox_.send_and_wait([&] { return send_now(packet); }, kLastPacketMs);
}

UsbLinkStats UsbPort::stats() const noexcept {
  return {packets_, overflow_, strays_, commands_, failures_};
}

std::vector<LinkCounter> UsbPort::counters() const {
  const UsbLinkStats now = stats();
  return {{"packets", now.packets},
          {"overflow", now.overflow},
          {"stray_bytes", now.strays},
          {"commands", now.commands},
          {"failed_transfers", now.failures}};
}

void UsbPort::run() noexcept {
  leave_signals_to_others();
  thread_id_ = gettid();
  become(io_);
  for (Transfer& read : reads_) submit(read);
  while (!closed() && !stop_) {
    send_waiting();
    const std::int64_t now_ns = monotonic_ns();
    if (turns_.ours(now_ns) && now_ns < reply_due_ns_) {
      sleep_until_ns(now_ns + kLookNs);
    } else {
      handle_events(kEventsNs);
      repair();
    }
  }
  stop_ = true;
  send_rest();
  const std::int64_t until_ns = monotonic_ns() + kCloseNs;
  for (Transfer& read : reads_) libusb_cancel_transfer(read.usb);
  libusb_cancel_transfer(write_.usb);
  const auto any_busy = [this] {
    return write_.busy || std::ranges::any_of(reads_, &Transfer::busy);
  };
  while (any_busy() && monotonic_ns() < until_ns) handle_events(kEventsNs);
}

/// Of what waits at the end, as much as the device takes in time.
void UsbPort::send_rest() noexcept {
  const std::int64_t until_ns = monotonic_ns() + kLastPacketMs * 1'000'000;
  while (!closed() && (write_.busy || !outbox_.empty()) && monotonic_ns() < until_ns) {
    hurry_ = true;
    send_waiting();
    handle_events(kEventsNs);
  }
}

void UsbPort::submit(Transfer& transfer) noexcept {
  const int error = libusb_submit_transfer(transfer.usb);
  transfer.busy = error == 0;
  if (error == LIBUSB_ERROR_NO_DEVICE) closed_ = true;
  if (error != 0) failed(transfer);
}

void UsbPort::failed(const Transfer& transfer) noexcept {
  (&transfer == &write_ ? write_halted_ : read_halted_) = true;
  ++failures_;
  if (++failures_in_a_row_ > kMostFailures) closed_ = true;
}

/// The newest command, when it is our turn or will not wait for it.
void UsbPort::send_waiting() noexcept {
  const std::int64_t now_ns = monotonic_ns();
  if (outbox_.empty() || (!hurry_ && !turns_.ours(now_ns))) return;
  if (write_.busy) {  // has grown old on its way
    libusb_cancel_transfer(write_.usb);
    return;
  }
  hurry_ = false;
  const std::size_t size = outbox_.take(write_.bytes);
  if (size == 0) return;
  write_.usb->length = static_cast<int>(size);
  submit(write_);
  if (write_.busy) turns_.sent(now_ns);
  outbox_.set_on_its_way(write_.busy);
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
      if (!is_read) turns_.answered();  // it will not be
      break;
    case LIBUSB_TRANSFER_NO_DEVICE:
      closed_ = true;
      break;
    default:
      failed(transfer);
  }
  if (is_read && !read_halted_ && !stop_ && !closed()) submit(transfer);
  if (!is_read) outbox_.set_on_its_way(false);
}

/// One packet of the chip: two bytes of status, then what came over the serial line.
void UsbPort::hear(std::span<const std::uint8_t> bytes) noexcept {
  for (std::size_t i = falcon::kFtdiStatusBytes; i < bytes.size(); ++i) {
    if (!framer_.take(bytes[i])) continue;
    ++(inbox_.put(framer_.packet()) ? packets_ : overflow_);
    turns_.answered();
    reply_due_ns_ = monotonic_ns() + kReplyNs;
  }
  strays_ = framer_.strays();
  if (!stop_) send_waiting();
}

/// A stalled endpoint is freed, and used again; a packet that was lost there is not repeated. The
/// kernel wants no transfer to wait on an endpoint that is freed, so reads are taken back before.
void UsbPort::repair() noexcept {
  if (std::exchange(write_halted_, false)) {
    libusb_clear_halt(device_->handle(), falcon::kEndpointOut);
  }
  if (!read_halted_) return;
  if (std::ranges::any_of(reads_, &Transfer::busy)) {
    for (Transfer& read : reads_) libusb_cancel_transfer(read.usb);
    return;  // until they have come back
  }
  read_halted_ = false;
  libusb_clear_halt(device_->handle(), falcon::kEndpointIn);
  for (Transfer& read : reads_) submit(read);
}

void UsbPort::handle_events(std::int64_t ns) noexcept {
  timeval patience{0, static_cast<suseconds_t>(ns / 1000)};
  libusb_handle_events_timeout_completed(device_->context(), &patience, nullptr);
}

}  // namespace kerf
