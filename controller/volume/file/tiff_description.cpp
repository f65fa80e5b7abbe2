// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cstddef>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

/// What programs write about a stack: ImageJ `key=value` on lines, OME-XML `key="value"`, tifffile
/// a shape.
class Description {
 public:
  explicit Description(std::string text) : text_(std::move(text)) {}

  [[nodiscard]] bool is_imagej() const { return text_.starts_with("ImageJ="); }
  [[nodiscard]] bool is_ome() const { return text_.find("<OME") != std::string::npos; }

  /// Empty if there is none.
  [[nodiscard]] std::string word(const std::string& key) const {
    const bool lines = is_imagej();
    const std::string start = key + (lines ? "=" : "=\"");
    for (std::size_t at = 0; (at = text_.find(start, at)) != std::string::npos; ++at) {
      if (at == 0 ||
          std::string_view(lines ? "\n" : " \t\r\n").find(text_[at - 1]) == std::string::npos)
        continue;  // the end of a longer key
      const std::string rest = text_.substr(at + start.size());
      return rest.substr(0, rest.find_first_of(lines ? "\r\n" : "\""));
    }
    return {};
  }
  [[nodiscard]] std::optional<double> number(const std::string& key) const {
    const std::string text = word(key);
    double value = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault != std::errc{} || end != text.data() + text.size()) return {};
    return value;
  }
  /// Names and lengths of the axes beyond rows and columns.
  [[nodiscard]] std::vector<std::pair<std::string, double>> axes() const {
    std::vector<std::pair<std::string, double>> found;
    for (const char* const key : {"channels", "slices", "frames", "SizeC", "SizeZ", "SizeT"}) {
      if (const auto count = number(key)) found.emplace_back(key, *count);
    }
    if (!text_.starts_with("{\"shape\": [")) return found;
    std::istringstream shape(text_.substr(text_.find('[') + 1));
    char after = ',';
    for (double count = 0; after == ',' && shape >> count >> after;) {
      found.emplace_back("axis " + std::to_string(found.size() + 1), count);
    }
    constexpr std::string_view kLetters = "\"axes\": \"";
    const std::size_t letters = text_.find(kLetters);
    for (std::size_t i = 0; letters != std::string::npos && i < found.size(); ++i) {
      const std::string rest = text_.substr(std::min(letters + kLetters.size() + i, text_.size()));
      if (rest.starts_with('C') || rest.starts_with('S')) found[i].first = "channels";
      if (rest.starts_with('T')) found[i].first = "frames";
    }
    found.resize(std::max<std::size_t>(found.size(), 2) - 2);
    return found;
  }
  /// Whether OME-XML has the planes in the order of the pages.
  [[nodiscard]] bool in_order() const {
    for (std::size_t at = 0; (at = text_.find("<TiffData", at)) != std::string::npos; ++at) {
      const Description part(text_.substr(at, text_.find('>', at) - at));
      double plane = 0;
      for (const char* const key : {"FirstZ", "FirstC", "FirstT"}) {
        plane += part.number(key).value_or(0);
      }
      if (plane != part.number("IFD").value_or(plane)) return false;
    }
    return true;
  }

 private:
  std::string text_;
};

/// A unit in mm; none for one that is no length, such as ImageJ's `pixel`.
std::optional<double> mm_of(std::string unit) {
  constexpr std::string_view kMicro = "\\u00B5";  // as ImageJ writes it
  if (unit.starts_with(kMicro)) unit.replace(0, kMicro.size(), "u");
  const auto length = unit.empty() || unit[0] == '?' ? std::nullopt : length_unit(unit);
  if (!length) return {};
  return length->times / length->over;
}

/// Refuses a file whose pages are not the slices of one volume by its description.
void check_axes(const fs::path& path, const Description& description, Slices& slices) {
  double images = 1;
  std::vector<std::string> names;
  for (const auto& [name, count] : description.axes()) {
    images *= count;
    if (count > 1) names.push_back(name);
  }
  if (names.size() > 1) {
    kerf::refuse(path.string(), ": its description has " + names[0] + " and " + names[1] +
                                    "; save one volume, of slices alone, as a separate file");
  }
  if (!names.empty() && (names[0] == "channels" || names[0] == "SizeC")) {
    kerf::refuse(path.string(), ": its description has " + short_text(images) +
                                    " channels; save one of them as a separate file");
  }
  images = std::max(images, description.number("images").value_or(1));
  if (images > 1 && images != static_cast<double>(slices.size[2])) {
    kerf::refuse(path.string(), ": its description names " + short_text(images) +
                                    " images, and the file has pages for " +
                                    std::to_string(slices.size[2]) +
                                    "; save it again with a page for each image");
  }
  if (!description.in_order()) {
    kerf::refuse(path.string(), ": its OME-XML has the pages in another order; save them in order");
  }
  if (!names.empty() && names[0] != "slices" && names[0] != "SizeZ" && names[0] != "axis 1") {
    slices.say("its " + names[0] + " are taken as slices");
  }
}

/// Sets the spacing that ImageJ or OME-XML names. Resolution alone is a size for printing, often a
/// program's constant: it is noted and not taken.
void set_spacing(const Description& description, const TiffResolution& resolution, Slices& slices) {
  const auto set = [&](std::size_t axis, double edge, const std::optional<double>& unit_mm) {
    if (!unit_mm || !(edge > 0) || !(edge < std::numeric_limits<double>::max())) return;
    slices.spacing_mm[axis] = edge * *unit_mm;
    slices.spacing_known |= 1U << axis;
  };
  if (description.is_imagej()) {
    const std::string unit = description.word("unit");
    const auto unit_of = [&](const char* key) {
      const std::string own = description.word(key);
      return mm_of(own.empty() ? unit : own);
    };
    set(0, 1 / resolution.x, mm_of(unit));
    set(1, 1 / resolution.y, unit_of("yunit"));
    set(2, description.number("spacing").value_or(0), unit_of("zunit"));
  } else if (description.is_ome()) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string key = std::string("PhysicalSize") + "XYZ"[axis];
      const std::string unit = description.word(key + "Unit");
      set(axis, description.number(key).value_or(0), mm_of(unit.empty() ? "um" : unit));
    }
  } else if (resolution.x > 0 && resolution.y > 0) {
    constexpr unsigned kInch = 2, kCentimetre = 3;  // TIFF 6.0, section 8
    const double mm = resolution.unit == kInch ? 25.4 : resolution.unit == kCentimetre ? 10 : 0;
    if (mm > 0) {
      slices.say("its resolution for printing, " + short_text(mm / resolution.x) + " x " +
                 short_text(mm / resolution.y) + " mm a pixel, is not taken as its spacing");
    }
  }
}

/// ImageJ keeps signed and calibrated images as unsigned numbers and a straight line.
Scaling scaling_of(const fs::path& path, const Description& description) {
  constexpr double kStraightLine = 0, kNone = 20;  // ij.measure.Calibration
  const auto function = description.number("cf");
  if (!description.is_imagej() || !function || *function == kNone) return {};
  const auto intercept = description.number("c0"), slope = description.number("c1");
  if (*function == kStraightLine && intercept && slope) return {*slope, *intercept};
  kerf::refuse(path.string(), ": ImageJ's calibration function " + short_text(*function) +
                                  " is no straight line; save it uncalibrated");
}

}  // namespace

void describe_slices(const fs::path& path, const std::string& text,
                     const TiffResolution& resolution, Slices& slices) {
  const Description description(text);
  check_axes(path, description, slices);
  set_spacing(description, resolution, slices);
  slices.scaling = scaling_of(path, description);
}

}  // namespace kerf::volume
