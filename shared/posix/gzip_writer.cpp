// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/gzip_writer.hpp"

#include <algorithm>
#include <array>
#include <new>

#include <zlib.h>

namespace kerf {

struct GzipWriter::State {
  z_stream stream{};
  std::array<unsigned char, std::size_t{1} << 18> packed;
};

GzipWriter::GzipWriter(AtomicFile& file, int level) : file_(file), state_(new State) {
  constexpr int kGzipWindow = 15 + 16;  // largest window, gzip framing
  constexpr int kMemory = 8;            // zlib's default
  if (deflateInit2(&state_->stream, level, Z_DEFLATED, kGzipWindow, kMemory, Z_DEFAULT_STRATEGY) !=
      Z_OK) {
    throw std::bad_alloc();
  }
}

GzipWriter::~GzipWriter() {
  deflateEnd(&state_->stream);
}

void GzipWriter::write(const void* data, std::size_t size) {
  constexpr std::size_t kPiece = std::size_t{1} << 18;  // zlib counts in unsigned
  const auto* at = static_cast<const unsigned char*>(data);
  while (size > 0) {
    const std::size_t piece = std::min(size, kPiece);
    state_->stream.next_in = at;
    state_->stream.avail_in = static_cast<uInt>(piece);
    pack(Z_NO_FLUSH);
    at += piece;
    size -= piece;
  }
}

void GzipWriter::finish() {
  pack(Z_FINISH);
}

void GzipWriter::pack(int flush) {
  z_stream& stream = state_->stream;
  do {
    stream.next_out = state_->packed.data();
    stream.avail_out = static_cast<uInt>(state_->packed.size());
    deflate(&stream, flush);
    file_.write(state_->packed.data(), state_->packed.size() - stream.avail_out);
  } while (stream.avail_out == 0);
}

}  // namespace kerf
