// SPDX-License-Identifier: Apache-2.0
#include "hil/front/fuse/caller_memory.hpp"

#include <algorithm>

#include <sys/uio.h>

namespace kerf {
namespace {

constexpr std::size_t kPageBytes = 4096;

void* pointer(std::uint64_t address) noexcept {
  // An address of another process: never followed here, only handed to the kernel.
  return reinterpret_cast<void*>(address);  // NOLINT(performance-no-int-to-ptr)
}

}  // namespace

std::size_t read_caller(pid_t thread, std::uint64_t address, std::span<std::uint8_t> out) noexcept {
  const iovec here{out.data(), out.size()};
  const iovec there{pointer(address), out.size()};
  if (process_vm_readv(thread, &here, 1, &there, 1, 0) == static_cast<ssize_t>(out.size())) {
    return out.size();
  }
  // The kernel promises whole elements only: page by page, to learn where the memory ends.
  std::size_t done = 0;
  while (done < out.size()) {
    const std::size_t to_page_end = kPageBytes - (address + done) % kPageBytes;
    const std::size_t size = std::min(to_page_end, out.size() - done);
    const iovec part{&out[done], size};
    const iovec from{pointer(address + done), size};
    if (process_vm_readv(thread, &part, 1, &from, 1, 0) != static_cast<ssize_t>(size)) break;
    done += size;
  }
  return done;
}

bool write_caller(pid_t thread, std::uint64_t address,
                  std::span<const std::uint8_t> bytes) noexcept {
  // The system call takes both ends as iovec, whose pointer is not const.
  const iovec here{const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
  const iovec there{pointer(address), bytes.size()};
  return process_vm_writev(thread, &here, 1, &there, 1, 0) == static_cast<ssize_t>(bytes.size());
}

}  // namespace kerf
