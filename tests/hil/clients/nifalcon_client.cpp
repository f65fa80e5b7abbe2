// SPDX-License-Identifier: Apache-2.0
#include "tests/hil/clients/nifalcon_client.hpp"

#include <algorithm>
#include <cstdint>
#include <stdexcept>

#include <libusb-1.0/libusb.h>

namespace kerf::test {
namespace {

using falcon::FtdiRequest;

constexpr unsigned kTransferMs = 1000;
constexpr int kQuestions = 10;
constexpr int kLooks = 100;
constexpr std::size_t kGreetingRoom = 512 - falcon::kFtdiStatusBytes;

void check(const char* call, int error) {
  if (error < 0) throw std::runtime_error(std::string(call) + ": " + libusb_error_name(error));
}

}  // namespace

NifalconClient::NifalconClient(int node) {
  check("libusb_init", libusb_init(&context_));
  transfer_ = libusb_alloc_transfer(0);
  if (node >= 0) {
    check("libusb_wrap_sys_device", libusb_wrap_sys_device(context_, node, &handle_));
  } else {
    open_first();
  }
  check("libusb_claim_interface", libusb_claim_interface(handle_, 0));
  purge();
  turn_to_packets();
}

NifalconClient::~NifalconClient() {
  libusb_release_interface(handle_, 0);
  if (reading_) libusb_cancel_transfer(transfer_);
  while (reading_) handle_events();
  libusb_close(handle_);
  libusb_free_transfer(transfer_);
  libusb_exit(context_);
}

void NifalconClient::open_first() {
  libusb_device** all = nullptr;
  const ssize_t count = libusb_get_device_list(context_, &all);
  check("libusb_get_device_list", static_cast<int>(count));
  int error = LIBUSB_ERROR_NO_DEVICE;
  for (ssize_t i = 0; i < count && !handle_; ++i) {
    libusb_device_descriptor about{};
    if (libusb_get_device_descriptor(all[i], &about) != 0) continue;
    if (about.idVendor != falcon::kVendorId || about.idProduct != falcon::kProductId) continue;
    error = libusb_open(all[i], &handle_);
  }
  libusb_free_device_list(all, 1);
  check("libusb_open", error);
}

// ---- settings ----

void NifalconClient::control(FtdiRequest request, std::uint16_t value) {
  check("libusb_control_transfer", libusb_control_transfer(handle_, falcon::kFtdiRequestType,
                                                           static_cast<std::uint8_t>(request),
                                                           value, 0, nullptr, 0, kTransferMs));
}

void NifalconClient::purge() {
  control(FtdiRequest::reset, falcon::kFtdiPurgeRx);
  control(FtdiRequest::reset, falcon::kFtdiPurgeTx);
}

void NifalconClient::turn_to_packets() {
  if (reading_) libusb_cancel_transfer(transfer_);
  while (reading_) handle_events();
  control(FtdiRequest::latency, falcon::kRunLatencyMs);
  control(FtdiRequest::baud, falcon::kRunDivisor);
  purge();
}

void NifalconClient::turn_to_boot_loader() {
  purge();
  control(FtdiRequest::latency, falcon::kBootLatencyMs);
  control(FtdiRequest::baud, falcon::kBootDivisor);
  control(FtdiRequest::data, falcon::kFtdi8N1);
  control(FtdiRequest::flow, falcon::kFtdiNoFlowControl);
  control(FtdiRequest::modem, falcon::kFtdiRtsLow);
  control(FtdiRequest::modem, falcon::kFtdiDtrLow);
  control(FtdiRequest::modem, falcon::kFtdiDtrHigh);
}

// ---- calls that wait ----

std::size_t NifalconClient::write(std::span<const std::uint8_t> bytes) {
  int sent = 0;
  // libusb's buffer is not const, because the same call reads.
  check("libusb_bulk_transfer",
        libusb_bulk_transfer(handle_, falcon::kEndpointOut, const_cast<std::uint8_t*>(bytes.data()),
                             static_cast<int>(bytes.size()), &sent, kTransferMs));
  return static_cast<std::size_t>(sent);
}

std::span<const std::uint8_t> NifalconClient::read(std::size_t room) {
  int size = 0;
  check(
      "libusb_bulk_transfer",
      libusb_bulk_transfer(handle_, falcon::kEndpointIn, packet_.data(),
                           static_cast<int>(room + falcon::kFtdiStatusBytes), &size, kTransferMs));
  const auto bytes = std::span(packet_).first(static_cast<std::size_t>(size));
  return bytes.subspan(std::min(bytes.size(), falcon::kFtdiStatusBytes));
}

bool NifalconClient::greeted() {
  for (int i = 0; i < falcon::kBootTries; ++i) {
    static_cast<void>(write(falcon::kBootHello));
    auto heard = read(kGreetingRoom);
    if (heard.size() == falcon::kBootHelloReply.size() + 1 && heard[0] == 0) {
      heard = heard.subspan(1);
    }
    if (std::ranges::equal(heard, falcon::kBootHelloReply)) return true;
  }
  return false;
}

std::string NifalconClient::load(std::span<const std::uint8_t> firmware) {
  turn_to_boot_loader();
  if (!greeted()) return "the greeting was not answered";
  control(FtdiRequest::modem, falcon::kFtdiDtrLow);
  control(FtdiRequest::baud, falcon::kUploadDivisor);
  static_cast<void>(write(falcon::kUploadBegin));
  if (!std::ranges::equal(read(1), falcon::kUploadBegin)) return "the upload did not begin";
  while (!firmware.empty()) {
    const auto chunk = firmware.first(std::min(firmware.size(), falcon::kUploadChunk));
    static_cast<void>(write(chunk));
    for (std::size_t back = 0; back < chunk.size();) {
      const auto heard = read(chunk.size());
      if (heard.size() > chunk.size() - back ||
          !std::ranges::equal(heard, chunk.subspan(back, heard.size()))) {
        return "the echo differs";
      }
      back += heard.size();
    }
    firmware = firmware.subspan(chunk.size());
  }
  turn_to_packets();
  asked_ = false;
  return {};
}

// ---- the read under way ----

void NifalconClient::handle_events() {
  timeval patience{.tv_sec = 0, .tv_usec = 100};
  libusb_handle_events_timeout(context_, &patience);
}

void NifalconClient::ask_to_read() {
  came_ = false;
  if (reading_) return;
  libusb_fill_bulk_transfer(transfer_, handle_, falcon::kEndpointIn, in_.data(),
                            static_cast<int>(in_.size()), read_ended, this, kTransferMs);
  check("libusb_submit_transfer", libusb_submit_transfer(transfer_));
  reading_ = true;
}

void NifalconClient::read_ended(libusb_transfer* transfer) {
  auto& client = *static_cast<NifalconClient*>(transfer->user_data);
  client.reading_ = false;
  client.came_ = transfer->status == LIBUSB_TRANSFER_COMPLETED && transfer->actual_length >= 2;
  client.size_ = client.came_ ? static_cast<std::size_t>(transfer->actual_length) - 2 : 0;
}

/// One runIOLoop(): a packet that came is read, a question is sent if none is out.
std::optional<FalconReport> NifalconClient::look(const FalconCommand& command) {
  handle_events();
  std::optional<FalconReport> report;
  if (asked_) {
    if (!came_) return std::nullopt;
    if (size_ == 0) {  // status alone
      ask_to_read();
      return std::nullopt;
    }
    const auto bytes = std::span(in_).subspan(falcon::kFtdiStatusBytes, size_);
    const auto begin = std::ranges::find(bytes, falcon::kBegin);
    const auto rest = bytes.subspan(static_cast<std::size_t>(begin - bytes.begin()));
    if (rest.size() >= falcon::kPacketBytes) {
      report = falcon::decode_report(rest.first(falcon::kPacketBytes));
    }
    asked_ = false;
  }
  static_cast<void>(write(encode(command)));
  ask_to_read();
  asked_ = true;
  return report;
}

std::optional<FalconReport> NifalconClient::exchange(const FalconCommand& command, int looks) {
  for (int i = 0; i < looks; ++i) {
    if (const auto report = look(command)) return report;
  }
  return std::nullopt;
}

bool NifalconClient::firmware_answers() {
  for (int question = 0; question < kQuestions; ++question) {
    asked_ = false;
    if (exchange({}, kLooks)) return true;
  }
  asked_ = false;
  return false;
}

}  // namespace kerf::test
