// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/run_files.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <system_error>

#include "shared/posix/new_file.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

/// Of the files that kerf reads and writes.
constexpr std::string_view kEndings[] = {
    ".nrrd", ".nhdr", ".mha", ".mhd", ".nii", ".gz",  ".tif", ".tiff", ".dcm", ".raw", ".toml",
    ".json", ".npy",  ".npz", ".csv", ".svg", ".png", ".md",  ".stl",  ".ply", ".y4m", ".pem"};

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](char c) {
    return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return ending;
}

fs::path place_of(const fs::path& path) {
  std::error_code fault;
  const fs::path place = fs::weakly_canonical(fs::absolute(path), fault);
  return fault ? path.lexically_normal() : place;
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  std::error_code fault;
  if (!fs::is_directory(folder, fault)) return false;
  const fs::path place = place_of(path);
  const fs::path above = place_of(folder);
  return std::ranges::mismatch(above, place).in1 == above.end();
}

void refuse_ending(const OutputFile& output) {
  const std::string ending = ending_of(output.path);
  if (ending == output.ending || std::ranges::find(kEndings, ending) == std::end(kEndings)) return;
  const std::string way_out = output.ending.empty()
                                  ? "; give a name without an ending"
                                  : "; let it end in " + std::string(output.ending);
  throw FileError(output.path.string() + ": " + std::string(output.option) + " writes no " +
                  ending + way_out);
}

void refuse_input(const OutputFile& output, const fs::path& input) {
  if (is_same_file(output.path, input)) {
    throw FileError(output.path.string() +
                    ": is a file of this run itself, which would be lost; give " +
                    std::string(output.option) + " another name");
  }
  if (lies_in(output.path, input)) {
    throw FileError(output.path.string() + ": would lie among the files of " + input.string() +
                    ", which are read; name a place outside with " + std::string(output.option));
  }
}

}  // namespace

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code fault;
  if (fs::equivalent(a, b, fault) && !fault) return true;
  return place_of(a) == place_of(b);
}

void check_outputs(const std::vector<fs::path>& inputs, const std::vector<OutputFile>& outputs) {
  for (const OutputFile& output : outputs) {
    if (output.path.empty()) continue;
    if (output.path == "-") {
      throw FileError("-: " + std::string(output.option) +
                      " would make a file of that name; give /dev/stdout for standard output");
    }
    if (!is_stream(output.path)) {
      refuse_ending(output);
      for (const fs::path& input : inputs) {
        if (!input.empty()) refuse_input(output, input);
      }
    }
    check_new_file(output.path);
  }
  check_distinct(outputs);
}

void check_distinct(const std::vector<OutputFile>& outputs) {
  for (const OutputFile& output : outputs) {
    if (output.path.empty() || is_stream(output.path)) continue;
    for (const OutputFile& other : outputs) {
      if (&other == &output) break;
      if (other.path.empty() || !is_same_file(output.path, other.path)) continue;
      throw FileError(std::string(output.option) + " " + output.path.string() + ": " +
                      std::string(other.option) +
                      " writes there, too; give each a file of its own");
    }
  }
}

}  // namespace kerf
