// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include <sys/types.h>

namespace kerf::standin {

/// The right of one process to use a device: a lock on a file beside the device's socket. It ends
/// with the process, however that ends, but a child by `fork` keeps it for its parent until that
/// gives it back. What the child gives back stays the parent's. One thread at a time.
///
/// If the file cannot be made, every process may use the device, and the emulator serves the first.
class Claim {
 public:
  explicit Claim(std::string path) noexcept : path_(std::move(path)) {}
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;
  ~Claim() { give_back(); }

  /// Returns false if another process has it.
  [[nodiscard]] bool take() noexcept;
  void give_back() noexcept;
  [[nodiscard]] bool is_with_another() const noexcept;

 private:
  std::string path_;
  int fd_ = -1;
  pid_t taker_ = -1;  ///< the process that took it, if fd_ is open
};

}  // namespace kerf::standin
