// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace kerf {

/// A file that cannot be written; the message is one line: path, reason, way out.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Whether what stands at `path` holds no bytes of its own, as a pipe, a terminal or /dev/null, or
/// is a link to such a thing: it is written to as it stands. So are /dev/stdout and /dev/stderr,
/// also where they lead to a file.
[[nodiscard]] bool is_stream(const std::filesystem::path& path);

/// Opens such a thing for writing, without waiting for the reader of a pipe, now or in a `write`.
/// -1 and errno: ENXIO where nobody reads, ELOOP where it is no stream any more. Creates and cuts
/// nothing.
[[nodiscard]] int open_stream(const std::filesystem::path& path) noexcept;

/// What is told, after its name, of a place that cannot be written for such an errno.
[[nodiscard]] std::string not_written(int error);

/// A file that appears whole or not at all: written without a name, so that nothing is left of it
/// however the program ends; `commit` gives it a temporary name in the same folder, then its own.
/// Without `commit` the destructor removes it, and what was there before stays. Where the file
/// system has only files with names, it has the temporary one from the start. Others may write to
/// the folder: the temporary is a new file or none, and a link that stands at `path` is refused. A
/// stream is written to as it stands.
///
/// Every failure (no folder, no right, disk full) is a FileError that names the final path.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& path);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(const void* data, std::size_t size);
  /// Ends writing, on the disk. Some file systems report a full disk only here.
  void close();
  /// After `close`: gives it the temporary name. A commit does that where nobody did.
  void take_temporary_name();
  /// After `close`. What it replaces keeps the temporary name until the destructor.
  void commit();
  /// The same where nothing is there yet; else false, and `path` stays as it is, whoever made it
  /// and when.
  [[nodiscard]] bool commit_if_new();
  /// After either: what was there before is there again. A file system that cannot swap two names
  /// keeps the new file where there was an old one.
  void take_back() noexcept;

 private:
  /// Sets `temporary_` to the first free name that `take` could take.
  template <class Take>
  void take_name(Take take);
  [[noreturn]] void fail(int error) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;  ///< empty: `path_` is written directly
  int fd_ = -1;
  bool nameless_ = false;
  enum class State { pending, swapped, created, replaced };
  State state_ = State::pending;
};

/// Throws now what a NewFile at `path` would throw later, but that nobody reads a pipe; leaves
/// nothing behind. For long runs.
void check_new_file(const std::filesystem::path& path);

/// Throws FileError where `folder` is something else or cannot be made or written; makes nothing.
void check_new_folder(const std::filesystem::path& folder);

/// All of `bytes` as one new file.
void write_new_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace kerf
