// SPDX-License-Identifier: Apache-2.0
#include "controller/run/law_trial.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <memory>
#include <new>
#include <random>
#include <stdexcept>
#include <string>
#include <system_error>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/law/law.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/loop/allocation_counter.hpp"
#include "controller/plan/plan_device.hpp"
#include "controller/scene/scene.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// The last input of a law, as numbers: written before the step, read by the parent process.
struct LastInput {
  std::array<double, 16> number{};
};

/// Random inputs: a third of each number is at an end of its range, 0, or one step of fixed point.
class LawInputs {
 public:
  template <class N>
  void next(ForceInput<N>& in, LastInput& last) {
    spring(in.spring_mm, last);
    vec(in.velocity_mm_per_s, kEnd, last, 3);
    vec(in.tip_mm, 1000, last, 6);
    in.scene_tip_mm = relabel<WorldSpace>(in.tip_mm);
    const double length = static_cast<double>(norm(in.spring_mm));
    for (auto of : {&DeviceVec<typename N::Unit>::x, &DeviceVec<typename N::Unit>::y,
                    &DeviceVec<typename N::Unit>::z}) {
      in.normal.*of = typename N::Unit(0);
    }
    if (length > 0) in.normal.y = typename N::Unit(1);
  }
  template <class N>
  void next(VelocityInput<N>& in, LastInput& last) {
    vec(in.tip_mm, kEnd, last, 0);
    constexpr std::array<std::uint32_t, 4> kTicks{1, 1, 2, 1000};
    in.ticks = kTicks[bits_() % kTicks.size()];
    last.number[3] = in.ticks;
  }
  template <class N>
  void next(StabiliserInput<N>& in, LastInput& last) {
    vec(in.wanted_n, 10, last, 0);
    vec(in.sent_n, 10, last, 3);
    vec(in.moved_mm, 100, last, 6);
    vec(in.velocity_mm_per_s, kEnd, last, 9);
    in.ticks = 1 + static_cast<std::uint32_t>(bits_() % 3);
    const double taken_mj = number(1000);
    if constexpr (N::kIsFixed) {
      in.taken_mj = static_cast<std::int64_t>(taken_mj * 4294967296.0);
    } else {
      in.taken_mj = static_cast<typename N::Energy>(taken_mj);
    }
    in.contact = bits_() % 2 == 0;
    last.number[12] = in.ticks;
    last.number[13] = taken_mj;
  }

  /// Text of an input to a law of this kind.
  [[nodiscard]] static std::string text(LawKind kind, const LastInput& last) {
    const auto& n = last.number;
    const auto vec = [&](const char* name, std::size_t at) {
      return format("%s [%g, %g, %g]", name, n[at], n[at + 1], n[at + 2]);
    };
    switch (kind) {
      case LawKind::force:
        return vec("spring_mm", 0) + ", " + vec("velocity_mm_per_s", 3) + ", " + vec("tip_mm", 6);
      case LawKind::velocity:
        return vec("tip_mm", 0) + format(", ticks %g", n[3]);
      case LawKind::stabiliser:
        break;
    }
    return vec("wanted_n", 0) + ", " + vec("sent_n", 3) + ", " + vec("moved_mm", 6) + ", " +
           vec("velocity_mm_per_s", 9) + format(", ticks %g, taken_mj %g", n[12], n[13]);
  }

 private:
  static constexpr double kEnd = 32767;  ///< of the loop's numbers

  double number(double end) {
    const std::array<double, 5> special{0, 1.0 / 65536, -1.0 / 65536, end, -end};
    const std::uint64_t draw = bits_();
    if (draw % 3 == 0) return special[draw / 3 % special.size()];
    return end * (2 * (static_cast<double>(draw >> 11) / 9007199254740992.0) - 1);
  }
  template <class V>
  void vec(V& v, double end, LastInput& last, std::size_t at) {
    using Real = decltype(v.x);
    for (auto of : {&V::x, &V::y, &V::z}) {
      last.number[at] = number(end);
      v.*of = Real(last.number[at++]);
    }
  }
  /// Most springs have the length of a usual press.
  template <class V>
  void spring(V& v, LastInput& last) {
    constexpr std::array<double, 4> kLength{0.1, 1, 10, kEnd};
    vec(v, kLength[bits_() % kLength.size()], last, 0);
  }

  std::mt19937_64 bits_{18};
};

constexpr rlim_t kMostSeconds = 2;

/// The trial of a law: each of these settings, so many steps each.
struct LawJob {
  std::vector<LawChoice> choices;
  int steps;
  LawLoop loop;
};

/// Results of the child, in shared memory.
struct LawProgress {
  std::size_t settings = 0;  ///< at work on this set
  LastInput last;
  std::uint64_t steps = 0;
  double seconds = 0;
  LawFlaw flaw = LawFlaw::none;
  bool done = false;
};

/// The tried sets of settings.
std::vector<LawChoice> choices_of(const LawRow& row) {
  const std::string name(row.name);
  std::vector<LawChoice> choices{{row.kind, name, {}}};
  LawChoice low{row.kind, name, {}}, high = low;
  for (const LawSetting& setting : row.settings) {
    const std::string key(setting.name);
    choices.push_back({row.kind, name, {{key, setting.lo}}});
    choices.push_back({row.kind, name, {{key, setting.hi}}});
    low.settings.emplace_back(key, setting.lo);
    high.settings.emplace_back(key, setting.hi);
  }
  choices.push_back(low);
  choices.push_back(high);
  return choices;
}

template <class In>
LawFlaw run_steps(const LawPlan<In>& plan, int steps, LawProgress& progress) {
  LawInputs inputs;
  const auto memory = std::make_unique<LawMemory>();
  In in;
  const CountedAllocations counted;
  const std::uint64_t allocations = CountedAllocations::total();
  for (int step = 0; step < steps; ++step) {
    inputs.next(in, progress.last);
    if constexpr (requires { in.first; }) in.first = !memory->begun;
    const auto out = plan(*memory, in);
    ++progress.steps;
    if (!all_finite(out)) return LawFlaw::no_number;
    if constexpr (requires { out.spring_n; }) {
      if (!all_finite(out.spring_n)) return LawFlaw::no_number;
    }
    if (CountedAllocations::total() != allocations) return LawFlaw::allocates;
  }
  return LawFlaw::none;
}

template <template <class> class In, class N>
void try_all(const LawJob& job, LawProgress& progress) {
  const std::clock_t began = std::clock();
  for (const LawChoice& choice : job.choices) {
    try {
      progress.flaw = run_steps(plan_law<In, N>(choice, job.loop), job.steps, progress);
    } catch (const LawError&) {  // not for its name or settings, which are valid
      progress.flaw = LawFlaw::unlisted;
    }
    if (progress.flaw != LawFlaw::none) break;
    ++progress.settings;
  }
  progress.seconds = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  progress.done = true;
}

template <class N>
void try_kind(const LawJob& job, LawProgress& progress) {
  switch (job.choices.front().kind) {
    case LawKind::force:
      return try_all<ForceInput, N>(job, progress);
    case LawKind::velocity:
      return try_all<VelocityInput, N>(job, progress);
    case LawKind::stabiliser:
      return try_all<StabiliserInput, N>(job, progress);
  }
}

std::string settings_of(const LawChoice& choice) {
  if (choice.settings.empty()) return "its defaults";
  std::string text;
  for (const auto& [name, value] : choice.settings) {
    text += (text.empty() ? "" : ", ") + format("%s = %g", name.c_str(), value);
  }
  return text;
}

LawFlaw flaw_of(const LawProgress& progress, int status) {
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
    return LawFlaw::endless;
  }
  return progress.done ? progress.flaw : LawFlaw::ends_program;
}

std::string fault_of(const LawJob& job, const LawProgress& progress, LawFlaw flaw, int status) {
  std::string what, way_out;
  switch (flaw) {
    case LawFlaw::none:
      return "";
    case LawFlaw::unlisted:
      return "reads a setting that its kSettings do not list; add it there";
    case LawFlaw::no_number:
      what = "gave something that is no finite number";
      way_out = "look for a division by 0 and for sums that overflow";
      break;
    case LawFlaw::allocates:
      what = "allocates";
      way_out = "keep all memory in its State";
      break;
    case LawFlaw::endless:
      what = format("did not end its steps in %d s", static_cast<int>(kMostSeconds));
      way_out = "give every loop a bound that does not depend on the input";
      break;
    case LawFlaw::ends_program: {
      if (!WIFSIGNALED(status)) {
        what = format("ended the program with exit code %d", WEXITSTATUS(status));
        way_out = "a step ends nothing but itself";
        break;
      }
      const int signal = WTERMSIG(status);
      what = format("ended the program by signal %d", signal);
      way_out = signal == SIGABRT ? "a step throws nothing" : "look at the memory that it writes";
      break;
    }
  }
  const LawChoice& choice = job.choices[std::min(progress.settings, job.choices.size() - 1)];
  return what + " with " + settings_of(choice) + " at " +
         LawInputs::text(choice.kind, progress.last) + "; " + way_out;
}

template <class N>
LawTrial try_in(const LawJob& job) {
  void* page =
      mmap(nullptr, sizeof(LawProgress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "mmap");
  auto& progress = *::new (page) LawProgress;
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    const rlimit cpu{kMostSeconds, kMostSeconds + 1}, no_core{0, 0};
    setrlimit(RLIMIT_CPU, &cpu);
    setrlimit(RLIMIT_CORE, &no_core);
    for (const int number : {SIGXCPU, SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS}) {
      std::signal(number, SIG_DFL);  // NOLINT(cert-err33-c): these can be set
    }
    try_kind<N>(job, progress);
    _exit(0);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  LawTrial trial{N::kName, progress.steps, 0, flaw_of(progress, status), ""};
  trial.fault = fault_of(job, progress, trial.flaw, status);
  if (progress.steps > 0) {
    trial.step_ns = progress.seconds * 1e9 / static_cast<double>(progress.steps);
  }
  munmap(page, sizeof(LawProgress));
  return trial;
}

bool is_own(const LawChoice& choice) {
  if (choice.name.empty()) return false;
  const LawRow& row = find_law(choice.kind, choice.name);
  for (const LawRow* own = first_own_law; own != nullptr; own = own->next) {
    if (own == &row) return true;
  }
  return false;
}

}  // namespace

std::vector<LawTrial> try_law(const LawRow& row) {
  // A loop that is easy to hold: it does not decide about the law.
  const LawJob job{choices_of(row), 20'000, {1000, 0.05}};
  return {try_in<FixedNumbers>(job), try_in<DoubleNumbers>(job)};
}

std::vector<std::string> try_own_laws(const LoadedScene& scene) {
  std::vector<std::string> lines;
  for (const LawChoice* choice :
       {&scene.force.law, &scene.servo.velocity, &scene.force.stabiliser}) {
    if (!is_own(*choice)) continue;
    const LawJob job{
        {*choice},
        2'000,
        {double(scene.servo.rate_hz), device_parts::tip_noise_mm(scene.device.personality)}};
    const LawTrial trial = scene.servo.numeric == NumericKind::fixed ? try_in<FixedNumbers>(job)
                                                                     : try_in<DoubleNumbers>(job);
    if (trial.flaw == LawFlaw::none || trial.flaw == LawFlaw::unlisted) continue;
    const std::string line = scene.path + ": " + std::string(kind_name(choice->kind)) + " " +
                             choice->name + " " + trial.fault;
    if (trial.flaw == LawFlaw::endless || trial.flaw == LawFlaw::ends_program) {
      throw std::runtime_error(line);
    }
    lines.push_back(line);
  }
  return lines;
}

}  // namespace kerf
