// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "controller/input/sandbox.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/volume_proposal.hpp"
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
  void print_crop(const VolumeFrame& kept, std::ostream& out) const;
  static void print_files(const Files& to, const char* behind_volume, std::ostream& out);
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

/// A picture: rows from the top, 8 bits of red, green and blue.
struct RgbPicture {
  std::int32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// The bytes of a PNG file (ISO 15948). Throws std::bad_alloc.
[[nodiscard]] std::string png_bytes(const RgbPicture& picture);

/// A sheet of four panels: slices across z, y and x through the middle of the kept part, the
/// surface seen from the front, above and the right of the source's frame.
///
/// In the slices grey is the value of the file, from air to the densest; kept voxels are tinted in
/// the colour of their material, removed ones are red. z is up, except in the first panel, where it
/// points into the picture. Load time; about a second.
[[nodiscard]] RgbPicture import_preview(const SourceVolume& source, const ProposedVolume& proposed);

/// Pictures a volume with labels, as four panels: each label has its own colour
/// (shared/volume/material.hpp), in the slices darker at low density; voxels without a label are
/// grey.
[[nodiscard]] RgbPicture label_preview(const VolumeImage& image, Density iso);

}  // namespace kerf
