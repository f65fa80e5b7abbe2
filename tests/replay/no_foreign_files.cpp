// SPDX-License-Identifier: Apache-2.0
// In place of the readers of volumes and meshes, whose libraries another processor has not.
#include "controller/input/load_error.hpp"
#include "controller/input/sandbox.hpp"
#include "controller/volume/file/volume_io.hpp"

namespace kerf {
namespace {

[[noreturn]] void refuse_file(const std::string& path) {
  throw LoadError(path + ": this program reads no files but scenes; give the phantom");
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

}  // namespace kerf
