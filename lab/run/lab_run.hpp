// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <initializer_list>
#include <iosfwd>
#include <string>
#include <vector>

#include "shared/numeric/statistics.hpp"

/// Runs of the lab: times of ticks, the core, and the files that a command writes.
namespace kerf {

/// Durations of single ticks, in ns.
struct TickTimes {
  double p50_ns = 0, p99_ns = 0, max_ns = 0;
};

/// Runs `tick(i)` for i = 0 .. ticks - 1 and times each by itself, after `before()`, which is not
/// timed. Twice, and the second time counts: caches and the core's clock have settled. The clock's
/// own 20 to 30 ns are in each figure.
template <class Before, class Tick>
[[nodiscard]] TickTimes time_ticks(int ticks, Before&& before, Tick&& tick) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> ns;
  for (int round = 0; round < 2; ++round) {
    ns.clear();
    for (int i = 0; i < ticks; ++i) {
      before();
      const auto start = Clock::now();
      tick(i);
      ns.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count());
    }
  }
  return {percentile(ns, 0.5), percentile(ns, 0.99), percentile(ns, 1)};
}

/// Keeps this process on one core, so that every figure of a run comes from it; negative: on the
/// last that it may use. Returns the core. Throws `HilError`.
int pin_lab(int core);

/// Day, processor, compiler with its flags, and fastest kernels of a run, for the page that it
/// writes. One line.
[[nodiscard]] std::string lab_provenance();

/// Three digits, or all before the point: how pages show their figures.
[[nodiscard]] std::string page_number(double value);

/// The file of a page's plot: the page's name with `ending`, in the folder plots/ beside the page,
/// which is made. Empty if the page is. Throws `HilError` that names `option`.
[[nodiscard]] std::string page_plot(const char* option, const std::string& page,
                                    const char* ending);

/// `plot` as `page` links to it.
[[nodiscard]] std::string page_link(const std::string& page, const std::string& plot);

/// An output file of a kind that ends in `ending`. Its name is checked before the measurement; the
/// file is made after it. Does nothing for an empty path. Throws `HilError` that names the option,
/// or `FileError`.
class LabOutput {
 public:
  LabOutput(const char* option, std::string path, const char* ending);
  void write(const std::string& text) const;
  /// The page or plot that `make_report` makes of `json`; prints the path of the file to `out`.
  void write_report(const std::vector<std::string>& words, const std::string& json,
                    std::ostream& out) const;
  /// Writes one part of a page that other commands write to, too (see `write_page_part`); prints
  /// the path of the file to `out`.
  void write_part(const char* name, const std::string& text, std::ostream& out) const;

  /// Throws `FileError` if two of a run's outputs are one file.
  static void check_distinct(std::initializer_list<const LabOutput*> outputs);

 private:
  const char* option_;
  std::string path_;
};

}  // namespace kerf
