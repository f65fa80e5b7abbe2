// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace kerf {

/// A device that is reached through a vendor's library (HdArm, DhdArm) or service (ServiceArm).
///
/// Main thread, in this order: open, start, stop, close. From `start` to `stop` another thread runs
/// frames, each of which is one of `ArmExchange`; `stop` returns after the last frame. Any call may
/// hang or crash in a library; `Overseer` watches for that.
class VendorArm {
 public:
  virtual ~VendorArm() = default;

  /// Throws ArmError if the device cannot be opened.
  virtual void open() = 0;
  /// Starts the frames. Throws ArmError if that fails.
  virtual void start() = 0;
  /// Call once the exchange has finished or failed.
  virtual void stop() = 0;
  virtual void close() = 0;

  /// Names and versions from the library, for the report and the first line. After `open`.
  using Facts = std::vector<std::pair<std::string, std::string>>;
  [[nodiscard]] const Facts& facts() const noexcept { return facts_; }
  /// Limitations of this device that the user should know, one line each. After `open`.
  [[nodiscard]] virtual std::vector<std::string> warnings() const { return {}; }
  /// The meaning of a failure of the exchange, and its remedy. Does not call the library. Main
  /// thread.
  [[nodiscard]] virtual std::string text_of(std::uint32_t failure) const = 0;
  /// How often each error of the library occurred. After `stop`.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::uint64_t>> errors() const = 0;
  /// What the user has to do now, such as a calibration; empty if nothing. Any thread.
  [[nodiscard]] const char* notice() const noexcept { return notice_.load(); }

 protected:
  Facts facts_;
  std::atomic<const char*> notice_{""};  ///< of static storage
};

}  // namespace kerf
