// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include <sys/types.h>

// Foreign files are parsed in a child process without rights: both ends of the channel, and the
// memory that they share.

namespace kerf {

/// Memory of an unnamed file, mapped for reading and writing; unmapped with the object. Load time.
class SharedBytes {
 public:
  SharedBytes() = default;
  /// Maps the first `size` bytes of `file`, which may be closed then; throws std::bad_alloc.
  SharedBytes(int file, std::size_t size);
  SharedBytes(SharedBytes&& other) noexcept;
  SharedBytes& operator=(SharedBytes&& other) noexcept;
  ~SharedBytes();

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  /// The memory is kept until the process ends.
  std::span<std::byte> release() noexcept;

 private:
  std::span<std::byte> bytes_;
};

/// The messages of a reader, one packet each: this byte, then the content that the comment names.
/// The parent answers an offer with the agreed size, once the memory has it.
enum class SandboxWord : std::uint8_t {
  at,         ///< the file that is read now
  offer,      ///< a header
  done,       ///< nothing; last
  refused,    ///< one line; last
  no_memory,  ///< nothing; last
};
inline constexpr std::size_t kLongestSandboxWord = 4096;  ///< bytes of a packet

/// The end of the channel in the child: hands over what a reader of foreign bytes has read.
class SandboxReader {
 public:
  SandboxReader(int channel, int memory) : channel_(channel), memory_(memory) {}

  /// Names the file that is read now, one of several. The message of a crash names it.
  void at(const std::string& location) { say(SandboxWord::at, location); }

  /// Sends `header`, of less than kLongestSandboxWord bytes, and returns the memory that the parent
  /// accepted for it, all zeros. Once. Does not return if the parent refuses.
  [[nodiscard]] std::span<std::byte> offer(std::span<const std::byte> header);

  /// Sends one packet; `text` is cut to its size. If that fails, the process ends.
  void say(SandboxWord word, std::string_view text = {});

 private:
  int channel_, memory_;
};

inline constexpr int kReadCpuSeconds = 60, kMostReadCpuSeconds = 86400;

/// One foreign file that is to be read.
struct SandboxJob {
  std::string location;  ///< begins every complaint: the file
  std::string kind;      ///< the expected kind, for complaints: NRRD
  /// Largest file that a reader holds as a whole before it knows the content.
  std::uint64_t file_bytes = 0;
  int cpu_s = kReadCpuSeconds;
};

/// Memory that every reader may take; most of it is for tables of the libraries.
inline constexpr std::uint64_t kSandboxBytes = std::uint64_t{64} << 20;

/// Runs `read` in a child process without rights (`drop_rights`), and returns the memory that it
/// filled. The libraries that parse foreign files have faults that a broken or hostile file finds;
/// the sandbox confines them.
///
/// `read` makes one offer. `accept` gets its header in the parent, and refuses it with a LoadError
/// or returns the number of bytes to grant; it must trust no byte of it, nor the caller any byte of
/// the memory. Both processes map the same pages, so nothing is copied; when this returns, the
/// child has ended and no other process maps them. The child may take kSandboxBytes and two times
/// `file_bytes` before the offer is accepted, then twice the accepted bytes more: the memory itself
/// and a copy of a library.
///
/// After 2 s a progress bar is shown on stderr, if that is a terminal.
///
/// Throws LoadError, one line: the error that `read` or `accept` threw; a signal that ended the
/// child (a crash); more memory or CPU time than allowed; `cpu_s` seconds without any work; an end
/// that the process was asked for meanwhile (`stop_requested`). Load time; any thread.
[[nodiscard]] SharedBytes read_in_sandbox(
    const SandboxJob& job, const std::function<void(SandboxReader&)>& read,
    const std::function<std::size_t(std::span<const std::byte>)>& accept);

/// The files that a process in the sandbox begins with, beside /dev/null as its standard three.
inline constexpr int kSandboxChannel = 3, kSandboxMemory = 4;

/// For a fresh child process of `parent`, once: it ends with its parent; no signal of a terminal
/// ends it, and every other has its default; of the files that it inherited it keeps `channel` and
/// `memory`, by the numbers above. Throws std::runtime_error, one line, with `channel` still open.
void drop_inheritance(pid_t parent, int channel, int memory);

/// Gives up all rights but to read, to decode and to speak on kSandboxChannel: a filter of system
/// calls in which all others fail with EPERM, no new privileges, no core, no file of any size, so
/// much memory beyond what the process has now, so much CPU time (SIGXCPU then). Cannot be undone;
/// only another process can raise the limit of memory (`raise_memory`).
///
/// Throws std::runtime_error, one line.
void drop_rights(std::uint64_t memory_bytes, int cpu_s);

/// Lets the process `child`, which dropped its rights, take so many bytes more.
void raise_memory(pid_t child, std::uint64_t bytes) noexcept;

}  // namespace kerf
