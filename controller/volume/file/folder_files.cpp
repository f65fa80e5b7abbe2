// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/folder_files.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/header_fields.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

/// Runs of digits count as numbers.
bool in_natural_order(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto number = [&](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t first = at;
      while (at < text.size() && digit(text[at])) ++at;
      return text.substr(first, at - first);
    };
    const std::string x = number(a, i), y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

/// Whether there is a file to read: a regular one, or one that is lost, as a link to a file that is
/// gone, which its reader refuses by name.
bool is_file(const fs::directory_entry& entry) {
  std::error_code fault;
  const fs::file_type type = entry.status(fault).type();
  return type == fs::file_type::regular || type == fs::file_type::not_found ||
         type == fs::file_type::none;
}

/// The files of a folder and of those below, in the order of their names.
std::vector<fs::path> all_files(const fs::path& folder, std::string& note) {
  constexpr std::size_t kMostFiles = 20000;
  std::vector<fs::path> files;
  std::error_code fault;
  fs::path listed = folder;  // the one that is opened next
  for (fs::recursive_directory_iterator entry(folder, fault), end; !fault && entry != end;
       entry.increment(fault)) {
    listed = entry->path();
    const std::string name = listed.filename().string();
    const bool hidden = name.starts_with('.');  // such as those of macOS beside each file
    std::error_code gone;
    if (hidden || (entry.depth() >= kDeepest && entry->is_directory(gone))) {
      entry.disable_recursion_pending();
      if (!hidden) note = "folders more than 5 levels below are not searched";
    }
    if (hidden || lower(name) == "dicomdir" || !is_file(*entry)) continue;
    files.push_back(listed);
    if (files.size() > kMostFiles) {
      throw LoadError(folder.string() + ": more than " + std::to_string(kMostFiles) +
                      " files; name the folder that holds the slices");
    }
  }
  if (fault) {
    throw LoadError(listed.string() + ": cannot be listed (" + fault.message() +
                    "); check its permissions");
  }
  std::ranges::sort(files, in_natural_order, [](const fs::path& file) { return file.string(); });
  return files;
}

enum Family : std::size_t { dicom, png, tiff, other };
constexpr std::array<const char*, 3> kNames{"DICOM", "PNG", "TIFF"};

Family family_of(const fs::path& file) {
  const std::string end = lower(file.extension().string());
  if (end == ".png") return png;
  if (end == ".tif" || end == ".tiff") return tiff;
  return end == ".dcm" || begins_as_dicom(file) ? dicom : other;
}

using Families = std::array<std::vector<fs::path>, 3>;

/// The most usual one. Refuses another of half as many files or more, but for pictures of two
/// kinds, which their reader refuses.
Family usual_family(const fs::path& folder, const Families& found) {
  const auto most = static_cast<Family>(
      std::ranges::max_element(found, {}, &std::vector<fs::path>::size) - found.begin());
  const auto text = [&](Family family) {
    return std::to_string(found[family].size()) + " " + kNames[family] + " (such as " +
           found[family].front().filename().string() + ")";
  };
  for (const Family rest : {dicom, png, tiff}) {
    const bool pictures = rest != dicom && most != dicom;
    if (rest == most || pictures || 2 * found[rest].size() < found[most].size()) continue;
    if (found[rest].empty()) continue;
    throw LoadError(folder.string() + ": holds " + text(most) + " and " + text(rest) +
                    "; keep one volume per folder, or name the folder of one");
  }
  return most;
}

}  // namespace

bool begins_as_dicom(const fs::path& file) {
  constexpr std::size_t kPreamble = 128;
  std::array<char, kPreamble + 4> bytes{};
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), bytes.size());
  if (std::string_view(bytes.data() + kPreamble, 4) == "DICM") return true;
  const bool group = bytes[0] == 2 || bytes[0] == 8;
  return in.gcount() >= 8 && group && bytes[1] == 0 && bytes[3] == 0;
}

FolderFiles files_of_volume(const fs::path& folder) {
  FolderFiles volume;
  const std::vector<fs::path> files = all_files(folder, volume.note);
  const fs::path top = folder.has_filename() ? folder : folder.parent_path();
  Families here, all;
  std::vector<Family> families;
  for (const fs::path& file : files) {
    families.push_back(family_of(file));
    if (families.back() == other) continue;
    all[families.back()].push_back(file);
    if (file.parent_path() == top) here[families.back()].push_back(file);
  }
  const bool chosen_here = !here[dicom].empty() || here[png].size() > 1 || here[tiff].size() > 1;
  const Family family = usual_family(folder, chosen_here ? here : all);
  constexpr std::array kKinds{VolumeKind::dicom_series, VolumeKind::png_stack,
                              VolumeKind::tiff_stack};
  volume.kind = kKinds[family];
  volume.name = kNames[family];
  std::vector<fs::path> left;  // images
  for (std::size_t i = 0; i < files.size(); ++i) {
    const bool picture = families[i] == png || families[i] == tiff;
    const bool is_read = family == dicom
                             ? !picture  // what is no image, the reader leaves out
                             : picture && (!chosen_here || files[i].parent_path() == top);
    if (is_read) {
      volume.files.push_back(files[i]);
    } else if (families[i] != other) {
      left.push_back(files[i]);
    }
  }
  if (!left.empty()) {
    volume.note += (volume.note.empty() ? "" : "; ") + std::to_string(left.size()) +
                   (left.size() == 1 ? " image of another kind or folder is not read, "
                                     : " images of another kind or folder are not read, such as ") +
                   left.front().lexically_relative(folder).string();
  }
  return volume;
}

}  // namespace kerf::volume
