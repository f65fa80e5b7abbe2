// SPDX-License-Identifier: Apache-2.0
// WebAssembly's libc++ comes without exceptions. One that is thrown ends the instance: its message
// goes to the worker, whose `kerf.failed` throws it on as an exception of JavaScript and never
// returns.
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <typeinfo>

extern "C" {

[[noreturn]] [[clang::import_module("kerf"), clang::import_name("failed")]] void kerf_failed(
    const char* text, std::size_t bytes);

void* __cxa_allocate_exception(std::size_t size) {
  return std::malloc(size);
}
void __cxa_free_exception(void* exception) {
  std::free(exception);
}
/// All exceptions of kerf and of the standard library derive from std::exception, as their first
/// base.
[[noreturn]] void __cxa_throw(void* exception, std::type_info*, void (*)(void*)) {
  const char* const text = static_cast<const std::exception*>(exception)->what();
  kerf_failed(text, std::strlen(text));
}

}  // extern "C"
