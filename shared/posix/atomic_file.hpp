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

/// Files that belong together and appear together: all are written, none with a name, before the
/// first gets its own. A program that is killed before a commit leaves nothing; in a commit each
/// file is the old or the new one, and the other may be left beside it as NAME.new-PID-N.
///
/// Throws FileError, and then what was there before stays as it was, as does every file that none
/// of this process wrote.
class NewFiles {
 public:
  /// Written to and closed by the caller.
  [[nodiscard]] NewFile& add(const std::filesystem::path& path);
  /// They replace what is there.
  void commit();
  /// They replace nothing: where something is there already, also since a moment ago, that one is
  /// told, and no file appears. Of several that do this with the same names, one gets them.
  [[nodiscard]] std::optional<std::filesystem::path> commit_if_new();

 private:
  struct Named {
    explicit Named(const std::filesystem::path& at) : path(at), file(at) {}
    std::filesystem::path path;
    NewFile file;
  };
  /// Tells the first that `commit` did not, with all taken back.
  template <class Commit>
  [[nodiscard]] const Named* commit_all(Commit commit);

  std::deque<Named> files_;
};

/// A Markdown page to which several programs write, each its own part between two comment lines:
/// `page` with the part `name` replaced by `text`, or with that part at its end where it had none.
[[nodiscard]] std::string with_part(std::string_view page, std::string_view name,
                                    std::string_view text);

/// The same with a file, which may be missing. Throws FileError.
void write_page_part(const std::filesystem::path& file, std::string_view name,
                     std::string_view text);

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
