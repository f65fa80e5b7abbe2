// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <filesystem>
#include <ios>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include <doctest/doctest.h>

#include "shared/posix/error_text.hpp"

namespace {

template <class Exception>
std::string text_of(const Exception& exception) {
  try {
    throw exception;
  } catch (...) {
    return kerf::failure_text();
  }
}

}  // namespace

TEST_CASE("what a program says at its end is one line with a way out") {
  CHECK(text_of(std::runtime_error("scene.toml: value; way\nout")) ==
        "scene.toml: value; way\\nout");
  CHECK(text_of(std::bad_alloc())
            .ends_with("; take a smaller volume, free memory, or raise ulimit -v"));
  CHECK(text_of(std::system_error(EAGAIN, std::generic_category())) ==
        "threads: Resource temporarily unavailable; raise ulimit -u, or TasksMax of the service");
  CHECK(text_of(std::ios_base::failure("read", {EIO, std::generic_category()})) ==
        "a file: Input/output error; check its disk, or copy it again");
  const auto code = [](int error) { return std::error_code(error, std::generic_category()); };
  CHECK(text_of(std::filesystem::filesystem_error("rename", "/a/b", code(EACCES))) ==
        "/a/b: Permission denied; check the path and its rights");
  CHECK(text_of(std::filesystem::filesystem_error("open", "/a/b", code(EMFILE))) ==
        "/a/b: Too many open files; raise ulimit -n");
}

TEST_CASE("a limit of the machine has its own way out, anything else the usual one") {
  CHECK(kerf::remedy_for(EMFILE, "knock") == std::string("raise ulimit -n"));
  CHECK(kerf::remedy_for(EFBIG, "knock") == std::string("raise ulimit -f"));
  CHECK(kerf::remedy_for(ENOMEM, "knock") == std::string("free memory, or raise ulimit -v"));
  CHECK(kerf::remedy_for(ENOENT, "knock") == std::string("knock"));
  CHECK(kerf::remedy_for(EAGAIN, "knock") == std::string("knock"));  // a full queue, of a socket
}
