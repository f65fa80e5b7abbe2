// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "controller/sandbox/sandbox_reader.hpp"
#include "controller/sandbox/shared_bytes.hpp"

namespace kerf {

inline constexpr int kReadCpuSeconds = 60, kMostReadCpuSeconds = 86400;

/// One foreign file that is to be read.
struct SandboxJob {
  std::string place;  ///< begins every complaint: the file
  std::string kind;   ///< what it should be, for complaints: NRRD
  /// Largest file that a reader holds as a whole before it knows what is in it.
  std::uint64_t file_bytes = 0;
  int cpu_s = kReadCpuSeconds;
};

/// Memory that every reader may take; most of it is for the libraries' tables.
inline constexpr std::uint64_t kSandboxBytes = std::uint64_t{64} << 20;

/// Runs `read` in a child process without rights (`drop_rights`), and gives the memory that it
/// filled. The libraries that parse foreign files have faults that a broken or hostile file finds;
/// whatever happens there stays there.
///
/// `read` makes one offer. `accept` gets its header on this side, refuses it with a SceneError, or
/// says how many bytes of memory it is worth; it must take every byte for a lie, as must the caller
/// with every byte of the memory. Both sides see the same pages, so nothing is copied; when this
/// returns, the child has ended and nobody else sees them. The child may take kSandboxBytes and two
/// times `file_bytes` before the offer is accepted, then twice the accepted bytes more: the memory
/// itself and a copy of a library.
///
/// A progress bar stands on stderr while it takes more than 2 s, where that is a terminal.
///
/// Throws SceneError, one line: what `read` or `accept` threw; a signal that ended the child (a
/// crash); more memory or CPU time than allowed; `cpu_s` seconds without any work; an end that the
/// process was asked for meanwhile (`stop_requested`). Load time; any thread.
[[nodiscard]] SharedBytes read_in_sandbox(
    const SandboxJob& job, const std::function<void(SandboxReader&)>& read,
    const std::function<std::size_t(std::span<const std::byte>)>& accept);

}  // namespace kerf
