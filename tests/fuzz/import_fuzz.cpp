// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "controller/input/sandbox.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "tests/support/temporary_folder.hpp"

/// Files of one kind, KERF_FUZZ_END, through the sandbox: whatever they do to the library that
/// reads them, they are a volume or one line, and take little memory. Mutations are blind, since
/// what a child covers is not seen here.
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnd = KERF_FUZZ_END;
// The libraries' own, what the address checks keep of it, and inputs of a few kilobytes.
constexpr long kMostKib = 256 << 10;
constexpr int kCpuSeconds = 1;

/// What the child's address checks say goes to a file meanwhile; they end it where memory is short,
/// which is no fault: elsewhere that is an exception.
class Errors {
 public:
  explicit Errors(const fs::path& file) : file_(file), kept_(::dup(STDERR_FILENO)) {
    constexpr mode_t kOwn = 0600;
    const int to = ::open(file.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, kOwn);
    ::dup2(to, STDERR_FILENO);
    ::close(to);
  }
  ~Errors() {
    ::dup2(kept_, STDERR_FILENO);
    ::close(kept_);
  }
  Errors(const Errors&) = delete;
  Errors& operator=(const Errors&) = delete;

  [[nodiscard]] std::string text() const { return kerf::test::text_of(file_); }

 private:
  fs::path file_;
  int kept_;
};

std::string read_it(const fs::path& path) {
  const Errors errors(path.parent_path() / "errors");
  try {
    if (kEnd == ".stl") {
      static_cast<void>(kerf::read_stl(path, kCpuSeconds));
    } else {
      static_cast<void>(kerf::read_volume(path, {.cpu_s = kCpuSeconds}));
    }
  } catch (const kerf::LoadError& error) {
    const std::string message = error.what();
    const bool ended = message.find(" ended without a word") != message.npos;
    const std::string found = ended ? errors.text() : "";
    return found.find("allocat") == found.npos ? message + found : message.substr(0, 100);
  }
  return {};
}

void demand(bool holds, const char* what, const std::string& message) {
  if (holds) return;
  std::fprintf(stderr, "import: %s: %s\n", what, message.c_str());
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const kerf::test::TemporaryFolder folder;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const bool packed = kEnd == ".nii" && bytes.starts_with("\x1f\x8b");
  const bool slices = kEnd == ".png";  // two of them in a folder
  const fs::path place = slices ? folder / "slices" : folder.path();
  fs::create_directory(place);
  const fs::path path = place / ("a" + std::string(kEnd) + (packed ? ".gz" : ""));
  std::ofstream(path, std::ios::binary) << bytes;
  if (slices) std::ofstream(place / "b.png", std::ios::binary) << bytes;

  const std::string message = read_it(slices ? place : path);
  const bool control =
      std::ranges::any_of(message, [](char c) { return static_cast<unsigned char>(c) < ' '; });
  demand(!control && message.size() < 1000, "not one line, or what the checks found", message);
  demand(waitpid(-1, nullptr, WNOHANG) < 0, "a child is left", message);
  rusage own{}, children{};
  getrusage(RUSAGE_SELF, &own);
  getrusage(RUSAGE_CHILDREN, &children);
  demand(children.ru_maxrss < own.ru_maxrss + kMostKib, "too much memory", message);
  return 0;
}
