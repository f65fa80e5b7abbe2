// SPDX-License-Identifier: Apache-2.0
// Text headers, NRRD and MetaImage: their fields, and where their voxels lie.
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <map>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/file_headers.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

/// Keys of a text header, in lower case, and their texts.
using HeaderFields = std::map<std::string, std::string>;

/// As NrrdIO knows them; `block` has no numbers.
constexpr std::string_view kNrrdTypes =
    "signed char|int8|int8_t|uchar|unsigned char|uint8|uint8_t|short|short int|signed short|"
    "signed short int|int16|int16_t|ushort|unsigned short|unsigned short int|uint16|uint16_t|int|"
    "signed int|int32|int32_t|uint|unsigned int|uint32|uint32_t|longlong|long long|long long int|"
    "signed long long|signed long long int|int64|int64_t|ulonglong|unsigned long long|"
    "unsigned long long int|uint64|uint64_t|float|double";
constexpr std::string_view kNrrdEncodings = "raw|txt|text|ascii|hex|gz|gzip";
constexpr std::string_view kMetaTypes =
    "met_char|met_uchar|met_short|met_ushort|met_int|met_uint|met_long|met_ulong|met_long_long|"
    "met_ulong_long|met_float|met_double";

bool among(std::string_view list, const std::string& word) {
  return ("|" + std::string(list) + "|").find("|" + word + "|") != std::string::npos;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

template <class Number>
bool is_number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

template <class Number>
bool all_numbers(const std::vector<std::string>& words) {
  return std::ranges::all_of(words,
                             [](const std::string& word) { return is_number<Number>(word); });
}

/// Count of the numbers in `(1,0,0)`; none if there is anything else.
std::optional<std::size_t> numbers_of_vector(std::string text) {
  if (text.size() < 2 || text.front() != '(' || text.back() != ')') return std::nullopt;
  std::ranges::replace(text, ',', ' ');
  const auto words = words_of(text.substr(1, text.size() - 2));
  return all_numbers<double>(words) ? std::optional(words.size()) : std::nullopt;
}

/// `(1,0,0) (0,1,0) none`: such vectors alone, of `length` numbers each. A blank after a comma is
/// ignored.
bool are_vectors(const std::string& text, std::size_t length) {
  std::string tight;
  bool inside = false;
  for (const char c : text) {
    if (c == '(') inside = true;
    if (c == ')') inside = false;
    if (!(inside && c == ' ')) tight += c;
  }
  return std::ranges::all_of(words_of(tight), [&](const std::string& word) {
    return word == "none" || numbers_of_vector(word) == length;
  });
}

/// The fields of a header, and the refusal of one.
struct Fields {
  const fs::path& path;
  const HeaderFields& all;

  /// Refuses the field if it is there and `fits` does not accept it.
  template <class Fits>
  void check(const char* key, const Fits& fits, const std::string& wanted) const {
    const auto field = all.find(key);
    if (field == all.end() || fits(field->second)) return;
    throw LoadError(path.string() + ": " + key + ": " + one_line(field->second.substr(0, 80)) +
                    " is not " + wanted + "; correct the header");
  }

  /// The number of axes in `key`, and as many numbers in `sizes`.
  void check_axes(const char* key, const char* sizes) const {
    check(
        key, [](const auto& t) { return is_number<std::uint8_t>(t); }, "a number of axes");
    const auto axes = all.find(key);
    const auto fits = [&](const std::string& text) {
      const auto words = words_of(text);
      const bool all_there = axes == all.end() || std::to_string(words.size()) == axes->second;
      return all_there && all_numbers<std::int64_t>(words);
    };
    check(sizes, fits,
          axes == all.end() ? "a whole number for each axis" : axes->second + " whole numbers");
  }
};

// Both checks refuse fields that the reading libraries would refuse with messages of their own, or
// misread: a LoadError with the field, its text and the expected value. Missing fields are not
// checked.

void check_nrrd_fields(const fs::path& path, const HeaderFields& all) {
  const Fields fields{path, all};
  const auto is_type = [](const std::string& t) { return among(kNrrdTypes, lower(t)); };
  const auto is_encoding = [](const std::string& t) { return among(kNrrdEncodings, lower(t)); };
  fields.check_axes("dimension", "sizes");
  fields.check("type", is_type, "a type of numbers, such as uint16 or float");
  const auto encoding = all.find("encoding");
  if (encoding != all.end() && among("bz2|bzip2", lower(encoding->second))) {
    throw LoadError(path.string() + ": encoding: bzip2 cannot be unpacked; save it as gzip or raw");
  }
  fields.check("encoding", is_encoding, "one of raw, text, hex, gzip");
  const auto all_are_numbers = [](const auto& t) { return all_numbers<double>(words_of(t)); };
  fields.check("spacings", all_are_numbers, "a number for each axis");
  const auto space = all.find("space dimension");
  const auto are_directions = [&](const std::string& t) {
    return are_vectors(t, space == all.end() || space->second == "3" ? 3 : 2);
  };
  fields.check("space directions", are_directions, "vectors such as (1,0,0) (0,1,0) (0,0,1)");
  const auto quoted = [](const std::string& t) {
    return t.starts_with('"') && std::ranges::count(t, '"') % 2 == 0;
  };
  fields.check("space units", quoted, "units in quotes, such as \"mm\" \"mm\" \"mm\"");
}

void check_meta_fields(const fs::path& path, const HeaderFields& all) {
  const Fields fields{path, all};
  const auto is_type = [](const std::string& t) { return among(kMetaTypes, lower(t)); };
  fields.check_axes("ndims", "dimsize");
  fields.check("elementtype", is_type, "a type of numbers, such as MET_SHORT");
}

/// Lines of `key<separator>value` up to a blank line, the end, or the key `last`. Keys in lower
/// case.
struct TextHeader {
  HeaderFields fields;
  std::string first;      ///< line
  std::string stray;      ///< first later line without a separator
  std::uint64_t end = 0;  ///< offset of the byte after the header

  [[nodiscard]] std::string get(const std::string& key) const {
    const auto it = fields.find(key);
    return it == fields.end() ? std::string{} : it->second;
  }
};

std::string trimmed(const std::string& text) {
  const auto space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  const auto first = std::find_if_not(text.begin(), text.end(), space);
  const auto last = std::find_if_not(text.rbegin(), text.rend(), space).base();
  return first < last ? std::string(first, last) : std::string{};
}

TextHeader read_text(const fs::path& path, char separator, const std::string& last) {
  constexpr std::size_t kLongestLine =
      4096;  // with kMostLines: a binary file is given up after 4 MiB
  constexpr int kMostLines = 1024;
  std::ifstream in(path, std::ios::binary);
  TextHeader header;
  std::string line;
  for (int lines = 0; lines < kMostLines; ++lines) {
    line.clear();
    int c = in.get();
    for (; c != EOF && c != '\n' && line.size() < kLongestLine; c = in.get()) {
      line.push_back(static_cast<char>(c));
    }
    header.end = c == EOF ? fs::file_size(path) : static_cast<std::uint64_t>(in.tellg());
    if (c == EOF && line.empty()) return header;
    if (trimmed(line).empty() && last.empty()) return header;
    if (lines == 0) header.first = line;
    const std::size_t at = line.find(separator);
    const bool says = !line.empty() && line.front() != '#';
    if (at == std::string::npos && says && lines > 0 && header.stray.empty()) header.stray = line;
    if (at == std::string::npos || line.front() == '#') continue;
    const std::string key = lower(trimmed(line.substr(0, at)));
    header.fields[key] = trimmed(line.substr(at + 1));
    if (!last.empty() && key == last) return header;
  }
  return header;
}

/// The numbers in a list such as `1 2 3` or `(1,0,0) none (0,2,0)`; words are left out.
std::vector<double> numbers(const std::string& text) {
  std::vector<double> found;
  std::string word;
  for (const char c : text + ' ') {
    if (c != ' ' && c != '\t' && c != ',' && c != '(' && c != ')') {
      word.push_back(c);
      continue;
    }
    double value = 0;
    const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
    if (!word.empty() && result.ec == std::errc{} && std::isfinite(value)) found.push_back(value);
    word.clear();
  }
  return found;
}

/// Refuses a size that ITK would wrap to 32 bits. The other limits are checked after it has read.
void check_sizes(const fs::path& path, const std::string& text) {
  std::vector<double> sizes = numbers(text);
  if (sizes.size() < 3) return;  // the number of axes is judged after reading
  constexpr double kFar = 1e15;  // far above the limit, and whole in 64 bits
  for (double& s : sizes) s = std::clamp(s, -kFar, kFar);
  for (const double s : sizes) {
    if (s < 1.0 || s > static_cast<double>(kMaxVoxelsPerAxis)) {
      check_grid(path.string(), static_cast<std::int64_t>(sizes[0]),
                 static_cast<std::int64_t>(sizes[1]), static_cast<std::int64_t>(sizes[2]));
    }
  }
}

/// A text of the file as part of a message.
std::string shown(const std::string& text) {
  constexpr std::size_t kLongest = 300;
  return escaped(text.substr(0, kLongest));
}

/// The most bytes of voxels that a byte of the file can be: raw; as a digit and a blank for each
/// voxel of at most 8 bytes; by deflate.
enum class Packing : std::uint64_t { raw = 1, text = 4, deflated = 1032 };

/// Sets the file of the voxels and their possible bytes. `offset`: bytes before them.
void locate_data(VolumeHeader& header, const fs::path& path, const fs::path& data,
                 std::uint64_t offset, Packing packing) {
  std::error_code error;
  const std::uint64_t size = fs::file_size(data, error);
  if (error) {
    throw LoadError(path.string() + ": data file " + shown(data.filename().string()) +
                    " cannot be read (" + error.message() +
                    "); put it beside the header or correct the header");
  }
  const std::uint64_t held = size - std::min(size, offset);
  header.data_file = shown(data.string());
  header.data_bytes_at_most = held * static_cast<std::uint64_t>(packing);
}

/// ITK reads each length as mm, whatever the unit of the header.
void check_units(const fs::path& path, const TextHeader& text) {
  constexpr std::array<std::string_view, 14> kOthers{
      "m",      "cm",      "dm",         "um", "\u00b5m", "\u03bcm", "nm",
      "micron", "microns", "micrometer", "in", "inch",    "inches",  "ft"};
  for (const char* const key : {"space units", "units"}) {
    std::istringstream words(text.get(key));
    for (std::string word; words >> std::quoted(word);) {
      if (std::ranges::find(kOthers, lower(word)) == kOthers.end()) continue;
      throw LoadError(path.string() + ": " + key + ": " + word +
                      " where kerf reads mm; write the header's lengths in mm, or remove the line "
                      "and give the spacing in the scene or with `--spacing`");
    }
  }
}

/// Unpacks from `offset` to the end, where the checksum is: NrrdIO stops at the last voxel that it
/// needs, and so accepts a broken stream that became longer.
void check_gzip(const fs::path& data, std::uint64_t offset) {
  const int fd = ::open(data.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;  // NrrdIO reports it
  ::lseek(fd, static_cast<off_t>(offset), SEEK_SET);
  const volume::GzFile file(gzdopen(fd, "rb"));
  if (!file) throw std::bad_alloc();
  std::vector<char> piece(std::size_t{1} << 20);
  int got = 0;
  do {
    got = gzread(file.get(), piece.data(), static_cast<unsigned>(piece.size()));
  } while (got > 0);
  int fault = Z_OK;
  gzerror(file.get(), &fault);
  if (fault != Z_DATA_ERROR) return;
  throw LoadError(shown(data.string()) + ": its packed voxels are broken; copy the file again");
}

}  // namespace

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

VolumeHeader read_nrrd_header(const fs::path& path) {
  const TextHeader text = read_text(path, ':', "");
  const std::string sizes = text.get("sizes");
  const bool is_nrrd = text.first.starts_with("NRRD");
  if (!is_nrrd || sizes.empty()) {
    throw LoadError(path.string() + ": no NRRD header (" +
                    (is_nrrd ? "`sizes` is missing" : "its first line is not NRRD0004") +
                    "); is it another format?");
  }
  const bool names_files = lower(text.get("data file")).starts_with("list");  // a line for each
  if (!text.stray.empty() && !names_files) {
    throw LoadError(path.string() + ": the header's line '" + shown(text.stray) +
                    "' is no 'field: value'; correct the header");
  }
  check_nrrd_fields(path, text.fields);
  check_sizes(path, sizes);
  check_units(path, text);
  for (const char* const needed : {"dimension", "type", "encoding"}) {
    if (text.get(needed).empty())
      throw LoadError(path.string() + ": " + needed + ": is missing; correct the header");
  }
  VolumeHeader header;
  const std::vector<double> spacings = numbers(text.get("spacings"));
  const std::vector<double> directions = numbers(text.get("space directions"));
  header.spacing_known = spacings.size() >= 3 || directions.size() >= 9 ? kAllAxes : 0;
  if (std::find(spacings.begin(), spacings.end(), 0.0) != spacings.end()) {
    throw LoadError(path.string() + ": spacings: " + shown(text.get("spacings")) +
                    " holds a zero; correct the header, or remove the line and give the spacing in "
                    "the scene or with `--spacing`");
  }
  std::string data = text.get("data file");
  if (data.empty()) data = text.get("datafile");
  const std::string encoding = lower(text.get("encoding"));
  const bool compressed = encoding == "gzip" || encoding == "gz";
  const bool text_voxels = encoding == "ascii" || encoding == "text" || encoding == "txt";
  const bool several = data.find('%') != std::string::npos || lower(data).rfind("list", 0) == 0;
  if (several || (encoding != "raw" && !compressed && !text_voxels)) return header;  // ITK counts
  const fs::path file = data.empty() ? path : path.parent_path() / data;
  locate_data(header, path, file, data.empty() ? text.end : 0,
              compressed    ? Packing::deflated
              : text_voxels ? Packing::text
                            : Packing::raw);
  const bool skips = !text.get("byte skip").empty() || !text.get("line skip").empty();
  if (compressed && !skips) check_gzip(file, data.empty() ? text.end : 0);
  return header;
}

VolumeHeader read_meta_header(const fs::path& path) {
  const TextHeader text = read_text(path, '=', "elementdatafile");
  const std::string sizes = text.get("dimsize");
  const std::string data = text.get("elementdatafile");
  if (sizes.empty() || data.empty()) {
    throw LoadError(path.string() +
                    ": no MetaImage header (`DimSize` or `ElementDataFile` is missing); is it "
                    "another format?");
  }
  check_meta_fields(path, text.fields);
  check_sizes(path, sizes);
  VolumeHeader header;
  const bool spaced = !text.get("elementspacing").empty() || !text.get("elementsize").empty();
  header.spacing_known = spaced ? kAllAxes : 0;
  const bool several = data.find('%') != std::string::npos || lower(data).rfind("list", 0) == 0;
  const bool packed = lower(text.get("compresseddata")) == "true";
  header.leaves_out = several || packed;
  if (several) return header;
  const bool ascii = lower(text.get("binarydata")) == "false";
  const bool local = lower(data) == "local";
  locate_data(header, path, local ? path : path.parent_path() / data, local ? text.end : 0,
              packed  ? Packing::deflated
              : ascii ? Packing::text
                      : Packing::raw);
  return header;
}

void refuse_not_finite(const fs::path& path, std::uint64_t count, std::uint64_t first_index,
                       std::uint64_t nx, std::uint64_t ny) {
  std::ostringstream text;
  text << path.string() << ": " << count << (count == 1 ? " voxel is" : " voxels are")
       << " NaN or infinite, the first at (" << first_index % nx << ", " << first_index / nx % ny
       << ", " << first_index / nx / ny << "); replace them with the value of air";
  throw LoadError(text.str());
}

void refuse_truncated(const std::string& file, std::uint64_t held, std::uint64_t expected) {
  std::ostringstream text;
  text << file << ": " << held << " of " << expected
       << " bytes of voxels; the file is cut off, copy it again";
  throw LoadError(text.str());
}

}  // namespace kerf
