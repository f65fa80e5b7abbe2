// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_mesh.hpp"

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
#include <map>
#include <optional>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/input/sandbox.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

using vec3::cross, vec3::dot, vec3::length, vec3::operator+, vec3::operator-, vec3::operator*;

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // lower corner first

std::string text_of(const ToolMesh::Point& p) {
  return "(" + short_text(p[0]) + ", " + short_text(p[1]) + ", " + short_text(p[2]) + ")";
}

void check_coordinates(std::span<const LooseTriangle> triangles, double scale,
                       const std::string& location) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (const auto& corner : triangles[t]) {
      for (const float x : corner) {
        const double mm = scale * static_cast<double>(x);
        if (std::abs(mm) <= kLargestMeshMm) continue;  // not so for NaN
        refuse(location, ": triangle " + std::to_string(t + 1) + " has the coordinate " +
                             short_text(mm) + " mm; use numbers within " +
                             short_text(kLargestMeshMm) + " mm, check scale");
      }
    }
  }
}

/// Counts of the directions of an edge: up is from the lower corner to the higher.
struct Passes {
  int up = 0, down = 0;
};

/// Why the mesh encloses nothing, or something twice; empty if it encloses a solid.
std::string fault_of(const ToolMesh& mesh) {
  std::set<ToolMesh::Triangle> known;  // with their lowest corner first
  for (ToolMesh::Triangle t : mesh.triangles) {
    std::ranges::rotate(t, std::ranges::min_element(t));
    if (known.insert(t).second) continue;
    return ": two triangles have the corners " + text_of(mesh.points_mm[t[0]]) + ", " +
           text_of(mesh.points_mm[t[1]]) + " and " + text_of(mesh.points_mm[t[2]]) +
           " mm; remove doubled triangles";
  }
  std::map<Edge, Passes> edges;
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      Passes& passes = edges[std::minmax(a, b)];
      ++(a < b ? passes.up : passes.down);
    }
  }
  for (const auto& [edge, passes] : edges) {
    if (passes.up == passes.down) continue;
    const std::string ends = "the edge from " + text_of(mesh.points_mm[edge.first]) + " to " +
                             text_of(mesh.points_mm[edge.second]) + " mm";
    const int count = passes.up + passes.down;
    if (count == 1) return ": not closed, " + ends + " has no partner; close the hole there";
    if (count % 2 == 1) {
      return ": " + std::to_string(count) + " triangles meet at " + ends +
             ", and two enclose a solid; remove the wall within it, or the sheet on it";
    }
    return ": the triangles at " + ends +
           " are turned against each other; let all be counter-clockwise from outside";
  }
  return {};
}

/// Joins corners of equal coordinates (`noise` 0), or those that no coordinate sets apart by more
/// than `noise`: to the first of them.
ToolMesh joined(std::span<const LooseTriangle> triangles, double scale, double noise) {
  using Cell = ToolMesh::Point;
  ToolMesh mesh;
  std::map<Cell, std::uint32_t> known;  // at most one corner in a cell of edge `noise`
  const auto index_of = [&](const ToolMesh::Point& corner) {
    Cell own = corner;
    if (noise > 0) {
      for (double& x : own) x = std::floor(x / noise);
      for (int step = 0; step < 27; ++step) {
        const int near = (step + 13) % 27;  // the corner's own cell first
        const auto beside = [&](int by) { return static_cast<double>(near / by % 3 - 1); };
        const Cell cell = own + Cell{beside(1), beside(3), beside(9)};
        const auto at = known.find(cell);
        if (at == known.end()) continue;
        const ToolMesh::Point apart = mesh.points_mm[at->second] - scale * corner;
        if (std::ranges::all_of(apart, [&](double x) { return std::abs(x) <= scale * noise; })) {
          return at->second;
        }
      }
    }
    const auto next = static_cast<std::uint32_t>(mesh.points_mm.size());
    const auto [at, is_new] = known.try_emplace(own, next);
    if (is_new) mesh.points_mm.push_back(scale * corner);
    return at->second;
  };
  for (const LooseTriangle& loose : triangles) {
    ToolMesh::Triangle t{};
    std::ranges::transform(loose, t.begin(), [&](const auto& corner) {
      return index_of({corner[0], corner[1], corner[2]});
    });
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  return mesh;
}

/// Distances by which writers may set one corner apart in its triangles: four steps of a float of
/// the size of the largest coordinate, after a few operations; one unit of the sixth digit, which
/// is the last that C and C++ write by default, and so less than one and a half.
std::array<double, 2> noises(std::span<const LooseTriangle> triangles) {
  float largest = 0;
  for (const LooseTriangle& triangle : triangles) {
    for (const auto& corner : triangle) {
      for (const float x : corner) largest = std::max(largest, std::abs(x));
    }
  }
  const auto size = static_cast<double>(largest);
  const double float_step = std::numeric_limits<float>::epsilon() * std::ldexp(1, std::ilogb(size));
  int digits = 0;  // behind the point, of the first one that is not 0
  while (size > 0 && power_of_tenth(digits) > size) ++digits;
  while (power_of_tenth(digits - 1) <= size) --digits;
  return {4 * float_step, 1.5e-5 * power_of_tenth(digits)};
}

/// The mesh with its corners joined: as they are, else without the noise of their numbers.
ToolMesh closed_mesh(std::span<const LooseTriangle> triangles, double scale,
                     const std::string& location) {
  ToolMesh mesh = joined(triangles, scale, 0);
  const std::string fault = fault_of(mesh);
  if (fault.empty()) return mesh;
  for (const double noise : noises(triangles)) {
    if (!(noise > 0)) continue;
    mesh = joined(triangles, scale, noise);
    if (fault_of(mesh).empty()) return mesh;
  }
  refuse(location, fault);
}

/// Puts the middle of the height at 0, in whole nanometres.
void stand_in_the_middle(std::vector<ToolMesh::Point>& points_mm) {
  const auto [low, high] = std::minmax_element(
      points_mm.begin(), points_mm.end(), [](const auto& a, const auto& b) { return a[1] < b[1]; });
  const double middle_mm = ((*low)[1] + (*high)[1]) / 2;
  for (ToolMesh::Point& p : points_mm) {
    p[1] -= middle_mm;
    // Zero is added to lose the sign of -0.
    for (double& x : p) x = std::round(x * 1e6) / 1e6 + 0.0;
  }
}

void check_size(std::size_t triangles, const std::string& location) {
  if (triangles == 0) refuse(location, ": no triangles; export a closed mesh");
  if (triangles <= kMaxMeshTriangles) return;
  refuse(location, ": " + std::to_string(triangles) + " triangles, above the limit of " +
                       std::to_string(kMaxMeshTriangles) + "; simplify the mesh");
}

void check_encloses(double volume_mm3, const std::string& location) {
  if (volume_mm3 >= 1e-9) return;
  refuse(location, ": the mesh encloses " + short_text(volume_mm3) +
                       " mm^3; export a solid, check scale (mm per unit of the file)");
}

}  // namespace

void check_mesh(const ToolMesh& mesh, const std::string& location) {
  check_size(mesh.triangles.size(), location);
  for (const ToolMesh::Point& point : mesh.points_mm) {
    for (const double mm : point) {
      if (std::abs(mm) <= 2 * kLargestMeshMm) continue;  // moved to the middle
      refuse(location, ": has the coordinate " + short_text(mm) + " mm; record it again");
    }
  }
  if (const std::string fault = fault_of(mesh); !fault.empty()) refuse(location, fault);
  ToolMesh turned = mesh;
  check_encloses(turn_outward(turned), location);
  if (turned.triangles != mesh.triangles) refuse(location, ": inside out; record it again");
}

ToolMesh join_triangles(std::span<const LooseTriangle> triangles, double scale,
                        const std::string& location) {
  check_size(triangles.size(), location);
  check_coordinates(triangles, scale, location);
  ToolMesh mesh = closed_mesh(triangles, scale, location);
  stand_in_the_middle(mesh.points_mm);
  check_encloses(turn_outward(mesh), location);
  return mesh;
}

namespace {

constexpr std::size_t kHeaderBytes = 84, kTriangleBytes = 50, kNormalBytes = 12;
constexpr std::string_view kBlanks = " \t\r\n\v\f";

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8 | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

void check_count(std::uint64_t triangles, const std::string& location) {
  if (triangles <= kMaxMeshTriangles) return;
  refuse(location,
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

/// Compares keywords: ASCII letters in any case.
bool is_word(std::string_view word, std::string_view lower) {
  return std::ranges::equal(word, lower, {},
                            [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
}

/// The words of an STL text, with the line for complaints.
class StlText {
 public:
  StlText(std::string_view text, const std::string& location) : rest_(text), location_(location) {}

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
#ifdef __cpp_lib_to_chars
    const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
    // The error does not tell too large from too small; a number that is too small becomes 0.
    if (fault == std::errc::result_out_of_range)
      value = std::strtod(std::string(word).c_str(), nullptr);
    const bool number = fault != std::errc::invalid_argument && end == word.data() + word.size();
#else  // libc++ 16, of WebAssembly
    const std::optional<double> read = number_in(word);
    value = read.value_or(0);
    const bool number = read.has_value();
#endif
    if (!number || std::abs(value) > std::numeric_limits<float>::max()) {
      const bool comma = word.find(',') != word.npos;
      complain(word, comma ? "a number with a decimal point" : "a number");
    }
    return static_cast<float>(value);
  }
  void skip_line() {
    skip(std::min(rest_.find_first_of("\r\n"), rest_.size()));
  }

  [[noreturn]] void complain(std::string_view word, std::string_view wanted) const {
    constexpr std::size_t kLongest = 40;
    const std::string found =
        word.empty() ? "the file ends" : "\"" + std::string(word.substr(0, kLongest)) + "\"";
    refuse(location_ + ":" + std::to_string(line_),
           ": " + found + " where " + std::string(wanted) + " belongs; export the mesh again");
  }

 private:
  void skip(std::size_t bytes) {
    for (std::size_t at = 0; at < bytes; ++at) {  // a line ends with \n, \r\n or \r
      const bool is_return = rest_[at] == '\r' && !rest_.substr(at + 1).starts_with('\n');
      line_ += rest_[at] == '\n' || is_return ? 1 : 0;
    }
    rest_.remove_prefix(bytes);
  }

  std::string_view rest_;
  const std::string& location_;
  std::ptrdiff_t line_ = 1;
};

/// The word that ends a block: in one, as `endloop`, or in two.
void expect_end(StlText& text, const std::string& of) {
  const std::string_view word = text.next();
  if (is_word(word, "end")) return text.expect(of);
  if (!is_word(word, "end" + of)) text.complain(word, "end" + of);
}

LooseTriangle read_facet(StlText& text) {
  text.expect("normal");
  for (int i = 0; i < 3; ++i) static_cast<void>(text.next());  // not used, and often no numbers
  text.expect("outer");
  text.expect("loop");
  LooseTriangle triangle{};
  for (auto& corner : triangle) {
    text.expect("vertex");
    for (float& x : corner) x = text.number();
  }
  expect_end(text, "loop");
  expect_end(text, "facet");
  return triangle;
}

std::vector<LooseTriangle> text_triangles(StlText text, const std::string& location) {
  std::vector<LooseTriangle> triangles;
  bool in_solid = false;
  for (std::string_view word = text.next(); !word.empty(); word = text.next()) {
    if (in_solid && is_word(word, "facet")) {
      triangles.push_back(read_facet(text));
      check_count(triangles.size(), location);
    } else if (is_word(word, "solid")) {
      in_solid = true;
      text.skip_line();  // its name
    } else if (in_solid && (is_word(word, "endsolid") || is_word(word, "end"))) {
      text.skip_line();
      in_solid = false;
    } else {
      text.complain(word, in_solid ? "facet or endsolid" : "solid");
    }
  }
  return triangles;
}

}  // namespace

std::vector<LooseTriangle> parse_stl(std::string_view bytes, const std::string& location) {
  if (bytes.size() >= kHeaderBytes) {
    const std::size_t count = word_at(bytes, kHeaderBytes - 4);
    if (bytes.size() == kHeaderBytes + kTriangleBytes * count) {
      check_count(count, location);
      return binary_triangles(bytes, count);
    }
    // Text holds no zero byte; a binary file does, at least in its count.
    if (bytes.find('\0') != bytes.npos) {
      refuse(location, ": a binary STL of " + std::to_string(count) + " triangles has " +
                           std::to_string(kHeaderBytes + kTriangleBytes * count) +
                           " bytes, and the file has " + std::to_string(bytes.size()) +
                           "; export the mesh again");
    }
  }
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
  return text_triangles(StlText(bytes, location), location);
}

namespace {

/// Runs in the sandbox.
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

std::vector<LooseTriangle> read_stl(const std::string& file, int cpu_s) {
  const std::filesystem::path path(file);
  std::error_code fault;
  if (std::filesystem::is_directory(path, fault)) {
    refuse(path.string(), ": is a folder; name an STL file in it");
  }
  if (const std::string why = access_error(path); !why.empty()) refuse(path.string(), why);
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
        triangles.resize(static_cast<std::size_t>(count));
        return triangles.size() * sizeof(LooseTriangle);
      });
  std::ranges::copy(memory.bytes(), std::as_writable_bytes(std::span(triangles)).begin());
  return triangles;
}

}  // namespace kerf
