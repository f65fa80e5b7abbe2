// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "record/check/recording_check.hpp"

namespace kerf {

/// Prints the problems of a recording on standard error, a line each. The exit code: 1 if there are
/// any, else 0.
[[nodiscard]] int report_problems(const CheckedRecording& checked);

/// `kerf record check DIR`: compares all files of a recording and prints what is wrong. With
/// `repair` first makes the manifest anew if that is lost or wrong. Returns the exit code, as
/// above; throws if the folder holds no log of ticks, or cannot be written for a repair.
[[nodiscard]] int run_check(const std::filesystem::path& folder, bool repair);

}  // namespace kerf
