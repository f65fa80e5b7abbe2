// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

// What the parts of the image share: symbols of the linker script and of the plan, lines of text,
// the stack's paint.

namespace kerf::bare {

/// A volume and its first content.
struct Copy {
  void* to;
  const void* from;
  std::size_t bytes;
};

extern "C" {
// Of the linker script. Those that end in _bytes are sizes, whatever their type: `size`.
extern std::uint32_t kerf_stack_low[], kerf_stack_high[];
extern std::byte kerf_data_begin[], kerf_bss_begin[], kerf_scratch_begin[];
extern const std::byte kerf_data_load[];
extern const char kerf_stack_bytes[], kerf_text_bytes[], kerf_tables_bytes[], kerf_first_bytes[],
    kerf_data_bytes[], kerf_bss_bytes[], kerf_volume_bytes[], kerf_scratch_bytes[];
// Of the plan (write_plan.cpp).
extern const Copy kerf_copies[], kerf_copies_end[];
extern const std::size_t kerf_layout[4];
}

[[nodiscard]] inline std::size_t size(const char* symbol) noexcept {
  return reinterpret_cast<std::size_t>(symbol);
}

/// The scene, from its first tick to its last. Returns the exit code: 0, or 1 if its bits are not
/// the known ones, 2 for a plan of another layout.
int run() noexcept;

inline constexpr std::uint32_t kStackPaint = 0xc5c5c5c5;

/// One line of text. What does not fit is left out.
class Text {
 public:
  Text& add(const char* text) noexcept {
    for (; *text != 0; ++text) add_char(*text);
    return *this;
  }
  Text& add(std::uint64_t number) noexcept {
    std::array<char, 20> digits{};
    std::size_t count = 0;
    do {
      digits[count++] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number != 0);
    while (count > 0) add_char(digits[--count]);
    return *this;
  }
  /// 16 digits, or 8 of a number of 32 bits.
  Text& add_hex(std::uint64_t number, int digits = 16) noexcept {
    while (digits-- > 0) add_char("0123456789abcdef"[number >> (4 * digits) & 15]);
    return *this;
  }
  Text& add_hex(std::uint32_t number) noexcept { return add_hex(number, 8); }
  Text& add(std::uint32_t number) noexcept { return add(std::uint64_t{number}); }
  Text& add(std::size_t number) noexcept { return add(std::uint64_t{number}); }

  [[nodiscard]] const char* text() const noexcept { return text_.data(); }

 private:
  void add_char(char c) noexcept {
    if (length_ + 1 < text_.size()) text_[length_++] = c;
  }

  std::array<char, 200> text_{};
  std::size_t length_ = 0;
};

}  // namespace kerf::bare
