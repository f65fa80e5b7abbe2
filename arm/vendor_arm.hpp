// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace kerf {

/// A device behind a vendor's library: HdArm, DhdArm.
///
/// Main thread, in this order: open, start, stop, close. From `start` to `stop` a thread runs
/// frames, each of which is one turn of an ArmExchange; `stop` returns once there are no more. Any
/// call may hang or crash in the library: the program watches over it from another thread.
class VendorArm {
 public:
  virtual ~VendorArm() = default;

  /// Throws ArmError with one line if the device cannot be opened.
  virtual void open() = 0;
  /// Frames begin. Throws ArmError likewise.
  virtual void start() = 0;
  /// Call once the exchange has finished or failed.
  virtual void stop() = 0;
  virtual void close() = 0;

  /// Names and versions that the library gives, for the report and the first line. After `open`.
  using Facts = std::vector<std::pair<std::string, std::string>>;
  [[nodiscard]] virtual Facts facts() const = 0;
  /// Lacks of this device that the user should know, a line each. After `open`.
  [[nodiscard]] virtual std::vector<std::string> warnings() const { return {}; }
  /// What a failure of the exchange means, with a way out. Calls no library. Main thread.
  [[nodiscard]] virtual std::string text_of(std::uint32_t failure) const = 0;
  /// How often each error of the library was seen. After `stop`.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::uint64_t>> errors() const = 0;
  /// What the user should know now: a calibration that is missing. Empty: nothing. Any thread.
  [[nodiscard]] virtual const char* notice() const noexcept = 0;
};

}  // namespace kerf
