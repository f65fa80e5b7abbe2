// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

// Files that appear whole or not at all, checks before a run, and sections of a page.

namespace kerf {

/// A file that cannot be written; the message is one line: path, reason, remedy.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The extension of a file in lower case, with its dot; empty if it has none.
[[nodiscard]] std::string ending_of(const std::filesystem::path& path);

/// The bytes of a file; none if it cannot be read, or is a pipe or device, which might block. Reads
/// in blocks: byte by byte, a file of 60 MB would take five seconds under a sanitizer.
[[nodiscard]] std::string text_in(const std::filesystem::path& path);

/// Whether `path` is a stream: a pipe, a terminal, /dev/null or a link to one of these. Streams are
/// written directly. So are /dev/stdout and /dev/stderr, even if they lead to a file.
[[nodiscard]] bool is_stream(const std::filesystem::path& path);

/// Opens a stream for writing without waiting for the reader of a pipe, now or in a `write`.
/// Returns -1 and sets errno: ENXIO if no process reads it, ELOOP if it is no stream any more.
/// Creates and truncates nothing.
[[nodiscard]] int open_stream(const std::filesystem::path& path) noexcept;

/// The message, to follow its name, for a path that cannot be written because of `error`.
[[nodiscard]] std::string not_written(int error);

/// A file that appears whole or not at all. It is written without a name, so that nothing is left
/// of it however the program ends; `commit` gives it a temporary name in the same folder, then its
/// own. Without `commit` the destructor removes it, and the old file stays. If the file system has
/// only named files, it has the temporary name from the start. Other users may write to the folder:
/// the temporary file is always a new one, and a link at `path` is refused. A stream is written
/// directly.
///
/// Every failure (no folder, no right, disk full) is a FileError that names the final path.
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, std::size_t size);
  /// Where a library that opens files by name writes it, before `close`: in /proc while it has no
  /// name. Not of a stream.
  [[nodiscard]] std::filesystem::path open_path() const;
  /// Ends writing, on the disk. Some file systems report a full disk only here.
  void close();
  /// After `close`: gives it the temporary name. `commit` does that if the caller has not.
  void take_temporary_name();
  /// After `close`. The file that it replaces keeps the temporary name until the destructor.
  void commit();
  /// Commits if nothing is at `path` yet; else returns false and leaves `path` unchanged.
  [[nodiscard]] bool commit_if_new();
  /// After either: restores the old state. A file system that cannot swap two names keeps the new
  /// file if it replaced an old one.
  void roll_back() noexcept;

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

/// Throws now what a AtomicFile at `path` would throw later, except for a pipe without a reader;
/// leaves nothing behind. For long runs.
void check_new_file(const std::filesystem::path& path);

/// Throws FileError if `folder` is no folder, or cannot be made or written; makes nothing.
void check_new_folder(const std::filesystem::path& folder);

/// All of `bytes` as one new file.
void write_new_file(const std::filesystem::path& path, std::string_view bytes);

/// Files that appear together: all are written, without names, before the first gets its own. A
/// program that is killed before a commit leaves nothing; if it is killed in a commit, each file is
/// the old or the new one, and the other may be left beside it as NAME.new-PID-N.
///
/// Throws FileError; then the old files stay, and so does every file of another process.
class AtomicFiles {
 public:
  /// The caller writes and closes the file.
  [[nodiscard]] AtomicFile& add(const std::filesystem::path& path);
  /// Replaces the old files.
  void commit();
  /// Replaces nothing: if one of the names exists, even since a moment ago, returns it, and no file
  /// appears. If several processes do this with the same names, one of them gets the names.
  [[nodiscard]] std::optional<std::filesystem::path> commit_if_new();

 private:
  struct Named {
    explicit Named(const std::filesystem::path& at) : path(at), file(at) {}
    std::filesystem::path path;
    AtomicFile file;
  };
  /// Returns the first file that `commit` refused, after undoing the others; null if all succeeded.
  template <class Commit>
  [[nodiscard]] const Named* commit_all(Commit commit);

  std::deque<Named> files_;
};

/// For a Markdown page to which several programs write, each its own part between two comment
/// lines: returns `page` with the part `name` replaced by `text`, or appended if it has no such
/// part.
[[nodiscard]] std::string with_part(std::string_view page, std::string_view name,
                                    std::string_view text);

/// Writes the part into the page in `file`, which may be missing. Throws FileError.
void write_page_part(const std::filesystem::path& file, std::string_view name,
                     std::string_view text);

/// A file that a run writes.
struct OutputFile {
  std::string_view option;     ///< that names it, for messages
  std::filesystem::path path;  ///< empty: not wanted
  std::string_view ending;     ///< of its kind, as ".json"; empty: a kind without one
};

/// Whether two names are one file: the same device and inode or, for files that do not exist yet,
/// the same path.
[[nodiscard]] bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// The check of every program before its work. Throws FileError if an output
/// - cannot be written as a AtomicFile,
/// - has the ending of another kind of file (a volume, a scene, a recording): most likely a slip,
///   which would overwrite that file,
/// - is one of `inputs`, by whatever name, or lies in a folder that is one of them,
/// - or is another output, too.
/// A pipe, a terminal and /dev/null count as no file. Makes nothing.
void check_outputs(const std::vector<std::filesystem::path>& inputs,
                   const std::vector<OutputFile>& outputs);

/// The last of these checks alone.
void check_distinct(const std::vector<OutputFile>& outputs);

}  // namespace kerf
