// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/usb_port.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <libusb-1.0/libusb.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

constexpr int kInterface = 0;
constexpr unsigned kTransferMs = 1000;
constexpr const char* kGiveRight =
    "; give your user the right: a udev rule with ATTRS{idVendor}==\"0403\", "
    "ATTRS{idProduct}==\"cb48\", TAG+=\"uaccess\" (docs/first-hour.md)";

// The I/O thread runs above the servo on its core: a packet comes first, and costs some
// microseconds.
constexpr std::int64_t kPollNs = 50'000;
constexpr std::int64_t kReplyNs = 2'000'000;   // later the servo sends no answer
constexpr std::int64_t kEventsNs = 2'000'000;  // a working chip ends a transfer each ms
constexpr std::int64_t kCloseNs = 500'000'000;
constexpr int kMostFailures = 100;
constexpr SoughtDevice kSought{
    .name = "Falcon (0403:cb48)", .port = "usb", .emulation = "--device falcon --port usb"};

/// Throws the line for the user; `where` as given.
[[noreturn]] void refuse_usb(const std::string& where, const std::string& rest) {
  throw std::runtime_error("--port usb" + (where.empty() ? "" : ":" + where) + ": " + rest);
}

[[noreturn]] void fail(const char* what, int error) {
  throw std::runtime_error(std::string(what) + ": " + libusb_strerror(error) +
                           "; unplug the device, plug it in again");
}

bool is_falcon(libusb_device* device) noexcept {
  libusb_device_descriptor about{};
  return libusb_get_device_descriptor(device, &about) == 0 && about.idVendor == falcon::kVendorId &&
         about.idProduct == falcon::kProductId;
}

std::string node_of(libusb_device* device) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "/dev/bus/usb/%03u/%03u", libusb_get_bus_number(device),
                libusb_get_device_address(device));
  return text.data();
}

std::string serial_of(libusb_device_handle* handle) {
  libusb_device_descriptor about{};
  std::array<unsigned char, 128> text{};
  if (libusb_get_device_descriptor(libusb_get_device(handle), &about) != 0) return {};
  const int size = libusb_get_string_descriptor_ascii(handle, about.iSerialNumber, text.data(),
                                                      static_cast<int>(text.size()));
  return {text.begin(), text.begin() + std::max(size, 0)};
}

/// One device that was found, open if that is allowed.
struct Found {
  std::string node, serial;
  libusb_device_handle* handle = nullptr;
  int error = 0;
};

std::vector<Found> list_falcons(libusb_context* context) {
  std::vector<Found> all;
  libusb_device** devices = nullptr;
  const ssize_t count = libusb_get_device_list(context, &devices);
  for (ssize_t i = 0; i < count; ++i) {
    if (!is_falcon(devices[i])) continue;
    Found& found = all.emplace_back();
    found.node = node_of(devices[i]);
    found.error = libusb_open(devices[i], &found.handle);
    if (found.error == 0) found.serial = serial_of(found.handle);
  }
  if (devices) libusb_free_device_list(devices, 1);
  std::ranges::sort(all, {}, &Found::node);
  return all;
}

}  // namespace

UsbOptions parse_usb_port(std::string_view text) {
  UsbOptions options;
  if (!text.empty() && text.front() == ':') text.remove_prefix(1);
  options.where = text.substr(0, text.find(','));
  text.remove_prefix(options.where.size());
  if (text.empty()) return options;
  constexpr std::string_view kFirmware = ",firmware=";
  if (!text.starts_with(kFirmware) || text.size() == kFirmware.size()) {
    refuse_usb("", "'" + std::string(text.substr(1)) + "' is not known; use firmware=FILE");
  }
  options.firmware = text.substr(kFirmware.size());
  return options;
}

UsbFalcon::UsbFalcon() {
  if (const int error = libusb_init(&context_); error != 0) fail("libusb", error);
}

UsbFalcon::~UsbFalcon() {
  if (handle_) {
    libusb_release_interface(handle_, kInterface);
    libusb_close(handle_);
  }
  if (fd_ >= 0) close(fd_);
  libusb_exit(context_);
}

std::unique_ptr<UsbFalcon> UsbFalcon::open(const std::string& where) {
  std::unique_ptr<UsbFalcon> device(new UsbFalcon);
  const bool is_path = where.find('/') != std::string::npos;
  if (!(is_path ? device->open_node(where) : device->open_found(where))) return nullptr;
  device->claim(where);
  return device;
}

bool UsbFalcon::open_node(const std::string& path) {
  fd_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd_ < 0 && errno == ENOENT) return false;
  if (fd_ < 0) {
    refuse_usb(path, "cannot be opened (" + std::generic_category().message(errno) + ")" +
                         (errno == EACCES ? kGiveRight
                                          : std::string("; ") +
                                                remedy_for(errno, "name the node of a Falcon")));
  }
  const int error = libusb_wrap_sys_device(context_, static_cast<std::intptr_t>(fd_), &handle_);
  if (error != 0) {
    refuse_usb(path, std::string("is no USB device (") + libusb_strerror(error) +
                         "); name a node below /dev/bus/usb");
  }
  if (!is_falcon(libusb_get_device(handle_))) {
    refuse_usb(path, "is another device than a Falcon (0403:cb48); see lsusb");
  }
  return true;
}

bool UsbFalcon::open_found(const std::string& serial) {
  std::vector<Found> all = list_falcons(context_);
  if (!serial.empty()) {
    const auto is_other = [&](const Found& f) { return f.error == 0 && f.serial != serial; };
    for (const Found& found : all) {
      if (is_other(found)) libusb_close(found.handle);
    }
    std::erase_if(all, is_other);
  }
  if (all.empty()) return false;
  const Found first = all.front();
  if (all.size() == 1 && first.error == 0) {
    handle_ = first.handle;
    return true;
  }
  std::string list;
  for (const Found& found : all) {
    if (found.handle) libusb_close(found.handle);
    list += " " + found.node + (found.serial.empty() ? "" : " (" + found.serial + ")");
  }
  if (all.size() > 1) {
    refuse_usb(serial, "several Falcons are there:" + list + "; name one by its node or serial");
  }
  refuse_usb(serial,
             first.node + " cannot be opened (" + libusb_strerror(first.error) + ")" + kGiveRight);
}

void UsbFalcon::claim(const std::string& where) {
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  const int error = libusb_claim_interface(handle_, kInterface);
  if (error == 0) return;
  refuse_usb(where, std::string("cannot be claimed (") + libusb_strerror(error) +
                        "); end the program that uses it");
}

void UsbFalcon::control(falcon::FtdiRequest request, std::uint16_t value) {
  const int error =
      libusb_control_transfer(handle_, falcon::kFtdiRequestType, static_cast<std::uint8_t>(request),
                              value, 0, nullptr, 0, kTransferMs);
  if (error < 0) fail("a setting was refused", error);
}

void UsbFalcon::write(std::span<const std::uint8_t> bytes) {
  int sent = 0;
  // The buffer of libusb is not const, because the same call reads.
  const int error =
      libusb_bulk_transfer(handle_, falcon::kEndpointOut, const_cast<std::uint8_t*>(bytes.data()),
                           static_cast<int>(bytes.size()), &sent, kTransferMs);
  if (error < 0) fail("bytes were not taken", error);
}

std::size_t UsbFalcon::read(std::span<std::uint8_t> out, int milliseconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(milliseconds);
  std::array<std::uint8_t, falcon::kFtdiPacketBytes> packet{};
  do {
    int size = 0;
    const int error = libusb_bulk_transfer(handle_, falcon::kEndpointIn, packet.data(),
                                           static_cast<int>(packet.size()), &size,
                                           static_cast<unsigned>(std::max(milliseconds, 1)));
    if (error < 0 && error != LIBUSB_ERROR_TIMEOUT) fail("bytes did not come", error);
    const auto payload = std::span(packet).first(static_cast<std::size_t>(size));
    if (payload.size() <= falcon::kFtdiStatusBytes) continue;  // status alone
    const auto bytes = payload.subspan(falcon::kFtdiStatusBytes);
    std::copy_n(bytes.begin(), std::min(bytes.size(), out.size()), out.begin());
    return std::min(bytes.size(), out.size());
  } while (std::chrono::steady_clock::now() < deadline);
  return 0;
}

// The port.

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
    firmware_tries_ = start_falcon(*device_, firmware);
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

UsbLinkStats UsbPort::stats() const noexcept {
  return {packets_, overflow_, strays_, commands_, failures_};
}

std::vector<LinkCounter> UsbPort::counters() const {
  const UsbLinkStats now = stats();
  return {{"packets", now.packets},
          {"overflow", now.overflow},
          {"stray_bytes", now.strays},
          {"commands", now.commands},
          {"failed_transfers", now.failures},
          {"firmware_tries", static_cast<std::uint64_t>(firmware_tries_)}};
}

void UsbPort::run() noexcept {
  block_signals();
  sender_id_ = gettid();
  become(io_);
  for (Transfer& read : reads_) submit(read);
  while (!gone_ && !stop_) {
    send_waiting();
    const std::int64_t now_ns = monotonic_ns();
    if (turns_.ours(now_ns) && now_ns < reply_due_ns_) {
      sleep_until_ns(now_ns + kPollNs);
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

/// Sends the waiting packets at the end, as many as the device takes in time.
void UsbPort::send_rest() noexcept {
  const std::int64_t until_ns = monotonic_ns() + kLastPacketMs * 1'000'000;
  while (!gone_ && (write_.busy || !outbox_.empty()) && monotonic_ns() < until_ns) {
    hurry_ = true;
    send_waiting();
    handle_events(kEventsNs);
  }
}

void UsbPort::submit(Transfer& transfer) noexcept {
  const int error = libusb_submit_transfer(transfer.usb);
  transfer.busy = error == 0;
  if (error == LIBUSB_ERROR_NO_DEVICE) closed_ = gone_ = true;
  if (error != 0) failed(transfer);
}

void UsbPort::failed(const Transfer& transfer) noexcept {
  (&transfer == &write_ ? write_halted_ : read_halted_) = true;
  ++failures_;
  if (++failures_in_a_row_ > kMostFailures) closed_ = true;
}

/// Sends the newest command, in its turn or if it is urgent.
void UsbPort::send_waiting() noexcept {
  const std::int64_t now_ns = monotonic_ns();
  if (outbox_.empty() || (!hurry_ && !turns_.ours(now_ns))) return;
  if (write_.busy) {  // outdated before the device took it
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
      if (!is_read) turns_.answered();  // there will be no answer
      break;
    case LIBUSB_TRANSFER_NO_DEVICE:
      closed_ = gone_ = true;
      break;
    default:
      failed(transfer);
  }
  if (is_read && !read_halted_ && !stop_ && !closed()) submit(transfer);
  if (!is_read) outbox_.set_on_its_way(false);
}

/// One packet of the chip: two bytes of status, then the bytes of the serial line.
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

/// Clears a stalled endpoint and uses it again; a packet that was lost there is not repeated. The
/// kernel allows no pending transfer on an endpoint that is cleared, so reads are cancelled before.
void UsbPort::repair() noexcept {
  if (std::exchange(write_halted_, false)) {
    libusb_clear_halt(device_->handle(), falcon::kEndpointOut);
  }
  if (!read_halted_ || closed()) return;
  if (std::ranges::any_of(reads_, &Transfer::busy)) {
    for (Transfer& read : reads_) libusb_cancel_transfer(read.usb);
    return;  // until they have ended
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
