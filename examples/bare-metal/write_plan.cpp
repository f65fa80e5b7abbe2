// SPDX-License-Identifier: Apache-2.0
// A compiled scene as assembler text for an image without an operating system: constants for flash,
// the state of the servo for RAM. Runs on a 32-bit ARM with Linux, or under qemu-arm: its structs
// have the same layout there.
//     write_plan SCENE.toml >plan.s
//     write_plan mill|feel|sweep fixed|double >plan.s     the scenes of tests/golden
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "examples/bare-metal/arena.hpp"
#include "examples/bare-metal/laws.hpp"
#include "examples/bare-metal/memory_image.hpp"
#include "tests/golden/golden_run.hpp"

namespace kerf::bare {
namespace {

using test::GoldenScene;

/// The symbol of a law's step; ends the program for a law without one.
template <class In>
std::string symbol_of(const LawPlan<In>& plan) {
  using Step = typename LawPlan<In>::Step;
  const auto one = [&]<class Law>(const char* symbol, const char*& found) {
    if constexpr (LawOf<Law, In>) {
      const Step step = &law_step<Law, In>;
      if (plan.step == step) found = symbol;
    }
  };
  const char* found = nullptr;
#define KERF_COMPARE(symbol, Law, Input)                      \
  one.template operator()<Law<FixedNumbers>>(#symbol, found); \
  one.template operator()<Law<DoubleNumbers>>(#symbol, found);
  KERF_BARE_LAWS(KERF_COMPARE)
#undef KERF_COMPARE
  if (found == nullptr) {
    std::fputs("write_plan: the scene has a law that laws.hpp does not list; add it there\n",
               stderr);
    std::exit(2);
  }
  return found;
}

template <class N>
void name_words(const ServoPlan<N>& plan, MemoryImage& image) {
  image.name_word(&plan.kernels, "_ZN4kerf10kScalarSetE");
  image.name_word(&plan.taps, "kerf_taps");
  image.add_constant(plan.taps, sizeof *plan.taps, "kerf_taps");
  const auto law = [&](const auto& of) {
    if (of.given()) image.name_word(&of.step, symbol_of(of));
  };
  law(plan.velocity);
  law(plan.force_law);
  law(plan.stabiliser);
}

template <class N>
void add_volumes(const ServoPlan<N>& plan, const ServoState<N>& state, MemoryImage& image) {
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const VolumeState<N>& volume = state.volumes[v];
    image.make_volume(volume.density.data(), false);
    if (!volume.gradient.empty()) image.make_volume(volume.gradient.data(), false);
    if (!volume.first.empty()) image.make_first(volume.first.data(), volume.density.data());
    const FreeSpaceMap& map = state.contact.volumes[v].field.free;
    if (map.distance != nullptr) image.make_volume(map.distance, true);
    const auto& labels = plan.force_cut.volume[v].labels;
    if (!labels.empty()) image.make_volume(labels.data(), true);
  }
}

template <class N>
void write(const Arm<N>& arm, const Arena& first, const Arena& second) {
  const ServoPlan<N>& plan = *arm.plan;
  const ServoState<N>& state = *arm.state;
  MemoryImage image(first, second);
  image.add_root(&plan, sizeof plan, alignof(ServoPlan<N>), "kerf_plan");
  image.add_root(&state, sizeof state, alignof(ServoState<N>), "kerf_state");
  image.add_root(state.history, sizeof *state.history, alignof(VolumeHistory));
  name_words(plan, image);
  add_volumes(plan, state, image);
  image.reach(&plan, true);
  image.reach(&state, false);
  image.write(stdout);
  // What the image compares with its own layout before the first tick.
  std::printf("\t.section .kerf_tables\n\t.balign 4\n\t.global kerf_layout\nkerf_layout:\n");
  for (const std::size_t bytes : {sizeof plan, sizeof state, offsetof(ServoPlan<N>, rate_hz),
                                  offsetof(ServoState<N>, output_hash)}) {
    std::printf("\t.word %zu\n", bytes);
  }
}

/// What the command line names.
struct Wanted {
  const char* file = nullptr;  ///< of a scene; null: a golden one
  GoldenScene golden = GoldenScene::mill;
  NumericKind numeric = NumericKind::fixed;

  [[nodiscard]] LoadedScene scene() const {
    return file != nullptr ? load_scene(file) : test::golden_scene(golden, numeric);
  }
};

std::optional<Wanted> wanted(int argc, char** argv) {
  if (argc == 2) return Wanted{argv[1], GoldenScene::mill, NumericKind::fixed};
  if (argc != 3) return std::nullopt;
  const bool in_double = std::strcmp(argv[2], "double") == 0;
  if (!in_double && std::strcmp(argv[2], "fixed") != 0) return std::nullopt;
  for (const GoldenScene one : {GoldenScene::mill, GoldenScene::feel, GoldenScene::sweep}) {
    if (std::strcmp(test::name_of(one), argv[1]) != 0) continue;
    return Wanted{nullptr, one, in_double ? NumericKind::float64 : NumericKind::fixed};
  }
  return std::nullopt;
}

std::unique_ptr<CompiledScene> compiled_in(Arena* arena, const Wanted& what) {
  Arena::use(arena);
  LoadedScene scene = what.scene();
  auto servo = compile(scene, kScalarSet);
  Arena::use(nullptr);
  return servo;
}

int write_plan(int argc, char** argv) {
  const std::optional<Wanted> what = wanted(argc, argv);
  if (!what) {
    std::fputs(
        "write_plan: no scene; give SCENE.toml, or as mill fixed: mill, feel or sweep, fixed or "
        "double\n",
        stderr);
    return 2;
  }
  const auto warm = compiled_in(nullptr, *what);  // what is made once, is made now
  static Arena first, second;
  const auto servo = compiled_in(&first, *what);
  const auto again = compiled_in(&second, *what);
  if (servo->arms() != 1) {
    std::fputs("write_plan: the scene has two arms; an image steps one, leave one [[device]] out\n",
               stderr);
    return 2;
  }
  std::visit([&](const auto& arms) { write(arms[0], first, second); }, servo->parts());
  return 0;
}

}  // namespace
}  // namespace kerf::bare

int main(int argc, char** argv) {
  try {
    return kerf::bare::write_plan(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "write_plan: %s\n", error.what());
    return 2;
  }
}
