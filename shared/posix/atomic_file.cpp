// SPDX-License-Identifier: Apache-2.0

#include "shared/posix/atomic_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/text/text.hpp"

namespace kerf {

namespace fs = std::filesystem;

namespace {

/// The path in /proc of an open file, by which it can be linked to a name.
std::string open_file(int fd) {
  return "/proc/self/fd/" + std::to_string(fd);
}

/// The descriptor behind /dev/stdout and similar paths; negative if none. It may lead to a file (as
/// with `>`).
int own_descriptor(const fs::path& path) noexcept {
  if (path == "/dev/stdout") return STDOUT_FILENO;
  if (path == "/dev/stderr") return STDERR_FILENO;
  return -1;
}

/// Of the files that kerf reads and writes.
constexpr std::string_view kEndings[] = {".nrrd", ".nhdr", ".mha", ".mhd", ".nii",  ".gz",
                                         ".tif",  ".tiff", ".dcm", ".raw", ".toml", ".json",
                                         ".npy",  ".npz",  ".csv", ".svg", ".png",  ".md",
                                         ".stl",  ".ply",  ".y4m", ".pem", ".h5",   ".mcap"};

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

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](char c) {
    return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return ending;
}

std::string text_in(const std::filesystem::path& path) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(path, fault)) return {};
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return std::move(text).str();
}

bool is_stream(const fs::path& path) {
  if (own_descriptor(path) >= 0) return true;
  std::error_code ignored;
  const auto status = fs::status(path, ignored);
  return fs::is_fifo(status) || fs::is_character_file(status);
}

int open_stream(const fs::path& path) noexcept {
  if (const int own = own_descriptor(path); own >= 0) return ::fcntl(own, F_DUPFD_CLOEXEC, 0);
  const int fd = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (fd < 0) return -1;
  struct stat opened {};
  if (::fstat(fd, &opened) == 0 && (S_ISFIFO(opened.st_mode) || S_ISCHR(opened.st_mode))) return fd;
  ::close(fd);
  errno = ELOOP;
  return -1;
}

std::string not_written(int error) {
  if (error == ELOOP) return "is a link; name a file itself";
  if (error == EPIPE) return "its reader left before the end; let it read on";
  if (error == ENXIO) return "no program reads this pipe; start the reader first";
  return "cannot be written (" + std::generic_category().message(error) + "); " +
         remedy_for(error, "make room or choose another place");
}

AtomicFile::AtomicFile(const fs::path& path) : path_(path) {
  if (is_stream(path)) {
    fd_ = open_stream(path);
    if (fd_ < 0) fail(errno);
    // `write` waits for a slow reader; a descriptor of ours keeps what its owner set, as `>>`.
    if (own_descriptor(path) < 0) ::fcntl(fd_, F_SETFL, 0);
    return;
  }
  const auto folder = path.has_parent_path() ? path.parent_path() : ".";
  if (const std::string why = access_error(folder); !why.empty()) {
    throw FileError(path.string() + why);
  }
  std::error_code error;
  const auto there = fs::symlink_status(path, error);
  if (there.type() == fs::file_type::none) fail(error.value());
  if (fs::is_symlink(there)) fail(ELOOP);
  if (fs::is_directory(there)) fail(EISDIR);
  if (fs::exists(there) && !fs::is_regular_file(there)) fail(EOPNOTSUPP);
  constexpr mode_t kReadWriteAll = 0666;  // the user's mask takes away from this
  fd_ = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, kReadWriteAll);
  nameless_ = fd_ >= 0 && ::access(open_file(fd_).c_str(), F_OK) == 0;
  if (nameless_) return;
  if (fd_ >= 0) ::close(fd_);
  take_name([&](const char* name) {
    fd_ = ::open(name, O_CREAT | O_EXCL | O_NOFOLLOW | O_WRONLY | O_CLOEXEC, kReadWriteAll);
    return fd_ >= 0;
  });
}

template <class Take>
void AtomicFile::take_name(Take take) {
  constexpr int kMaxTries = 100;             // names that others have taken
  constexpr std::size_t kLongestStem = 200;  // of 255 bytes that a name may have
  const std::string stem = path_.filename().string().substr(0, kLongestStem) + ".new-" +
                           std::to_string(::getpid()) + "-";
  for (int tries = 0; tries < kMaxTries; ++tries) {
    const auto name = path_.parent_path() / (stem + std::to_string(tries));
    if (take(name.c_str())) {
      temporary_ = name;
      return;
    }
    if (errno != EEXIST) break;
  }
  fail(errno);
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) ::close(fd_);
  const bool waits = state_ == State::pending || state_ == State::swapped;
  if (waits && !temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::write(const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(fd_, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(errno);
    at += written;
    size -= static_cast<std::size_t>(written);
  }
}

fs::path AtomicFile::open_path() const {
  return nameless_ ? fs::path(open_file(fd_)) : temporary_;
}

void AtomicFile::close() {
  const bool stored = ::fsync(fd_) == 0 || errno == EINVAL || errno == EROFS;  // pipes cannot
  const int error = errno;
  if (stored && nameless_) return;  // open until it has a name
  if (::close(std::exchange(fd_, -1)) != 0) fail(errno);
  if (!stored) fail(error);
}

void AtomicFile::take_temporary_name() {
  if (!nameless_ || !temporary_.empty()) return;
  take_name([&](const char* name) {
    return ::linkat(AT_FDCWD, open_file(fd_).c_str(), AT_FDCWD, name, AT_SYMLINK_FOLLOW) == 0;
  });
}

void AtomicFile::commit() {
  take_temporary_name();
  if (temporary_.empty()) return;
  const char* const from = temporary_.c_str();
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, path_.c_str(), RENAME_EXCHANGE) == 0) {
    state_ = State::swapped;
    return;
  }
  const bool is_new = errno == ENOENT, cannot_swap = errno == EINVAL || errno == ENOSYS;
  if (!(is_new || cannot_swap) || ::rename(from, path_.c_str()) != 0) fail(errno);
  state_ = is_new ? State::created : State::replaced;
}

bool AtomicFile::commit_if_new() {
  take_temporary_name();
  if (temporary_.empty()) return true;
  const char* const from = temporary_.c_str();
  int error =
      ::renameat2(AT_FDCWD, from, AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) == 0 ? 0 : errno;
  if (error == EINVAL || error == ENOSYS) {  // a file system that has only links for this
    error = ::link(from, path_.c_str()) == 0 ? 0 : errno;
    if (error == 0) ::unlink(from);
  }
  if (error == EEXIST) return false;
  if (error != 0) fail(error);
  state_ = State::created;
  return true;
}

void AtomicFile::roll_back() noexcept {
  if (state_ == State::created) ::unlink(path_.c_str());
  if (state_ == State::swapped) {
    ::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, path_.c_str(), RENAME_EXCHANGE);
  }
}

void AtomicFile::fail(int error) const {
  throw FileError(path_.string() + ": " + not_written(error));
}

void check_new_file(const fs::path& path) {
  // The reader of a pipe would take this for its end.
  if (is_stream(path) && ::access(path.c_str(), W_OK) == 0) return;
  const AtomicFile never_committed(path);
}

void check_new_folder(const fs::path& folder) {
  fs::path there = folder;
  while (!there.empty() && !fs::exists(fs::symlink_status(there))) {
    there = there.parent_path();
  }
  if (there.empty()) there = ".";
  const bool is_folder = fs::is_directory(there);
  if (is_folder && ::access(there.c_str(), W_OK | X_OK) == 0) return;
  const int error = is_folder ? errno : ENOTDIR;
  throw FileError(folder.string() + ": " + std::generic_category().message(error) +
                  "; name a folder that can be written");
}

void write_new_file(const fs::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.write(bytes.data(), bytes.size());
  file.close();
  file.commit();
}

AtomicFile& AtomicFiles::add(const fs::path& path) {
  return files_.emplace_back(path).file;
}

template <class Commit>
const AtomicFiles::Named* AtomicFiles::commit_all(Commit commit) {
  for (Named& named : files_) named.file.take_temporary_name();
  std::size_t done = 0;
  const auto roll_back = [&] {
    while (done > 0) files_[--done].file.roll_back();
  };
  try {
    for (; done < files_.size(); ++done) {
      const Named& named = files_[done];
      if (commit(files_[done].file)) continue;
      roll_back();
      return &named;
    }
  } catch (const FileError&) {
    roll_back();
    throw;
  }
  return nullptr;
}

void AtomicFiles::commit() {
  static_cast<void>(commit_all([](AtomicFile& file) {
    file.commit();
    return true;
  }));
}

std::optional<fs::path> AtomicFiles::commit_if_new() {
  const Named* const there = commit_all([](AtomicFile& file) { return file.commit_if_new(); });
  return there == nullptr ? std::nullopt : std::optional(there->path);
}

std::string with_part(std::string_view page, std::string_view name, std::string_view text) {
  const std::string begin = "<!-- begin " + std::string(name) + " -->\n";
  const std::string end = "<!-- end " + std::string(name) + " -->\n";
  const std::string part = begin + std::string(text) + end;
  const std::size_t first = page.find(begin);
  const std::size_t last = first == page.npos ? page.npos : page.find(end, first);
  if (last == page.npos) return std::string(page) + (page.empty() ? "" : "\n") + part;
  return std::string(page.substr(0, first)) + part + std::string(page.substr(last + end.size()));
}

void write_page_part(const fs::path& file, std::string_view name, std::string_view text) {
  write_new_file(file, with_part(text_in(file), name, text));
}

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
                      std::string(other.option) + " writes there, too; give each its own file");
    }
  }
}

}  // namespace kerf
