// SPDX-License-Identifier: Apache-2.0
// The parts of a segment that need the operating system: memory, a reader's mapping, random
// numbers. The page in the browser has its own version (web/absent).
#include <cerrno>
#include <string>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/segment.hpp"

namespace kerf {

SegmentMemory SegmentMemory::create(std::uint64_t bytes) {
  const auto fail = [bytes](const char* call) {
    return SegmentError("segment: " + std::string(call) + " of " + std::to_string(bytes >> 20) +
                        " MiB: " + system_message(errno) + "; " +
                        remedy_for(errno, "crop the volume or free shared memory"));
  };
  SegmentMemory memory;
  memory.fd_ = memfd_create("kerf-segment", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (memory.fd_ < 0) throw fail("memfd_create");
  // Reserved now, so that a lack of memory is an error here and not a SIGBUS in the servo.
  errno = posix_fallocate(memory.fd_, 0, static_cast<off_t>(bytes));
  if (errno != 0) {
    throw fail("allocation");
  }
  const auto size = static_cast<std::size_t>(bytes);
  void* const at =
      mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, memory.fd_, 0);
  if (at == MAP_FAILED) throw fail("mmap");
  memory.bytes_ = {static_cast<std::byte*>(at), size};
  memory.locked_ = mlock(at, size) == 0;
  return memory;
}

SegmentMemory::~SegmentMemory() {
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
  if (fd_ >= 0) close(fd_);
}

void SegmentMemory::seal() {
  if (fcntl(fd_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL) !=
      0) {
    throw SegmentError(std::string("segment: sealing: ") + system_message(errno) +
                       "; Linux 5.1 or newer is needed");
  }
}

std::uint64_t random_session_id() {
  std::uint64_t id = 0;
  while (id == 0) {
    if (getrandom(&id, sizeof id, 0) != static_cast<ssize_t>(sizeof id)) id = 0;
  }
  return id;
}

SegmentReader SegmentReader::map(int fd) {
  const int seals = fcntl(fd, F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0) {
    throw SegmentError(
        "segment: descriptor " + std::to_string(fd) +
        " is not sealed against shrinking; expected the memory of a kerf-controller");
  }
  struct stat status {};
  if (fstat(fd, &status) != 0 || status.st_size < static_cast<off_t>(sizeof(SegmentHeader))) {
    throw SegmentError("segment: size = " + std::to_string(status.st_size) +
                       "; expected at least one page of header");
  }
  const auto bytes = static_cast<std::size_t>(status.st_size);
  void* const at = mmap(nullptr, bytes, PROT_READ, MAP_SHARED, fd, 0);
  if (at == MAP_FAILED) {
    throw SegmentError("segment: mmap of " + std::to_string(bytes >> 20) +
                       " MiB: " + system_message(errno) + "; free memory");
  }
  // Owns the mapping from here on, so an exception unmaps it.
  SegmentReader reader({static_cast<std::byte*>(at), bytes}, {});
  reader.info_ = parse_segment(reader.bytes_);
  return reader;
}

SegmentReader::~SegmentReader() {
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
}

void SegmentReader::forget_pages() const noexcept {
  madvise(bytes_.data(), bytes_.size(), MADV_DONTNEED);
}

}  // namespace kerf
