// SPDX-License-Identifier: Apache-2.0
#include "lab/law/trial.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <ctime>
#include <memory>
#include <new>
#include <system_error>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/law/registry/law_registry.hpp"
#include "controller/shell/allocation_counter.hpp"
#include "lab/law/inputs.hpp"
#include "shared/text/format.hpp"

namespace kerf::laws {
namespace {

constexpr int kSteps = 20'000;
constexpr rlim_t kMostSeconds = 2;

enum class Fault : int { none, no_number, allocates };

/// What the child tells, in memory that both see.
struct Progress {
  std::size_t settings = 0;  ///< at work on this set
  Told told;
  std::uint64_t steps = 0;
  double seconds = 0;
  Fault fault = Fault::none;
  bool done = false;
};

/// The sets of settings that are tried.
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

template <class In, class Real>
Fault run_steps(const LawPlan<In, Real>& plan, Progress& progress) {
  Inputs inputs;
  const auto memory = std::make_unique<LawMemory>();
  In in;
  const CountedAllocations counted;
  const std::uint64_t allocations = CountedAllocations::total();
  for (int step = 0; step < kSteps; ++step) {
    inputs.next(in, progress.told);
    if constexpr (requires { in.first; }) in.first = !memory->begun;
    const auto out = plan(*memory, in);
    ++progress.steps;
    if (!is_finite(out.x) || !is_finite(out.y) || !is_finite(out.z)) return Fault::no_number;
    if (CountedAllocations::total() != allocations) return Fault::allocates;
  }
  return Fault::none;
}

template <template <class> class In, class N>
void try_all(const LawRow& row, Progress& progress) {
  const std::vector<LawChoice> choices = choices_of(row);
  const std::clock_t began = std::clock();
  for (; progress.settings < choices.size() && progress.fault == Fault::none; ++progress.settings) {
    // A spacious loop: nothing of it decides whether a law holds.
    const auto plan = plan_law<In, N>(choices[progress.settings], {1000, 0.05});
    progress.fault = run_steps(plan, progress);
    if (progress.fault != Fault::none) break;
  }
  progress.seconds = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  progress.done = true;
}

template <class N>
void try_kind(const LawRow& row, Progress& progress) {
  switch (row.kind) {
    case LawKind::force:
      return try_all<ForceInput, N>(row, progress);
    case LawKind::velocity:
      return try_all<VelocityInput, N>(row, progress);
    case LawKind::stabiliser:
      return try_all<StabiliserInput, N>(row, progress);
  }
}

std::string text_of(const LawChoice& choice) {
  if (choice.settings.empty()) return "its defaults";
  std::string text;
  for (const auto& [name, value] : choice.settings) {
    text += (text.empty() ? "" : ", ") + format("%s = %g", name.c_str(), value);
  }
  return text;
}

std::string fault_of(const LawRow& row, const Progress& progress, int status) {
  std::string what, way_out;
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
    what = format("did not end its steps in %d s", static_cast<int>(kMostSeconds));
    way_out = "give every loop a bound that does not depend on the input";
  } else if (!progress.done) {
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    what = format("ended the program by signal %d", signal);
    way_out = signal == SIGABRT ? "a step throws nothing" : "look at the memory that it writes";
  } else if (progress.fault == Fault::no_number) {
    what = "gave something that is no finite number";
    way_out = "look for a division by 0 and for sums that overflow";
  } else if (progress.fault == Fault::allocates) {
    what = "allocates";
    way_out = "keep all memory in its State";
  } else {
    return "";
  }
  const std::vector<LawChoice> choices = choices_of(row);
  const LawChoice& choice = choices[std::min(progress.settings, choices.size() - 1)];
  return what + " with " + text_of(choice) + " at " + Inputs::text(row.kind, progress.told) + "; " +
         way_out;
}

template <class N>
Trial try_in(const LawRow& row) {
  void* page =
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "mmap");
  auto& progress = *::new (page) Progress;
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    const rlimit cpu{kMostSeconds, kMostSeconds + 1}, no_core{0, 0};
    setrlimit(RLIMIT_CPU, &cpu);
    setrlimit(RLIMIT_CORE, &no_core);
    for (const int number : {SIGXCPU, SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS}) {
      std::signal(number, SIG_DFL);  // NOLINT(cert-err33-c): these can be set
    }
    try_kind<N>(row, progress);
    _exit(0);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  Trial trial{N::kName, progress.steps, 0, fault_of(row, progress, status)};
  if (progress.steps > 0) {
    trial.step_ns = progress.seconds * 1e9 / static_cast<double>(progress.steps);
  }
  munmap(page, sizeof(Progress));
  return trial;
}

}  // namespace

std::vector<Trial> try_law(const LawRow& row) {
  static_cast<void>(choices_of(row));
  return {try_in<FixedNumbers>(row), try_in<FloatNumbers>(row), try_in<DoubleNumbers>(row)};
}

}  // namespace kerf::laws
