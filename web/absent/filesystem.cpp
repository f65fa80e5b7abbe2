// SPDX-License-Identifier: Apache-2.0
// The part of std::filesystem behind its header that libc++ of WebAssembly lacks
// (headers/filesystem): names are taken apart as POSIX has them, and no file is there.
#include <filesystem>
#include <system_error>

_LIBCPP_BEGIN_NAMESPACE_FILESYSTEM
namespace {

string_view last_part(string_view name) noexcept {
  return name.substr(name.rfind('/') + 1);  // npos + 1 is 0
}

error_code absent() noexcept {
  return make_error_code(errc::no_such_file_or_directory);
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

file_status __status(const path&, error_code* error) {
  if (error != nullptr) *error = absent();
  return file_status(file_type::not_found);
}
file_status __symlink_status(const path& name, error_code* error) {
  return __status(name, error);
}
uintmax_t __file_size(const path&, error_code* error) {
  if (error != nullptr) *error = absent();
  return static_cast<uintmax_t>(-1);
}
path __absolute(const path& name, error_code* error) {
  if (error != nullptr) error->clear();
  return name;
}
path __weakly_canonical(const path& name, error_code* error) {
  return __absolute(name, error);
}

_LIBCPP_END_NAMESPACE_FILESYSTEM
