// SPDX-License-Identifier: Apache-2.0
#include "record/packed_npy.hpp"

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>

#include <unistd.h>
#include <zlib.h>

#include "record/tick_log.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/gzip_writer.hpp"

namespace kerf {
namespace {

gzFile handle(void* file) noexcept {
  return static_cast<gzFile>(file);
}

}  // namespace

void require_rights(const std::filesystem::path& path) {
  if (access(path.c_str(), R_OK) == 0 || errno != EACCES) return;
  std::string why = access_error(path);
  if (why.empty()) {
    why = ": cannot be read (" + std::generic_category().message(EACCES) + "); check its rights";
  }
  throw RecordError(path.string() + why);
}

void write_packed_npy(AtomicFile& file, std::string_view header,
                      std::span<const std::byte> content) {
  constexpr int kFastest = 1;  // 3 % larger than the best on a CT
  GzipWriter gzip(file, kFastest);
  gzip.write(header.data(), header.size());
  gzip.write(content.data(), content.size());
  gzip.finish();
  file.close();
}

void PackedNpyReader::Close::operator()(void* file) const noexcept {
  gzclose(handle(file));
}

PackedNpyReader::PackedNpyReader(const std::filesystem::path& path, std::string_view header) {
  require_rights(path);
  std::error_code fault;
  if (!std::filesystem::is_regular_file(path, fault)) return;  // opening a pipe would block
  file_.reset(gzopen(path.c_str(), "rb"));
  std::string found(header.size(), '\0');
  if (!read(std::as_writable_bytes(std::span(found))) || found != header) file_.reset();
}

bool PackedNpyReader::read(std::span<std::byte> content) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  while (file_ != nullptr && !content.empty()) {
    // The last byte apart: only such a short read goes on to the checksum, for `at_end`.
    const std::size_t most = content.size() > 1 ? content.size() - 1 : 1;
    const auto piece = static_cast<unsigned>(std::min(most, kPiece));
    if (gzread(handle(file_.get()), content.data(), piece) != static_cast<int>(piece)) {
      file_.reset();
    } else {
      content = content.subspan(piece);
    }
  }
  return file_ != nullptr;
}

bool PackedNpyReader::at_end() {
  char beyond = 0;
  if (file_ == nullptr || gzread(handle(file_.get()), &beyond, 1) != 0) return false;
  // Z_BUF_ERROR: the file ends within its checksum, which gzread takes for an end.
  int status = Z_OK;
  static_cast<void>(gzerror(handle(file_.get()), &status));
  return status == Z_OK;
}

}  // namespace kerf
