// SPDX-License-Identifier: Apache-2.0
// A tab has no files but those of a recording: its scenes are texts, and their volumes are
// phantoms. What loading asks of other files and of the system is answered with "there is none".
#include <string>

#include "controller/input/load_error.hpp"
#include "controller/input/sandbox.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

[[noreturn]] void refuse_file(const std::string& path) {
  throw LoadError(
      path +
      ": a browser's tab does not read it; take a scene of phantoms, or a recording that has "
      "its volumes");
}

}  // namespace

SourceVolume read_volume(const std::filesystem::path& path, const ReadOptions&) {
  refuse_file(path.string());
}

void read_labels_beside(const std::filesystem::path&, VolumeImage&, int) {}

std::filesystem::path labels_path(const std::filesystem::path& volume_path) {
  return volume_path;
}

SharedBytes read_in_sandbox(const SandboxJob& job, const std::function<void(SandboxReader&)>&,
                            const std::function<std::size_t(std::span<const std::byte>)>&) {
  refuse_file(job.location);
}
std::span<std::byte> SandboxReader::offer(std::span<const std::byte>) {
  return {};
}
void SandboxReader::say(SandboxWord, std::string_view) {}
SharedBytes::SharedBytes(SharedBytes&& other) noexcept : bytes_(other.bytes_) {}
SharedBytes::~SharedBytes() = default;

bool stop_requested() noexcept {
  return false;
}
std::string find_beside_program(const std::string&) {
  return {};
}
std::string user_data_folder() {
  return {};
}
std::string access_error(const std::filesystem::path&) {
  return {};
}
const char* remedy_for(int, const char* usual) noexcept {
  return usual;
}

}  // namespace kerf
