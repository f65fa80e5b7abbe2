// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/falcon_boot.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include "shared/wire/falcon.hpp"

namespace kerf {
namespace {

using falcon::FtdiRequest;

constexpr int kAnswerMs = 20;  // the boot loader's latency timer is 16 ms
constexpr int kEchoTries = 10;
constexpr int kEchoMs = 200;
constexpr int kSilenceMs = 100;

void purge(FalconLine& line) {
  line.control(FtdiRequest::reset, falcon::kFtdiPurgeRx);
  line.control(FtdiRequest::reset, falcon::kFtdiPurgeTx);
}

void settle_to_run(FalconLine& line) {
  line.control(FtdiRequest::latency, falcon::kRunLatencyMs);
  line.control(FtdiRequest::baud, falcon::kRunDivisor);
  purge(line);
}

/// Whether the firmware is there: it answers each packet with one.
bool runs(FalconLine& line) {
  falcon::Framer framer;
  std::array<std::uint8_t, falcon::kFtdiPacketBytes> bytes{};
  for (int probe = 0; probe < kEchoTries; ++probe) {
    line.write(encode(FalconCommand{}));
    for (std::size_t size = 0; (size = line.read(bytes, kAnswerMs)) > 0;) {
      for (std::size_t i = 0; i < size; ++i) {
        if (framer.take(bytes[i]) && falcon::decode_report(framer.packet())) return true;
      }
    }
  }
  return false;
}

/// Reads until what came ends in `wanted`, at most so many times.
template <std::size_t N>
bool hears(FalconLine& line, const std::array<std::uint8_t, N>& wanted, int tries) {
  std::vector<std::uint8_t> heard;
  std::array<std::uint8_t, falcon::kFtdiPacketBytes> bytes{};
  for (int i = 0; i < tries; ++i) {
    const std::size_t size = line.read(bytes, kAnswerMs);
    heard.insert(heard.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    if (std::ranges::search(heard, wanted).size() == N) return true;
  }
  return false;
}

void greet(FalconLine& line) {
  purge(line);
  line.control(FtdiRequest::latency, falcon::kBootLatencyMs);
  line.control(FtdiRequest::baud, falcon::kBootDivisor);
  line.control(FtdiRequest::data, falcon::kFtdi8N1);
  line.control(FtdiRequest::flow, falcon::kFtdiNoFlowControl);
  line.control(FtdiRequest::modem, falcon::kFtdiRtsLow);
  line.control(FtdiRequest::modem, falcon::kFtdiDtrLow);
  line.control(FtdiRequest::modem, falcon::kFtdiDtrHigh);
  line.write(falcon::kBootHello);
  if (!hears(line, falcon::kBootHelloReply, falcon::kBootTries)) {
    throw FalconBootError("the boot loader does not answer");
  }
  line.control(FtdiRequest::modem, falcon::kFtdiDtrLow);
  line.control(FtdiRequest::baud, falcon::kUploadDivisor);
  line.write(falcon::kUploadBegin);
  if (!hears(line, falcon::kUploadBegin, falcon::kBootTries)) {
    throw FalconBootError("the boot loader takes no firmware");
  }
}

/// Sends one chunk and compares what comes back.
void upload(FalconLine& line, std::span<const std::uint8_t> chunk, std::size_t offset) {
  line.write(chunk);
  std::array<std::uint8_t, falcon::kFtdiPacketBytes> bytes{};
  for (std::size_t done = 0; done < chunk.size();) {
    const std::size_t size = line.read(bytes, kEchoMs);
    if (size == 0) {
      throw FalconBootError("firmware: no echo from byte " + std::to_string(offset + done) + " on");
    }
    for (std::size_t i = 0; i < size && done < chunk.size(); ++i, ++done) {
      if (bytes[i] == chunk[done]) continue;
      throw FalconBootError("firmware: byte " + std::to_string(offset + done) + " was " +
                            std::to_string(chunk[done]) + " and came back as " +
                            std::to_string(bytes[i]));
    }
  }
}

/// One try.
void load(FalconLine& line, std::span<const std::uint8_t> firmware) {
  greet(line);
  for (std::size_t at = 0; at < firmware.size(); at += falcon::kUploadChunk) {
    const std::size_t size = std::min(falcon::kUploadChunk, firmware.size() - at);
    upload(line, firmware.subspan(at, size), at);
  }
  settle_to_run(line);
  if (!runs(line)) throw FalconBootError("the firmware was taken and does not answer");
}

/// Before another try: the chip forgets what is on its way, and the line is silent for a while.
void reset(FalconLine& line) {
  line.control(FtdiRequest::reset, falcon::kFtdiReset);
  line.control(FtdiRequest::modem, falcon::kFtdiDtrLow);
  std::array<std::uint8_t, falcon::kFtdiPacketBytes> dropped{};
  for (int reads = 0; reads < kEchoTries && line.read(dropped, kSilenceMs) > 0; ++reads) {
  }
}

}  // namespace

std::vector<std::uint8_t> read_firmware(const std::string& file) {
  std::error_code fault;
  if (std::filesystem::exists(file, fault) && !std::filesystem::is_regular_file(file, fault)) {
    throw std::runtime_error("firmware " + file +
                             ": is no regular file; name the file with the Falcon's firmware");
  }
  std::ifstream in(file, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
  if (!in.is_open() || in.bad() || bytes.empty()) {
    throw std::runtime_error("firmware " + file + ": " +
                             (in.is_open() ? "is empty" : std::generic_category().message(errno)) +
                             "; name the file with the Falcon's firmware");
  }
  return bytes;
}

int start_falcon(FalconLine& line, std::span<const std::uint8_t> firmware) {
  settle_to_run(line);
  if (runs(line)) return 0;
  if (firmware.empty()) {
    throw std::runtime_error(
        "the Falcon has no firmware since it was powered up; name its file: ,firmware=FILE");
  }
  for (int tries = 1;; ++tries) {
    try {
      load(line, firmware);
      return tries;
    } catch (const FalconBootError& error) {
      if (tries == kFirmwareTries) {
        throw FalconBootError(std::string(error.what()) + ", in the last of " +
                              std::to_string(tries) +
                              " tries; unplug the device and its power, plug them in again, use "
                              "another cable; is the file the Falcon's firmware?");
      }
      reset(line);
    }
  }
}

}  // namespace kerf
