// SPDX-License-Identifier: Apache-2.0
#include "controller/sandbox/shared_bytes.hpp"

#include <new>
#include <utility>

#include <sys/mman.h>

namespace kerf {

SharedBytes::SharedBytes(int file, std::size_t size) {
  if (size == 0) return;  // nothing can be mapped then
  void* at = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (at == MAP_FAILED) throw std::bad_alloc();
  bytes_ = {static_cast<std::byte*>(at), size};
}

SharedBytes::SharedBytes(SharedBytes&& other) noexcept : bytes_(other.release()) {}

SharedBytes& SharedBytes::operator=(SharedBytes&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  return *this;
}

SharedBytes::~SharedBytes() {
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
}

std::span<std::byte> SharedBytes::release() noexcept {
  return std::exchange(bytes_, {});
}

}  // namespace kerf
