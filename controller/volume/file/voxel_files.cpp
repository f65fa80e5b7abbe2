// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/voxel_files.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <type_traits>

#include <archive.h>
#include <zlib.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

/// The most bytes of voxels that a byte of the file can be: as a digit and a blank for each voxel
/// of at most 8 bytes; by deflate.
std::uint64_t most_bytes(Packing packing, std::uint64_t held) {
  constexpr std::uint64_t kText = 4, kDeflated = 1032;
  constexpr std::uint64_t kBzip2 = 1 << 20;  // a block of 46 bytes may hold 45,899,236
  switch (packing) {
    case Packing::text:
      return (held + 1) * kText;  // no blank after the last
    case Packing::hex:
      return held / 2;
    case Packing::deflated:
      return held * kDeflated;
    case Packing::bzip2:
      return held * kBzip2;
    case Packing::raw:
      break;
  }
  return held;
}

std::string shown(const fs::path& file) {
  return one_line(file.string());
}

[[noreturn]] void refuse_broken(const fs::path& file) {
  throw LoadError(shown(file) + ": its packed voxels are broken; copy the file again");
}

bool is_packed(Packing packing) {
  return packing == Packing::deflated || packing == Packing::bzip2;
}

[[noreturn]] void refuse_surplus(const fs::path& file) {
  throw LoadError(shown(file) + ": holds more voxels than its header says; correct the sizes");
}

/// Offset of the first byte after the lines that a part skips; the end of a file of fewer lines.
std::uint64_t after_lines(const VoxelPart& part) {
  if (part.lines == 0) return part.begin;
  std::ifstream in(part.file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(part.begin));
  for (std::uint64_t line = 0; line < part.lines && in; ++line) {
    in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return in.good() ? static_cast<std::uint64_t>(in.tellg()) : fs::file_size(part.file);
}

/// The bytes of a part, unpacked if they are packed.
class PartBytes {
 public:
  PartBytes(const VoxelPart& part, Packing packing, std::uint64_t packed_bytes,
            std::uint64_t wanted)
      : file_(part.file), in_(part.file, std::ios::binary), left_(packed_bytes) {
    in_.seekg(static_cast<std::streamoff>(after_lines(part)));
    if (part.bytes < 0) {  // of raw voxels alone
      const auto behind = static_cast<std::uint64_t>(-(part.bytes + 1));
      in_.seekg(static_cast<std::streamoff>(fs::file_size(part.file) - behind - wanted));
    }
    constexpr int kGzipOrZlib = 15 + 32;  // largest window, either framing
    if (packing == Packing::deflated) {
      unpacks_ = inflateInit2(&stream_, kGzipOrZlib) == Z_OK;
      if (!unpacks_) throw std::bad_alloc();
    }
    if (packing == Packing::bzip2) open_bzip2();
  }
  ~PartBytes() {
    if (unpacks_) inflateEnd(&stream_);
  }
  PartBytes(const PartBytes&) = delete;
  PartBytes& operator=(const PartBytes&) = delete;

  /// Leaves out so many bytes, or all if there are fewer.
  void skip(std::uint64_t left) {
    std::array<std::byte, kPiece> skipped;
    std::size_t got = 1;
    for (; left > 0 && got > 0; left -= got) {
      got = read(std::span(skipped).first(std::min<std::uint64_t>(left, kPiece)));
    }
  }

  /// Fills `to`; returns the number of bytes, fewer at the end alone.
  std::size_t read(std::span<std::byte> to) {
    if (!bzip2_) return unpacks_ ? unpacked(to) : plain(to);
    const la_ssize_t got = archive_read_data(bzip2_.get(), to.data(), to.size());
    if (got < 0) refuse_broken(file_);
    ended_ = static_cast<std::size_t>(got) < to.size();
    return static_cast<std::size_t>(got);
  }
  /// Whether the packed bytes were read to their end, and their checksum is right.
  [[nodiscard]] bool ended() const noexcept { return ended_; }

 private:
  static constexpr std::size_t kPiece = std::size_t{1} << 16;

  std::size_t plain(std::span<std::byte> to) {
    in_.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
    return static_cast<std::size_t>(in_.gcount());
  }

  /// Whether there are packed bytes, after reading more if none are left.
  bool has_input() {
    if (stream_.avail_in > 0) return true;
    const std::size_t got = plain(std::span(packed_).first(std::min<std::uint64_t>(left_, kPiece)));
    left_ -= got;
    stream_.next_in = reinterpret_cast<const Bytef*>(packed_.data());
    stream_.avail_in = static_cast<uInt>(got);
    return got > 0;
  }

  std::size_t unpacked(std::span<std::byte> to) {
    constexpr std::size_t kMost = std::size_t{1} << 30;  // zlib counts in 32 bits
    std::size_t done = 0;
    while (done < to.size() && !ended_ && has_input()) {
      const std::size_t room = std::min(to.size() - done, kMost);
      stream_.next_out = reinterpret_cast<Bytef*>(to.data() + done);
      stream_.avail_out = static_cast<uInt>(room);
      const int state = inflate(&stream_, Z_NO_FLUSH);
      done += room - stream_.avail_out;
      constexpr std::byte kGzip{0x1f};  // another member of a gzip file follows
      if (state == Z_STREAM_END) {
        ended_ = !has_input() || std::byte{*stream_.next_in} != kGzip;
        if (!ended_) inflateReset(&stream_);
      } else if (state != Z_OK && state != Z_BUF_ERROR) {
        refuse_broken(file_);
      }
    }
    return done;
  }

  void open_bzip2() {
    const auto next_block = [](archive*, void* self, const void** block) {
      auto& bytes = *static_cast<PartBytes*>(self);
      *block = bytes.packed_.data();
      return static_cast<la_ssize_t>(bytes.plain(bytes.packed_));
    };
    bzip2_.reset(archive_read_new());
    archive* const bzip2 = bzip2_.get();
    archive_read_support_filter_bzip2(bzip2);
    archive_read_support_format_raw(bzip2);
    archive_entry* entry = nullptr;
    const bool opened =
        archive_read_open(bzip2, this, nullptr, next_block, nullptr) == ARCHIVE_OK &&
        archive_read_next_header(bzip2, &entry) == ARCHIVE_OK;
    if (!opened || archive_filter_code(bzip2, 0) != ARCHIVE_FILTER_BZIP2) refuse_broken(file_);
  }

  const fs::path& file_;
  std::ifstream in_;
  std::unique_ptr<archive, int (*)(archive*)> bzip2_{nullptr, archive_read_free};
  std::uint64_t left_;  ///< packed bytes that are not read
  z_stream stream_{};
  bool unpacks_ = false, ended_ = false;
  std::array<std::byte, kPiece> packed_;
};

/// The words of a part: numbers between blanks, a comma before or after each.
class PartWords {
 public:
  explicit PartWords(PartBytes& bytes) : bytes_(bytes) {}

  /// Empty at the end.
  std::string_view next() {
    word_.clear();
    for (;;) {
      if (at_ == held_) {
        held_ = bytes_.read(std::as_writable_bytes(std::span(piece_)));
        at_ = 0;
        if (held_ == 0) break;
      }
      const char c = piece_[at_++];
      const bool blank = c == ' ' || (c >= '\t' && c <= '\r');
      if (!blank) word_ += c;
      if (blank && !word().empty()) break;
      if (blank) word_.clear();
    }
    return word();
  }

 private:
  [[nodiscard]] std::string_view word() const {
    std::string_view text = word_;
    while (text.starts_with(',')) text.remove_prefix(1);
    while (text.ends_with(',')) text.remove_suffix(1);
    if (text.starts_with('+')) text.remove_prefix(1);
    return text;
  }

  PartBytes& bytes_;
  std::array<char, std::size_t{1} << 16> piece_;
  std::size_t at_ = 0, held_ = 0;
  std::string word_;
};

/// A number of a text; whole numbers may be written as `12.0`.
template <class T>
std::optional<T> value_of(std::string_view word) {
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc{} && end == word.data() + word.size()) return value;
  if constexpr (std::is_integral_v<T>) {
    const auto number = value_of<double>(word);
    constexpr double kBelow = -0x1p63, kAbove = 0x1p64;
    if (number && *number >= kBelow && *number < kAbove && std::floor(*number) == *number) {
      std::array<char, 32> digits;
      std::snprintf(digits.data(), digits.size(), "%.0f", *number);
      const std::string_view whole = digits.data();
      return whole == word ? std::nullopt : value_of<T>(whole);
    }
  }
  return std::nullopt;
}

void read_text(const VoxelPart& part, VoxelType type, PartBytes& bytes, std::span<std::byte> to) {
  PartWords words(bytes);
  visit_type(type, [&]<class T>(T) {
    for (std::size_t at = 0; at < to.size(); at += sizeof(T)) {
      const std::string_view word = words.next();
      if (word.empty()) refuse_truncated(shown(part.file), at, to.size());
      const std::optional<T> value = value_of<T>(word);
      if (!value) {
        throw LoadError(shown(part.file) + ": voxel " + std::to_string(at / sizeof(T)) + ": " +
                        one_line(word.substr(0, 40)) + " is no " +
                        std::string(kVoxelTypeWords[static_cast<std::size_t>(type)]) +
                        "; correct it, or the type in the header");
      }
      std::memcpy(to.data() + at, &*value, sizeof(T));
    }
  });
  if (!words.next().empty()) refuse_surplus(part.file);
}

void read_hex(const VoxelPart& part, PartBytes& bytes, std::span<std::byte> to) {
  PartWords words(bytes);
  std::string_view word;
  const auto digit = [&](std::size_t at) {
    if (word.empty()) word = words.next();
    if (word.empty()) refuse_truncated(shown(part.file), at, to.size());
    unsigned value = 0;
    if (std::from_chars(word.data(), word.data() + 1, value, 16).ec != std::errc{}) {
      throw LoadError(shown(part.file) + ": a character is no hex digit; copy the file again");
    }
    word.remove_prefix(1);
    return value;
  };
  for (std::size_t at = 0; at < to.size(); ++at) {
    const unsigned high = digit(at), low = digit(at);
    to[at] = static_cast<std::byte>(high << 4 | low);
  }
  if (!word.empty() || !words.next().empty()) refuse_surplus(part.file);
}

void read_part(const VoxelFiles& files, const VoxelPart& part, std::span<std::byte> to) {
  const bool packed = is_packed(files.packing);
  PartBytes bytes(part, files.packing, files.packed_bytes, to.size());
  bytes.skip(static_cast<std::uint64_t>(std::max<std::int64_t>(part.bytes, 0)));
  if (files.packing == Packing::text) return read_text(part, files.type, bytes, to);
  if (files.packing == Packing::hex) {
    read_hex(part, bytes, to);
  } else {
    const std::size_t got = bytes.read(to);
    if (got < to.size()) refuse_truncated(shown(part.file), got, to.size());
    std::byte more;
    if (packed && bytes.read({&more, 1}) > 0) refuse_surplus(part.file);
    if (packed && !bytes.ended()) {  // the checksum is not there
      throw LoadError(shown(part.file) + ": its packed voxels are cut off; copy the file again");
    }
  }
  const std::size_t each = bytes_of(files.type);
  if (!files.big_endian || each == 1) return;
  for (std::size_t at = 0; at < to.size(); at += each) std::ranges::reverse(to.subspan(at, each));
}

/// Refuses a part that is missing, too short for `wanted` bytes of voxels, or that holds as many
/// raw bytes again: another type, or sizes of fewer voxels. Returns the number of bytes that follow
/// raw voxels. Both only if no other part is in the file.
std::uint64_t check_part(const fs::path& header, const VoxelFiles& files, const VoxelPart& part,
                         std::uint64_t wanted, bool is_alone) {
  std::error_code error;
  const std::uint64_t size = fs::file_size(part.file, error);
  if (error) {
    throw LoadError(header.string() + ": data file " + one_line(part.file.filename().string()) +
                    " cannot be read (" + error.message() +
                    "); put it beside the header or correct the header");
  }
  const bool from_end = part.bytes < 0;
  const bool packed = is_packed(files.packing);
  const std::uint64_t skipped =
      from_end ? static_cast<std::uint64_t>(-(part.bytes + 1))
               : after_lines(part) + (packed ? 0 : static_cast<std::uint64_t>(part.bytes));
  const std::uint64_t held = std::min(size - std::min(size, skipped), files.packed_bytes);
  const std::uint64_t most = most_bytes(files.packing, held);
  if (most < wanted) refuse_truncated(shown(part.file), most, wanted);
  if (files.packing != Packing::raw || from_end || !is_alone) return 0;
  if (most / 2 >= wanted) {
    throw LoadError(shown(part.file) + ": holds " + std::to_string(most) +
                    " bytes of voxels, and its header says " + std::to_string(wanted) +
                    "; correct the sizes or the type");
  }
  return most - wanted;
}

}  // namespace

FileNames::FileNames(const std::string& text, std::size_t most) {
  constexpr std::int64_t kFar = std::int64_t{1} << 30;
  std::vector<std::string> words = words_of(text);
  while (words.size() > 1 && numbers.size() < most) {
    const auto number = whole_number(words.back());
    if (!number || *number < -kFar || *number > kFar) break;
    numbers.insert(numbers.begin(), *number);
    words.pop_back();
  }
  for (const std::string& word : words) pattern += (pattern.empty() ? "" : " ") + word;
}

std::string FileNames::name(std::int64_t number) const {
  std::string text;
  for (std::size_t at = 0; at < pattern.size();) {
    const std::size_t end = pattern.find_first_not_of("0123456789", at + 1);
    if (pattern[at] != '%' || end == std::string::npos || pattern[end] != 'd') {
      const bool escaped = pattern[at] == '%' && pattern.substr(at + 1, 1) == "%";
      text += pattern[at];
      at += escaped ? 2 : 1;
      continue;
    }
    constexpr std::size_t kWidest = 100;
    std::string digits = std::to_string(number);
    const std::string format = pattern.substr(at + 1, end - at - 1);
    const auto width = static_cast<std::size_t>(whole_number(format).value_or(0));
    const std::size_t missing =
        std::min(width, kWidest) - std::min({width, kWidest, digits.size()});
    text += std::string(missing, format.starts_with('0') ? '0' : ' ') + digits;
    at = end + 1;
  }
  return text;
}

void refuse_itself(const HeaderFields& fields, const char* key, const fs::path& file,
                   const char* remedy) {
  std::error_code error;
  if (fs::equivalent(file, fields.path(), error)) {
    fields.refuse(key, std::string("names the header itself; ") + remedy);
  }
}

std::vector<fs::path> files_of(const HeaderFields& fields, const char* key, const FileNames& names,
                               const std::vector<std::string>& list,
                               const std::vector<std::int64_t>& sizes) {
  const std::vector<std::int64_t>& numbers = names.numbers;
  auto count = static_cast<std::int64_t>(list.size());
  if (!names.is_list()) {
    if (numbers.size() < 3 || numbers[2] == 0) {
      fields.refuse(key, "needs the first number, the last and the step; correct the header");
    }
    const std::int64_t far = (numbers[1] - numbers[0]) * (numbers[2] < 0 ? -1 : 1);
    count = far < 0 ? 0 : far / std::abs(numbers[2]) + 1;
  }
  const std::size_t at = names.is_list() ? 0 : 3;
  const auto all = static_cast<std::int64_t>(sizes.size());
  const std::int64_t in_one = numbers.size() > at ? numbers[at] : all - 1;
  double expected = in_one < 1 || in_one > all ? 0 : 1;
  for (std::int64_t axis = std::max<std::int64_t>(in_one, 0); axis < all; ++axis) {
    expected *= static_cast<double>(sizes[static_cast<std::size_t>(axis)]);
  }
  const bool fits =
      expected > 0 && count > 0 &&
      (in_one == all ? sizes.back() % count == 0 : expected == static_cast<double>(count));
  if (!fits) {
    fields.refuse(key, "names " + std::to_string(count) + " files, and the sizes are those of " +
                           number_text(expected) + "; correct the header");
  }
  std::vector<fs::path> files;
  for (std::int64_t i = 0; i < count; ++i) {
    files.push_back(fields.path().parent_path() / (names.is_list()
                                                       ? list[static_cast<std::size_t>(i)]
                                                       : names.name(numbers[0] + i * numbers[2])));
  }
  return files;
}

void read_voxel_files(const fs::path& header, const VoxelFiles& files, UntrustedHeader claim,
                      const MemoryRequest& offer) {
  const std::size_t each = bytes_of(files.type);
  check_grid(header.string(), claim.size[0], claim.size[1], claim.size[2]);
  const auto wanted =
      static_cast<std::uint64_t>(claim.size[0] * claim.size[1] * claim.size[2]) * each;
  const std::uint64_t of_part = wanted / files.parts.size();
  std::map<fs::path, std::set<std::int64_t>> starts;  // several parts may lie in one file
  for (const VoxelPart& part : files.parts) {
    if (starts[part.file].insert(part.bytes).second) continue;
    throw LoadError(header.string() + ": names the same voxels of " +
                    one_line(part.file.filename().string()) + " twice; correct the list");
  }
  std::uint64_t behind = 0;
  for (const VoxelPart& part : files.parts) {
    const bool is_alone = starts[part.file].size() == 1;
    behind += check_part(header, files, part, of_part, is_alone);
  }
  if (behind > 0) {
    add_note(claim, std::to_string(behind) + " bytes after the voxels are not read");
  }
  claim.voxel_bytes = static_cast<std::uint32_t>(each);
  claim.kind = kind_of(files.type, files.scaling);
  const std::span<std::byte> memory = offer(claim);
  // The file's own voxels fill the end of the memory, their values then its begin.
  std::span<std::byte> own = memory.last(wanted);
  for (const VoxelPart& part : files.parts) {
    read_part(files, part, own.first(of_part));
    own = own.subspan(of_part);
  }
  convert_values(files.type, memory.last(wanted), claim.kind, memory, files.scaling);
}

}  // namespace kerf::volume
