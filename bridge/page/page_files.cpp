// SPDX-License-Identifier: Apache-2.0
#include "bridge/page/page_files.hpp"

#include <array>

namespace kerf::bridge {

std::span<const PageFile> page_files() noexcept {
  static constexpr std::array kFiles = {
      PageFile{"index.html", "text/html; charset=utf-8",
               "<!doctype html><html lang=\"en\"><title>kerf</title><p>kerf bridge\n"}};
  return kFiles;
}

}  // namespace kerf::bridge
