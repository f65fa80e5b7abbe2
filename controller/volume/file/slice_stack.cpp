// SPDX-License-Identifier: Apache-2.0
// A folder of PNG or TIFF slices as one volume, in the order of the numbers in their names.
#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

bool is_digit(char c) {
  return '0' <= c && c <= '9';
}

/// A name as its groups of digits and the text around them.
struct SliceName {
  std::string text;  ///< with the folder; a zero byte, which no name has, for each group
  std::vector<std::string> groups;

  explicit SliceName(const fs::path& file) : text(file.parent_path().string() + '/') {
    bool in_group = false;
    for (const char c : file.stem().string()) {
      if (!is_digit(c)) {
        text += c;
      } else if (in_group) {
        groups.back() += c;
      } else {
        text += '\0';
        groups.emplace_back(1, c);
      }
      in_group = is_digit(c);
    }
  }
};

/// The text of most names; of equally many that which comes first.
std::string usual_text(const std::vector<SliceName>& names) {
  std::map<std::string, std::size_t> count;
  for (const SliceName& name : names) ++count[name.text];
  const auto most =
      std::ranges::max_element(names, {}, [&](const SliceName& name) { return count[name.text]; });
  return most->text;
}

[[noreturn]] void refuse_stranger(const fs::path& file, const fs::path& slice) {
  throw LoadError(file.string() + ": is no slice of the stack of " + slice.filename().string() +
                  "; keep one stack of slices, and no other picture, in a folder");
}

/// The last group that differs between names of one text, which have one or more.
std::size_t counting_group(const std::vector<SliceName>& names) {
  const std::vector<std::string>& first = names.front().groups;
  for (std::size_t g = first.size(); g-- > 0;) {
    const auto differs = [&](const SliceName& name) { return name.groups[g] != first[g]; };
    if (std::ranges::any_of(names, differs)) return g;
  }
  return first.size() - 1;
}

std::int64_t number_of(const fs::path& file, const std::string& digits) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error == std::errc{} && end == digits.data() + digits.size()) return number;
  throw LoadError(file.string() + ": " + digits + " is no number of a slice; renumber the stack");
}

/// The step between most slices, the smallest of equally many.
std::int64_t usual_step(const std::vector<std::int64_t>& numbers) {
  std::map<std::int64_t, std::size_t> count;
  for (std::size_t i = 1; i < numbers.size(); ++i) ++count[numbers[i] - numbers[i - 1]];
  return std::ranges::max_element(count, {}, [](const auto& row) { return row.second; })->first;
}

/// The name of `file` with another number, as long as its own.
std::string renumbered(const fs::path& file, const std::string& digits, std::int64_t number) {
  std::string name = file.filename().string();
  std::string text = std::to_string(number);
  if (text.size() < digits.size()) text.insert(0, digits.size() - text.size(), '0');
  return name.replace(name.rfind(digits), digits.size(), text);
}

/// Refuses files that are not one whole stack of slices by their names: pictures of two stacks, two
/// slices of one number, a missing slice. The last group of digits that differs between the names
/// counts the slices; its steps are even, of 1 or more. `files`: in the order of their numbers, two
/// or more.
///
/// Throws LoadError that names the slice.
void check_slice_names(std::span<const fs::path> files) {
  std::vector<SliceName> names(files.begin(), files.end());
  const std::string usual = usual_text(names);
  const auto own =
      static_cast<std::size_t>(std::ranges::find(names, usual, &SliceName::text) - names.begin());
  if (names[own].groups.empty()) {
    throw LoadError(files[own].string() +
                    ": has no number in its name; number the slices of the stack");
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (names[i].text != usual) refuse_stranger(files[i], files[own]);
  }
  const std::size_t group = counting_group(names);

  std::vector<std::int64_t> numbers;
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::vector<std::string>& groups = names[i].groups;
    numbers.push_back(number_of(files[i], groups[group]));
    for (std::size_t g = 0; g < group; ++g) {
      if (groups[g] != names.front().groups[g]) refuse_stranger(files[i], files.front());
    }
  }
  const std::int64_t step = usual_step(numbers);
  for (std::size_t i = 1; i < files.size(); ++i) {
    const std::string before = files[i - 1].filename().string();
    const std::int64_t apart = numbers[i] - numbers[i - 1];
    if (apart == 0) {
      throw LoadError(files[i].string() + ": has the same number as " + before +
                      "; keep one of them");
    }
    if (apart == step) continue;
    const std::string missing =
        renumbered(files[i - 1], names[i - 1].groups[group], numbers[i - 1] + step);
    throw LoadError(files[i].string() + ": follows " + before + ", " +
                    (apart > step ? missing + " is missing; add it, or"
                                  : "where steps of " + std::to_string(step) + " are usual;") +
                    " number the slices in even steps");
  }
}

/// The files of the kind; refuses those of the other kind, which belong to another stack.
std::vector<fs::path> pictures_among(const std::vector<fs::path>& files, VolumeKind kind) {
  std::vector<fs::path> pictures;
  for (const fs::path& file : files) {
    const std::string end = lower(file.extension().string());
    const bool png = end == ".png", tiff = end == ".tif" || end == ".tiff";
    if (!png && !tiff) continue;
    if (png != (kind == VolumeKind::png_stack)) {
      throw LoadError(file.string() + (png ? ": a PNG among TIFF" : ": a TIFF among PNG") +
                      " slices; keep one stack of slices per folder");
    }
    pictures.push_back(file);
  }
  return pictures;
}

/// Reads one picture of a stack.
void read_picture(const fs::path& file, VolumeKind kind, const SliceMemory& memory) {
  if (kind == VolumeKind::png_stack) return read_png_slice(file, memory);
  read_tiff_slices(file, [&](const Slices& found) {
    if (found.size[2] == 1) return memory(found);
    kerf::refuse(file.string(),
                 ": " + std::to_string(found.size[2]) +
                     " pages; a stack is one picture in each file, name this file alone");
  });
}

/// Refuses a picture of another size, type or meaning than the first.
void check_equal(const fs::path& file, const Slices& own, const fs::path& first_file,
                 const Slices& first) {
  const auto text = [](const auto& numbers) {
    return short_text(static_cast<double>(numbers[0])) + " x " +
           short_text(static_cast<double>(numbers[1]));
  };
  const auto differ = [&](const std::string& one, const std::string& other,
                          const std::string& way_out) {
    kerf::refuse(file.string(), ": " + one + ", and " + first_file.filename().string() + " has " +
                                    other + "; " + way_out);
  };
  if (own.size != first.size) {
    differ(text(own.size) + " pixels", text(first.size), "keep one stack of slices per folder");
  }
  if (own.type != first.type) {
    const auto word = [](const Slices& of) {
      return std::string(kVoxelTypeWords[static_cast<std::size_t>(of.type)]);
    };
    differ("values of " + word(own), word(first), "save all slices with values of one type");
  }
  if (own.scaling != first.scaling || own.spacing_known != first.spacing_known ||
      own.spacing_mm != first.spacing_mm) {
    const auto words = [&](const Slices& of) {
      return text(of.spacing_mm) + " mm, values times " + short_text(of.scaling.slope) + " plus " +
             short_text(of.scaling.intercept);
    };
    differ("a calibration of " + words(own), words(first), "calibrate all slices alike");
  }
}

}  // namespace

void read_slice_stack(const fs::path& folder, const std::vector<fs::path>& beside, VolumeKind kind,
                      SandboxReader& sandbox, const MemoryRequest& offer) {
  const std::vector<fs::path> files = pictures_among(beside, kind);
  if (files.size() < 2) {
    throw LoadError(folder.string() + ": one picture; name a folder that holds all slices");
  }
  check_slice_names(files);
  Slices first;
  for (const fs::path& file : files) {
    sandbox.at(file.string());
    read_picture(file, kind, [&](const Slices& own) {
      if (file == files.front()) first = own;
      check_equal(file, own, files.front(), first);
      return std::span<std::byte>{};
    });
  }
  UntrustedHeader claim;
  claim.size = {first.size[0], first.size[1], static_cast<std::int64_t>(files.size())};
  claim.kind = kind_of(first.type, first.scaling);
  claim.voxel_bytes = static_cast<std::uint32_t>(bytes_of(claim.kind));
  claim.spacing_mm = {first.spacing_mm[0], first.spacing_mm[1], 1};
  claim.spacing_known = first.spacing_known & 0b011;  // none between files
  claim.axes = kSliceAxes;
  claim.axes_known = 0;
  add_note(claim, "slices in the order of the numbers in their names, " +
                      files.front().filename().string() + " first");
  if (!first.note.empty()) add_note(claim, first.note);

  sandbox.at(folder.string());
  std::span<std::byte> rest = offer(claim);
  const auto pixels = static_cast<std::size_t>(claim.size[0] * claim.size[1]);
  std::vector<std::byte> own(pixels * bytes_of(first.type));
  for (const fs::path& file : files) {
    sandbox.at(file.string());
    read_picture(file, kind, [&](const Slices& found) {
      check_equal(file, found, files.front(), first);
      return std::span(own);
    });
    convert_values(first.type, own, claim.kind, rest, first.scaling);
    rest = rest.subspan(pixels * claim.voxel_bytes);
  }
}

}  // namespace kerf::volume
