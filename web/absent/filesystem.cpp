// SPDX-License-Identifier: Apache-2.0
// The part of std::filesystem behind its header that libc++ of WebAssembly lacks
// (headers/filesystem): names are taken apart as POSIX has them. Which files are there, the worker
// answers (page/log_files.js): those of a recording, else none.
#include <cerrno>
#include <filesystem>
#include <system_error>

#include <sys/stat.h>

_LIBCPP_BEGIN_NAMESPACE_FILESYSTEM
namespace {

string_view last_part(string_view name) noexcept {
  return name.substr(name.rfind('/') + 1);  // npos + 1 is 0
}

/// False, and the reason, if nothing is there.
bool state_of(const path& name, struct stat& state, error_code* error) noexcept {
  const bool is_there = stat(name.c_str(), &state) == 0;
  if (error != nullptr) *error = is_there ? error_code() : error_code(errno, generic_category());
  return is_there;
}

}  // namespace

string_view path::__parent_path() const {
  const string_view name = __pn_;
  const size_t slash = name.rfind('/');
  if (slash == string_view::npos) return {};
  return name.substr(0, slash == 0 ? 1 : slash);
}

string_view path::__filename() const {
  return last_part(__pn_);
}

string_view path::__stem() const {
  const string_view name = last_part(__pn_);
  const size_t dot = name.rfind('.');
  return dot == string_view::npos || dot == 0 ? name : name.substr(0, dot);
}

string_view path::__extension() const {
  return last_part(__pn_).substr(__stem().size());
}

string_view path::__root_directory() const {
  return __pn_.starts_with('/') ? string_view(__pn_).substr(0, 1) : string_view();
}

int path::__compare(string_view other) const {
  return string_view(__pn_).compare(other);
}

/// Asked for the first part of a name below kerf's own folder alone, which a tab lacks.
path::iterator path::begin() const {
  return {};
}

/// Names here come from texts of kerf, which have neither `.` nor `..` to be resolved.
path path::lexically_normal() const {
  return *this;
}
path path::lexically_relative(const path&) const {
  return {};
}

file_status __status(const path& name, error_code* error) {
  struct stat state {};
  if (!state_of(name, state, error)) return file_status(file_type::not_found);
  return file_status(S_ISDIR(state.st_mode) ? file_type::directory : file_type::regular);
}
file_status __symlink_status(const path& name, error_code* error) {
  return __status(name, error);
}
uintmax_t __file_size(const path& name, error_code* error) {
  struct stat state {};
  if (!state_of(name, state, error)) return static_cast<uintmax_t>(-1);
  return static_cast<uintmax_t>(state.st_size);
}
path __absolute(const path& name, error_code* error) {
  if (error != nullptr) error->clear();
  return name;
}
path __weakly_canonical(const path& name, error_code* error) {
  return __absolute(name, error);
}

/// The worker answers for each file by its name and has no list of them: a folder is one that
/// cannot be read. A part that is missing in the middle of a split log is seen in log_files.js.
directory_iterator::directory_iterator(const path& /*name*/, error_code* error,
                                       directory_options /*options*/) {
  if (error != nullptr) *error = error_code(ENOTSUP, generic_category());
}
directory_iterator& directory_iterator::__increment(error_code* error) {
  if (error != nullptr) *error = error_code(ENOTSUP, generic_category());
  return *this;
}
const directory_entry& directory_iterator::__dereference() const {
  __builtin_unreachable();  // there is no first entry
}

_LIBCPP_END_NAMESPACE_FILESYSTEM
