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
/// stays, without the lock that says that its controller lives, until the next run of its name. Who
/// truncates it while it is mapped ends the run (SIGBUS, as of any mapped file; the motors go off).
class ExternalPage {
 public:
  /// Under the name of the segment, whose lock the caller holds. Throws SegmentError with one line
  /// if there can be no file.
  struct Run {
    std::size_t arms = 1;
    int rate_hz = 1000;
    double workspace_scale = 1;
    std::uint32_t stale_ticks = 20;  ///< of the scene
  };
  ExternalPage(std::string_view name, const Run& run);
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
  [[nodiscard]] std::uint64_t taken() const noexcept { return arms_[0].taken + arms_[1].taken; }
  [[nodiscard]] std::uint64_t refused() const noexcept {
    return arms_[0].refused + arms_[1].refused;
  }
  /// Times that a force became stale.
  [[nodiscard]] std::uint64_t gaps() const noexcept {
    return std::uint64_t{arms_[0].gaps} + arms_[1].gaps;
  }

 private:
  struct ArmCounts {
    std::uint64_t number = 0;  ///< of the force that was taken last
    std::uint64_t taken = 0, refused = 0;
    std::uint32_t age_ticks = 0;  ///< since one was taken, up to stale_ticks
    std::uint32_t gaps = 0;       ///< times that it became stale
    std::uint64_t published = 0;
  };

  [[nodiscard]] std::byte* at(std::size_t offset) const noexcept { return bytes_ + offset; }

  std::string path_;
  OwnedFd file_;
  std::byte* bytes_ = nullptr;
  std::uint32_t stale_ticks_;
  std::array<ArmCounts, kMaxArms> arms_;
};

}  // namespace kerf
