// SPDX-License-Identifier: Apache-2.0
// From reset to `run`, for a Cortex-M7: vectors, floating-point unit, memory, protection of flash,
// and what happens at a fault: one line, exit code 3.
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "examples/bare-metal/board.hpp"
#include "examples/bare-metal/image.hpp"

namespace kerf::bare {
namespace {

volatile std::uint32_t& reg(std::uintptr_t address) noexcept {
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}

/// Full access to the floating-point unit, which reset leaves off. Its control register is that of
/// IEEE 754 after reset: round to nearest, subnormal numbers kept, NaN passed on; written all the
/// same, because the bits of a tick depend on it.
void switch_on_floating_point() noexcept {
  reg(0xe000ed88) = reg(0xe000ed88) | 0xfU << 20;  // CPACR: CP10, CP11
  asm volatile("dsb\n isb\n vmsr fpscr, %0" ::"r"(0) : "memory");
  reg(0xe000ef3c) = 0;  // FPDSCR: the same for new contexts
}

/// Of the memory protection unit (Armv7-M B3.5): flash is read-only, and RAM has no code. A write
/// through a pointer to a constant is a fault then.
void protect() noexcept {
  const auto region = [](std::uint32_t number, std::uint32_t base, std::uint32_t log2_bytes,
                         std::uint32_t rights) {
    reg(0xe000ed9c) = base | 1U << 4 | number;              // RBAR
    reg(0xe000eda0) = rights | (log2_bytes - 1) << 1 | 1U;  // RASR
  };
  constexpr std::uint32_t kReadOnly = 6U << 24, kReadWrite = 3U << 24, kNeverCode = 1U << 28;
  constexpr std::uint32_t kNormalMemory = 1U << 19;  // TEX 1, not cached
  region(0, 0x00000000, 22, kReadOnly | kNormalMemory);
  region(1, 0x20000000, 22, kReadWrite | kNeverCode | kNormalMemory);
  region(2, 0x60000000, 24, kReadWrite | kNeverCode | kNormalMemory);
  reg(0xe000ed94) = 5;  // MPU_CTRL: on; the rest of the map as ever
  asm volatile("dsb\n isb" ::: "memory");
}

void fill_memory() noexcept {
  std::memcpy(kerf_data_begin, kerf_data_load, size(kerf_data_bytes));
  std::memset(kerf_bss_begin, 0, size(kerf_bss_bytes));
  std::memset(kerf_scratch_begin, 0, size(kerf_scratch_bytes));
  for (const Copy* copy = kerf_copies; copy != kerf_copies_end; ++copy) {
    std::memcpy(copy->to, copy->from, copy->bytes);
  }
}

/// From the low end up to this function's own frame.
void paint_stack() noexcept {
  const auto* here = static_cast<const std::uint32_t*>(__builtin_frame_address(0)) - 32;
  for (volatile std::uint32_t* at = kerf_stack_low; at < here; at = at + 1) *at = kStackPaint;
}

/// What can go wrong in a loop that has no bug of its own: a stack that is too small, a write to
/// flash, an instruction that the core lacks.
[[noreturn, gnu::used]] void report_fault(std::uint32_t stack) noexcept {
  const std::uint32_t status = reg(0xe000ed28);  // CFSR
  const std::uint32_t address =
      reg((status & 1U << 7) != 0 ? 0xe000ed34 : 0xe000ed38);  // MMFAR, BFAR
  constexpr std::uint32_t kStacking = 1U << 12 | 1U << 4, kBusAddressValid = 1U << 15;
  const auto low = reinterpret_cast<std::uintptr_t>(kerf_stack_low);
  const bool below = (status & kBusAddressValid) != 0 && address < low && address + 0x10000 > low;
  Text text;
  if (stack < low || below || (status & kStacking) != 0) {
    text.add("bare-metal: the stack of ").add(size(kerf_stack_bytes));
    text.add(" bytes overflowed; give it more: --defsym=kerf_stack=BYTES\n");
  } else {
    text.add("bare-metal: fault ").add_hex(status).add(" at address ").add_hex(address);
    text.add("; CFSR and MMFAR or BFAR of the Armv7-M manual, B3.2\n");
  }
  write(text.text());
  finish(3);
}

/// The stack may be what failed: the report has it anew.
[[gnu::naked]] void fault() noexcept {
  asm volatile(
      "mov r0, sp\n"
      "ldr r1, =kerf_stack_high\n"
      "mov sp, r1\n"
      "b %c0\n" ::"i"(report_fault));
}

}  // namespace

extern "C" [[noreturn]] void kerf_start() noexcept {
  switch_on_floating_point();
  fill_memory();
  protect();
  paint_stack();
  finish(run());
}

namespace {

/// Armv7-M B1.5.3. No interrupt is on; what arrives all the same is a fault.
struct Vectors {
  const void* stack;
  void (*handler[15])() noexcept;
};
[[gnu::section(".vectors"), gnu::used]] const Vectors vectors{
    kerf_stack_high,
    {kerf_start, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault,
     fault, fault}};

}  // namespace
}  // namespace kerf::bare
