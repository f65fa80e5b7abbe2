// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/volume_commands.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/volume_crop.hpp"
#include "controller/volume/volume_density.hpp"
#include "controller/volume/volume_resample.hpp"
#include "controller/volume_tool/import_command.hpp"
#include "controller/volume_tool/volume_info.hpp"
#include "controller/volume_tool/volume_options.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/run_files.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace {

/// What the commands that read a volume have in common.
struct Source {
  std::string file, spacing, window;
  int cpu_s = kReadCpuSeconds;

  void add_to(Arguments& command, bool with_spacing) {
    command.option("file", file, "volume file, or folder with a DICOM series")
        .required()
        .shown_as("FILE");
    if (with_spacing) {
      command.option("--spacing", spacing, "mm per voxel, in place of the file's")
          .shown_as("A[,B,C]");
    }
    command.option("--window", window, "values that become density 0 and 1 (default: all)")
        .shown_as("LO,HI");
    command.option("--read-seconds", cpu_s, "CPU time that parsing a file may take")
        .within(1, kMostReadCpuSeconds)
        .shows_default();
  }
  [[nodiscard]] SourceVolume read(bool allow_missing_spacing = false) const {
    ReadOptions options;
    options.allow_missing_spacing = allow_missing_spacing;
    options.cpu_s = cpu_s;
    if (!spacing.empty()) options.spacing_mm = spacing_from(spacing);
    return read_volume(file, options);
  }
  [[nodiscard]] Window window_for(const SourceVolume& source) const {
    return window.empty() ? range_window(source) : window_from(window);
  }
  [[nodiscard]] VolumeImage image() const {
    const SourceVolume source = read();
    VolumeImage image = apply_window(source, window_for(source));
    read_labels_beside(file, image, cpu_s);
    return image;
  }
};

struct Target {
  std::string file;
  bool raw = false, force = false;

  void add_to(Arguments& command) {
    command.option("--out", file, "file to write").required().shown_as("OUT.nrrd");
    command.flag("--raw", raw, "write without compression");
    command.flag("--force", force, "replace the file, and the labels beside it, where it is there");
  }
  /// Before the work.
  void check(const std::vector<std::filesystem::path>& read) const {
    check_volume_path(file);
    const std::filesystem::path labels = labels_path(file);
    check_outputs(read, {{"--out", file, ".nrrd"}, {"--out", labels, ".nrrd"}});
    refuse_replacing(file, force);
    refuse_replacing(labels, force);
  }
  void write(const VolumeImage& image, std::ostream& out) const {
    NewFiles files;
    add_volume(image, file, raw ? VolumeEncoding::raw : VolumeEncoding::gzip, files);
    commit(files, force);
    if (image.labels.empty()) remove_labels(file);
    out << escaped(file) << ": " << image.grid.nx << " x " << image.grid.ny << " x "
        << image.grid.nz << " voxels of " << image.spacing_mm[0] << " x " << image.spacing_mm[1]
        << " x " << image.spacing_mm[2] << " mm" << (image.labels.empty() ? "" : ", with labels")
        << '\n';
  }
};

struct Commands {
  Source source;
  Target target;
  std::string report, resample_spacing, size = "256x256x161";
  std::string shape{kMolar};
  double iso = -1.0;
  std::int32_t guard = kGuardVoxels;
  ImportCommand import;
  Arguments info, crop, resample, phantom;

  explicit Commands(Arguments& app)
      : import(app),
        info(app.command("info", "print size, spacing, values and what is solid")),
        crop(app.command("crop", "cut to the tightest box around what is solid, plus a guard")),
        resample(app.command("resample", "change the voxel size")),
        phantom(app.command("phantom", "make the procedural molar, or a solid to measure on")) {
    source.add_to(info, true);
    info.option("--report", report, "write the same figures as JSON").shown_as("FILE");

    source.add_to(crop, true);
    target.add_to(crop);
    crop.option("--iso", iso, "density from which a voxel is solid (default: Otsu)")
        .within(0.0, 1.0);
    crop.option("--guard", guard, "voxels kept around it").within(0, 64).shows_default();

    source.add_to(resample, false);
    target.add_to(resample);
    resample.option("--spacing", resample_spacing, "new mm per voxel")
        .required()
        .shown_as("A[,B,C]");

    phantom.option("--shape", shape, "what it is")
        .one_of({kPhantomShapes.begin(), kPhantomShapes.end()})
        .shows_default();
    phantom.option("--size", size, "voxels; its size in mm stays")
        .shows_default()
        .shown_as("NXxNYxNZ");
    target.add_to(phantom);
  }

  void run(std::ostream& out) const {
    if (import.chosen()) return import.run(out);
    const auto read =
        phantom.chosen() ? std::vector<std::filesystem::path>{} : files_read(source.file);
    if (!info.chosen()) target.check(read);
    if (info.chosen()) {
      check_outputs(read, {{"--report", report, ".json"}});
      const SourceVolume volume = source.read(true);
      const VolumeInfo figures = describe(source.file, volume, source.window_for(volume));
      print(figures, out);
      if (!report.empty()) write_report(figures, report);
    } else if (crop.chosen()) {
      const VolumeImage image = source.image();
      const Density threshold =
          iso < 0.0 ? otsu_threshold(image) : static_cast<Density>(std::lround(iso * kDensityMax));
      target.write(crop_to_solid(image, threshold, guard), out);
    } else if (resample.chosen()) {
      target.write(kerf::resample(source.image(), spacing_from(resample_spacing)), out);
    } else {
      PhantomSpec spec;
      spec.shape = shape;
      spec.grid = grid_from("--size", size);
      target.write(make_phantom(spec), out);
    }
  }
};

}  // namespace

int run_volume_tool(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CommandLine app("Inspect, import, crop and resample volumes; make the molar phantom.",
                  "kerf-volume", KERF_VERSION);
  Commands commands(app);
  try {
    if (app.parse(argc, argv, out)) commands.run(out);
    return 0;
  } catch (...) {
    err << "kerf-volume: " << failure_text() << '\n';
    return 2;
  }
}

}  // namespace kerf
