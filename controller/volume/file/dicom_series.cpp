// SPDX-License-Identifier: Apache-2.0
// The frames of DICOM files as series, and one of these as a volume.
#include "controller/volume/file/dicom_series.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <list>
#include <map>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>

#include <gdcmTrace.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/dicom_header.hpp"
#include "controller/volume/file/dicom_pixels.hpp"
#include "controller/volume/file/foreign_itk.hpp"
#include "controller/volume/file/volume_image.hpp"
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

/// What a slice is called in a message.
std::string name_of(const DicomSlice& slice) {
  const std::string file = slice.file->path.filename().string();
  if (slice.file->frames.size() == 1) return file;
  return "frame " + std::to_string(slice.frame->index + 1) + " of " + file;
}

bool same_spacing(const DicomSlice& a, const DicomSlice& b) {
  const auto &p = a.frame->spacing_mm, &q = b.frame->spacing_mm;
  if (!p || !q) return !p && !q;
  const StoredPixels& pixels = a.file->pixels;
  return same_number((*p)[0], (*q)[0], static_cast<double>(pixels.rows), (*p)[0].value) &&
         same_number((*p)[1], (*q)[1], static_cast<double>(pixels.columns), (*p)[1].value);
}

/// Of one size, and of one orientation or none.
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

/// By what slices are put in order.
enum class Order : std::uint8_t { position, location, number };

/// Slices of one size and orientation, in order; a volume, if they are even.
struct Stack {
  double number = 0;
  std::string series, name;
  std::string part;  ///< of a series that is several volumes: what it has alone
  Order order = Order::position;
  std::vector<DicomSlice> slices;
  std::vector<double> depth_mm;  ///< of each, along the normal; or numbers
};

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

constexpr double kSameMm = 1e-3;  ///< between the depths of two slices at one position

/// Index of the first slice at the position of the one before it; 0 if there is none.
std::size_t doubled(const Stack& stack) {
  for (std::size_t i = 1; i < stack.depth_mm.size(); ++i) {
    if (stack.depth_mm[i] - stack.depth_mm[i - 1] < kSameMm) return i;
  }
  return 0;
}

/// The text of a mark of a slice, or empty.
std::string mark_of(const DicomSlice& slice, const std::string& name) {
  for (const auto& [own, text] : slice.frame->marks) {
    if (own == name) return text;
  }
  return {};
}

/// The slices by their texts of one mark, in the order of these as numbers or words.
std::vector<Stack> parts_by(const Stack& whole, const std::string& mark) {
  std::map<std::pair<double, std::string>, Stack> parts;
  for (const DicomSlice& slice : whole.slices) {
    const std::string text = mark_of(slice, mark);
    Stack& part = parts[{number_in(text).value_or(0), text}];
    if (part.slices.empty()) {
      part = whole;
      part.slices.clear();
      part.part += (part.part.empty() ? "" : ", ") + mark + ' ' + (text.empty() ? "none" : text);
    }
    part.slices.push_back(slice);
  }
  std::vector<Stack> list;
  for (auto& [key, part] : parts) {
    put_in_order(part);
    list.push_back(std::move(part));
  }
  return list;
}

/// Marks by which parts that reach over the same depths are different volumes in any case.
constexpr std::string_view kSureMarks[] = {
    "TemporalPositionIndex", "TemporalPositionIdentifier", "StackID",        "EchoNumbers",
    "EffectiveEchoTime",     "ReferencedSegmentNumber",    "DiffusionBValue"};

bool overlap(const std::vector<Stack>& parts) {
  for (const Stack& a : parts) {
    for (const Stack& b : parts) {
      if (&a != &b && a.depth_mm.front() < b.depth_mm.back() &&
          b.depth_mm.front() < a.depth_mm.back()) {
        return true;
      }
    }
  }
  return false;
}

/// A series that holds several volumes, such as times or echoes, as these: by the first marks that
/// leave one slice at each position. As one, if there are none such.
std::vector<Stack> split(const Stack& whole, int marks_left = 3) {
  const bool twice = doubled(whole) != 0;
  for (const auto& [mark, text] : whole.slices.front().frame->marks) {
    const bool sure = std::ranges::find(kSureMarks, mark) != std::end(kSureMarks);
    if (marks_left == 0 || (!twice && !sure)) continue;
    const std::vector<Stack> parts = parts_by(whole, mark);
    const bool stacks =
        std::ranges::all_of(parts, [](const Stack& part) { return part.slices.size() > 1; });
    if (parts.size() < 2 || !stacks || (!twice && !overlap(parts))) continue;
    std::vector<Stack> all;
    bool clean = true;
    for (const Stack& part : parts) {
      for (Stack& each : split(part, marks_left - 1)) {
        clean = clean && doubled(each) == 0;
        all.push_back(std::move(each));
      }
    }
    if (clean) return all;
  }
  return {whole};
}

/// All stacks of the files, in the order of their series.
std::vector<Stack> all_stacks(const std::list<DicomFile>& files) {
  std::map<std::pair<double, std::string>, std::vector<Stack>> series;
  for (const DicomFile& file : files) {
    std::vector<Stack>& stacks = series[{file.series_number, file.series}];
    for (const DicomFrame& frame : file.frames) {
      const DicomSlice slice{&file, &frame};
      auto own = std::ranges::find_if(
          stacks, [&](const Stack& stack) { return alike(stack.slices.front(), slice); });
      if (own == stacks.end()) {
        stacks.push_back({file.series_number, file.series, file.series_name, {}, {}, {}, {}});
        own = stacks.end() - 1;
      }
      own->slices.push_back(slice);
    }
  }
  std::vector<Stack> all;
  for (auto& [key, stacks] : series) {
    for (Stack& stack : stacks) {
      put_in_order(stack);
      for (Stack& part : split(stack)) all.push_back(std::move(part));
    }
  }
  return all;
}

std::string text_of(const Stack& stack) {
  const StoredPixels& pixels = stack.slices.front().file->pixels;
  const std::size_t slices = stack.slices.size();
  return "'" + stack.name + "'" + (stack.part.empty() ? "" : ", " + stack.part) + " (" +
         std::to_string(slices) + (slices == 1 ? " slice of " : " slices of ") +
         std::to_string(pixels.columns) + " x " + std::to_string(pixels.rows) + ")";
}

/// Index of the wanted series: by its number in the list, or by a part of its name or identifier.
/// Without a word the only one that has more than one slice: the others are overviews.
std::size_t chosen_stack(const fs::path& path, const std::vector<Stack>& all,
                         const std::string& wanted) {
  const auto fitting = [&](const auto& fits) {
    std::vector<std::size_t> fit;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (fits(i)) fit.push_back(i);
    }
    return fit;
  };
  std::vector<std::size_t> fit =
      fitting([&](std::size_t i) { return !wanted.empty() && all[i].series == wanted; });
  if (fit.size() != 1) {
    fit = fitting([&](std::size_t i) {
      if (wanted.empty()) return all[i].slices.size() > 1 || all.size() == 1;
      if (std::to_string(i + 1) == wanted) return true;
      const auto has = [&](const std::string& text) { return text.find(wanted) != text.npos; };
      return !number_in(wanted) && (has(all[i].name) || has(all[i].series) || has(all[i].part));
    });
  }
  if (fit.size() == 1) return fit.front();
  std::string list;
  for (std::size_t i = 0; i < all.size(); ++i) {
    list += (i == 0 ? " " : ", ") + std::to_string(i + 1) + " " + text_of(all[i]);
  }
  throw LoadError(
      path.string() + ": " + std::to_string(all.size()) + " DICOM series" +
      (wanted.empty() ? "" : ", and --series " + one_line(wanted) + " is not one of them") +
      "; choose one with ./kerf volume import --series:" + list);
}

[[noreturn]] void refuse(const DicomFile& file) {
  throw LoadError(file.path.string() + ": " + file.unfit + "; " + file.way_out);
}

/// Sentences for the user, each once.
class Note {
 public:
  void add(const std::string& sentence) {
    if (sentence.empty() || std::ranges::find(sentences_, sentence) != sentences_.end()) return;
    sentences_.push_back(sentence);
  }
  void write(UntrustedHeader& claim) const {
    for (const std::string& sentence : sentences_) add_note(claim, sentence);
  }

 private:
  std::vector<std::string> sentences_;
};

/// Refuses an unreadable slice of the series; names the other files that are left out.
void note_unfit(const std::list<DicomFile>& files, const Stack& stack, Note& note) {
  constexpr std::size_t kMostNamed = 3;
  std::vector<const DicomFile*> unfit;
  for (const DicomFile& file : files) {
    if (file.unfit.empty()) continue;
    if (file.is_slice && file.series == stack.series) refuse(file);
    unfit.push_back(&file);
  }
  for (std::size_t i = 0; i < std::min(unfit.size(), kMostNamed); ++i) {
    note.add("skipped " + unfit[i]->path.filename().string() + " (" + unfit[i]->unfit + ")");
  }
  if (unfit.size() > kMostNamed) {
    note.add("skipped " + std::to_string(unfit.size() - kMostNamed) + " more such files");
  }
}

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
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (width(a) < width(b) ? high : low) = width(a) < width(b) ? b : a;
  }
  return std::min(width(low), width(step));
}

/// The most by which the writer has changed the depths. A gap among slices `step` apart makes them
/// uneven by half a step or more: rounding by a quarter of it or more would hide one, and does not
/// count.
double rounding_of_depths(const Stack& stack, double step, const Vec& normal) {
  int decimals = 0;
  double largest = 0;
  for (const DicomSlice& slice : stack.slices) {
    if (stack.order == Order::position) {
      for (const WrittenNumber& number : *slice.frame->position_mm) {
        decimals = std::max(decimals, number.decimals);
        largest = std::max(largest, std::abs(number.value));
      }
    } else if (stack.order == Order::location) {
      decimals = std::max(decimals, slice.frame->location_mm->decimals);
      largest = std::max(largest, std::abs(slice.frame->location_mm->value));
    }
  }
  const double noise = largest * std::numeric_limits<float>::epsilon();  // of a float's writer
  const double all = std::max(rounding_of(decimals), noise) *
                     (std::abs(normal[0]) + std::abs(normal[1]) + std::abs(normal[2]));
  constexpr double kHidesGap = 0.25;
  return all < kHidesGap * step ? all : 0;
}

/// The common distance of the slices. Refuses gaps, doubled positions and a slanted stack.
double slice_distance(const fs::path& path, const Stack& stack) {
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
    throw LoadError(path.string() + ": " + name_of(b) + " has the " +
                    (stack.order == Order::number ? "number" : "position") + " of " + name_of(a) +
                    ", and no tag tells two volumes apart; keep one volume in a series");
  }
  const double rounding = rounding_of_depths(stack, step, axes.normal);
  const double slack_mm = std::max(kOffVoxels * step, rounding);
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

/// The frame of the volume. Refuses what is not one even stack.
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
  constexpr std::uint32_t kInPlane = 0b011, kBetween = 0b100;
  claim.spacing_known = 0;
  if (finest->frame->spacing_mm) {
    claim.spacing_known = kInPlane;
    claim.spacing_mm = {(*finest->frame->spacing_mm)[1].value,
                        (*finest->frame->spacing_mm)[0].value, 1};
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
             std::string(first.file->frames.size() > 1 ? "frames" : "InstanceNumber") +
             ": may be mirrored");
  }
  return claim;
}

/// A slice of the same series that was left out, because it is alone in its size or orientation.
const DicomSlice* odd_one(const std::vector<Stack>& all, const Stack& chosen) {
  for (const Stack& stack : all) {
    if (&stack != &chosen && stack.series == chosen.series && stack.slices.size() == 1) {
      return &stack.slices.front();
    }
  }
  return nullptr;
}

UntrustedHeader whole_claim_of(const fs::path& path, const std::vector<Stack>& all,
                               const Stack& stack, Note& note) {
  try {
    return claim_of(path, stack, note);
  } catch (const LoadError& error) {
    const DicomSlice* odd = odd_one(all, stack);
    if (odd == nullptr) throw;
    throw LoadError(std::string(error.what()) + ", such as " + name_of(*odd) +
                    ", which differs in size or direction");
  }
}

/// If no file, or none but overviews, can be read: names the first that cannot, a slice if any is.
void refuse_if_all_unfit(const std::list<DicomFile>& files, const std::vector<Stack>& all) {
  if (std::ranges::any_of(all, [](const Stack& stack) { return stack.slices.size() > 1; })) return;
  const auto is_unfit = [](const DicomFile& file) { return !file.unfit.empty(); };
  for (const DicomFile& file : files) {
    if (is_unfit(file) && file.is_slice) refuse(file);
  }
  const auto any = std::ranges::find_if(files, is_unfit);
  if (all.empty() && any != files.end()) refuse(*any);
}

}  // namespace

void read_dicom(const fs::path& path, const std::vector<fs::path>& files, const std::string& wanted,
                SandboxReader& sandbox, const MemoryRequest& offer) {
  const Quiet quiet;
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  std::list<DicomFile> found;
  for (const fs::path& file : files) {
    sandbox.at(file.string());
    if (auto header = read_dicom_header(file)) found.push_back(std::move(*header));
  }
  sandbox.at(path.string());
  if (found.empty() && files.size() == 1 && files.front() == path) {
    refuse_unreadable(path, "no DICOM");
  }
  if (found.empty()) {
    throw LoadError(path.string() +
                    ": no DICOM series in this folder; name a volume file or another folder");
  }
  const std::vector<Stack> all = all_stacks(found);
  refuse_if_all_unfit(found, all);
  const std::size_t chosen = chosen_stack(path, all, wanted);
  const Stack& stack = all[chosen];
  Note note;
  if (all.size() > 1) {
    note.add("series " + std::to_string(chosen + 1) + " of " + std::to_string(all.size()) + ", " +
             text_of(stack) + " (import --series chooses another)");
  }
  if (const DicomSlice* odd = odd_one(all, stack)) {
    note.add("skipped " + name_of(*odd) + " (of another size or direction)");
  }
  note_unfit(found, stack, note);
  if (stack.slices.size() == 1) {
    throw LoadError(stack.slices.front().file->path.string() +
                    ": one slice; name the folder that holds the whole DICOM series");
  }
  UntrustedHeader claim = whole_claim_of(path, all, stack, note);
  const DicomValues values = values_of(stack.slices);
  for (const DicomSlice& slice : stack.slices) {
    note.add(slice.file->remark);
    if (const auto& padding = slice.file->pixels.padding) {
      note.add("PixelPaddingValue " + number_text(padding->first) + " is read as air");
    }
  }
  note.write(claim);
  claim.kind = values.kind;
  claim.voxel_bytes = static_cast<std::uint32_t>(bytes_of(values.kind));
  const std::span<std::byte> memory = offer(claim);
  const std::size_t bytes = stack.slices.front().file->pixels.cells() * bytes_of(values.kind);
  DicomPixels pixels(values);
  std::span<std::byte> rest = memory;
  for (const DicomSlice& slice : stack.slices) {
    sandbox.at(slice.file->path.string());
    pixels.read(slice, rest.first(bytes));
    rest = rest.subspan(bytes);
  }
  pixels.fill_padding(memory);
}

}  // namespace kerf::volume
