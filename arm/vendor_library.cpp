// SPDX-License-Identifier: Apache-2.0
#include "arm/vendor_library.hpp"

#include <algorithm>
#include <cstddef>

#include <dlfcn.h>
#include <link.h>

#include "arm/arm_error.hpp"

namespace kerf {
namespace {

std::string loader_error() {
  const char* const text = dlerror();  // NOLINT(concurrency-mt-unsafe): start
  return text != nullptr ? text : "cannot be loaded";
}

}  // namespace

VendorLibrary::VendorLibrary(const std::string& path, std::initializer_list<const char*> names,
                             const char* product)
    : product_(product) {
  constexpr int kMode = RTLD_LAZY | RTLD_GLOBAL;
  std::string error;
  if (!path.empty()) {
    // The loader searches for a name without a slash instead of opening it.
    const std::string file = path.find('/') == std::string::npos ? "./" + path : path;
    handle_ = dlopen(file.c_str(), kMode);
    if (handle_ == nullptr) error = loader_error();
  } else {
    for (const char* const name : names) {
      handle_ = dlopen(name, kMode);
      if (handle_ != nullptr) break;
      if (error.empty()) error = loader_error();
    }
  }
  if (handle_ == nullptr) {
    throw ArmError(error + "; install " + product_ + ", or name its file: --library PATH");
  }
  const link_map* loaded = nullptr;
  if (dlinfo(handle_, RTLD_DI_LINKMAP, &loaded) == 0 && loaded != nullptr) file_ = loaded->l_name;
}

void* VendorLibrary::address_of(const char* symbol) {
  void* const address = dlsym(handle_, symbol);
  if (address == nullptr) missing_.emplace_back(symbol);
  return address;
}

void VendorLibrary::require_all() const {
  if (missing_.empty()) return;
  constexpr std::size_t kMost = 8;  // in a different library all are missing
  std::string list;
  for (std::size_t i = 0; i < std::min(missing_.size(), kMost); ++i) {
    list += (i > 0 ? ", " : "") + missing_[i];
  }
  if (missing_.size() > kMost) list += " and " + std::to_string(missing_.size() - kMost) + " more";
  throw ArmError(file_ + ": lacks " + list + "; install " + product_ +
                 ", or name its file: --library PATH");
}

}  // namespace kerf
