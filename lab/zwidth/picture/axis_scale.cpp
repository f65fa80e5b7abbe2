// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/picture/axis_scale.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>
#include <sstream>

#include "shared/text/number.hpp"

namespace kerf::zwidth {
namespace {

/// What an axis is called in a picture, with its unit.
std::string axis_label(std::size_t axis) {
  if (axis == kAxisCount) return "stiffness of the wall, K (N/mm)";
  const AxisKind& kind = axis_kinds()[axis];
  switch (static_cast<AxisId>(axis)) {
    case AxisId::damping:
      return "damping of the wall, B (N s/mm)";
    case AxisId::delay:
      return "delay from reading to force (periods)";
    case AxisId::quantum:
      return "step of the encoders at the tip (mm)";
    case AxisId::friction:
      return "Coulomb friction of the device (N)";
    default:
      return std::string(kind.name) + (*kind.unit != 0 ? std::string(" (") + kind.unit + ")" : "");
  }
}

}  // namespace

AxisScale::AxisScale(const MapSpec& spec, std::size_t axis) : axis_(axis) {
  if (axis == kAxisCount) {
    places_ = spec.stiffness_n_per_mm;
    for (const double value : places_) texts_.push_back(number_text(value));
  } else {
    texts_ = spec.table[axis];
    for (const std::string& text : texts_) {
      places_.push_back(number_in(text).value_or(static_cast<double>(places_.size())));
    }
  }
  words_ = axis < kAxisCount && axis_kinds()[axis].lowest == axis_kinds()[axis].highest;
  if (words_) {
    for (std::size_t i = 0; i < places_.size(); ++i) places_[i] = static_cast<double>(i);
  }
  log_ = axis == kAxisCount;
}

std::size_t AxisScale::index(const std::string& text) const {
  return static_cast<std::size_t>(std::ranges::find(texts_, text) - texts_.begin());
}

std::string AxisScale::box(const AxisScale& x, std::size_t i, const AxisScale& y, std::size_t k) {
  std::ostringstream text;
  text.precision(7);
  text << x.place(i) << ' ' << y.place(k) << ' ' << x.low(i) << ' ' << x.high(i) << ' ' << y.low(k)
       << ' ' << y.high(k);
  return text.str();
}

void AxisScale::set(std::ostream& script, const char* axis) const {
  script << "set " << axis << "label \"" << axis_label(axis_) << "\""
         << (*axis == 'y' ? " offset 1,0" : "") << "\nset " << axis << "range [" << low(0) << ":"
         << high(size() - 1) << "]\n";
  script << (log_ ? "set logscale " : "unset logscale ") << axis << "\n";
  if (!words_) {
    script << "set " << axis << "tics autofreq\n";
    return;
  }
  script << "set " << axis << "tics (";
  for (std::size_t i = 0; i < size(); ++i) {
    script << (i > 0 ? "," : "") << "\"" << texts_[i] << "\" " << i;
  }
  script << ")\n";
}

double AxisScale::low(std::size_t i) const {
  return i > 0 ? between(places_[i - 1], places_[i]) : beyond(i, -1);
}

double AxisScale::high(std::size_t i) const {
  return i + 1 < places_.size() ? between(places_[i], places_[i + 1]) : beyond(i, 1);
}

double AxisScale::between(double a, double b) const {
  return log_ ? std::sqrt(a * b) : (a + b) / 2;
}

/// To one side (-1 or 1) of an end, as far as the border to its neighbour is on the other.
double AxisScale::beyond(std::size_t i, int side) const {
  const double at = places_[i];
  if (size() == 1) {
    const double half = at == 0 || words_ ? 0.5 : std::abs(at) / 2;
    return log_ ? at * std::pow(1.25, side) : at + half * side;
  }
  const double other = places_[side < 0 ? i + 1 : i - 1];
  return log_ ? at * std::sqrt(at / other) : at + (at - other) / 2;
}

}  // namespace kerf::zwidth
