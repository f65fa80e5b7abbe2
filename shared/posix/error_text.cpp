// SPDX-License-Identifier: Apache-2.0

#include "shared/posix/error_text.hpp"

#include <cerrno>
#include <exception>
#include <filesystem>
#include <ios>
#include <new>
#include <ostream>
#include <system_error>

#include <poll.h>
#include <unistd.h>

#include "shared/text/text.hpp"

namespace kerf {
namespace {

bool reader_left() noexcept {
  pollfd out{STDOUT_FILENO, POLLOUT, 0};
  return poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

}  // namespace

const char* remedy_for(int error, const char* usual) noexcept {
  switch (error) {
    case EMFILE:
      return "raise ulimit -n";
    case ENFILE:
      return "end other programs, or raise fs.file-max";
    case EFBIG:
      return "raise ulimit -f";
    case ELOOP:
      return "mend its links, which lead to themselves";
    case ENOMEM:
      return "free memory, or raise ulimit -v";
    default:
      return usual;
  }
}

std::string failure_text() {
  constexpr const char* kNoMemory =
      "memory: none is left; take a smaller volume, free memory, or raise ulimit -v";
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return kNoMemory;
  } catch (const std::filesystem::filesystem_error& error) {
    return escaped(error.path1().string()) + ": " + error.code().message() + "; " +
           remedy_for(error.code().value(), "check the path and its rights");
  } catch (const std::ios_base::failure& error) {
    return "a file: " + error.code().message() + "; check its disk, or copy it again";
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::not_enough_memory) return kNoMemory;  // of mmap
    // Of std::thread or fork: none could be started.
    return "threads: " + error.code().message() + "; raise ulimit -u, or TasksMax of the service";
  } catch (const std::exception& error) {
    return escaped(error.what());
  }
}

std::string stdout_error(std::ostream& out) {
  errno = 0;
  if (out.flush() || reader_left()) return {};
  int error = errno;
  // An earlier write failed and its errno is lost: one more byte fails for the same reason.
  if (error == 0 && ::write(STDOUT_FILENO, "\n", 1) < 0) error = errno;
  const std::string reason =
      error != 0 ? std::generic_category().message(error) : "cannot be written";
  return "standard output: " + reason + "; " + remedy_for(error, "make room, or send it elsewhere");
}

std::string access_error(const std::filesystem::path& path) {
  std::error_code fault;
  if (status(path, fault).type() != std::filesystem::file_type::none) return {};
  return ": cannot be reached (" + fault.message() + "); " +
         remedy_for(fault.value(), "check the permissions of its folders");
}

}  // namespace kerf
