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

/// All files of the page, valid as long as the program runs. The HTML has no inline script or
/// style, because the server forbids them (Content-Security-Policy), as well as anything from
/// another address.
[[nodiscard]] std::span<const PageFile> page_files() noexcept;

}  // namespace kerf::bridge
