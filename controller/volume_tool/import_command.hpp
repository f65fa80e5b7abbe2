// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>

#include "controller/input/sandbox.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "controller/volume_tool/volume_commands.hpp"
#include "shared/text/command_line.hpp"

namespace kerf {

struct ImportedScene;
struct ProposalWishes;
struct ReadOptions;

/// kerf-volume import: any CT to a .nrrd of densities, a scene and a preview, by the proposal of
/// volume_proposal.hpp; prints one line for each choice, with the option that changes it.
class ImportCommand {
 public:
  explicit ImportCommand(Arguments& app);
  ImportCommand(const ImportCommand&) = delete;
  ImportCommand& operator=(const ImportCommand&) = delete;

  [[nodiscard]] bool chosen() const { return command_.chosen(); }
  /// Throws LoadError, one line, with nothing written.
  void run(std::ostream& out) const;

 private:
  struct Files;
  struct SourceLines;
  [[nodiscard]] Files files() const;
  /// The options for reading the file, and those that replace a proposal.
  [[nodiscard]] ReadOptions read_options() const;
  [[nodiscard]] ProposalWishes wishes() const;
  /// Writes all files, with a scene that runs, or none.
  void write(VolumeImage image, ImportedScene scene, const std::string& preview,
             const Files& to) const;
  /// Refuses an odd spacing of the file, unless the user gave one.
  void refuse_odd(const std::string& odd) const;
  /// Refuses options for the surface, which the labels define.
  void refuse_beside_labels() const;
  void print_source(const SourceLines& source, std::ostream& out) const;
  void import_labelled(VolumeImage image, const SourceLines& source, const Files& files,
                       std::ostream& out) const;

  Arguments command_;
  FrameOptions frame_;
  std::string path_, out_, window_, iso_, denoise_ = "auto";
  std::string series_, dims_, type_ = "uint16";
  std::int64_t skip_ = 0;
  bool big_endian_ = false;
  int cpu_s_ = kReadCpuSeconds;
  bool force_ = false, keep_all_ = false, whole_ = false, packed_ = false;
};

}  // namespace kerf
