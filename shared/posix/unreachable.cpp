// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/unreachable.hpp"

#include <system_error>

#include "shared/posix/failure.hpp"

namespace kerf {

std::string why_unreachable(const std::filesystem::path& path) {
  std::error_code fault;
  if (status(path, fault).type() != std::filesystem::file_type::none) return {};
  return ": cannot be reached (" + fault.message() + "); " +
         way_out_of(fault.value(), "check the permissions of its folders");
}

}  // namespace kerf
