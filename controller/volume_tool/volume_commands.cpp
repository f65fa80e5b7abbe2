// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/volume_commands.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/volume_crop.hpp"
#include "controller/volume/volume_density.hpp"
#include "controller/volume/volume_io.hpp"
#include "controller/volume/volume_resample.hpp"
#include "controller/volume/volume_write.hpp"
#include "controller/volume_tool/volume_info.hpp"
#include "shared/posix/failure.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/number.hpp"

namespace kerf {
namespace {

/// SceneError that names the option where `text` is no number.
double number(const std::string& option, std::string_view text) {
  if (const auto value = number_in(text)) return *value;
  throw SceneError(option + ": '" + std::string(text) + "' is not a number; see --help");
}

std::vector<double> numbers(const std::string& option, const std::string& text, char separator) {
  std::vector<double> values;
  std::istringstream parts(text + separator);
  for (std::string part; std::getline(parts, part, separator);) {
    values.push_back(number(option, part));
  }
  return values;
}

std::array<double, 3> spacing_from(const std::string& text) {
  const std::vector<double> s = numbers("--spacing", text, ',');
  if (s.size() == 1) return {s[0], s[0], s[0]};
  if (s.size() == 3) return {s[0], s[1], s[2]};
  throw SceneError("--spacing: " + text + " has " + std::to_string(s.size()) +
                   " numbers; give one, or three as x,y,z (mm)");
}

Window window_from(const std::string& text) {
  const std::vector<double> w = numbers("--window", text, ',');
  if (w.size() != 2) {
    throw SceneError("--window: " + text + " is not a range; give lo,hi in values of the file");
  }
  return {w[0], w[1]};
}

VoxelGrid grid_from(const std::string& text) {
  const std::vector<double> n = numbers("--size", text, 'x');
  const auto whole = [](double v) { return v >= 1.0 && v <= 1e6 && v == std::floor(v); };
  if (n.size() != 3 || !std::all_of(n.begin(), n.end(), whole)) {
    throw SceneError("--size: " + text + " is not a size; give three counts such as 256x256x161");
  }
  return {static_cast<std::int32_t>(n[0]), static_cast<std::int32_t>(n[1]),
          static_cast<std::int32_t>(n[2])};
}

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
  void check() const {
    check_volume_path(file);
    for (const std::filesystem::path& path : {std::filesystem::path(file), labels_path(file)}) {
      std::error_code fault;
      if (force || !exists(symlink_status(path, fault))) continue;
      throw SceneError(path.string() +
                       ": is there already; take another name, or --force to replace it");
    }
  }
  void write(const VolumeImage& image, std::ostream& out) const {
    write_volume(image, file, raw ? VolumeEncoding::raw : VolumeEncoding::gzip);
    out << file << ": " << image.grid.nx << " x " << image.grid.ny << " x " << image.grid.nz
        << " voxels of " << image.spacing_mm[0] << " x " << image.spacing_mm[1] << " x "
        << image.spacing_mm[2] << " mm" << (image.labels.empty() ? "" : ", with labels") << '\n';
  }
};

struct Commands {
  Source source;
  Target target;
  std::string report, resample_spacing, size = "256x256x161";
  std::string shape{kMolar};
  double iso = -1.0;
  std::int32_t guard = kGuardVoxels;
  Arguments info, import, crop, resample, phantom;

  explicit Commands(Arguments& app)
      : info(app.command("info", "print size, spacing, values and what is solid")),
        import(app.command("import", "convert any readable volume to a .nrrd of densities")),
        crop(app.command("crop", "cut to the tightest box around what is solid, plus a guard")),
        resample(app.command("resample", "change the voxel size")),
        phantom(app.command("phantom", "make the procedural molar, or a solid to measure on")) {
    source.add_to(info, true);
    info.option("--report", report, "write the same figures as JSON").shown_as("FILE");

    source.add_to(import, true);
    target.add_to(import);

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
    if (!info.chosen()) target.check();
    if (info.chosen()) {
      const SourceVolume volume = source.read(true);
      const VolumeInfo figures = describe(source.file, volume, source.window_for(volume));
      print(figures, out);
      if (!report.empty()) write_report(figures, report);
    } else if (import.chosen()) {
      const VolumeImage image = source.image();
      target.write(image, out);
      out << noise_line(noise_of(image.grid, image.density, otsu_threshold(image)),
                        {0, kDensityMax})
          << '\n';
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
      spec.grid = grid_from(size);
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
