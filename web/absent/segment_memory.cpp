// SPDX-License-Identifier: Apache-2.0
// Segments without an operating system: writer and reader are in one process, so a segment is an
// array, and its descriptor a number that this file gives out. In place of
// shared/segment/segment_memory.cpp.
#include <cstddef>
#include <map>
#include <memory>

#include <unistd.h>

#include "shared/segment/reader.hpp"
#include "shared/segment/segment.hpp"

namespace kerf {
namespace {

struct Memory {
  std::unique_ptr<std::byte[]> bytes;
  std::size_t size;
};

std::map<int, Memory>& memories() {
  static std::map<int, Memory> all;
  return all;
}

}  // namespace

SegmentMemory SegmentMemory::create(std::uint64_t bytes) {
  static int last = 0;
  const auto size = static_cast<std::size_t>(bytes);
  SegmentMemory memory;
  memory.fd_ = ++last;
  Memory& own = memories()[memory.fd_] = {std::make_unique<std::byte[]>(size), size};
  memory.bytes_ = {own.bytes.get(), size};
  memory.locked_ = true;
  return memory;
}

SegmentMemory::~SegmentMemory() {
  memories().erase(fd_);
}

void SegmentMemory::seal() {}

std::uint64_t random_session_id() {
  std::uint64_t id = 0;
  while (id == 0) {
    if (getentropy(&id, sizeof id) != 0) id = 0;
  }
  return id;
}

SegmentReader SegmentReader::map(int fd) {
  const auto found = memories().find(fd);
  if (found == memories().end()) throw SegmentError("segment: no such descriptor; open one first");
  SegmentReader reader({found->second.bytes.get(), found->second.size}, {});
  reader.info_ = parse_segment(reader.bytes_);
  return reader;
}

/// The memory is the writer's, which lives longer.
SegmentReader::~SegmentReader() = default;

void SegmentReader::forget_pages() const noexcept {}

}  // namespace kerf
