// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/dicom_stack.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <sstream>

#include "controller/input/load_error.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
using vec3::Vec, vec3::cross, vec3::dot, vec3::length;
using vec3::operator-, vec3::operator*;
namespace {

/// A slice that is off by so much of a voxel is not off: far below what any picture resolves.
constexpr double kOffVoxels = 0.02;
/// Rounding in a file is believed as long as no voxel moves by half its size, and the number has
/// three digits or more: one of fewer is chosen.
constexpr double kRoundedVoxels = 0.5, kThreeDigits = 0.005;

/// Whether two numbers of two files are the same: `reach` times their difference moves a voxel of
/// size `voxel_mm` by nothing, or both may be roundings of one number.
bool same_number(const WrittenNumber& a, const WrittenNumber& b, double reach, double voxel_mm) {
  const double apart = std::abs(a.value - b.value);
  if (apart * reach <= kOffVoxels * voxel_mm) return true;
  const auto rounding = [&](const WrittenNumber& number) {
    const double most = rounding_of(number.decimals);
    return most <= kThreeDigits * voxel_mm ? most : 0;
  };
  return apart <= rounding(a) + rounding(b) && apart * reach <= kRoundedVoxels * voxel_mm;
}

constexpr double kSameMm = 1e-3;  ///< between the depths of two slices at one position

bool same_spacing(const DicomSlice& a, const DicomSlice& b) {
  const auto &p = a.frame->spacing_mm, &q = b.frame->spacing_mm;
  if (!p || !q) return !p && !q;
  const StoredPixels& pixels = a.file->pixels;
  return same_number((*p)[0], (*q)[0], static_cast<double>(pixels.rows), (*p)[0].value) &&
         same_number((*p)[1], (*q)[1], static_cast<double>(pixels.columns), (*p)[1].value);
}

struct Axes {
  Vec x{1, 0, 0}, y{0, 1, 0}, normal{0, 0, 1};
};

Axes axes_of(const DicomSlice& slice) {
  const auto& o = slice.frame->orientation;
  if (!o) return {};
  Axes axes;
  for (std::size_t i = 0; i < 3; ++i) {
    axes.x[i] = (*o)[i].value;
    axes.y[i] = (*o)[3 + i].value;
  }
  axes.normal = cross(axes.x, axes.y);
  return axes;
}

Vec position_of(const DicomSlice& slice) {
  const auto& p = *slice.frame->position_mm;
  return {p[0].value, p[1].value, p[2].value};
}

/// Refuses slices of which only some have a position.
Order order_of(const std::vector<DicomSlice>& slices) {
  const auto lacks = std::ranges::find_if(
      slices, [](const DicomSlice& slice) { return !slice.frame->position_mm.has_value(); });
  if (lacks == slices.end()) return Order::position;
  for (const DicomSlice& slice : slices) {
    if (!slice.frame->position_mm) continue;
    throw LoadError(lacks->file->path.string() + ": " + name_of(*lacks) + " has no position, and " +
                    name_of(slice) + " of the same series has one; export the series again");
  }
  const auto location = [](const DicomSlice& slice) { return slice.frame->location_mm; };
  const bool all = std::ranges::all_of(
      slices, [&](const DicomSlice& slice) { return location(slice).has_value(); });
  const bool differ = all && std::ranges::any_of(slices, [&](const DicomSlice& slice) {
                        return location(slice)->value != location(slices.front())->value;
                      });
  return differ ? Order::location : Order::number;
}

}  // namespace

std::string name_of(const DicomSlice& slice) {
  std::string file = slice.file->path.filename().string();
  if (slice.file->frames.size() == 1) return file;
  return "frame " + std::to_string(slice.frame->index + 1) + " of " + file;
}

bool alike(const DicomSlice& a, const DicomSlice& b) {
  const StoredPixels &p = a.file->pixels, &q = b.file->pixels;
  const auto &x = a.frame->orientation, &y = b.frame->orientation;
  if (p.columns != q.columns || p.rows != q.rows || x.has_value() != y.has_value()) return false;
  if (!x) return true;
  const double reach = static_cast<double>(p.columns + p.rows);  // voxels; both of one size
  for (std::size_t i = 0; i < x->size(); ++i) {
    if (!same_number((*x)[i], (*y)[i], reach, 1)) return false;
  }
  return true;
}

void put_in_order(Stack& stack) {
  stack.order = order_of(stack.slices);
  const Vec normal = axes_of(stack.slices.front()).normal;
  const auto depth = [&](const DicomSlice& slice) {
    if (stack.order == Order::position) return dot(position_of(slice), normal);
    return stack.order == Order::location ? slice.frame->location_mm->value
                                          : slice.frame->number.value_or(0);
  };
  std::ranges::stable_sort(stack.slices, {}, depth);
  stack.depth_mm.clear();
  for (const DicomSlice& slice : stack.slices) stack.depth_mm.push_back(depth(slice));
}

std::size_t doubled(const Stack& stack) {
  const std::vector<double>& depth = stack.depth_mm;
  const double step = (depth.back() - depth.front()) / static_cast<double>(depth.size());
  const double same_mm = std::min(kSameMm, step / 4);  // micrometres apart are two positions
  for (std::size_t i = 1; i < depth.size(); ++i) {
    if (depth[i] - depth[i - 1] <= same_mm) return i;
  }
  return 0;
}

namespace {

/// The slices do not follow one another evenly: names the one whose distance to the slice before it
/// is the oddest. Most others are right, so the median is what is usual.
[[noreturn]] void refuse_uneven(const fs::path& path, const Stack& stack) {
  std::vector<double> apart;
  for (std::size_t i = 1; i < stack.depth_mm.size(); ++i) {
    apart.push_back(stack.depth_mm[i] - stack.depth_mm[i - 1]);
  }
  std::vector<double> sorted = apart;
  std::ranges::sort(sorted);
  const double usual = sorted[sorted.size() / 2];
  const auto oddest = std::ranges::max_element(
      apart, {}, [&](double distance) { return std::abs(distance - usual); });
  const auto slice = static_cast<std::size_t>(oddest - apart.begin()) + 1;
  std::ostringstream text;
  if (stack.order == Order::number) {
    text << path.string() << ": " << name_of(stack.slices[slice]) << " has the number "
         << stack.depth_mm[slice] << " and follows " << stack.depth_mm[slice - 1]
         << ", without positions; add the missing slices";
  } else {
    text << path.string() << ": " << *oddest << " mm before slice " << name_of(stack.slices[slice])
         << " where " << usual << " mm is usual; add the missing slices or remove doubled ones";
  }
  throw LoadError(text.str());
}

/// The least width of a band along a line of slope `step` or near it that holds all depths by their
/// numbers: how far they are from even, whatever the step. Convex in the slope.
double unevenness(const std::vector<double>& depth, double step) {
  const auto width = [&](double slope) {
    double least = depth.front(), most = least;
    for (std::size_t i = 0; i < depth.size(); ++i) {
      const double off = depth[i] - slope * static_cast<double>(i);
      least = std::min(least, off);
      most = std::max(most, off);
    }
    return most - least;
  };
  double low = step / 2, high = 2 * step;
  constexpr int kSteps = 100;  // by two thirds each: below an ulp
  for (int i = 0; i < kSteps; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (width(a) < width(b) ? high : low) = width(a) < width(b) ? b : a;
  }
  return std::min(width(low), width(step));
}

struct DepthErrors {
  double rounding = 0;  ///< by the digits of the file
  double noise = 0;     ///< by the sums of this program
};

/// The most by which the depths may be wrong. Each coordinate is rounded by its own digits. A gap
/// among slices `step` apart makes them uneven by half a step or more: rounding by a quarter of it
/// or more would hide one, and does not count.
DepthErrors errors_of_depths(const Stack& stack, double step, const Vec& normal) {
  std::array<WrittenNumber, 3> worst{};  // of the largest value and the most decimals
  std::size_t terms = 0;
  const auto take = [&](std::span<const WrittenNumber> numbers) {
    terms = numbers.size();
    for (std::size_t i = 0; i < terms; ++i) {
      worst[i].value = std::max(worst[i].value, std::abs(numbers[i].value));
      worst[i].decimals = std::max(worst[i].decimals, numbers[i].decimals);
    }
  };
  for (const DicomSlice& slice : stack.slices) {
    if (stack.order == Order::position) take(*slice.frame->position_mm);
    if (stack.order == Order::location) take(std::span(&*slice.frame->location_mm, 1));
  }
  DepthErrors errors;
  double largest = 0;
  for (std::size_t i = 0; i < terms; ++i) {
    const double part = stack.order == Order::position ? std::abs(normal[i]) : 1;
    const double float_noise = worst[i].value * std::numeric_limits<float>::epsilon();
    errors.rounding += part * std::max(rounding_of(worst[i].decimals), float_noise);
    largest += part * worst[i].value;
  }
  // With u = epsilon / 2: 7 u of a depth (its text, the normal, product and sums), 7 u of what is
  // taken from it (i times the slope, at most twice the largest, and the difference), 2 u of the
  // slope that is found.
  constexpr double kRoundings = 8;
  errors.noise = kRoundings * std::numeric_limits<double>::epsilon() * largest;
  constexpr double kHidesGap = 0.25;
  if (errors.rounding >= kHidesGap * step) errors.rounding = 0;
  return errors;
}

/// Refuses slices of which any has neither a position nor a number: their order is not known.
void check_numbers(const fs::path& path, const Stack& stack) {
  const auto has_number = [](const DicomSlice& slice) { return slice.frame->number.has_value(); };
  const auto lacks = std::ranges::find_if_not(stack.slices, has_number);
  if (lacks == stack.slices.end()) return;
  if (std::ranges::none_of(stack.slices, has_number)) {
    throw LoadError(path.string() + ": its " + std::to_string(stack.slices.size()) +
                    " slices have neither positions nor numbers; export it again, with positions");
  }
  throw LoadError(lacks->file->path.string() + ": " + name_of(*lacks) +
                  " has neither a position nor a number, and other slices have a number; export "
                  "the series again, with positions");
}

/// The common distance of the slices. Refuses gaps, doubled positions and a slanted stack.
double slice_distance(const fs::path& path, const Stack& stack) {
  if (stack.order == Order::number) check_numbers(path, stack);
  const std::vector<double>& depth = stack.depth_mm;
  const Axes axes = axes_of(stack.slices.front());
  const double step = (depth.back() - depth.front()) / static_cast<double>(depth.size() - 1);
  const std::size_t twin = doubled(stack);
  if (twin != 0 && depth.back() - depth.front() < kSameMm) {
    throw LoadError(path.string() + ": its " + std::to_string(depth.size()) + " slices have one " +
                    (stack.order == Order::number ? "number" : "position") +
                    "; export it again, with the position of each");
  }
  if (twin != 0) {
    const DicomSlice &a = stack.slices[twin - 1], &b = stack.slices[twin];
    // Files of one name lie in two folders.
    const bool same_name = name_of(a) == name_of(b);
    const auto shown = [&](const DicomSlice& slice) {
      return same_name ? slice.file->path.lexically_relative(path).string() : name_of(slice);
    };
    throw LoadError(path.string() + ": " + shown(b) + " has the " +
                    (stack.order == Order::number ? "number" : "position") + " of " + shown(a) +
                    ", and no tag separates two volumes; keep one volume in a series");
  }
  const DepthErrors errors = errors_of_depths(stack, step, axes.normal);
  const double slack_mm = std::max(kOffVoxels * step, errors.rounding) + errors.noise;
  if (unevenness(depth, step) > 2 * slack_mm ||
      (stack.order == Order::number && std::abs(step - 1) > kOffVoxels)) {
    refuse_uneven(path, stack);
  }
  if (stack.order != Order::position) return step;

  int decimals = 0;
  for (const DicomSlice& slice : stack.slices) {
    if (!slice.frame->orientation) continue;
    for (const WrittenNumber& cosine : *slice.frame->orientation) {
      decimals = std::max(decimals, cosine.decimals);
    }
  }
  const double turned = std::max(3 * rounding_of(decimals), 1e-6);  // of the normal, rad
  const Vec origin = position_of(stack.slices.front());
  for (const DicomSlice& slice : stack.slices) {
    const Vec apart = position_of(slice) - origin;
    const double along = dot(apart, axes.normal);
    const Vec aside = apart - along * axes.normal;
    if (length(aside) > 2 * slack_mm + along * turned) {
      throw LoadError(path.string() +
                      ": its axes are not at right angles (tilted gantry); resample it to a "
                      "straight grid first");
    }
  }
  return step;
}

/// Without positions: SliceLocation and the numbers must not contradict one another.
void check_locations(const fs::path& path, const Stack& stack) {
  bool rises = true, falls = true;
  for (std::size_t i = 1; i < stack.slices.size(); ++i) {
    const auto before = stack.slices[i - 1].frame->number, own = stack.slices[i].frame->number;
    if (!before || !own) return;
    rises = rises && *own > *before;
    falls = falls && *own < *before;
  }
  if (rises || falls) return;
  throw LoadError(path.string() +
                  ": its slices have no positions, and SliceLocation and InstanceNumber put them "
                  "in different orders; export it again, with positions");
}

}  // namespace

UntrustedHeader claim_of(const fs::path& path, const Stack& stack, Note& note) {
  const DicomSlice& first = stack.slices.front();
  const DicomSlice* finest = &first;  // of the most digits
  for (const DicomSlice& slice : stack.slices) {
    if (!same_spacing(first, slice)) {
      throw LoadError(slice.file->path.string() + ": the spacing of " + name_of(slice) +
                      " differs from " + name_of(first) + "; keep one stack of slices per folder");
    }
    const auto &own = slice.frame->spacing_mm, &best = finest->frame->spacing_mm;
    if (own && (*own)[0].decimals > (*best)[0].decimals) finest = &slice;
  }
  UntrustedHeader claim;
  const Axes axes = axes_of(first);
  claim.size = {first.file->pixels.columns, first.file->pixels.rows,
                static_cast<std::int64_t>(stack.slices.size())};
  claim.axes = {axes.x, axes.y, axes.normal};
  claim.axes_known = stack.order == Order::position && first.frame->orientation ? 1 : 0;
  constexpr std::uint32_t kInPlane = 0b011, kBetween = 0b100;
  claim.spacing_known = 0;
  if (finest->frame->spacing_mm) {
    claim.spacing_known = kInPlane;
    claim.spacing_mm = {(*finest->frame->spacing_mm)[1].value,
                        (*finest->frame->spacing_mm)[0].value, 1};
  }
  if (const std::string& bad = finest->frame->bad_spacing; !bad.empty()) {
    constexpr std::size_t kMostShown = 40;
    const std::string text = "PixelSpacing '" + one_line(bad.substr(0, kMostShown)) + "'";
    text.copy(claim.bad_spacing.data(), claim.bad_spacing.size() - 1);
    note.add(text + " is no two distances and is not used");
  }
  const double step = slice_distance(path, stack);
  if (stack.order != Order::number) {
    claim.spacing_mm[2] = step;
    claim.spacing_known |= kBetween;
  }
  if (stack.order == Order::position) {
    claim.origin_mm = position_of(first);
    if (!first.frame->orientation) note.add("without an orientation: taken as axial");
  } else if (stack.order == Order::location) {
    check_locations(path, stack);
    note.add("slices without position, in the order of SliceLocation: may be mirrored");
  } else {
    const auto distance = first.frame->distance_mm;
    const bool common = distance && *distance > 0 &&
                        std::ranges::all_of(stack.slices, [&](const DicomSlice& slice) {
                          return slice.frame->distance_mm == distance;
                        });
    if (common) {
      claim.spacing_mm[2] = *distance;
      claim.spacing_known |= kBetween;
    }
    note.add("slices without position, in the order of " +
             std::string(first.file->frames.size() > 1 ? "their numbers" : "InstanceNumber") +
             ": may be mirrored");
  }
  return claim;
}

bool is_regular(const Stack& stack) {
  try {
    Note unused;
    static_cast<void>(claim_of({}, stack, unused));
    return true;
  } catch (const LoadError&) {
    return false;
  }
}

}  // namespace kerf::volume
