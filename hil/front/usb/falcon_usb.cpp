// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/falcon_usb.hpp"

#include <algorithm>
#include <cerrno>

namespace kerf {
namespace {

using falcon::FtdiRequest;

constexpr std::size_t kDeviceBytes = 18;
constexpr std::uint8_t kSerialText = 3;

// USB 2.0, chapter 9.6.
constexpr auto kDescriptors = usb_bytes(
    18, 1, 0x00, 0x02, 0, 0, 0, 8, low(falcon::kVendorId), high(falcon::kVendorId),
    low(falcon::kProductId), high(falcon::kProductId), 0x00, 0x06, 1, 2, kSerialText, 1,  // device
    9, 2, 32, 0, 1, 1, 0, 0xA0, 45,          // configuration
    9, 4, 0, 0, 2, 0xFF, 0xFF, 0xFF, 2,      // interface
    7, 5, falcon::kEndpointIn, 2, 64, 0, 0,  // two bulk endpoints of 64 bytes
    7, 5, falcon::kEndpointOut, 2, 64, 0, 0);

constexpr std::uint8_t kToHost = 0x80;
constexpr std::uint8_t kGetDescriptor = 6;
constexpr std::uint8_t kGetConfiguration = 8;
constexpr std::uint8_t kStatusOfModem = 0x01;  // reserved bit, always set
constexpr std::uint8_t kStatusOfLine = 0x60;   // transmitter empty

std::vector<std::uint8_t> string_descriptor(std::string_view text) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char letter : text) {
    bytes.push_back(static_cast<std::uint8_t>(letter));
    bytes.push_back(0);
  }
  return bytes;
}

constexpr std::uint8_t kToEndpoint = 0x02;    // bmRequestType (USB 2.0, 9.4)
constexpr std::uint8_t kClearFeature = 0x01;  // value 0: ENDPOINT_HALT

}  // namespace

void FalconBootLoader::set_divisor(std::uint16_t divisor) noexcept {
  divisor_ = divisor;
  if (state_ == State::loading && divisor == falcon::kRunDivisor && stored_ > 0) {
    state_ = State::running;
  }
}

void FalconBootLoader::set_dtr(bool high) noexcept {
  const bool listens = !running() || divisor_ == falcon::kBootDivisor;
  if (high && !dtr_ && listens) {
    state_ = State::greeting;
    greeted_ = 0;
    stored_ = 0;
  }
  dtr_ = high;
}

void FalconBootLoader::take(std::uint8_t byte, std::deque<std::uint8_t>& line) {
  switch (state_) {
    case State::asleep:
    case State::running:
      return;
    case State::greeting:
    case State::waiting:
      if (state_ == State::waiting && divisor_ == falcon::kUploadDivisor && !dtr_ &&
          byte == falcon::kUploadBegin[0]) {
        state_ = State::loading;
        line.push_back(byte);
        return;
      }
      return on_greeting(byte, line);
    case State::loading:
      if (stored_++ == wrong_echo_at_ && wrong_loads_ > 0) {
        --wrong_loads_;
        line.push_back(static_cast<std::uint8_t>(byte ^ 1));
      } else {
        line.push_back(byte);
      }
      return;
  }
}

/// Answered as often as it comes: hosts repeat it if a read that was under way took the answer.
void FalconBootLoader::on_greeting(std::uint8_t byte, std::deque<std::uint8_t>& line) {
  if (divisor_ != falcon::kBootDivisor || byte != falcon::kBootHello[greeted_]) {
    greeted_ = 0;
    return;
  }
  if (++greeted_ < falcon::kBootHello.size()) return;
  greeted_ = 0;
  if (state_ == State::greeting) line.push_back(0);  // some units begin so: hosts have to bear it
  line.insert(line.end(), falcon::kBootHelloReply.begin(), falcon::kBootHelloReply.end());
  state_ = State::waiting;
}

std::span<const std::uint8_t> FtdiFalcon::descriptors() noexcept {
  return kDescriptors;
}

std::optional<std::vector<std::uint8_t>> FtdiFalcon::control(const UsbSetup& setup) {
  if ((setup.type & kToHost) != 0) {
    auto answer = standard(setup);
    if (answer) answer->resize(std::min<std::size_t>(answer->size(), setup.length));
    return answer;
  }
  const bool known = setup.type != falcon::kFtdiRequestType || set(setup);
  return known ? std::optional<std::vector<std::uint8_t>>{std::in_place} : std::nullopt;
}

std::optional<std::vector<std::uint8_t>> FtdiFalcon::standard(const UsbSetup& setup) const {
  if (setup.type != kToHost) return std::nullopt;
  if (setup.request == kGetConfiguration) return std::vector<std::uint8_t>{1};
  if (setup.request != kGetDescriptor) return std::nullopt;
  switch (setup.value) {
    case 0x0100:
      return std::vector(kDescriptors.begin(), kDescriptors.begin() + kDeviceBytes);
    case 0x0200:
      return std::vector(kDescriptors.begin() + kDeviceBytes, kDescriptors.end());
    case 0x0300:
      return std::vector<std::uint8_t>{4, 3, 0x09, 0x04};  // languages: English
    case 0x0301:
      return string_descriptor("kerf");
    case 0x0302:
      return string_descriptor("emulated Falcon");
    case 0x0300 + kSerialText:
      return string_descriptor(serial_);
    default:
      return std::nullopt;
  }
}

bool FtdiFalcon::set(const UsbSetup& setup) {
  switch (static_cast<FtdiRequest>(setup.request)) {
    case FtdiRequest::reset:
      if (setup.value == falcon::kFtdiPurgeRx || setup.value == falcon::kFtdiReset) line_.clear();
      return setup.value <= falcon::kFtdiPurgeTx;
    case FtdiRequest::modem:
      if ((setup.value & 0x0100) != 0) loader_.set_dtr((setup.value & 1) != 0);
      return true;
    case FtdiRequest::baud:
      loader_.set_divisor(setup.value);
      return true;
    case FtdiRequest::latency:
      latency_frames_ = std::clamp<int>(setup.value, 1, 255);
      return setup.value >= 1 && setup.value <= 255;
    case FtdiRequest::flow:
    case FtdiRequest::data:
      return true;
  }
  return false;
}

void FtdiFalcon::out(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    if (!loader_.running()) {
      loader_.take(byte, line_);
    } else if (framer_.take(byte)) {
      device_.receive(framer_.packet());
    }
  }
}

void FtdiFalcon::on_packet(std::span<const std::uint8_t> packet) {
  if (!loader_.running()) return;
  if (line_.size() + packet.size() > kFifoBytes) {
    ++lost_;
    return;
  }
  ++reports_;
  line_.insert(line_.end(), packet.begin(), packet.end());
}

bool FtdiFalcon::due() const noexcept {
  return line_.size() >= falcon::kUploadChunk || quiet_frames_ >= latency_frames_;
}

std::span<const std::uint8_t> FtdiFalcon::next_in() {
  quiet_frames_ = 0;
  std::size_t size = std::min(line_.size(), falcon::kUploadChunk);
  if (slow_frames_ > 0) {
    --slow_frames_;
    size = std::min(size, kSplitBytes);
  }
  packet_ = {kStatusOfModem, kStatusOfLine};
  packet_.insert(packet_.end(), line_.begin(), line_.begin() + static_cast<std::ptrdiff_t>(size));
  line_.erase(line_.begin(), line_.begin() + static_cast<std::ptrdiff_t>(size));
  return packet_;
}

void FalconUsb::catch_up(UsbHost& host) {
  chip_.catch_up([&] { return present_ && halt_ == Halt::none && host.room(); },
                 [&](std::span<const std::uint8_t> packet) {
                   const std::size_t room = *host.room();
                   const auto part = packet.first(std::min(packet.size(), room));
                   host.complete_read(packet.size() <= room ? 0 : -EOVERFLOW, part);
                 });
  script_.run(chip_.time().cycle(), [&](UsbFault fault) { apply_fault(fault, host); });
  if (halt_ == Halt::unreported && present_ && host.room()) {
    halt_ = Halt::reported;
    host.complete_read(-EPIPE, {});
  }
}

std::optional<std::vector<std::uint8_t>> FalconUsb::control(const UsbSetup& setup) {
  if (setup.type == kToEndpoint && setup.request == kClearFeature && !clear_halt(setup.index)) {
    return std::nullopt;
  }
  return chip_.control(setup);
}

bool FalconUsb::clear_halt(unsigned endpoint) noexcept {
  if (endpoint == falcon::kEndpointIn) halt_ = Halt::none;
  return endpoint == falcon::kEndpointIn || endpoint == falcon::kEndpointOut;
}

void FalconUsb::apply_fault(UsbFault fault, UsbHost& host) {
  switch (fault) {
    case UsbFault::stall:
      if (halt_ == Halt::none) halt_ = Halt::unreported;
      return;
    case UsbFault::split:
      return chip_.slow_down(kUsbFaultFrames);
    case UsbFault::nak:
      nak_until_ = chip_.time().cycle() + kUsbFaultFrames * kCyclesPerUsbFrame;
      return;
    case UsbFault::vanish:
    case UsbFault::back:
      present_ = fault == UsbFault::back;
      return host.plugged(present_);
  }
}

}  // namespace kerf
