// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/stl_file.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <system_error>

#include "controller/sandbox/sandbox.hpp"
#include "controller/scene/scene_text.hpp"
#include "shared/posix/unreachable.hpp"

namespace kerf {
namespace {

constexpr std::size_t kHeaderBytes = 84, kTriangleBytes = 50, kNormalBytes = 12;
constexpr std::string_view kBlanks = " \t\r\n\v\f";

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8 | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

void check_count(std::size_t triangles, const std::string& place) {
  if (triangles <= kMaxMeshTriangles) return;
  refuse(place,
         ": more than " + std::to_string(kMaxMeshTriangles) + " triangles; simplify the mesh");
}

std::vector<LooseTriangle> binary_triangles(std::string_view bytes, std::size_t count) {
  std::vector<LooseTriangle> triangles(count);
  std::size_t at = kHeaderBytes;
  for (LooseTriangle& triangle : triangles) {
    std::size_t number = at + kNormalBytes;
    for (auto& corner : triangle) {
      for (float& x : corner) {
        x = std::bit_cast<float>(word_at(bytes, number));
        number += 4;
      }
    }
    at += kTriangleBytes;
  }
  return triangles;
}

/// Of keywords: ASCII letters in any case.
bool is_word(std::string_view word, std::string_view lower) {
  return std::ranges::equal(word, lower, {},
                            [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
}

/// Word after word of an STL text, with the line for complaints.
class StlText {
 public:
  StlText(std::string_view text, const std::string& place) : rest_(text), place_(place) {}

  /// Empty at the end.
  std::string_view next() {
    skip(std::min(rest_.find_first_not_of(kBlanks), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kBlanks));
    skip(word.size());
    return word;
  }
  void expect(std::string_view wanted) {
    const std::string_view word = next();
    if (!is_word(word, wanted)) complain(word, wanted);
  }
  float number() {
    std::string_view word = next();
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
    // Says not whether too large or too small; what is too small for a number is 0.
    if (fault == std::errc::result_out_of_range)
      value = std::strtod(std::string(word).c_str(), nullptr);
    const bool number = fault != std::errc::invalid_argument && end == word.data() + word.size();
    if (!number || std::abs(value) > std::numeric_limits<float>::max()) complain(word, "a number");
    return static_cast<float>(value);
  }
  void skip_line() { skip(std::min(rest_.find('\n'), rest_.size())); }

  [[noreturn]] void complain(std::string_view word, std::string_view wanted) const {
    constexpr std::size_t kLongest = 40;
    const std::string found =
        word.empty() ? "the file ends" : "\"" + std::string(word.substr(0, kLongest)) + "\"";
    refuse(place_ + ":" + std::to_string(line_),
           ": " + found + " where " + std::string(wanted) + " belongs; export the mesh again");
  }

 private:
  void skip(std::size_t bytes) {
    const auto end = rest_.begin() + static_cast<std::ptrdiff_t>(bytes);
    line_ += std::count(rest_.begin(), end, '\n');
    rest_.remove_prefix(bytes);
  }

  std::string_view rest_;
  const std::string& place_;
  std::ptrdiff_t line_ = 1;
};

LooseTriangle read_facet(StlText& text) {
  text.expect("normal");
  for (int i = 0; i < 3; ++i) static_cast<void>(text.number());
  text.expect("outer");
  text.expect("loop");
  LooseTriangle triangle{};
  for (auto& corner : triangle) {
    text.expect("vertex");
    for (float& x : corner) x = text.number();
  }
  text.expect("endloop");
  text.expect("endfacet");
  return triangle;
}

std::vector<LooseTriangle> text_triangles(StlText text, const std::string& place) {
  std::vector<LooseTriangle> triangles;
  for (std::string_view solid = text.next(); !solid.empty(); solid = text.next()) {
    if (!is_word(solid, "solid")) text.complain(solid, "solid");
    text.skip_line();  // its name
    for (;;) {
      const std::string_view word = text.next();
      if (is_word(word, "endsolid")) break;
      if (!is_word(word, "facet")) text.complain(word, "facet or endsolid");
      triangles.push_back(read_facet(text));
      check_count(triangles.size(), place);
    }
    text.skip_line();
  }
  return triangles;
}

}  // namespace

std::vector<LooseTriangle> parse_stl(std::string_view bytes, const std::string& place) {
  if (bytes.size() >= kHeaderBytes) {
    const std::size_t count = word_at(bytes, kHeaderBytes - 4);
    if (bytes.size() == kHeaderBytes + kTriangleBytes * count) {
      check_count(count, place);
      return binary_triangles(bytes, count);
    }
    // Text holds no zero byte; a binary file does, in its count if nowhere else.
    if (bytes.find('\0') != bytes.npos) {
      refuse(place, ": a binary STL of " + std::to_string(count) + " triangles has " +
                        std::to_string(kHeaderBytes + kTriangleBytes * count) +
                        " bytes, and the file has " + std::to_string(bytes.size()) +
                        "; export the mesh again");
    }
  }
  return text_triangles(StlText(bytes, place), place);
}

namespace {

/// In the sandbox.
void hand_over_stl(const std::filesystem::path& path, SandboxReader& sandbox) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) refuse(path.string(), ": cannot be read; check its permissions");
  const std::vector<LooseTriangle> triangles = parse_stl(bytes, path.string());
  const std::uint64_t count = triangles.size();
  const std::span<std::byte> memory = sandbox.offer(std::as_bytes(std::span(&count, 1)));
  std::ranges::copy(std::as_bytes(std::span(triangles)), memory.begin());
}

}  // namespace

std::vector<LooseTriangle> read_stl(const std::filesystem::path& path, int cpu_s) {
  std::error_code fault;
  if (std::filesystem::is_directory(path, fault)) {
    refuse(path.string(), ": is a folder; name an STL file in it");
  }
  if (const std::string why = why_unreachable(path); !why.empty()) refuse(path.string(), why);
  if (!std::filesystem::exists(path, fault)) {
    refuse(path.string(), ": no such STL file; name one, relative to the scene's folder");
  }
  if (!std::filesystem::is_regular_file(path, fault)) {
    refuse(path.string(),
           ": a pipe, socket or device; copy what it gives to a file, and name that");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, fault);
  if (fault || size > kMaxStlBytes) {
    refuse(path.string(),
           ": larger than " + std::to_string(kMaxStlBytes >> 20) + " MiB; simplify the mesh");
  }
  std::vector<LooseTriangle> triangles;
  const SharedBytes memory = read_in_sandbox(
      {path.string(), "STL", size, cpu_s},
      [&](SandboxReader& sandbox) { hand_over_stl(path, sandbox); },
      [&](std::span<const std::byte> header) {
        std::uint64_t count = 0;
        if (header.size() == sizeof count) std::memcpy(&count, header.data(), sizeof count);
        check_count(count, path.string());
        triangles.resize(count);
        return count * sizeof(LooseTriangle);
      });
  std::ranges::copy(memory.bytes(), std::as_writable_bytes(std::span(triangles)).begin());
  return triangles;
}

}  // namespace kerf
