// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/presented_view.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <iterator>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {

namespace {

/// What the file holds. It is written and read as a whole; a reader that meets a write sees another
/// hash and looks again later.
struct ViewRecord {
  std::uint64_t magic = 0x3177'6569'7666'726b;  // "krfview1"
  std::uint64_t pid = 0;
  std::uint64_t count = 0;  ///< of views, from 1
  PresentedView view;
  std::uint64_t hash = 0;  ///< FNV-1a of what lies before it
};
static_assert(sizeof(ViewRecord) == 104);

std::uint64_t hash_of(const ViewRecord& record) noexcept {
  return fnv1a({reinterpret_cast<const char*>(&record), offsetof(ViewRecord, hash)});
}

std::string view_file(std::string_view name) {
  const std::string socket = segment_socket(name);
  return socket.substr(0, socket.size() - std::strlen(".sock")) + ".view";
}

/// The whole file, which belongs to its open file: the kernel gives it up with the process.
struct flock lock_of(short type) noexcept {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

bool is_locked(int file) noexcept {
  struct flock lock = lock_of(F_RDLCK);
  return fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

bool read_record(int file, ViewRecord& record) noexcept {
  return pread(file, &record, sizeof record, 0) == sizeof record &&
         record.magic == ViewRecord{}.magic && record.hash == hash_of(record);
}

}  // namespace

ViewProblem problem_in(const PresentedView& view) noexcept {
  // Places are written to a millionth of a mm; directions of six digits are off by up to 1e-6 of
  // their length.
  constexpr double kNearestMm = 1e-6;
  constexpr double kLeastSine = 1e-5;
  const auto is_far = [](const double(&place)[3]) {
    // A NaN is within nothing.
    return !std::all_of(std::begin(place), std::end(place),
                        [](double v) { return std::abs(v) <= kFarthestViewMm; });
  };
  if (is_far(view.eye_mm)) return ViewProblem::eye_far;
  if (is_far(view.target_mm)) return ViewProblem::target_far;
  if (is_far(view.up)) return ViewProblem::up_far;
  double away[3], far_2 = 0.0, up_2 = 0.0, cross_2 = 0.0;
  for (int i = 0; i < 3; ++i) {
    away[i] = view.eye_mm[i] - view.target_mm[i];
    far_2 += away[i] * away[i];
    up_2 += view.up[i] * view.up[i];
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double cross = away[j] * view.up[k] - away[k] * view.up[j];
    cross_2 += cross * cross;
  }
  if (!(far_2 >= kNearestMm * kNearestMm)) return ViewProblem::eye_at_target;
  if (!(up_2 > 0.0)) return ViewProblem::up_zero;
  if (!(cross_2 >= kLeastSine * kLeastSine * far_2 * up_2)) return ViewProblem::up_along_view;
  return ViewProblem::none;
}

ViewPresenter::ViewPresenter(std::string_view name) : path_(view_file(name)) {
  for (;;) {
    file_ = OwnedFd(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (file_.get() < 0) {
      throw SegmentError(path_ + ": " + system_message(errno) + "; " +
                         remedy_for(errno, "make the folder writable"));
    }
    struct flock lock = lock_of(F_WRLCK);
    if (fcntl(file_.get(), F_OFD_SETLK, &lock) != 0) {
      ViewRecord record;
      const std::string who = read_record(file_.get(), record)
                                  ? "process " + std::to_string(record.pid)
                                  : "another one";
      throw SegmentError("--present: " + who + " presents the views of \"" + std::string(name) +
                         "\" already; end it, or follow it with --follow-view");
    }
    // The last presenter may have unlinked the file between our open and our lock.
    struct stat ours {};
    struct stat named {};
    if (fstat(file_.get(), &ours) == 0 && stat(path_.c_str(), &named) == 0 &&
        ours.st_ino == named.st_ino && ours.st_dev == named.st_dev) {
      break;
    }
  }
  static_cast<void>(ftruncate(file_.get(), 0));  // of a presenter that was killed
}

ViewPresenter::~ViewPresenter() {
  unlink(path_.c_str());
}

void ViewPresenter::show(const PresentedView& view) noexcept {
  if (!is_valid(view) || (count_ > 0 && view == shown_)) return;
  shown_ = view;
  ViewRecord record;
  record.pid = static_cast<std::uint64_t>(getpid());
  record.count = ++count_;
  record.view = view;
  record.hash = hash_of(record);
  static_cast<void>(pwrite(file_.get(), &record, sizeof record, 0) == sizeof record);
}

ViewFollower::ViewFollower(std::string_view name) : path_(view_file(name)) {}

void ViewFollower::poll() noexcept {
  if (file_.get() < 0) {
    file_ = OwnedFd(open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    if (file_.get() < 0) return;
  }
  ViewRecord record;
  const bool held = is_locked(file_.get());
  if (held && read_record(file_.get(), record) && is_valid(record.view)) {
    presented_ = true;
    pid_ = record.pid;
    if (count_ == 0 || record.hash != hash_) {
      ++count_;
      hash_ = record.hash;
      view_ = record.view;
    }
  }
  if (held) return;
  presented_ = false;
  file_ = OwnedFd();  // the next presenter may have another file
}

}  // namespace kerf
