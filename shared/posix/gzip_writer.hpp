// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include "shared/posix/atomic_file.hpp"

namespace kerf {

/// Packs bytes into a file as gzip. Throws as `AtomicFile::write` does, and std::bad_alloc.
class GzipWriter {
 public:
  /// `level`: 1 is the fastest, 9 the smallest. `file` outlives it.
  GzipWriter(AtomicFile& file, int level);
  ~GzipWriter();
  GzipWriter(const GzipWriter&) = delete;
  GzipWriter& operator=(const GzipWriter&) = delete;

  void write(const void* data, std::size_t size);
  /// Writes what is left. The file is not closed.
  void finish();

 private:
  struct State;
  void pack(int flush);
  AtomicFile& file_;
  std::unique_ptr<State> state_;
};

}  // namespace kerf
