// SPDX-License-Identifier: Apache-2.0
#include "controller/sandbox/sandbox_reader.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <unistd.h>

#include "controller/sandbox/shared_bytes.hpp"

namespace kerf {

void SandboxReader::say(SandboxWord word, std::string_view text) {
  std::array<char, kLongestSandboxWord> packet;
  packet[0] = static_cast<char>(word);
  const std::size_t length = std::min(text.size(), packet.size() - 1);
  std::copy_n(text.begin(), length, packet.begin() + 1);
  if (::write(channel_, packet.data(), length + 1) < 0) ::_exit(1);  // nobody listens any more
}

std::span<std::byte> SandboxReader::offer(std::span<const std::byte> header) {
  if (header.size() >= kLongestSandboxWord) throw std::length_error("a header of that size");
  say(SandboxWord::offer, {reinterpret_cast<const char*>(header.data()), header.size()});
  std::uint64_t size = 0;
  if (::read(channel_, &size, sizeof size) != sizeof size) ::_exit(1);
  return SharedBytes(memory_, size).release();
}

}  // namespace kerf
