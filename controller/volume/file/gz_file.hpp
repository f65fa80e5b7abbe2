// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <zlib.h>

namespace kerf::volume {

struct CloseGz {
  void operator()(gzFile file) const noexcept { gzclose(file); }
};
/// A file that zlib reads, packed or not; closed with the object.
using GzFile = std::unique_ptr<gzFile_s, CloseGz>;

}  // namespace kerf::volume
