// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/falcon_boot.hpp"

#include <algorithm>
#include <deque>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "hil/front/usb/falcon_usb.hpp"
#include "shared/wire/falcon.hpp"
#include "tests/support/errors.hpp"

namespace kerf::falcon_boot_test {

using kerf::falcon::FtdiRequest;
using kerf::test::error_of;
using kerf::test::has;

namespace {

/// The emulator's boot loader at the other end of a wire, in pieces of at most `piece` bytes.
class Wire final : public kerf::FalconLine {
 public:
  explicit Wire(bool runs, std::int64_t wrong_echo_at = -1, std::size_t piece = 62,
                int wrong_loads = kerf::FalconBootLoader::kEveryLoad)
      : loader(runs, wrong_echo_at, wrong_loads), piece_(piece) {}

  void control(FtdiRequest request, std::uint16_t value) override {
    settings.emplace_back(request, value);
    if (request == FtdiRequest::baud) loader.set_divisor(value);
    if (request == FtdiRequest::modem && (value & 0x100) != 0) loader.set_dtr((value & 1) != 0);
    if (request == FtdiRequest::reset) line_.clear();
  }
  void write(std::span<const std::uint8_t> bytes) override {
    longest_write = std::max(longest_write, bytes.size());
    for (const std::uint8_t byte : bytes) {
      if (!loader.running()) {
        if (loader_answers) loader.take(byte, line_);
      } else if (framer_.take(byte) && firmware_answers) {
        const auto answer = encode(kerf::FalconReport{});
        line_.insert(line_.end(), answer.begin(), answer.end());
      }
    }
  }
  std::size_t read(std::span<std::uint8_t> out, int /*milliseconds*/) override {
    const std::size_t size = std::min({line_.size(), out.size(), piece_});
    std::copy_n(line_.begin(), size, out.begin());
    line_.erase(line_.begin(), line_.begin() + static_cast<std::ptrdiff_t>(size));
    return size;
  }

  kerf::FalconBootLoader loader;
  std::vector<std::pair<FtdiRequest, std::uint16_t>> settings;
  std::size_t longest_write = 0;
  bool loader_answers = true;
  bool firmware_answers = true;

 private:
  std::size_t piece_;
  std::deque<std::uint8_t> line_;
  kerf::falcon::Framer framer_;
};

std::vector<std::uint8_t> firmware() {
  std::vector<std::uint8_t> bytes(1000);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

}  // namespace

TEST_CASE("falcon boot: firmware that runs is left alone") {
  Wire wire(true);
  CHECK(kerf::start_falcon(wire, {}) == 0);
  CHECK(wire.settings.front() == std::pair(FtdiRequest::latency, kerf::falcon::kRunLatencyMs));
}

TEST_CASE("falcon boot: the loader is greeted, takes every byte, and the firmware runs") {
  for (const std::size_t piece : {62U, 1U, 3U}) {
    Wire wire(false, -1, piece);
    CHECK(kerf::start_falcon(wire, firmware()) == 1);
    CHECK(wire.loader.running());
    CHECK(wire.loader.stored() == 1000);
    CHECK(wire.longest_write <= kerf::falcon::kUploadChunk);
    CHECK(wire.settings[wire.settings.size() - 3] ==
          std::pair(FtdiRequest::baud, kerf::falcon::kRunDivisor));
  }
}

TEST_CASE("falcon boot: a load that fails is repeated after a reset of the chip") {
  for (int wrong = 1; wrong < kerf::kFirmwareTries; ++wrong) {
    Wire wire(false, 700, 62, wrong);
    CHECK(kerf::start_falcon(wire, firmware()) == wrong + 1);
    CHECK(wire.loader.running());
    CHECK(wire.loader.stored() == 1000);
    CHECK(std::ranges::count(wire.settings,
                             std::pair(FtdiRequest::reset, kerf::falcon::kFtdiReset)) == wrong);
  }
  Wire wire(false, 700, 62, kerf::kFirmwareTries);
  CHECK_THROWS_AS(kerf::start_falcon(wire, firmware()), kerf::FalconBootError);
}

TEST_CASE("falcon boot: a line that breaks is not tried again") {
  class Broken final : public kerf::FalconLine {
   public:
    void control(FtdiRequest, std::uint16_t) override {}
    void write(std::span<const std::uint8_t>) override {
      if (++writes == 11) throw std::runtime_error("unplugged");  // after the ten probes
    }
    std::size_t read(std::span<std::uint8_t>, int) override { return 0; }
    int writes = 0;
  };
  Broken line;
  CHECK(error_of([&] { kerf::start_falcon(line, firmware()); }) == "unplugged");
  CHECK(line.writes == 11);
}

TEST_CASE("falcon boot: an error is one line with its position") {
  const auto error_with = [](Wire& wire, std::span<const std::uint8_t> bytes) {
    const std::string error = error_of([&] { kerf::start_falcon(wire, bytes); });
    CHECK_FALSE(has(error, "\n"));
    return error;
  };
  Wire none(false);
  CHECK(has(error_with(none, {}), "has no firmware since it was powered up"));
  for (const std::int64_t at : {0, 61, 62, 999}) {
    Wire wrong(false, at);
    CHECK(error_with(wrong, firmware())
              .starts_with("firmware: byte " + std::to_string(at) + " was "));
  }
  Wire silent(false);
  silent.loader_answers = false;
  const std::string silence = error_with(silent, firmware());
  CHECK(silence.starts_with("the boot loader does not answer, in the last of 5 tries; unplug"));
  Wire mute(false);
  mute.firmware_answers = false;
  CHECK(error_with(mute, firmware()).starts_with("the firmware was taken and does not answer"));
  const auto read_error = [](const char* file) {
    return error_of([&] { static_cast<void>(kerf::read_firmware(file)); });
  };
  CHECK(has(read_error("/nowhere/at/all"), "firmware /nowhere/at/all: No such file"));
  CHECK(has(read_error("/dev/null"), "is no regular file; name the file"));
}

}  // namespace kerf::falcon_boot_test
