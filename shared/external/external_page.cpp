// SPDX-License-Identifier: Apache-2.0
#include "shared/external/external_page.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <iterator>
#include <limits>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "include/kerf/external.h"
#include "shared/posix/error_text.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/seqlock.hpp"

namespace kerf {
namespace {

static_assert(sizeof(kerf_external_page) == KERF_EXTERNAL_BYTES);
static_assert(sizeof(kerf_report) % 8 == 0 && sizeof(kerf_force) == 64);
static_assert(KERF_EXTERNAL_ARMS == kMaxArms);
static_assert(KERF_PHASE_ACTIVE == static_cast<int>(Phase::active) &&
              KERF_PHASE_FAULT == static_cast<int>(Phase::fault));
static_assert(KERF_FLAG_BUTTON1 == kFlagButton1 && KERF_FLAG_BUTTON2 == kFlagButton2 &&
              KERF_FLAG_MOTORS_ON == kFlagMotorsOn && KERF_FLAG_PARKED == kFlagParked);

SegmentError failure(const std::string& path) {
  const int error = errno;
  return SegmentError(path + ": " + system_message(error) + "; " +
                      remedy_for(error, "remove the file, or make the folder writable"));
}

/// Of the part of an arm.
std::size_t part_of(std::size_t arm) noexcept {
  return offsetof(kerf_external_page, arm) + arm * sizeof(kerf_external_arm);
}

}  // namespace

ExternalPage::ExternalPage(std::string_view name, const Run& run)
    : path_(segment_folder() + "/external-" + std::string(name) + ".page"),
      stale_ticks_(run.stale_ticks) {
  // A program finds the page complete or not at all: it has its name from the last line on.
  const std::string unfinished = path_ + ".new";
  unlink(unfinished.c_str());  // of a run that was killed
  file_ =
      OwnedFd(open(unfinished.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (file_.get() < 0) throw failure(unfinished);
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_len = 1;
  // Of the open file, not of the process, which may close another copy of it.
  if (fcntl(file_.get(), F_OFD_SETLK, &lock) != 0) throw failure(path_);
  // A full disk is an error here, in place of a SIGBUS in the loop.
  errno = posix_fallocate(file_.get(), 0, KERF_EXTERNAL_BYTES);
  if (errno != 0) throw failure(path_);
  void* const mapped = mmap(nullptr, KERF_EXTERNAL_BYTES, PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_POPULATE, file_.get(), 0);
  if (mapped == MAP_FAILED) throw failure(path_);
  bytes_ = static_cast<std::byte*>(mapped);
  using shared_words::word;
  const auto put = [&](std::size_t offset, std::uint32_t value) {
    word<std::uint32_t>(at(offset)).store(value, std::memory_order_relaxed);
  };
  word(at(offsetof(kerf_external_page, magic)))
      .store(KERF_EXTERNAL_MAGIC, std::memory_order_relaxed);
  put(offsetof(kerf_external_page, layout), KERF_EXTERNAL_LAYOUT);
  put(offsetof(kerf_external_page, arms), static_cast<std::uint32_t>(run.arms));
  put(offsetof(kerf_external_page, rate_hz), static_cast<std::uint32_t>(run.rate_hz));
  word(at(offsetof(kerf_external_page, workspace_scale)))
      .store(std::bit_cast<std::uint64_t>(run.workspace_scale), std::memory_order_relaxed);
  TickRecord none{};
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::ranges::fill(none.position_mm, kNan);
  std::ranges::fill(none.orientation, static_cast<float>(kNan));
  std::ranges::fill(none.velocity_mm_per_s, static_cast<float>(kNan));
  for (std::size_t arm = 0; arm < run.arms; ++arm) publish(arm, none);
  word(at(offsetof(kerf_external_page, session)))
      .store(random_session_id(), std::memory_order_release);
  if (rename(unfinished.c_str(), path_.c_str()) != 0) throw failure(path_);
}

ExternalPage::~ExternalPage() {
  shared_words::word(at(offsetof(kerf_external_page, session))).store(0, std::memory_order_release);
  munmap(bytes_, KERF_EXTERNAL_BYTES);
  unlink(path_.c_str());
}

bool ExternalPage::take(std::size_t arm, ProgramForce& force) noexcept {
  ArmCounts& counts = arms_[arm];
  const bool was_given = counts.taken > 0 && counts.age_ticks < stale_ticks_;
  if (was_given && ++counts.age_ticks == stale_ticks_) ++counts.gaps;
  std::byte* const part = at(part_of(arm));
  std::byte* const version = part + offsetof(kerf_external_arm, force_version);
  const std::uint64_t seen = shared_words::word(version).load(std::memory_order_acquire);
  if (seen % 2 != 0) return false;
  struct {
    std::uint64_t number;
    kerf_force force;
  } read;
  shared_words::load(&read, part + offsetof(kerf_external_arm, force_number), sizeof read);
  if (!shared_words::unchanged(version, seen) || read.number == counts.number) return false;
  counts.number = read.number;
  counts.age_ticks = 0;
  ++counts.taken;
  force = {.stiffness_n_per_mm = read.force.stiffness_n_per_mm,
           .damping_ns_per_mm = read.force.damping_ns_per_mm};
  std::ranges::copy(read.force.force_n, force.force_n.begin());
  std::ranges::copy(read.force.goal_mm, force.goal_mm.begin());
  return true;
}

void ExternalPage::publish(std::size_t arm, const TickRecord& record) noexcept {
  kerf_report report{};
  report.tick = record.tick;
  report.answers = arms_[arm].number;
  report.refused = arms_[arm].refused;
  std::ranges::copy(record.position_mm, report.position_mm);
  std::ranges::copy(record.orientation, report.orientation);
  std::ranges::copy(record.velocity_mm_per_s, report.velocity_mm_per_s);
  std::ranges::copy(record.commanded_force_n, report.force_n);
  report.phase = record.phase;
  report.fault = record.fault;
  report.flags = record.flags;
  report.gaps = arms_[arm].gaps;
  std::byte* const part = at(part_of(arm));
  std::byte* const version = part + offsetof(kerf_external_arm, report_version);
  const std::uint64_t even = 2 * arms_[arm].published++;
  shared_words::open(version, even + 1);
  shared_words::store(part + offsetof(kerf_external_arm, report), &report, sizeof report);
  shared_words::close(version, even + 2);
}

}  // namespace kerf
