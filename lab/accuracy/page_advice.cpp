// SPDX-License-Identifier: Apache-2.0

#include <initializer_list>
#include <string_view>

#include "lab/accuracy/page_column.hpp"

namespace kerf::accuracy {
namespace {

/// `text` with each {} replaced by the next figure.
std::string filled(std::string text, std::initializer_list<std::string> figures) {
  std::size_t at = 0;
  for (const std::string& figure : figures) {
    at = text.find("{}", at);
    text.replace(at, 2, figure);
    at += figure.size();
  }
  return text;
}

/// Looks up the choice of a value; values are unique among the knobs.
class Choices {
 public:
  explicit Choices(const std::vector<Entry>& entries) : entries_(entries) {}

  [[nodiscard]] const Entry& at(std::string_view value) const {
    for (const Entry& entry : entries_) {
      if (entry.value == value) return entry;
    }
    return entries_.front();
  }
  [[nodiscard]] std::string of(std::string_view value, const PageColumn& column) const {
    return column.cell(at(value));
  }
  [[nodiscard]] std::string us(std::string_view value) const {
    return page_number(at(value).times.p50_ns / 1e3);
  }
  /// How many times longer the tick of `slow` takes.
  [[nodiscard]] std::string times(std::string_view slow, std::string_view fast) const {
    return page_number(at(slow).times.p50_ns / at(fast).times.p50_ns);
  }

 private:
  const std::vector<Entry>& entries_;
};

}  // namespace

std::string page_advice(const std::vector<Entry>& entries) {
  using namespace column;
  const Choices c(entries);
  constexpr const char* kAlignedFine = "aligned 0.0625 mm";
  std::string text = "## What to choose\n\n";
  text += filled(
      R"(* A round tool: the method `aligned`, {} us a tick, at most {} ppm of full scale away from double. Nothing is
  stored, so a cut refreshes nothing.
* Any other tool: `gather` ({} us, at most {} ppm, {} bytes a voxel), and `splat` where the scene cuts ({} us,
  at most {} ppm, nothing stored).
* Few samples favour `gather`, many `aligned`: {} of them take {} against {} us, {} (in voxels of 0.0625 mm)
  {} against {} us. The servo takes `aligned` wherever it can: it also needs no memory and no refresh.
)",
      {c.us("aligned"), c.of("aligned", kDoubleMax), c.us("int16 gradients"),
       c.of("int16 gradients", kDoubleMax), c.of("int16 gradients", kMemory), c.us("splat"),
       c.of("splat", kDoubleMax), c.of("aligned", kSamples), c.us("int16 gradients"),
       c.us("aligned"), c.of(kAlignedFine, kSamples), c.us("0.0625 mm"), c.us(kAlignedFine)});
  text += filled(
      R"(* Fixed point: Q15, at most {} ppm away from double (Q12 {}, Q8 {}). Theory is {} % away from all of them: the
  hand could do with Q8; the 16 bits of the kernels hold Q15.
)",
      {c.of("Q15", kDoubleMax), c.of("Q12", kDoubleMax), c.of("Q8", kDoubleMax),
       c.of("Q15", kTheory)});
  text += filled(
      R"(* Pitch 1. Half of it takes {} times as long for an error of {} instead of {} %; twice of it leaves {} %.
)",
      {c.times("1/2", "1"), c.of("1/2", kTheory), c.of("1", kTheory), c.of("2", kTheory)});
  text += filled(
      R"(* Gradients by `farid`: normals to {} deg rms (`sobel5` {}, `central` {}). `central` blurs less, so its force
  is nearer to theory ({} against {} %), but it passes {} of the noise instead of {}, and a closed path of
  the tool makes or takes {} of the work that goes to and fro instead of {}.
)",
      {c.of("farid", kNormal), c.of("sobel5", kNormal), c.of("central", kNormal),
       c.of("central", kTheory), c.of("farid", kTheory), c.of("central", kNoise),
       c.of("farid", kNoise), c.of("central", kToolLoop), c.of("farid", kToolLoop)});
  text += filled(
      R"(* Where no energy may come from nothing: a spline of the density. The tool's loop makes or takes {}
  (quadratic) or {} (cubic) of the work instead of {}.
)",
      {c.of("spline 2", kToolLoop), c.of("spline 3", kToolLoop),
       c.of("int16 gradients", kToolLoop)});
  text += filled(
      R"(* Never the nearest voxel: 0.01 voxel can change the force by {} thousandths of full scale, trilinear by {}.
)",
      {c.of("nearest", kStep), c.of("trilinear", kStep)});
  text += filled(
      R"(* Most of the error of theory is blur, by the kernel and by the ramp of one voxel at each face. Voxels of
  0.0625 mm instead of 0.125 mm take {} times as long in the method `gather` and bring {} instead of {} %.
)",
      {c.times("0.0625 mm", "0.125 mm"), c.of("0.0625 mm", kTheory), c.of("0.125 mm", kTheory)});
  return text + "\n";
}

}  // namespace kerf::accuracy
