// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

namespace kerf {

/// A vendor's shared library that the user has installed, opened by name or path at run time. kerf
/// ships no such library and none of its headers.
///
/// It stays loaded until the process ends, because its own threads may still run.
class VendorLibrary {
 public:
  /// Opens `path`; if it is empty, the first of `names` that the loader finds in LD_LIBRARY_PATH,
  /// the cache of ldconfig, /lib or /usr/lib. Uses RTLD_LAZY | RTLD_GLOBAL, as the programs with
  /// which the vendors' libraries are known to work. If that fails, throws ArmError, which asks the
  /// user to install `product`.
  VendorLibrary(const std::string& path, std::initializer_list<const char*> names,
                const char* product);

  /// Sets `function` to the address of the symbol, or to null if it is missing; `require_all` then
  /// reports it.
  template <class Function>
  void find(const char* symbol, Function*& function) {
    function = reinterpret_cast<Function*>(address_of(symbol));
  }
  /// Throws ArmError with the names of symbols that `find` did not find: eight, then their number.
  void require_all() const;

  /// The file that the loader opened.
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

 private:
  [[nodiscard]] void* address_of(const char* symbol);

  void* handle_ = nullptr;
  std::string file_;
  const char* product_;
  std::vector<std::string> missing_;
};

}  // namespace kerf
