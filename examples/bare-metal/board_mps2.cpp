// SPDX-License-Identifier: Apache-2.0
// QEMU's mps2-an500: semihosting for text and the exit code, the core's SysTick as the counter.
#include <cstdint>

#include "examples/bare-metal/board.hpp"

namespace kerf::bare {
namespace {

/// A call of the host (Arm, "Semihosting for AArch32 and AArch64", 2.0): operation in r0,
/// parameter in r1, answer in r0.
std::uint32_t call_host(std::uint32_t operation, const void* parameter) noexcept {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = parameter;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

struct SysTick {
  std::uint32_t control, reload, value;
};
volatile SysTick& systick = *reinterpret_cast<volatile SysTick*>(0xe000e010);

}  // namespace

void write(const char* text) noexcept {
  constexpr std::uint32_t kWrite0 = 0x04;
  call_host(kWrite0, text);
}

void finish(int code) noexcept {
  constexpr std::uint32_t kExitExtended = 0x20, kApplicationExit = 0x20026;
  const std::uint32_t parameter[2] = {kApplicationExit, static_cast<std::uint32_t>(code)};
  call_host(kExitExtended, parameter);
  for (;;) {
  }
}

void start_count() noexcept {
  constexpr std::uint32_t kCoreClock = 4, kEnable = 1;
  systick.reload = 0xffffff;
  systick.value = 0;
  systick.control = kCoreClock | kEnable;
}

std::uint32_t count() noexcept {
  return systick.value;
}

}  // namespace kerf::bare
