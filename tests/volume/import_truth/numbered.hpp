// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "controller/volume/file/volume_io.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "tests/support/temporary_folder.hpp"

/// Numbered volumes: each voxel has a value of its own and a known position in the patient. They
/// are written in each format from its specification, without the libraries that read them, so that
/// a test can compare value and position of each voxel (`docs/own-volume.md` is made of them).
namespace kerf::test {

/// The random choices of one case. The same seed makes the same case.
class Draw {
 public:
  Draw(std::uint64_t seed, int longest) : engine_(seed), longest_(longest) {}

  /// 0 .. n - 1.
  int below(int n) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(n)); }
  bool coin() { return below(2) == 0; }
  template <class T>
  T of(std::initializer_list<T> list) {
    return list.begin()[below(static_cast<int>(list.size()))];
  }
  /// One word of a list such as "short|int16".
  std::string word(std::string_view list);
  /// A decimal number in [low, high) of 1 to 4 digits behind the point.
  double decimal(double low, double high);
  std::uint64_t bits() { return engine_(); }
  /// Voxels along the longest side.
  [[nodiscard]] int longest() const { return longest_; }

  bool invert_values = false;  ///< numbers each voxel with another value than without it

 private:
  std::mt19937_64 engine_;
  int longest_;
};

/// A volume as its file must give it back. Voxel (i, j, k) lies at
/// `origin_mm + axes * (spacing_mm * (i, j, k))` in LPS; the axes are unit vectors at right angles,
/// of either handedness.
struct Numbered {
  std::array<int, 3> size{};
  std::array<double, 3> spacing_mm{};
  vec3::Vec origin_mm{};
  std::array<vec3::Vec, 3> axes{};
  VoxelType type = VoxelType::uint16;
  std::endian order = std::endian::little;
  std::vector<double> stored;  ///< as the file holds them, x fastest
  std::vector<double> values;  ///< after scaling
  bool any_origin = false;     ///< no file says where the volume lies
  double digits = 1e-12;       ///< relative rounding of the numbers of its header
  double slack_mm = 0;         ///< of positions, beside that of `digits`
  double value_slack = 0;      ///< relative to the largest value: rounding of float32 arithmetic

  [[nodiscard]] std::size_t count() const { return stored.size(); }
  [[nodiscard]] std::size_t layer() const { return count() / static_cast<std::size_t>(size[2]); }
  [[nodiscard]] vec3::Vec position(double i, double j, double k) const;
  /// The bytes of the stored values of the slices [first, last).
  [[nodiscard]] std::string bytes(int first, int last) const;
  [[nodiscard]] std::string bytes() const { return bytes(0, size[2]); }
  /// Scales each slice; float32 may round it.
  void scale(const std::function<std::array<double, 2>(int)>& slope_and_intercept);
  /// No orientation and no origin, for formats that have neither.
  void lay_flat();
};

/// Random size, spacing, position, orientation (the 48 permutations and mirrors of the axes, or any
/// rotation) and values from the whole range of `type`; at least `slices` layers. `type` may be
/// changed with `number_anew`.
[[nodiscard]] Numbered numbered(Draw& draw, VoxelType type, int slices = 1);
/// Other values, from the whole range of the type or of `bits`.
void number_anew(Draw& draw, Numbered& volume, VoxelType type, int bits = 64);

/// The text of a number that is exact to 17 digits, in one of the ways in which programs write it.
[[nodiscard]] std::string decimal_text(Draw& draw, double value);
/// Rounded to `digits` behind the point.
[[nodiscard]] std::string fixed_text(double value, int digits);

/// Deflated, with the frame of zlib (RFC 1950).
[[nodiscard]] std::string zlib_packed(const std::string& bytes);
[[nodiscard]] std::string bzip2_packed(const std::string& bytes);

/// The outcome that a situation must have. Each other one is a failure, silent errors first.
enum class Expected : std::uint8_t {
  read,             ///< each voxel with value and position
  refused,          ///< one line
  asked,            ///< one line that asks for --spacing or --series
  read_or_refused,  ///< not wrong in silence; the page has which of both
};
inline constexpr auto kRead = Expected::read, kRefused = Expected::refused,
                      kAsked = Expected::asked, kEither = Expected::read_or_refused;

/// A case on disk.
struct Written {
  std::filesystem::path path;
  ReadOptions options{};
  Numbered truth{};
  std::string note{};  ///< a part of the note of the reading
};

/// One row of the page.
struct Situation {
  std::string format, name;
  Expected expected = Expected::read;
  std::string word;  ///< of the refusal
  std::function<Written(Draw&, const TemporaryFolder&)> write;
};

void add_nrrd(std::vector<Situation>& all);
void add_meta(std::vector<Situation>& all);
void add_nifti(std::vector<Situation>& all);
void add_tiff(std::vector<Situation>& all);
void add_stacks_and_raw(std::vector<Situation>& all);
void add_dicom_series(std::vector<Situation>& all);
void add_dicom_frames(std::vector<Situation>& all);

}  // namespace kerf::test
