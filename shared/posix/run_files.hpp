// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace kerf {

/// A file that a run writes.
struct OutputFile {
  std::string_view option;     ///< that names it, as a complaint tells it
  std::filesystem::path path;  ///< empty: not asked for
  std::string_view ending;     ///< of its kind, as ".json"; empty: a kind without one
};

/// Whether two names are one file: the same device and inode, or, of files that are not there yet,
/// the same place.
[[nodiscard]] bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// What every program asks before its work. Throws FileError where an output
/// - cannot be written as a NewFile,
/// - ends as files of another kind of kerf's do (a volume, a scene, a recording): a slip of the
///   hand, which would cost that file,
/// - is one of `inputs`, by whatever name, or lies in a folder that is one of them,
/// - or is another output, too.
/// A pipe, a terminal and /dev/null are nobody's file. Makes nothing.
void check_outputs(const std::vector<std::filesystem::path>& inputs,
                   const std::vector<OutputFile>& outputs);

/// The last of these alone, for who asks the others elsewhere.
void check_distinct(const std::vector<OutputFile>& outputs);

}  // namespace kerf
