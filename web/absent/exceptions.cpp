// SPDX-License-Identifier: Apache-2.0
// WebAssembly's libc++ comes without exceptions. One that is thrown ends the instance: its message
// goes to the worker, whose `kerf.failed` throws it on as an exception of JavaScript and never
// returns.
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>
#include <typeinfo>
#include <utility>

#include "shared/text/json.hpp"
#include "web/absent/failure_place.hpp"

namespace kerf::web {
namespace {

std::string place_text, remedy_text;  // of the FailurePlace that lives

}  // namespace

FailurePlace::FailurePlace(std::string place, std::string remedy) {
  place_text = std::move(place);
  remedy_text = std::move(remedy);
}
FailurePlace::~FailurePlace() {
  place_text.clear();
}

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
/// base. A parser's words need a place; all others of kerf are a line with one.
[[noreturn]] void __cxa_throw(void* exception, std::type_info* type, void (*)(void*)) {
  using kerf::web::place_text, kerf::web::remedy_text;
  std::string line = static_cast<const std::exception*>(exception)->what();
  if (!place_text.empty() && *type == typeid(kerf::JsonError)) {
    line = place_text + " (" + line + "); " + remedy_text;
  }
  kerf_failed(line.data(), line.size());
}

}  // extern "C"
