// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/folder_list.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>
#include <system_error>

namespace kerf {

namespace {

namespace fs = std::filesystem;

// As `kerf volume` reads them; a folder of slices is no file, and is given to ./kerf demo --volume.
constexpr std::array<std::string_view, 9> kVolumes{".nrrd", ".nhdr", ".mha",  ".mhd", ".nii",
                                                   ".gz",   ".tif",  ".tiff", ".dcm"};
constexpr std::string_view kScene = ".toml";
constexpr int kMostLooked = 100'000;  // in a folder of more the rest is left out

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return ending;
}

bool is_volume(const fs::path& file) {
  return std::ranges::find(kVolumes, ending_of(file)) != kVolumes.end();
}

}  // namespace

FolderList list_folder(const fs::path& folder) {
  std::error_code problem;
  FolderList list;
  list.folder = fs::absolute(folder, problem).lexically_normal();
  if (problem) list.folder = folder;
  if (list.folder.filename().empty())
    list.folder = list.folder.parent_path();  // a slash at the end
  if (list.folder.has_parent_path() && list.folder != list.folder.root_path()) {
    list.entries.push_back({"..", true});
  }
  const std::size_t above = list.entries.size();
  fs::directory_iterator at(list.folder, problem);
  int looked = 0;
  for (; !problem && at != fs::directory_iterator() && looked < kMostLooked;
       at.increment(problem), ++looked) {
    const std::string name = at->path().filename().string();
    if (name.starts_with('.')) continue;
    std::error_code unknown;  // a link to nothing is neither
    const bool is_folder = at->is_directory(unknown);
    const bool is_file = at->is_regular_file(unknown);
    const bool opens = ending_of(name) == kScene || is_volume(name);
    if (is_folder || (is_file && opens)) list.entries.push_back({name, is_folder});
  }
  std::sort(list.entries.begin() + static_cast<std::ptrdiff_t>(above), list.entries.end(),
            [](const FolderList::Entry& a, const FolderList::Entry& b) {
              return a.is_folder != b.is_folder ? a.is_folder : a.name < b.name;
            });
  if (problem) {
    list.note = list.folder.string() + ": " + problem.message() + "; choose another folder";
  } else if (list.entries.size() > FolderList::kMost || looked == kMostLooked) {
    const std::size_t all = list.entries.size();
    list.entries.resize(std::min(all, FolderList::kMost));
    list.note = list.folder.string() + ": " + std::to_string(list.entries.size()) + " of " +
                std::to_string(all) + " entries or more; give ./kerf demo the one you want";
  } else if (list.entries.size() == above) {
    list.note = list.folder.string() + ": no scene (.toml) and no volume; choose another folder";
  }
  return list;
}

std::string why_not_open(const fs::path& file) {
  if (is_volume(file)) return {};
  std::ifstream text(file);
  if (!text) return file.string() + ": cannot be read; choose another file";
  constexpr int kMostLines = 100'000;
  std::string line;
  for (int i = 0; i < kMostLines && std::getline(text, line); ++i) {
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin != std::string::npos && line.compare(begin, 10, "[[volume]]") == 0) return {};
  }
  return file.string() + ": no scene, it has no [[volume]]; choose another file";
}

}  // namespace kerf
