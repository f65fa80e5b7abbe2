// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace kerf::bridge {

using Digest = std::array<unsigned char, 32>;
[[nodiscard]] Digest digest_of(std::string_view text) noexcept;

/// What the holder of a token may do.
enum class Right { none, look, command };

/// The tokens and their rights. Tokens have 16 to 128 letters, digits, '-' and '_'.
class Tokens {
 public:
  /// Adds the tokens of a file, one per line; '#' starts a comment. Throws `BridgeError` if the
  /// file cannot be read, is open to others, or has no token or an invalid one.
  void add_file(const std::filesystem::path& file, const char* option, Right right);
  void add(std::string_view token, Right right);

  /// In constant time: compares the digests of all tokens, each to its end.
  [[nodiscard]] Right right_of(std::string_view token) const noexcept;
  /// The right of a cookie, a value of `cookie_for`; in constant time.
  [[nodiscard]] Right right_of_cookie(std::string_view cookie) const noexcept;

  [[nodiscard]] bool may_command() const noexcept {
    return std::ranges::any_of(entries_,
                               [](const Entry& one) { return one.right == Right::command; });
  }
  /// The first token, for the printed address.
  [[nodiscard]] const std::string& first() const noexcept { return first_; }

 private:
  struct Entry {
    Digest token, cookie;
    Right right;
  };
  [[nodiscard]] Right right_by(Digest Entry::*secret, std::string_view shown) const noexcept;

  std::vector<Entry> entries_;
  std::string first_;
};

/// 128 random bits in hex.
[[nodiscard]] std::string new_token();

/// The cookie that a browser keeps instead of a token: the same after a restart, and the token
/// cannot be computed from it.
[[nodiscard]] std::string cookie_for(std::string_view token);

/// A token that opens the page in one browser; after its use `renew` makes another one.
class OneTimeToken {
 public:
  [[nodiscard]] const std::string& token() const noexcept { return token_; }
  /// In constant time.
  [[nodiscard]] bool is(std::string_view token) const noexcept;
  void renew() { token_ = new_token(); }

 private:
  std::string token_ = new_token();
};

/// The value of `key` in `a=1&b=2`, of a target `/path?a=1&b=2`; empty if there is none.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view key) noexcept;
/// The target without its query.
[[nodiscard]] std::string_view path_of(std::string_view target) noexcept;
/// The value of `name` in the text of a Cookie header; empty if there is none.
[[nodiscard]] std::string_view cookie_value(std::string_view cookies,
                                            std::string_view name) noexcept;

/// A Host header without its port, and IPv6 without its brackets.
[[nodiscard]] std::string_view host_name(std::string_view host) noexcept;

/// Whether a request with this Host header, without its port, may be answered: any IP address,
/// "localhost" or one of `names`. Any other name could be a DNS rebinding attack: a foreign page
/// whose name server returns this machine's address.
[[nodiscard]] bool is_own_host(std::string_view host, const std::vector<std::string>& names);

/// Whether the page that opens a WebSocket was loaded from here: the origin is empty (no browser),
/// or has the scheme and host of the request, or is `public_origin`, that of a proxy.
[[nodiscard]] bool is_own_origin(std::string_view origin, std::string_view host, bool tls,
                                 std::string_view public_origin = {});

}  // namespace kerf::bridge
