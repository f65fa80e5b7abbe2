// SPDX-License-Identifier: Apache-2.0
// One golden scene on a bare processor: every tick of its script, then what it ends in and what it
// took. KERF_SCENE is its name, KERF_NUMBERS the bundle of numbers.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/servo_step.hpp"
#include "examples/bare-metal/board.hpp"
#include "examples/bare-metal/image.hpp"
#include "examples/bare-metal/laws.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/golden/golden_hash.hpp"
#include "tests/golden/golden_script.hpp"

namespace kerf::bare {
namespace {

using N = KERF_NUMBERS;
constexpr auto kScene = test::GoldenScene::KERF_SCENE;

extern "C" {
extern const ServoPlan<N> kerf_plan;
extern ServoState<N> kerf_state;
}

/// The plan was made by another compiler: whether both lay out its structs alike.
bool is_of_this_layout() noexcept {
  return kerf_layout[0] == sizeof kerf_plan && kerf_layout[1] == sizeof kerf_state &&
         kerf_layout[2] == offsetof(ServoPlan<N>, rate_hz) &&
         kerf_layout[3] == offsetof(ServoState<N>, output_hash);
}

constexpr std::uint32_t kCountMask = 0xffffff;

/// Counts of the board's counter per `kLoops` rounds of two instructions: with QEMU's -icount every
/// instruction takes the same time, so this is the counter's rate.
constexpr std::uint32_t kLoops = 1'000'000;
std::uint32_t counts_of_loops() noexcept {
  const std::uint32_t begin = count();
  std::uint32_t left = kLoops;
  asm volatile("1: subs %0, %0, #1\n bne 1b" : "+r"(left)::"cc");
  return (begin - count()) & kCountMask;
}

/// Instructions of the ticks, in counts.
struct Work {
  std::uint64_t sum = 0;
  std::uint32_t most = 0;

  void add(std::uint32_t counts) noexcept {
    sum += counts;
    most = std::max(most, counts);
  }
};

struct End {
  std::uint64_t hash = 0, volume_hash = kFnv1aBasis;
  Work work;
};

/// Kept out of `run`, whose frame is not part of what a loop needs.
[[gnu::noinline]] End step_all() noexcept {
  const Arm<N> arm{&kerf_plan, &kerf_state};
  const Arms<N> arms(&arm, 1);
  const auto tools = static_cast<std::uint32_t>(kerf_plan.tool_count);
  test::GoldenHash hash(kScene);
  End end;
  for (std::int32_t tick = 0; tick < test::golden_ticks(kScene); ++tick) {
    apply_command<N>(arms, test::scripted_command(tick, tools));
    const DeviceReport report = test::scripted_report(tick);
    ServoOutput out;
    const std::uint32_t begin = count();
    servo_step<N>(arms, std::span(&report, 1), std::span(&out, 1));
    end.work.add((begin - count()) & kCountMask);
    hash.add(out);
    if (tick % test::kPenetrationTicks == 0) hash.add(penetration_mm(kerf_plan, kerf_state));
  }
  end.hash = hash.value();
  for (std::size_t v = 0; v < kerf_plan.volume_count; ++v) {
    end.volume_hash = fnv1a_bytes(end.volume_hash, density_hash(kerf_state.volumes[v].density));
  }
  return end;
}

/// Bytes of the stack that were ever written.
std::size_t stack_bytes_used() noexcept {
  const std::uint32_t* at = kerf_stack_low;
  while (at < kerf_stack_high && *at == kStackPaint) ++at;
  return static_cast<std::size_t>(kerf_stack_high - at) * sizeof(std::uint32_t);
}

}  // namespace

int run() noexcept {
  if (!is_of_this_layout()) {
    write("bare-metal: the plan is of another layout; make it again by write_plan\n");
    return 2;
  }
  start_count();
  const std::uint64_t loops = std::max(counts_of_loops(), std::uint32_t{1});
  const End end = step_all();
  Text line;
  line.add("golden ").add(test::name_of(kScene)).add(N::kIsFixed ? " fixed" : " double");
  line.add(" scalar ").add_hex(end.hash).add(" ").add_hex(end.volume_hash).add("\n");
  write(line.text());
  Text sizes;
  sizes.add("bytes: code ").add(size(kerf_text_bytes)).add(", tables ");
  sizes.add(size(kerf_tables_bytes)).add(", state ").add(size(kerf_data_bytes));
  sizes.add(", volumes ").add(size(kerf_volume_bytes)).add(", scratch ");
  sizes.add(size(kerf_scratch_bytes) + size(kerf_bss_bytes)).add("\n");
  write(sizes.text());
  Text stack;
  stack.add("stack: ").add(stack_bytes_used()).add(" of ").add(size(kerf_stack_bytes));
  stack.add(" bytes\n");
  write(stack.text());
  const auto instructions = [&](std::uint64_t counts) { return counts * 2 * kLoops / loops; };
  Text work;
  work.add("instructions of a tick: mean ");
  work.add(instructions(end.work.sum) / static_cast<std::uint64_t>(test::golden_ticks(kScene)));
  work.add(", most ").add(instructions(end.work.most)).add("\n");
  write(work.text());

  const test::GoldenEnd known = test::golden_end(kScene, N::kIsFixed);
  if (end.hash == known.hash && end.volume_hash == known.volume_hash) return 0;
  Text wrong;
  wrong.add("bare-metal: other bits than tests/golden, which has ").add_hex(known.hash).add(" ");
  wrong.add_hex(known.volume_hash).add("; docs/determinism.md\n");
  write(wrong.text());
  return 1;
}

}  // namespace kerf::bare

// The steps of the laws by the names that the plan has for them.
#define KERF_DEFINE(symbol, Law, Input)                                                            \
  extern "C" kerf::Input<kerf::bare::N>::Output symbol(                                            \
      const kerf::LawPlan<kerf::Input<kerf::bare::N>>& plan, kerf::LawMemory& memory,              \
      const kerf::Input<kerf::bare::N>& in) noexcept {                                             \
    return kerf::law_step<kerf::Law<kerf::bare::N>, kerf::Input<kerf::bare::N>>(plan, memory, in); \
  }
KERF_BARE_LAWS(KERF_DEFINE)
