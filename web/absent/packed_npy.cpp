// SPDX-License-Identifier: Apache-2.0
// Packed arrays of a recording: the worker has unpacked them (page/log_files.js), so they are read
// as they are. In place of record/packed_npy.cpp.
#include "record/packed_npy.hpp"

#include <cstdio>
#include <string>

namespace kerf {
namespace {

std::FILE* handle(void* file) noexcept {
  return static_cast<std::FILE*>(file);
}

}  // namespace

/// The worker's files belong to nobody else.
void require_rights(const std::filesystem::path&) {}

void PackedNpyReader::Close::operator()(void* file) const noexcept {
  std::fclose(handle(file));
}

PackedNpyReader::PackedNpyReader(const std::filesystem::path& path, std::string_view header)
    : file_(std::fopen(path.c_str(), "rb")) {
  std::string found(header.size(), '\0');
  if (!read(std::as_writable_bytes(std::span(found))) || found != header) file_.reset();
}

bool PackedNpyReader::read(std::span<std::byte> content) {
  if (file_ == nullptr) return false;
  const bool whole =
      std::fread(content.data(), 1, content.size(), handle(file_.get())) == content.size();
  if (!whole) file_.reset();
  return whole;
}

bool PackedNpyReader::at_end() {
  return file_ != nullptr && std::fgetc(handle(file_.get())) == EOF;
}

}  // namespace kerf
