// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

namespace kerf {

/// A shared library that the user has installed, opened by name or path while the program runs.
/// kerf ships none, and has no header of one.
///
/// It stays loaded until the process ends: threads of its own may still run.
class VendorLibrary {
 public:
  /// Opens `path`; if it is empty, the first of `names` that the loader finds: in LD_LIBRARY_PATH,
  /// the cache of ldconfig, /lib and /usr/lib. Lazily and for all, as programs do for which the
  /// vendors' libraries are known to work. Throws ArmError, with `product` as what to install.
  VendorLibrary(const std::string& path, std::initializer_list<const char*> names,
                const char* product);

  /// Sets `function` to the symbol; a missing one is remembered.
  template <class Function>
  void find(const char* symbol, Function*& function) {
    function = reinterpret_cast<Function*>(address_of(symbol));
  }
  /// Throws ArmError with the names of all symbols that `find` has missed.
  void require_all() const;

  /// The file that the loader took.
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

 private:
  [[nodiscard]] void* address_of(const char* symbol);

  void* handle_ = nullptr;
  std::string file_;
  const char* product_;
  std::vector<std::string> missing_;
};

}  // namespace kerf
