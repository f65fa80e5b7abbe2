// SPDX-License-Identifier: Apache-2.0
// The frames of DICOM files as series, and one of these as a volume.

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <iterator>
#include <list>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <gdcmTrace.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/dicom_header.hpp"
#include "controller/volume/file/dicom_pixels.hpp"
#include "controller/volume/file/dicom_stack.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

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
      part = {whole.number, whole.series, whole.name, whole.part, whole.order, {}, {}};
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
constexpr std::string_view kSureMarks[] = {"PatientID",
                                           "StudyInstanceUID",
                                           "FrameOfReferenceUID",
                                           "TemporalPositionIndex",
                                           "TemporalPositionIdentifier",
                                           "EchoNumbers",
                                           "EffectiveEchoTime",
                                           "ReferencedSegmentNumber",
                                           "DiffusionBValue",
                                           kStackMark};

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
/// leave one slice at each position. As one, if there are none such. Stacks are parts of space
/// (PS3.3 C.7.6.16.2.2), not other acquisitions: they stay one volume if they form a regular grid.
std::vector<Stack> split(const Stack& whole, int marks_left = 3) {
  const bool twice = doubled(whole) != 0;
  for (const auto& [mark, text] : whole.slices.front().frame->marks) {
    const bool sure = std::ranges::find(kSureMarks, mark) != std::end(kSureMarks);
    if (marks_left == 0 || (!twice && !sure)) continue;
    const std::vector<Stack> parts = parts_by(whole, mark);
    const bool stacks =
        std::ranges::all_of(parts, [](const Stack& part) { return part.slices.size() > 1; });
    if (parts.size() < 2 || !stacks || (!twice && !overlap(parts))) continue;
    if (mark == kStackMark && !twice && is_regular(whole)) continue;
    std::vector<Stack> all;
    bool clean = true;
    for (const Stack& part : parts) {
      if (!clean) break;
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
        constexpr std::size_t kMostDirections = 1000;
        if (stacks.size() == kMostDirections) {
          throw LoadError(file.path.string() + ": the slices of its series have more than " +
                          std::to_string(kMostDirections) +
                          " sizes or directions; name a file or folder of one stack");
        }
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
  const std::string found = path.string() + ": " + std::to_string(all.size()) + " DICOM series";
  std::string list;
  std::size_t named = 0, left = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    constexpr std::size_t kMostNamed = 20;
    if (all[i].slices.size() == 1 || named == kMostNamed) {
      ++left;
    } else {
      list += (named++ == 0 ? " " : ", ") + std::to_string(i + 1) + " " + text_of(all[i]);
    }
  }
  if (named == 0) throw LoadError(found + " of one slice each; name a folder of a whole series");
  if (left > 0) list += ", and " + std::to_string(left) + " others";
  if (std::ranges::any_of(
          fit, [&](std::size_t i) { return all[i].part.find(kStackMark) != std::string::npos; })) {
    list += "; the stacks of a series form no regular grid together";
  }
  throw LoadError(
      found + (wanted.empty() ? "" : ", and --series " + one_line(wanted) + " is not one of them") +
      "; choose one with ./kerf volume import --series:" + list);
}

[[noreturn]] void refuse_unfit(const DicomFile& file) {
  throw LoadError(file.path.string() + ": " + file.unfit + "; " + file.way_out);
}

/// Whether a file that names no series lies beside slices of this one: it may be one of them.
bool may_belong(const DicomFile& file, const Stack& stack) {
  return file.series.empty() && !file.is_index &&
         std::ranges::any_of(stack.slices, [&](const DicomSlice& slice) {
           return slice.file->path.parent_path() == file.path.parent_path();
         });
}

/// Refuses an unreadable slice of the series; names the other files that are left out.
void note_unfit(const std::list<DicomFile>& files, const Stack& stack, Note& note) {
  constexpr std::size_t kMostNamed = 3;
  std::vector<const DicomFile*> unfit;
  for (const DicomFile& file : files) {
    if (file.unfit.empty()) continue;
    if (file.is_slice && file.series == stack.series) refuse_unfit(file);
    if (may_belong(file, stack)) {
      throw LoadError(file.path.string() + ": " + file.unfit +
                      ", and may be a slice of this series; " + file.way_out + ", or remove it");
    }
    unfit.push_back(&file);
  }
  for (std::size_t i = 0; i < std::min(unfit.size(), kMostNamed); ++i) {
    note.add("skipped " + unfit[i]->path.filename().string() + " (" + unfit[i]->unfit + ")");
  }
  if (unfit.size() > kMostNamed) {
    note.add("skipped " + std::to_string(unfit.size() - kMostNamed) + " more such files");
  }
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

/// Refuses slices of two bodies, studies or frames of reference: positions are comparable within
/// one (PS3.3 C.7.4.1.1.1). A slice that does not name its own may be of any.
void check_one_body(const Stack& stack) {
  for (const char* mark : {"PatientID", "StudyInstanceUID", "FrameOfReferenceUID"}) {
    const DicomSlice* named = nullptr;
    for (const DicomSlice& slice : stack.slices) {
      const std::string own = mark_of(slice, mark);
      if (own.empty()) continue;
      if (named == nullptr) named = &slice;
      if (own == mark_of(*named, mark)) continue;
      throw LoadError(slice.file->path.string() + ": " + mark + ' ' + one_line(own) + ", and " +
                      name_of(*named) + " of the same series has " +
                      one_line(mark_of(*named, mark)) + "; keep one of them in a folder");
    }
  }
}

/// Names what the values depend on and the slices do not share: two acquisitions that alternate in
/// space look like one volume.
void note_mixed(const Stack& stack, Note& note) {
  for (const char* mark :
       {"EchoTime", "CT FrameType", "MR FrameType", "ImageType", "ConvolutionKernel", "KVP"}) {
    std::set<std::string> texts;
    for (const DicomSlice& slice : stack.slices) texts.insert(mark_of(slice, mark));
    if (texts.size() < 2) continue;
    const auto shown = [](const std::string& text) {
      return text.empty() ? "none" : one_line(text);
    };
    note.add("its slices differ in " + std::string(mark) + " (" + shown(*texts.begin()) + ", " +
             shown(*std::next(texts.begin())) + (texts.size() > 2 ? ", ..." : "") + ")");
  }
}

/// Names stacks (PS3.3 C.7.6.16.2.2) that were joined to one grid.
void note_joined(const Stack& stack, Note& note) {
  std::set<std::string> stacks;
  for (const DicomSlice& slice : stack.slices) stacks.insert(mark_of(slice, kStackMark));
  if (stacks.size() < 2) return;
  note.add("joined of " + std::to_string(stacks.size()) + " stacks (" + kStackMark +
           "), whose slices form one regular grid");
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
    if (is_unfit(file) && file.is_slice) refuse_unfit(file);
  }
  const auto any = std::ranges::find_if(files, is_unfit);
  if (all.empty() && any != files.end()) refuse_unfit(*any);
}

}  // namespace

void read_dicom(const fs::path& path, const std::vector<fs::path>& files, const std::string& wanted,
                SandboxReader& sandbox, const MemoryRequest& offer) {
  // GDCM prints to both; the process ends with this volume.
  std::cerr.rdbuf(nullptr);
  std::cout.rdbuf(nullptr);
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
  check_one_body(stack);
  note_mixed(stack, note);
  note_joined(stack, note);
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
