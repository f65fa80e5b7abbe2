// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/volume_commands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/volume/crop_resample.hpp"
#include "controller/volume/denoise.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/windowing.hpp"
#include "controller/volume_tool/import_command.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

std::vector<double> numbers(const std::string& option, const std::string& text, char separator) {
  std::vector<double> values;
  std::istringstream parts(text + separator);
  for (std::string part; std::getline(parts, part, separator);) {
    const auto value = number_in(part);
    if (!value) throw LoadError(option + ": '" + part + "' is not a number; see --help");
    values.push_back(*value);
  }
  return values;
}

}  // namespace

std::array<double, 3> spacing_from(const std::string& option, const std::string& text) {
  const std::vector<double> s = numbers(option, text, ',');
  if (s.size() == 1) return {s[0], s[0], s[0]};
  if (s.size() == 3) return {s[0], s[1], s[2]};
  throw LoadError(option + ": " + text + " has " + std::to_string(s.size()) +
                  " numbers; give one, or three as x,y,z (mm)");
}

void FrameOptions::add_to(Arguments& command, bool with_spacing) {
  Option replaces = command.option("--override-spacing", override_spacing,
                                   "mm per voxel, in place of the file's");
  replaces.shown_as("A[,B,C]");
  command
      .option("--axes", axes,
              "if the file has none: where columns, rows and slices lead in the body, such as LPS "
              "(left, back, top) or RAI (right, front, bottom)")
      .shown_as("XYZ");
  if (!with_spacing) return;
  Option fills = command.option("--spacing", spacing, "mm per voxel, if the file has none");
  fills.shown_as("A[,B,C]");
  replaces.excludes(fills);
}

void FrameOptions::set(ReadOptions& options) const {
  options.axes = axes;
  if (!spacing.empty()) options.spacing_mm = spacing_from("--spacing", spacing);
  if (override_spacing.empty()) return;
  options.override_spacing_mm = spacing_from("--override-spacing", override_spacing);
}

Window window_from(const std::string& text) {
  const std::vector<double> w = numbers("--window", text, ',');
  if (w.size() != 2) {
    throw LoadError("--window: " + text + " is not a range; give lo,hi in values of the file");
  }
  if (!(w[0] < w[1])) {
    throw LoadError("--window: " + text + " is empty; give lo,hi with lo < hi");
  }
  return {w[0], w[1]};
}

VoxelGrid grid_from(const std::string& option, const std::string& text) {
  const std::vector<double> n = numbers(option, text, 'x');
  const auto whole = [](double v) { return v >= 1.0 && v <= 1e6 && v == std::floor(v); };
  if (n.size() != 3 || !std::all_of(n.begin(), n.end(), whole)) {
    throw LoadError(option + ": " + text + " is not a size; give three counts such as 256x256x161");
  }
  return {static_cast<std::int32_t>(n[0]), static_cast<std::int32_t>(n[1]),
          static_cast<std::int32_t>(n[2])};
}

std::vector<std::filesystem::path> files_read(const std::filesystem::path& volume) {
  std::vector<std::filesystem::path> files{volume};
  const std::filesystem::path labels = labels_path(volume);
  std::error_code fault;
  if (exists(symlink_status(labels, fault))) files.push_back(labels);
  return files;
}

namespace {

[[noreturn]] void refuse_there(const std::filesystem::path& path) {
  throw LoadError(path.string() +
                  ": exists already; choose another name, or --force to replace it");
}

}  // namespace

void refuse_replacing(const std::filesystem::path& path, bool force) {
  std::error_code fault;
  if (!force && exists(symlink_status(path, fault))) refuse_there(path);
}

void commit(AtomicFiles& files, bool force) {
  if (force) return files.commit();
  if (const auto there = files.commit_if_new()) refuse_there(*there);
}

namespace {

/// The figures of `kerf-volume info`.
struct VolumeInfo : VolumeFrame {
  static constexpr std::size_t kHistogramBins = 64;

  std::string file;
  std::uint32_t spacing_known = kAllAxes;
  std::string note, axes_note;
  double min = 0, max = 0;  ///< values of the file
  Window window;
  Density otsu = 0;
  double otsu_value = 0;   ///< the same threshold in values of the file
  Noise noise;             ///< of the voxels at or above it
  VoxelBox solid;          ///< tightest box of the voxels at or above it
  double solid_ratio = 0;  ///< their fraction of all voxels, 0..1
  std::array<std::uint64_t, kHistogramBins> histogram{};  ///< over the window, equal steps
};

/// One character per bin, taller with the logarithm of the count.
std::string bars(const VolumeInfo& info) {
  constexpr std::array<const char*, 9> kBars{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double most =
      static_cast<double>(*std::max_element(info.histogram.begin(), info.histogram.end()));
  std::string line;
  for (const std::uint64_t count : info.histogram) {
    const double height = std::log1p(static_cast<double>(count)) / std::log1p(most);
    line += kBars[static_cast<std::size_t>(std::ceil(height * (kBars.size() - 1)))];
  }
  return line;
}

/// The noise in one line: in values of a file of that window, and the passes of a scene against it.
std::string noise_line(const Noise& noise, Window window) {
  if (noise.share == 0) return "noise      none found";
  const int passes = passes_for(noise);
  char text[128];
  std::snprintf(
      text, sizeof text,
      "noise      %.4g (%.3g %% of the surface's step); denoise = \"auto\" makes %d pass%s",
      noise.density * (window.hi - window.lo), 100 * noise.share, passes, passes == 1 ? "" : "es");
  return text;
}

VolumeInfo describe(const std::string& file, const SourceVolume& volume, Window window) {
  const VolumeImage image = apply_window(volume, window);
  VolumeInfo info;
  static_cast<VolumeFrame&>(info) = volume;
  info.file = file;
  info.spacing_known = volume.spacing_known;
  info.note = volume.note;
  info.axes_note = volume.axes_note;
  info.min = volume.min;
  info.max = volume.max;
  info.window = window;
  info.otsu = otsu_threshold(image);
  info.otsu_value = window.lo + (window.hi - window.lo) * info.otsu / kDensityMax;
  info.noise = noise_of(image.grid, image.density, info.otsu);
  info.solid = solid_box(image, info.otsu);
  const auto solid = std::count_if(image.density.begin(), image.density.end(),
                                   [&](Density d) { return d >= info.otsu; });
  info.solid_ratio = static_cast<double>(solid) / static_cast<double>(image.density.size());
  for (const Density d : image.density) {
    ++info.histogram[std::size_t{d} * VolumeInfo::kHistogramBins >> 16];
  }
  return info;
}

void print(const VolumeInfo& info, std::ostream& out) {
  const auto& s = info.spacing_mm;
  const auto& o = info.origin_mm;
  const auto& d = info.direction;
  out << "file       " << escaped(info.file) << "\nsize       " << info.grid.nx << " x "
      << info.grid.ny << " x " << info.grid.nz << " voxels\nspacing    ";
  if (info.spacing_known == kAllAxes) {
    out << s[0] << " x " << s[1] << " x " << s[2] << " mm\nextent     " << s[0] * info.grid.nx
        << " x " << s[1] * info.grid.ny << " x " << s[2] * info.grid.nz << " mm\n";
  } else {
    for (std::size_t axis = 0; info.spacing_known != 0 && axis < 3; ++axis) {
      const bool known = (info.spacing_known >> axis & 1) != 0;
      out << (known ? number_text(s[axis]) : "?") << (axis < 2 ? " x " : " mm: ");
    }
    out << "not known from the file; give it with --spacing or spacing_mm\n";
  }
  if (!info.note.empty()) out << "note       " << info.note << '\n';
  if (!info.axes_note.empty()) {
    out << "axes       " << info.axes_note << "; --axes XYZ for others\n";
  }
  out << "origin     " << o[0] << " " << o[1] << " " << o[2] << " mm\ndirection  (" << d[0] << " "
      << d[3] << " " << d[6] << ") (" << d[1] << " " << d[4] << " " << d[7] << ") (" << d[2] << " "
      << d[5] << " " << d[8] << ")\nvalues     " << info.min << " .. " << info.max
      << "\nwindow     " << info.window.lo << " .. " << info.window.hi << "\notsu       "
      << info.otsu_value << " (density " << info.otsu / kDensityMax << ")\n"
      << noise_line(info.noise, info.window) << "\nsolid box  (" << info.solid.lo.x << ", "
      << info.solid.lo.y << ", " << info.solid.lo.z << ") .. (" << info.solid.hi.x - 1 << ", "
      << info.solid.hi.y - 1 << ", " << info.solid.hi.z - 1 << "), " << 100.0 * info.solid_ratio
      << " % of the voxels are solid\nhistogram  |" << bars(info) << "| (log)\n";
}

/// As JSON. Throws FileError if it cannot be written.
void write_report(const VolumeInfo& info, const std::filesystem::path& path) {
  const auto corner = [](VoxelIndex v) { return std::array{v.x, v.y, v.z}; };
  const Json report{{"denoise_passes", passes_for(info.noise)},
                    {"direction", info.direction},
                    {"file", info.file},
                    {"has_spacing", info.spacing_known == kAllAxes},
                    {"histogram", info.histogram},
                    {"max", info.max},
                    {"min", info.min},
                    {"noise_density", info.noise.density},
                    {"noise_share", info.noise.share},
                    {"origin_mm", info.origin_mm},
                    {"note", info.note},
                    {"axes_note", info.axes_note},
                    {"otsu_density", info.otsu / kDensityMax},
                    {"otsu_value", info.otsu_value},
                    {"size_vox", std::array{info.grid.nx, info.grid.ny, info.grid.nz}},
                    {"solid_box", {{"hi", corner(info.solid.hi)}, {"lo", corner(info.solid.lo)}}},
                    {"solid_ratio", info.solid_ratio},
                    {"spacing_mm", info.spacing_mm},
                    {"window", std::array{info.window.lo, info.window.hi}}};
  write_new_file(path, report.document());
}

/// The input of the commands that read a volume.
struct Source {
  std::string file, window;
  FrameOptions frame;
  int cpu_s = kReadCpuSeconds;

  void add_to(Arguments& command, bool with_spacing) {
    command.option("file", file, "volume file, or folder with a DICOM series")
        .required()
        .shown_as("FILE");
    frame.add_to(command, with_spacing);
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
    frame.set(options);
    return read_volume(file, options);
  }
  [[nodiscard]] Window window_for(const SourceVolume& source) const {
    return window.empty() ? range_window(source) : window_from(window);
  }
  /// Prints the note of the reading, if there is one. `spacing_is_new`: of the output, in mm.
  [[nodiscard]] VolumeImage image(std::ostream& out, bool spacing_is_new = false) const {
    const SourceVolume source = read(spacing_is_new);
    if (source.spacing_known != kAllAxes) {
      throw LoadError(file +
                      ": spacing is not known from the file; give it with --override-spacing x,y,z "
                      "(mm), since --spacing is the new one");
    }
    if (!source.note.empty()) out << escaped(file) << ": " << source.note << '\n';
    if (!source.axes_note.empty()) {
      out << escaped(file) << ": axes " << source.axes_note << "; --axes XYZ for others\n";
    }
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
  /// Call before the work.
  void check(const std::vector<std::filesystem::path>& read) const {
    check_volume_path(file);
    const std::filesystem::path labels = labels_path(file);
    check_outputs(read, {{"--out", file, ".nrrd"}, {"--out", labels, ".nrrd"}});
    refuse_replacing(file, force);
    refuse_replacing(labels, force);
  }
  void write(const VolumeImage& image, std::ostream& out) const {
    AtomicFiles files;
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
      const VolumeImage image = source.image(out);
      const Density threshold =
          iso < 0.0 ? otsu_threshold(image) : static_cast<Density>(std::lround(iso * kDensityMax));
      target.write(crop_to_solid(image, threshold, guard), out);
    } else if (resample.chosen()) {
      target.write(
          kerf::resample(source.image(out, true), spacing_from("--spacing", resample_spacing)),
          out);
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
