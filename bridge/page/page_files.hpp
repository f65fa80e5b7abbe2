// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace kerf::bridge {

/// One file of the browser page, as it is served at `/NAME`; "index.html" is served at `/` too.
struct PageFile {
  std::string_view name;
  std::string_view content_type;
  std::string_view bytes;
};

/// All of the page, for the life of the program. No script or style stands inside of the HTML: the
/// server forbids it (Content-Security-Policy), as well as anything from another address.
[[nodiscard]] std::span<const PageFile> page_files() noexcept;

}  // namespace kerf::bridge
