// SPDX-License-Identifier: Apache-2.0

#include "bridge/net/tokens.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <span>
#include <sstream>

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <openssl/sha.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bridge/net/address.hpp"

namespace kerf::bridge {
namespace {

constexpr std::size_t kFewest = 16, kMost = 128;
constexpr std::size_t kMaxTokens = 256;

[[nodiscard]] bool same_digest(const Digest& a, const Digest& b) noexcept {
  return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

[[nodiscard]] std::string hex(std::span<const unsigned char> bytes) {
  std::string text;
  for (const unsigned char byte : bytes) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

[[nodiscard]] bool is_token(std::string_view text) noexcept {
  return text.size() >= kFewest && text.size() <= kMost &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; });
}

/// The text of a file or a pipe. No pipe is waited for without end.
std::string text_of(const std::filesystem::path& file, const std::string& location) {
  constexpr int kPatienceMs = 2000;
  constexpr std::size_t kMostBytes = 1 << 20;
  const int fd = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) throw BridgeError(location + std::strerror(errno) + "; let this user read it");
  std::string text;
  std::array<char, 4096> part;
  ssize_t bytes = 0;
  do {
    pollfd ready{fd, POLLIN, 0};
    bytes = ::poll(&ready, 1, kPatienceMs) == 1 ? ::read(fd, part.data(), part.size()) : -1;
    text.append(part.data(), static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
  } while (bytes > 0 && text.size() <= kMostBytes);
  ::close(fd);
  if (bytes < 0) throw BridgeError(location + "no program writes into this pipe; name a file");
  if (bytes > 0) throw BridgeError(location + "more than 1 MiB; write one token a line into it");
  return text;
}

[[nodiscard]] bool same_text(std::string_view a, std::string_view b) noexcept {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

/// The value of `key` among `key=value` parts with `separator` between them.
[[nodiscard]] std::string_view value_among(std::string_view parts, std::string_view key,
                                           char separator) noexcept {
  while (!parts.empty()) {
    const std::size_t end = std::min(parts.find(separator), parts.size());
    std::string_view part = parts.substr(0, end);
    while (!part.empty() && part.front() == ' ') part.remove_prefix(1);
    parts.remove_prefix(std::min(end + 1, parts.size()));
    if (part.size() > key.size() && part.starts_with(key) && part[key.size()] == '=') {
      return part.substr(key.size() + 1);
    }
  }
  return {};
}

}  // namespace

Digest digest_of(std::string_view text) noexcept {
  Digest digest;
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  return digest;
}

void Tokens::add_file(const std::filesystem::path& file, const char* option, Right right) {
  const std::string location = std::string(option) + " " + file.string() + ": ";
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) {
    throw BridgeError(location + std::strerror(errno) + "; write one token a line into it");
  }
  if (S_ISDIR(status.st_mode)) {
    throw BridgeError(location + "is a folder; name a file with one token a line");
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw BridgeError(location + "is open to other users; chmod 600 it");
  }
  std::istringstream in(text_of(file, location));
  const std::size_t before = entries_.size();
  std::string line;
  while (std::getline(in, line)) {
    line.erase(std::min(line.find('#'), line.size()));
    line.erase(line.find_last_not_of(" \t\r") + 1);
    if (line.empty()) continue;
    if (!is_token(line)) {
      throw BridgeError(location + "a line of " + std::to_string(line.size()) +
                        " characters is no token; take 16 to 128 letters, digits, '-' or '_'");
    }
    if (entries_.size() == kMaxTokens)
      throw BridgeError(location + "more than 256 tokens; take fewer");
    add(line, right);
  }
  if (entries_.size() == before) throw BridgeError(location + "no token; write one a line into it");
}

void Tokens::add(std::string_view token, Right right) {
  entries_.push_back({digest_of(token), digest_of(cookie_for(token)), right});
  if (first_.empty()) first_ = token;
}

Right Tokens::right_by(Digest Entry::*secret, std::string_view shown) const noexcept {
  const Digest digest = digest_of(shown);
  Right right = Right::none;
  for (const Entry& entry : entries_) {
    right = std::max(right, same_digest(digest, entry.*secret) ? entry.right : Right::none);
  }
  return right;
}

Right Tokens::right_of(std::string_view token) const noexcept {
  return right_by(&Entry::token, token);
}

Right Tokens::right_of_cookie(std::string_view cookie) const noexcept {
  return right_by(&Entry::cookie, cookie);
}

std::string new_token() {
  std::array<unsigned char, 16> random;
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1) {
    throw BridgeError("token: the system gives no random numbers; try again");
  }
  return hex(random);
}

std::string cookie_for(std::string_view token) {
  return hex(digest_of("kerf page " + std::string(token)));
}

bool OneTimeToken::is(std::string_view token) const noexcept {
  return same_digest(digest_of(token), digest_of(token_));
}

std::string_view query_value(std::string_view target, std::string_view key) noexcept {
  const std::size_t query = target.find('?');
  if (query == std::string_view::npos) return {};
  return value_among(target.substr(query + 1), key, '&');
}

std::string_view path_of(std::string_view target) noexcept {
  return target.substr(0, target.find('?'));
}

std::string_view cookie_value(std::string_view cookies, std::string_view name) noexcept {
  return value_among(cookies, name, ';');
}

namespace {

/// Nothing, or a colon and digits.
[[nodiscard]] bool is_port_or_none(std::string_view text) noexcept {
  return text.empty() ||
         (text.front() == ':' &&
          std::all_of(text.begin() + 1, text.end(), [](char c) { return c >= '0' && c <= '9'; }));
}

}  // namespace

std::string_view host_name(std::string_view host) noexcept {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    const bool ends = end != std::string_view::npos && is_port_or_none(host.substr(end + 1));
    return ends ? host.substr(1, end - 1) : std::string_view{};
  }
  const std::string_view name = host.substr(0, host.find(':'));
  return is_port_or_none(host.substr(name.size())) ? name : std::string_view{};
}

bool is_own_host(std::string_view host, const std::vector<std::string>& names) {
  const std::string text(host);
  return is_address(text) || same_text(text, "localhost") ||
         std::any_of(names.begin(), names.end(),
                     [&text](const std::string& name) { return same_text(text, name); });
}

bool is_own_origin(std::string_view origin, std::string_view host, bool tls,
                   std::string_view public_origin) {
  return origin.empty() || same_text(origin, public_origin) ||
         same_text(origin, std::string(tls ? "https://" : "http://") + std::string(host));
}

}  // namespace kerf::bridge
