// SPDX-License-Identifier: Apache-2.0
// WebAssembly's libc++ comes without exceptions: one that is thrown ends the program.
#include <cstddef>
#include <cstdlib>

extern "C" {
void* __cxa_allocate_exception(std::size_t size) {
  return std::malloc(size);
}
void __cxa_free_exception(void* exception) {
  std::free(exception);
}
[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) {
  __builtin_trap();
}
}
