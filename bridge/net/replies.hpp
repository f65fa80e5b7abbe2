// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace kerf::bridge {

/// One answer to a request for a page.
struct HttpReply {
  int status = 200;
  std::string_view content_type = "text/plain; charset=utf-8";
  std::string_view body;
  std::string cookie;  ///< value of Set-Cookie; empty: none
  bool keep_alive = true;
  bool head_only = false;  ///< the request was a HEAD
};

/// The bytes of it. All that a browser can be told to forbid is forbidden: scripts, styles and
/// connections from elsewhere or inside of the HTML, frames around the page, a guess at the type.
[[nodiscard]] std::string http_text(const HttpReply& reply);

}  // namespace kerf::bridge
