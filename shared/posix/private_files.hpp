// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>

namespace kerf {

/// First thing in `main` of a program that handles patients' data: whatever umask it was started
/// with, files and sockets that it makes are 0600, folders 0700.
inline void keep_files_private() noexcept {
  umask(S_IRWXG | S_IRWXO);
}

}  // namespace kerf
