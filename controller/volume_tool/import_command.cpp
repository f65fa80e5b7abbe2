// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/import_command.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_presets.hpp"
#include "controller/volume/crop_resample.hpp"
#include "controller/volume/denoise.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/volume_proposal.hpp"
#include "controller/volume_tool/volume_commands.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace fs = std::filesystem;

/// Content of the scene of an imported volume, beside the file.
struct ImportedScene {
  std::string source;                        ///< the imported path, for a comment
  std::filesystem::path volume;              ///< beside the scene
  const VolumeProposal* proposal = nullptr;  ///< null for a volume with labels
  Label last_label = 0;                      ///< the highest that a voxel has
  double iso_density = 0;
  int passes = 0;                                     ///< against noise, made by the import
  int longest_vox = std::numeric_limits<int>::max();  ///< no tool is larger
};

namespace {

/// On one line of a comment, for any bytes in the name.
std::string comment(const std::string& name) {
  std::string text = Json(name).canonical();
  std::ranges::replace(text, '\x7f', ' ');
  return text;
}

bool is_control(char c) {
  return static_cast<unsigned char>(c) < ' ' || c == '\x7f';
}

/// Balls of these sizes, those that fit; for a volume smaller than all of them, one as large as it.
std::string tools_text(int longest_vox) {
  std::ostringstream text;
  const auto add = [&text](int size_vox) {
    text << "\n[[tool]]\nname = \"ball " << size_vox
         << "\"\nshape = \"ball\"\nsize_vox = " << size_vox << "  # in voxels of this volume\n";
  };
  bool any = false;
  for (const int size_vox : {16, 10, 24}) {
    if (size_vox > longest_vox) continue;
    add(size_vox);
    any = true;
  }
  if (!any) add(longest_vox);
  return text.str();
}

constexpr const char* kDevice = R"(
[device]
personality = "omni"
fit = true  # the volume fills the workspace; cutting, as for voxels of 0.125 mm, grows with its own

[force]
stiffness_n_per_mm = 0.4   # of the coupling, at the device
damping_ns_per_mm = 0.002

[cut]
machinability_mm3_per_s_n = 4  # of glass ceramic, to see a cavity within seconds; enamel has 0.083
)";

/// Reads that text as the controller will, as `scene`, and throws LoadError if it is no scene of
/// `volume`.
void check_imported_scene(const std::string& text, const std::filesystem::path& scene,
                          const std::filesystem::path& volume) {
  const std::string name = volume.filename().string();
  const bool plain = std::ranges::none_of(name, is_control);
  if (plain && parse_scene(text, scene).volumes.front().file == name) return;
  throw LoadError(volume.string() +
                  ": a scene cannot name this file (its name has control characters, or is no "
                  "UTF-8); give another with --out");
}

/// The text of a scene (TOML) with this volume alone, fitted to any device as --volume fits it.
std::string imported_scene_text(const ImportedScene& scene) {
  std::ostringstream text;
  text << "# Made by kerf volume import from " << comment(scene.source)
       << "\n# ./kerf demo --scene THIS; what each key means: "
          "docs/scene-keys.md\n\n[[volume]]\nfile = "
       << Json(scene.volume.filename().string()).canonical()
       << "\nwindow = [0, 65535]\niso = " << scene.iso_density;
  if (scene.proposal != nullptr) {
    text << "  # " << scene.proposal->iso << scene.proposal->unit() << " of the source, where "
         << scene.proposal->window.lo << " is 0 and " << scene.proposal->window.hi << " is 1";
  }
  text << "\ndenoise = \"off\"  # the import made " << scene.passes
       << (scene.passes == 1 ? " pass" : " passes") << "\ncrop = false     # the import did\n";
  if (scene.proposal != nullptr) {
    text << "\n# By density alone; no voxel has a label.\n";
    for (const ProposedMaterial& material : scene.proposal->materials) {
      const auto& c = material.colour;
      text << "[[material]]\nname = " << Json(material.name).canonical()
           << "\niso = " << scene.proposal->density_of(material.from) << "\ncolour = [" << c[0]
           << ", " << c[1] << ", " << c[2] << "]\n";
    }
  }
  for (std::size_t label = default_materials().size(); label <= scene.last_label; ++label) {
    const Material material = label_material(label, scene.iso_density);
    const auto& c = material.colour;
    text << "\n[[material]]\nname = " << Json(material.name).canonical()
         << "\niso = " << material.iso << "\ncolour = [" << c[0] << ", " << c[1] << ", " << c[2]
         << "]\n";
  }
  text << tools_text(scene.longest_vox) << kDevice;
  return text.str();
}

void line(std::ostream& out, std::string what, const std::string& chosen, const char* change) {
  what.resize(11, ' ');
  out << what << escaped(chosen) << (*change == '\0' ? "" : "; ") << change << '\n';
}

std::string size_text(const VolumeFrame& frame) {
  const auto& s = frame.spacing_mm;
  std::ostringstream text;
  text << frame.grid.nx << " x " << frame.grid.ny << " x " << frame.grid.nz << " voxels of " << s[0]
       << " x " << s[1] << " x " << s[2] << " mm";
  return text.str();
}

/// No tool fits such a scene, with a spacing of the file or of the user.
void refuse_stretched(const std::string& path, const VolumeFrame& frame) {
  if (!is_stretched(frame)) return;
  const auto& s = frame.spacing_mm;
  std::ostringstream text;
  text << path << ": spacing " << s[0] << " x " << s[1] << " x " << s[2]
       << " mm has a side of more than " << kMostStretched
       << " times another; give the true voxel size with --override-spacing x,y,z (mm), or "
          "resample it";
  throw LoadError(text.str());
}

/// The longest side, in the shortest edges of a voxel: the largest size of a tool.
int longest_vox(const VolumeFrame& frame) {
  const auto& s = frame.spacing_mm;
  const double longest_mm =
      std::max({s[0] * frame.grid.nx, s[1] * frame.grid.ny, s[2] * frame.grid.nz});
  return static_cast<int>(longest_mm / std::ranges::min(s));
}

constexpr const char* kAll = ", all of it";
constexpr const char* kCropped = ", the solid and three voxels around it";
constexpr const char* kKeepsAll = "--no-crop keeps all";

std::string denoise_text(int passes, const Noise& noise) {
  std::ostringstream text;
  text << passes << (passes == 1 ? " pass" : " passes") << " of smoothing against noise of "
       << std::round(1000 * noise.share) / 10 << " % of the surface's step";
  return text.str();
}

const char* way_to_change(const std::string& what) {
  if (what == "surface") return "--iso VALUE for another";
  if (what == "window") return "--window LO,HI for another";
  if (what == "body") return "--keep-all keeps them";
  return "edit [[material]] in the scene";
}

}  // namespace

/// Lines of the output: the file, the note of its reading, and guessed axes.
struct ImportCommand::SourceLines {
  std::string file, note, axes;
};

/// The written files.
struct ImportCommand::Files {
  fs::path volume, labels, scene, preview;
};

ImportCommand::ImportCommand(Arguments& app)
    : command_(app.command("import", "any CT to a volume, a ready scene and a preview")) {
  command_.option("path", path_, "volume file, or folder of DICOM, PNG or TIFF slices")
      .required()
      .shown_as("PATH");
  command_
      .option("--out", out_, "the volume; scene and preview lie beside it (default: PATH's name)")
      .shown_as("OUT.nrrd");
  command_.option("--series", series_, "of several of DICOM: its number or a part of its name")
      .shown_as("WHICH");
  Option dims = command_.option("--dims", dims_, "voxels of a file without a header");
  dims.shown_as("NXxNYxNZ");
  command_.option("--type", type_, "of its numbers")
      .one_of({std::begin(kVoxelTypeWords), std::end(kVoxelTypeWords)})
      .shows_default()
      .needs(dims);
  command_.flag("--big-endian", big_endian_, "of its numbers: the highest byte is first")
      .needs(dims);
  command_.option("--skip", skip_, "bytes before its first voxel").within(0, 1e12).needs(dims);
  frame_.add_to(command_);
  command_.option("--iso", iso_, "the surface, in values of the file (HU of a CT)")
      .shown_as("VALUE");
  command_.option("--window", window_, "values that become density 0 and 1").shown_as("LO,HI");
  command_.option("--denoise", denoise_, "passes against noise")
      .one_of({"auto", "off", "1", "2", "3"})
      .shows_default();
  command_.flag("--keep-all", keep_all_, "couch, holder and specks stay");
  command_.flag("--no-crop", whole_, "all of the volume stays");
  command_.flag("--packed", packed_, "write with compression: smaller, and slower to load");
  command_.flag("--force", force_, "replace what is there");
  command_.option("--read-seconds", cpu_s_, "CPU time that parsing a file may take")
      .within(1, kMostReadCpuSeconds)
      .shows_default();
}

ImportCommand::Files ImportCommand::files() const {
  Files files{out_, {}, {}, {}};
  if (out_.empty()) {
    fs::path name = fs::path(path_).lexically_normal();
    if (!name.has_filename()) name = name.parent_path();
    std::string stem = name.stem().string();
    if (stem.ends_with(".nii")) stem.resize(stem.size() - 4);
    if (stem.empty() || stem == "." || stem == "..") stem = "volume";
    files.volume = stem + ".nrrd";
  }
  check_volume_path(files.volume);
  files.scene = fs::path(files.volume).replace_extension(".toml");
  files.preview = fs::path(files.volume).replace_extension(".png");
  files.labels = labels_path(files.volume);
  check_outputs(files_read(path_), {{"--out", files.volume, ".nrrd"},
                                    {"--out", files.labels, ".nrrd"},
                                    {"--out", files.scene, ".toml"},
                                    {"--out", files.preview, ".png"}});
  check_imported_scene(imported_scene_text({path_, files.volume, nullptr, 0, 0.5, 0}), files.scene,
                       files.volume);
  for (const fs::path& file : {files.volume, files.labels, files.scene, files.preview}) {
    refuse_replacing(file, force_);
  }
  return files;
}

ReadOptions ImportCommand::read_options() const {
  ReadOptions options;
  options.cpu_s = cpu_s_;
  options.series = series_;
  if (!dims_.empty()) {
    const auto word = std::ranges::find(kVoxelTypeWords, type_) - std::begin(kVoxelTypeWords);
    options.raw = RawLayout{grid_from("--dims", dims_), static_cast<VoxelType>(word), big_endian_,
                            static_cast<std::uint64_t>(skip_)};
  }
  frame_.set(options);
  return options;
}

ProposalWishes ImportCommand::wishes() const {
  ProposalWishes wishes;
  wishes.keep_all = keep_all_;
  if (!window_.empty()) wishes.window = window_from(window_);
  if (!iso_.empty()) {
    wishes.iso = number_in(iso_);
    if (!wishes.iso)
      throw LoadError("--iso: '" + iso_ + "' is not a number; give a value of the file");
  }
  return wishes;
}

void ImportCommand::run(std::ostream& out) const {
  std::error_code fault;
  if (!dims_.empty() && fs::is_directory(path_, fault)) {
    throw LoadError("--dims: " + path_ +
                    " is a folder; name one file without a header, or leave it out");
  }
  const Files to = files();
  const ReadOptions options = read_options();
  const ProposalWishes wished = wishes();
  SourceVolume source = read_volume(path_, options);
  refuse_stretched(path_, source);
  const Window range = range_window(source);
  const std::string note = source.note, axes = source.axes_note;
  std::ostringstream values;
  values << path_ << ": " << size_text(source) << ", values " << source.min << " .. " << source.max;

  VolumeImage whole = apply_window(source, range);
  read_labels_beside(path_, whole, cpu_s_);
  if (!whole.labels.empty()) refuse_beside_labels();
  const bool asked = !iso_.empty() || !window_.empty() || denoise_ != "auto" || keep_all_;
  if (whole.labels.empty() && !asked && take_label_map(source, whole, path_ + ": ")) {
    values << ", a map of labels; --iso 0.5 makes one body of them";
  }
  if (!whole.labels.empty()) {
    constexpr bool kOftenOneMm = true;  // as a CT in HU is
    refuse_odd(odd_spacing(source, solid_box(whole, otsu_threshold(whole)), kOftenOneMm));
    source = {};
    return import_labelled(std::move(whole), {values.str(), note, axes}, to, out);
  }
  ProposedVolume proposed = propose_volume(std::move(whole), range, wished);
  const VolumeProposal& proposal = proposed.proposal;
  refuse_odd(odd_spacing(source, proposal.solid, proposal.surface.hounsfield));
  const std::string preview = png_bytes(import_preview(source, proposed));
  source = {};

  const Density iso = nearest_density(proposal.density_of(proposal.iso) * kDensityMax);
  VolumeImage image = std::move(proposed.image);
  const Noise noise = noise_of(image.grid, image.density, iso);
  const int passes = denoise_ == "auto"  ? passes_for(noise)
                     : denoise_ == "off" ? 0
                                         : denoise_[0] - '0';
  if (!whole_) image = crop_for_passes(image, iso, passes);
  denoise(image.grid, image.density, passes);
  if (!whole_) {
    image = crop_to_solid(image, iso);
    fade_to_air(image);
  }
  const VolumeFrame kept = image;
  write(std::move(image), {path_, to.volume, &proposal, 0, iso / kDensityMax, passes}, preview, to);

  if (proposal.surface.hounsfield) values << ", HU by their air of -1000";
  print_source({values.str(), note, axes}, out);
  for (const ProposalLine& choice : proposal_lines(proposal)) {
    line(out, choice.what, choice.chosen, way_to_change(choice.what));
  }
  print_crop(kept, out);
  line(out, "denoise", denoise_text(passes, noise), "--denoise off, 1, 2 or 3");
  print_files(to, ", ", out);
}

void ImportCommand::print_crop(const VolumeFrame& kept, std::ostream& out) const {
  line(out, "crop", size_text(kept) + (whole_ ? kAll : kCropped), whole_ ? "" : kKeepsAll);
}

void ImportCommand::print_files(const Files& to, const char* behind_volume, std::ostream& out) {
  line(out, "wrote",
       to.volume.string() + behind_volume + to.scene.string() + ", " + to.preview.string(),
       "look at the picture first");
  line(out, "try", "./kerf demo --scene " + to.scene.string(), "");
}

void ImportCommand::print_source(const SourceLines& source, std::ostream& out) const {
  line(out, "file", source.file,
       frame_.gives_spacing() ? "" : "--override-spacing A,B,C for another voxel size");
  if (!source.note.empty()) line(out, "note", source.note, "");
  if (!source.axes.empty()) line(out, "axes", source.axes, "--axes XYZ for others");
}

void ImportCommand::refuse_odd(const std::string& odd) const {
  if (odd.empty() || frame_.gives_spacing()) return;
  throw LoadError(path_ + ": spacing " + odd);
}

void ImportCommand::refuse_beside_labels() const {
  const std::pair<const char*, bool> given[] = {{"--iso", !iso_.empty()},
                                                {"--window", !window_.empty()},
                                                {"--denoise", denoise_ != "auto"},
                                                {"--keep-all", keep_all_}};
  for (const auto& [option, is_given] : given) {
    if (!is_given) continue;
    throw LoadError(std::string(option) + ": the labels beside " + path_ +
                    " tell what is solid; leave it out");
  }
}

void ImportCommand::write(VolumeImage image, ImportedScene scene, const std::string& preview,
                          const Files& to) const {
  scene.longest_vox = longest_vox(image);
  AtomicFiles files;
  add_volume(image, to.volume, packed_ ? VolumeEncoding::gzip : VolumeEncoding::raw, files);
  const auto add = [&](const fs::path& path, const std::string& bytes) {
    AtomicFile& file = files.add(path);
    file.write(bytes.data(), bytes.size());
    file.close();
  };
  const std::string text = imported_scene_text(scene);
  check_imported_scene(text, to.scene, to.volume);
  add(to.scene, text);
  add(to.preview, preview);
  const bool labelled = !image.labels.empty();
  static_cast<void>(plan_scene(load_scene(to.scene, text, std::move(image))));  // as a run does
  commit(files, force_);
  if (!labelled) remove_labels(to.volume);
}

void ImportCommand::import_labelled(VolumeImage image, const SourceLines& source, const Files& to,
                                    std::ostream& out) const {
  const Density iso = otsu_threshold(image);
  if (!whole_) image = crop_to_solid(image, iso);
  const VolumeFrame kept = image;
  const Label last = *std::ranges::max_element(image.labels);
  const std::string preview = png_bytes(label_preview(image, iso));
  write(std::move(image), {path_, to.volume, nullptr, last, iso / kDensityMax, 0}, preview, to);
  print_source(source, out);
  line(out, "materials", "by label, the highest is " + std::to_string(last),
       "edit [[material]] in the scene");
  print_crop(kept, out);
  print_files(to, ", its labels, ", out);
}

}  // namespace kerf
