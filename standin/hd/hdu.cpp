// SPDX-License-Identifier: Apache-2.0
// HDU of the stand-in, what is not in its headers: C++11 for any program, libHD for the texts.

#include <cstdio>
#include <ostream>

#include <HDU/hduError.h>

namespace {

constexpr int kMostBytes = 160;

void write(char (&line)[kMostBytes], const HDErrorInfo& error) {
  const char* const text = hdGetErrorString(error.errorCode);
  std::snprintf(line, sizeof line, "HD error 0x%04x: %s (internal code %d, device %u)",
                error.errorCode, text != nullptr ? text : "", error.internalErrorCode, error.hHD);
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): names of the interface
extern "C" void hduPrintError(FILE* stream, const HDErrorInfo* error, const char* message) {
  if (stream == nullptr || error == nullptr) return;
  char line[kMostBytes];
  write(line, *error);
  const bool has_message = message != nullptr && *message != '\0';
  std::fprintf(stream, "%s%s%s\n", has_message ? message : "", has_message ? ": " : "", line);
}

extern "C" HDboolean hduIsForceError(const HDErrorInfo* error) {
  if (error == nullptr) return HD_FALSE;
  return error->errorCode >= HD_WARM_MOTORS && error->errorCode <= HD_FORCE_ERROR ? HD_TRUE
                                                                                  : HD_FALSE;
}

extern "C" HDboolean hduIsSchedulerError(const HDErrorInfo* error) {
  if (error == nullptr) return HD_FALSE;
  switch (error->errorCode) {
    case HD_COMM_ERROR:
    case HD_COMM_CONFIG_ERROR:
    case HD_TIMER_ERROR:
    case HD_INVALID_PRIORITY:
    case HD_SCHEDULER_FULL:
      return HD_TRUE;
    default:
      return HD_FALSE;
  }
}
// NOLINTEND(readability-identifier-naming)

std::ostream& operator<<(std::ostream& stream, const HDErrorInfo& error) {
  char line[kMostBytes];
  write(line, error);
  return stream << line;
}
