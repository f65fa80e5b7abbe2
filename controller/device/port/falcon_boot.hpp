// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "shared/wire/falcon.hpp"

namespace kerf {

/// A Falcon's serial line before the servo runs: it may block, allocate and throw.
class FalconLine {
 public:
  virtual ~FalconLine() = default;
  virtual void control(falcon::FtdiRequest request, std::uint16_t value) = 0;
  virtual void write(std::span<const std::uint8_t> bytes) = 0;
  /// Returns the received bytes without the status bytes; waits at most `milliseconds` for the
  /// first byte.
  virtual std::size_t read(std::span<std::uint8_t> out, int milliseconds) = 0;
};

/// Whole contents of the file that the user named. Throws std::runtime_error with one line.
[[nodiscard]] std::vector<std::uint8_t> read_firmware(const std::string& file);

/// A start of the firmware that failed on the serial line, so that another try may succeed.
class FalconBootError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Tries to load the firmware: users of the open driver need several on some units.
inline constexpr int kFirmwareTries = 5;

/// Makes the Falcon answer packets: it may do so already, else the boot loader is greeted and gets
/// `firmware`, whose every byte it has to echo (shared/wire/falcon.hpp). A failed try is repeated
/// after a reset of the chip and 100 ms of silence. Returns the number of tries; 0 if the firmware
/// ran already.
///
/// Throws FalconBootError with the rest of one line after the last try: no answer, an echo that
/// differs (with its position). Throws std::runtime_error at once if a firmware is needed and
/// `firmware` is empty; errors of the line itself, such as a device that is unplugged, pass
/// through.
int start_falcon(FalconLine& line, std::span<const std::uint8_t> firmware);

}  // namespace kerf
