// SPDX-License-Identifier: Apache-2.0
// WebAssembly's libc++ comes without exceptions. One that is thrown ends the instance: its message
// goes to the worker, whose `kerf.failed` throws it on as an exception of JavaScript and never
// returns.
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <typeinfo>
#include <utility>

#include "shared/text/json.hpp"
#include "web/absent/parser_line.hpp"

namespace kerf::web {
namespace {

std::string parser_line;  // of the one that lives; empty: none

}  // namespace

ParserLine::ParserLine(std::string line) {
  parser_line = std::move(line);
}
ParserLine::~ParserLine() {
  parser_line.clear();
}

namespace {

/// JsonError, or what the library of JSON throws below it. All other exceptions are lines already.
bool is_of_parser(const std::type_info& type) {
  return type == typeid(JsonError) ||
         std::string_view(type.name()).find("nlohmann") != std::string_view::npos;
}

}  // namespace
}  // namespace kerf::web

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
[[noreturn]] void __cxa_throw(void* exception, std::type_info* type, void (*)(void*)) {
  std::string line = static_cast<const std::exception*>(exception)->what();
  if (!kerf::web::parser_line.empty() && kerf::web::is_of_parser(*type)) {
    line = kerf::web::parser_line;
  }
  kerf_failed(line.data(), line.size());
}

}  // extern "C"

namespace {

/// That library's own `new` returns null without exceptions, and the memory of WebAssembly begins
/// at address 0.
void* given(void* memory) {
  constexpr std::string_view kNone =
      "memory: none is left for this run; close other tabs, or take a smaller scene or recording";
  if (memory == nullptr) kerf_failed(kNone.data(), kNone.size());
  return memory;
}

}  // namespace

// Its nothrow forms call these too, so they also end the instance.
void* operator new(std::size_t size) {
  return given(std::malloc(size == 0 ? 1 : size));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto to = static_cast<std::size_t>(alignment);
  return given(std::aligned_alloc(to, (size + to) / to * to));
}
