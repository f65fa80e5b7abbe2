// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
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

/// Makes the Falcon answer packets: it may do so already, else the boot loader is greeted and gets
/// `firmware`, whose every byte it has to echo. The steps are those of falcon_usb.hpp.
///
/// Throws std::runtime_error with the rest of one line: no firmware where one is needed, no answer,
/// an echo that differs (with its place).
void start_falcon(FalconLine& line, std::span<const std::uint8_t> firmware);

}  // namespace kerf
