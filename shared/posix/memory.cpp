// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/memory.hpp"

#include <fstream>
#include <limits>
#include <string>

namespace kerf {

std::optional<std::uint64_t> available_memory() {
  std::ifstream table("/proc/meminfo");
  std::string name;
  std::uint64_t kib = 0;
  while (table >> name >> kib) {
    if (name == "MemAvailable:") return kib << 10;
    table.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return std::nullopt;
}

}  // namespace kerf
