// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "include/kerf/tick.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/layout.hpp"

// The controller's side of the page that a program with a force of its own maps: layout and the
// program's side are include/kerf/external.h.

namespace kerf {

/// The page of a run. The file is made anew at the start, and unlinked at the end; after a kill it
/// stays, without the lock that says that its controller lives, until the next run of its name.
class ExternalPage {
 public:
  /// Under the name of the segment, whose lock the caller holds. Throws SegmentError with one line
  /// if there can be no file.
  ExternalPage(std::string_view name, std::size_t arms, int rate_hz);
  ~ExternalPage();
  ExternalPage(const ExternalPage&) = delete;
  ExternalPage& operator=(const ExternalPage&) = delete;

  // Servo thread: no system call, lock or wait.

  /// A force that was given since the last call. False if there is none, or if the program is just
  /// writing one: the next tick gets it.
  [[nodiscard]] bool take(std::size_t arm, ProgramForce& force) noexcept;
  /// The servo has refused the force that was taken last.
  void refuse(std::size_t arm) noexcept { ++arms_[arm].refused; }
  /// A tick for the program.
  void publish(std::size_t arm, const TickRecord& record) noexcept;

  /// Of both arms, since the start.
  [[nodiscard]] std::uint64_t given() const noexcept { return arms_[0].given + arms_[1].given; }
  [[nodiscard]] std::uint64_t refused() const noexcept {
    return arms_[0].refused + arms_[1].refused;
  }

 private:
  struct ArmCounts {
    std::uint64_t number = 0;  ///< of the force that was taken last
    std::uint64_t given = 0, refused = 0;
    std::uint64_t published = 0;
  };

  [[nodiscard]] std::byte* at(std::size_t offset) const noexcept { return bytes_ + offset; }

  std::string path_;
  OwnedFd file_;
  std::byte* bytes_ = nullptr;
  std::array<ArmCounts, kMaxArms> arms_;
};

}  // namespace kerf
