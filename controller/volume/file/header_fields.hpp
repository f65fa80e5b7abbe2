// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <zlib.h>

// What the readers of volume files share: complaints, packed files, and the text headers of NRRD
// and MetaImage: lines, fields, strict numbers, units of length.

namespace kerf {

/// In lower case, ASCII only: for comparing keys of headers and ends of file names.
[[nodiscard]] std::string lower(std::string text);

/// One line for voxels that are not numbers: how many, and the place of the first.
[[noreturn]] void refuse_not_finite(const std::filesystem::path& path, std::uint64_t count,
                                    std::uint64_t first_index, std::uint64_t nx, std::uint64_t ny);

/// One line for a file that is empty, or that a library gives up for a reason.
[[noreturn]] void refuse_unreadable(const std::filesystem::path& path, const std::string& reason);

/// One line for a file that ends too early.
[[noreturn]] void refuse_truncated(const std::string& file, std::uint64_t held,
                                   std::uint64_t expected);

}  // namespace kerf

namespace kerf::volume {

struct CloseGz {
  void operator()(gzFile file) const noexcept { gzclose(file); }
};
/// A file that zlib reads, packed or not; closed with the object.
using GzFile = std::unique_ptr<gzFile_s, CloseGz>;

/// The lines of a header, from the begin of its file; an empty file is refused.
class HeaderLines {
 public:
  explicit HeaderLines(const std::filesystem::path& path);
  /// The next line without its end, `\n` or `\r\n`; none at the end of the file or after 16 MiB.
  [[nodiscard]] std::optional<std::string> next();
  /// Offset of the byte after the last line.
  [[nodiscard]] std::uint64_t end() const noexcept { return at_; }

 private:
  std::string text_;
  std::size_t at_ = 0;
};

/// A number of a header. One with a decimal point and three digits or more may be rounded, by half
/// a unit of its last digit; others are exact.
struct Written {
  double value = 0;
  double rounding = 0;
};

/// Text without blanks at its ends.
[[nodiscard]] std::string stripped(std::string_view text);
/// In lower case and without the characters of `without`.
[[nodiscard]] std::string squeezed(std::string_view text, std::string_view without = " \t");
[[nodiscard]] std::vector<std::string> words_of(const std::string& text);
/// A whole number, all of `word`; none otherwise.
[[nodiscard]] std::optional<std::int64_t> whole_number(std::string_view word);
/// A finite number or NaN, all of `word`; none otherwise.
[[nodiscard]] std::optional<Written> header_number(std::string_view word);

/// The fields of one header. Keys are compared without case and blanks, as NRRD's are; messages
/// show them as the caller writes them.
class HeaderFields {
 public:
  explicit HeaderFields(const std::filesystem::path& path) : path_(path) {}

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Refuses a second text for the same key.
  void add(std::string_view key, const std::string& text);
  [[nodiscard]] bool has(std::string_view key) const;
  /// Empty if there is no such field.
  [[nodiscard]] std::string text(std::string_view key) const;
  /// Refuses a field that is missing.
  [[nodiscard]] std::string needed(std::string_view key) const;

  /// All of the field, which has `count` of them.
  [[nodiscard]] std::vector<std::int64_t> whole_numbers(std::string_view key,
                                                        std::size_t count) const;
  [[nodiscard]] std::int64_t whole_number_or(std::string_view key, std::int64_t otherwise) const;
  [[nodiscard]] std::vector<Written> numbers(std::string_view key, std::size_t count) const;

  /// Throws LoadError: file, key, text, `why`.
  [[noreturn]] void refuse(std::string_view key, const std::string& why) const;

 private:
  const std::filesystem::path& path_;
  std::map<std::string, std::string> all_;
};

/// A unit of length: mm are `times / over` of it.
struct LengthUnit {
  double times = 1, over = 1;
};
/// `mm`, `microns`, `inch`, ...; mm for an empty word or one of question marks; none for another.
[[nodiscard]] std::optional<LengthUnit> length_unit(const std::string& word);

}  // namespace kerf::volume
