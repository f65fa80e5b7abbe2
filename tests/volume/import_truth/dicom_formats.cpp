// SPDX-License-Identifier: Apache-2.0
// DICOM: a series of CT slices, and an enhanced CT of many frames in one file (PS3.3 A.3, A.38;
// PS3.5 7.1, PS3.10 7.1).
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "tests/volume/import_truth/numbered.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::test {
namespace {
using vec3::Vec, vec3::cross, vec3::dot, vec3::operator*, vec3::operator+;

struct DataSet;
struct Element {
  std::string vr, value;       ///< numbers little-endian
  std::vector<DataSet> items;  ///< of a sequence
};
struct DataSet {
  std::map<std::uint32_t, Element> elements;

  void set(std::uint32_t tag, const char* vr, const std::string& value) {
    elements[tag] = {vr, value, {}};
  }
  void number(std::uint32_t tag, int value) {
    set(tag, "US", bytes_of(static_cast<std::uint16_t>(value)));
  }
  void nest(std::uint32_t tag, std::vector<DataSet> items) {
    elements[tag] = {"SQ", "", std::move(items)};
  }
  DataSet& item(std::uint32_t tag) { return elements[tag].items.front(); }
  void erase(std::uint32_t tag) { elements.erase(tag); }
};

enum class Syntax : std::uint8_t { explicit_little, implicit_little, explicit_big };

std::string encoded(const DataSet& set, Syntax syntax) {
  const std::endian order = syntax == Syntax::explicit_big ? std::endian::big : std::endian::little;
  std::string all;
  for (const auto& [tag, element] : set.elements) {
    std::string value = element.value;
    for (const DataSet& item : element.items) {
      const std::string bytes = encoded(item, syntax);
      value += bytes_of(std::uint16_t{0xFFFE}, order) + bytes_of(std::uint16_t{0xE000}, order) +
               bytes_of(static_cast<std::uint32_t>(bytes.size()), order) + bytes;
    }
    const std::string& vr = element.vr;
    if (value.size() % 2 == 1) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
    const std::size_t unit = vr == "US" || vr == "SS" || vr == "OW" ? 2 : vr == "UL" ? 4 : 1;
    if (order == std::endian::big) {
      for (std::size_t at = 0; at < value.size(); at += unit) {
        std::reverse(value.begin() + static_cast<std::ptrdiff_t>(at),
                     value.begin() + static_cast<std::ptrdiff_t>(at + unit));
      }
    }
    all += bytes_of(static_cast<std::uint16_t>(tag >> 16), order) +
           bytes_of(static_cast<std::uint16_t>(tag), order);
    const bool wide = vr == "OB" || vr == "OW" || vr == "SQ" || vr == "UT";
    if (syntax != Syntax::implicit_little) all += vr + (wide ? std::string(2, '\0') : "");
    all += syntax == Syntax::implicit_little || wide
               ? bytes_of(static_cast<std::uint32_t>(value.size()), order)
               : bytes_of(static_cast<std::uint16_t>(value.size()), order);
    all += value;
  }
  return all;
}

std::string dicom_bytes(const DataSet& set, Syntax syntax, const std::string& uid = "") {
  constexpr const char* kUids[] = {"1.2.840.10008.1.2.1", "1.2.840.10008.1.2",
                                   "1.2.840.10008.1.2.2"};
  DataSet meta;
  meta.set(0x00020001, "OB", std::string("\0\1", 2));
  meta.set(0x00020002, "UI", set.elements.at(0x00080016).value);
  meta.set(0x00020003, "UI", set.elements.at(0x00080018).value);
  meta.set(0x00020010, "UI", uid.empty() ? kUids[static_cast<int>(syntax)] : uid);
  const std::string bytes = encoded(meta, Syntax::explicit_little);
  DataSet length;
  length.set(0x00020000, "UL", bytes_of(static_cast<std::uint32_t>(bytes.size())));
  return std::string(128, '\0') + "DICM" + encoded(length, Syntax::explicit_little) + bytes +
         encoded(set, syntax);
}

/// A decimal string of at most 16 characters (PS3.5 6.2) with `digits` behind the point.
std::string ds(double value, int digits = 10) {
  std::string text = fixed_text(value, digits);
  if (text.find('.') != std::string::npos) {
    while (text.back() == '0') text.pop_back();
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}
std::string ds(std::initializer_list<double> list, int digits = 10) {
  std::string text;
  for (const double x : list) text += (text.empty() ? "" : "\\") + ds(x, digits);
  return text;
}
std::string ds(const Vec& v, int digits = 10) {
  return ds({v[0], v[1], v[2]}, digits);
}

constexpr const char* kSeries = "1.2.826.0.1.3680043.2.1125.5";

/// What one image of the volume has, classic or enhanced, but for its position.
DataSet common(Draw& draw, const Numbered& v, const char* sop_class, const std::string& instance) {
  DataSet set;
  set.set(0x00080008, "CS", "ORIGINAL\\PRIMARY\\AXIAL");
  set.set(0x00080016, "UI", sop_class);
  set.set(0x00080018, "UI", instance);
  set.set(0x00080060, "CS", "CT");
  set.set(0x0020000D, "UI", "1.2.826.0.1.3680043.2.1125.9");
  set.set(0x0020000E, "UI", kSeries);
  set.set(0x00200052, "UI", "1.2.826.0.1.3680043.2.1125.8");
  set.number(0x00280002, 1);
  set.set(0x00280004, "CS", "MONOCHROME2");
  set.number(0x00280010, v.size[1]);
  set.number(0x00280011, v.size[0]);
  const int bits = static_cast<int>(8 * bytes_of(v.type));
  set.number(0x00280100, bits);
  set.number(0x00280101, bits);
  set.number(0x00280102, bits - 1);
  set.number(0x00280103, static_cast<int>(v.type) % 2);
  if (draw.coin()) {  // of the display alone
    set.set(0x00281050, "DS", "40\\400");
    set.set(0x00281051, "DS", "400\\2000");
  }
  return set;
}

std::string orientation_of(const Numbered& v, int digits = 12) {
  return ds(v.axes[0], digits) + "\\" + ds(v.axes[1], digits);
}

std::string spacing_text(const Numbered& v) {
  return ds({v.spacing_mm[1], v.spacing_mm[0]});
}

/// The slices of a series in the order of the volume, and their files.
struct Series {
  Draw& draw;
  const TemporaryFolder& folder;
  Written out{};
  std::vector<DataSet> slices{};
  std::vector<std::string> names{};
  Syntax syntax = Syntax::explicit_little;

  Numbered& volume() { return out.truth; }
  void each(const std::function<void(DataSet&, int)>& change) {
    for (std::size_t k = 0; k < slices.size(); ++k) change(slices[k], static_cast<int>(k));
  }
};

void set_values(DataSet& set, const Numbered& v, int first, int last) {
  set.set(0x7FE00010, bytes_of(v.type) == 1 ? "OB" : "OW", v.bytes(first, last));
}

Numbered dicom_volume(Draw& draw) {
  Numbered v = numbered(
      draw, draw.of({VoxelType::int16, VoxelType::uint16, VoxelType::int16, VoxelType::uint8}), 3);
  v.order = std::endian::little;
  v.digits = 2e-12;
  return v;
}

Series series_of(Draw& draw, const TemporaryFolder& folder) {
  Series f{draw, folder, {{}, {}, dicom_volume(draw)}};
  const Numbered& v = f.volume();
  f.syntax = draw.of({Syntax::explicit_little, Syntax::implicit_little, Syntax::explicit_big});
  std::vector<int> numbers(static_cast<std::size_t>(v.size[2]));
  std::iota(numbers.begin(), numbers.end(), 0);
  const int order = draw.below(3);  // of the files: rising, falling, random
  if (order == 1) std::ranges::reverse(numbers);
  for (std::size_t i = numbers.size(); order == 2 && i > 1; --i) {
    std::swap(numbers[i - 1], numbers[static_cast<std::size_t>(draw.below(static_cast<int>(i)))]);
  }
  for (int k = 0; k < v.size[2]; ++k) {
    const int number = numbers[static_cast<std::size_t>(k)];
    DataSet set = common(draw, v, "1.2.840.10008.5.1.4.1.1.2",
                         std::string(kSeries) + ".7." + std::to_string(number + 1));
    set.set(0x00180050, "DS", ds(draw.of({v.spacing_mm[2], 0.5, 5.0})));  // thickness
    set.set(0x00200013, "IS", std::to_string(number + 1));
    set.set(0x00200032, "DS", ds(v.position(0, 0, k)));
    set.set(0x00200037, "DS", orientation_of(v));
    set.set(0x00280030, "DS", spacing_text(v));
    set_values(set, v, k, k + 1);
    f.slices.push_back(set);
    f.names.push_back("I" + std::to_string(number));
  }
  return f;
}

void write_series(Series& f) {
  for (std::size_t k = 0; k < f.slices.size(); ++k) {
    f.folder.write(f.names[k], dicom_bytes(f.slices[k], f.syntax));
  }
  f.out.path = f.folder.path();
}

/// Slope and intercept for each slice.
template <class Number>
void rescale(Series& f, const Number& of_slice) {
  f.each([&](DataSet& set, int k) {
    set.set(0x00281052, "DS", ds(of_slice(k)[1]));
    set.set(0x00281053, "DS", ds(of_slice(k)[0]));
  });
  f.volume().scale(of_slice);
}

/// Files without positions: the slices lie along the normal, from the first, which is nowhere.
void without_positions(Series& f, bool by_number) {
  Numbered& v = f.volume();
  v.axes[2] = cross(v.axes[0], v.axes[1]);
  f.each([&](DataSet& set, int k) {
    set.erase(0x00200032);
    if (by_number) {
      set.set(0x00200013, "IS", std::to_string(k + 1));
    } else {
      set.erase(0x00200013);
      set.set(0x00201041, "DS", ds(k * v.spacing_mm[2]));
    }
  });
  v.any_origin = true;
  if (by_number) f.out.options.spacing_mm = v.spacing_mm;
  f.out.note = by_number ? "InstanceNumber" : "SliceLocation";
}

struct SeriesRow {
  const char* name;
  Expected expected;
  const char* word;
  void (*change)(Series&);
};

/// A pixel padding: a value of the file that stands for no measurement. It may come back as any
/// value that is not denser than the rest.
void pad(Series& f, VoxelType type, double padding, std::optional<double> limit = {}) {
  Numbered& v = f.volume();
  number_anew(f.draw, v, type, 10);
  for (std::size_t i = 1; i < v.count(); i += 3) {
    v.stored[i] = i % 2 == 0 ? padding : limit.value_or(padding);
    v.values[i] = NAN;  // air: any value that is at most the least of the others
  }
  const int bits = static_cast<int>(8 * bytes_of(type));
  f.each([&](DataSet& set, int k) {
    set.number(0x00280100, bits);
    set.number(0x00280101, bits);
    set.number(0x00280102, bits - 1);
    set.number(0x00280103, static_cast<int>(type) % 2);
    const bool is_signed = static_cast<int>(type) % 2 == 1;
    const auto text = [](double value) {
      return bytes_of(static_cast<std::uint16_t>(static_cast<std::int32_t>(value)));
    };
    set.set(0x00280120, is_signed ? "SS" : "US", text(padding));
    if (limit) set.set(0x00280121, is_signed ? "SS" : "US", text(*limit));
    set_values(set, v, k, k + 1);
  });
}

/// Takes the last layer from the truth.
void without_last(Numbered& v) {
  --v.size[2];
  v.stored.resize(v.stored.size() - v.stored.size() / static_cast<std::size_t>(v.size[2] + 1));
  v.values.resize(v.stored.size());
}

/// A file that is no slice: colours, no picture at all, or of an encoding that is unknown.
void add_unfit(Series& f, const char* series) {
  DataSet other = f.slices[0];
  other.set(0x00080018, "UI", "1.2.3.4");
  other.set(0x0020000E, "UI", series);
#ifdef KERF_SANITIZED  // whose allocator ends a reader that asks for as much as a broken file says
  const int kind = f.draw.below(3) % 2;
#else
  const int kind = f.draw.below(3);
#endif
  if (kind == 0) {
    other.number(0x00280002, 3);
    other.set(0x00280004, "CS", "RGB");
    other.number(0x00280006, 0);
    other.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.7");
    const std::string& grey = other.elements[0x7FE00010].value;
    other.set(0x7FE00010, "OW", grey + grey + grey);
  } else if (kind == 1) {
    other.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.88.11");
    for (const std::uint32_t tag : {0x7FE00010U, 0x00280010U, 0x00280011U}) other.erase(tag);
  }
  f.folder.write(f.draw.word("A|zz"),
                 dicom_bytes(other, f.syntax, kind == 2 ? "1.2.840.10008.1.2.4.203" : ""));
  f.out.note = kind == 1 ? "" : "skipped";
}

constexpr SeriesRow kSeriesRows[] = {
    {"each type, orientation, order of files and numbers; implicit, explicit, big-endian", kRead,
     "", [](Series&) {}},
    {"rescale slope and intercept", kRead, "",
     [](Series& f) {
       const double slope = f.draw.of({1.0, 0.5, 2.0, 0.1});
       const double intercept = f.draw.of({0.0, -1024.0, -1000.5});
       rescale(f, [=](int) { return std::array{slope, intercept}; });
     }},
    {"rescale slope of each slice", kRead, "",
     [](Series& f) {
       rescale(f, [](int k) {
         return std::array{std::array{0.5, 1.0, 0.25}[std::size_t(k % 3)], -1.0 * k};
       });
     }},
    {"rescale slope 0 or no number", kRefused, "Rescale",
     [](Series& f) {
       f.slices[1].set(0x00281053, "DS", f.draw.of({"0", "abc", "nan"}));
       f.slices[1].set(0x00281052, "DS", "0");
     }},
    {"12 bits stored of 16, and bits of another use above them", kRead, "",
     [](Series& f) {
       Numbered& v = f.volume();
       number_anew(f.draw, v, f.draw.of({VoxelType::int16, VoxelType::uint16}), 12);
       const bool is_signed = v.type == VoxelType::int16, junk = f.draw.coin();
       std::vector<double> kept = v.values;
       v.type = VoxelType::uint16;
       for (double& value : v.stored) {
         value = (static_cast<int>(value) & 0xFFF) + (junk ? f.draw.below(16) << 12 : 0);
       }
       f.each([&](DataSet& set, int k) {
         set.number(0x00280100, 16);
         set.number(0x00280101, 12);
         set.number(0x00280102, 11);
         set.number(0x00280103, is_signed ? 1 : 0);
         set_values(set, v, k, k + 1);
       });
       v.values = kept;
     }},
    {"tags that concern only the display (MONOCHROME1, windows, VOI LUT, presentation LUT)", kRead,
     "",
     [](Series& f) {
       const int kind = f.draw.below(3);
       f.each([&](DataSet& set, int) {
         if (kind == 0) set.set(0x00280004, "CS", "MONOCHROME1");
         if (kind == 1) set.set(0x20500020, "CS", "INVERSE");
         if (kind == 2) {
           DataSet lut;
           lut.set(0x00283002, "US", bytes_of(std::vector<std::uint16_t>{2, 0, 16}));
           lut.set(0x00283006, "OW", bytes_of(std::vector<std::uint16_t>{65535, 0}));
           set.nest(0x00283010, {lut});
         }
       });
     }},
    {"Modality LUT sequence", kEither, "LUT",
     [](Series& f) {
       Numbered& v = f.volume();
       number_anew(f.draw, v, VoxelType::uint8);
       DataSet lut;
       std::vector<std::uint16_t> table;
       for (int i = 0; i < 256; ++i) table.push_back(static_cast<std::uint16_t>(f.draw.bits()));
       lut.set(0x00283002, "US", bytes_of(std::vector<std::uint16_t>{256, 0, 16}));
       lut.set(0x00283004, "LO", "HU");
       lut.set(0x00283006, "OW", bytes_of(table));
       f.each([&](DataSet& set, int k) {
         for (const std::uint32_t tag : {0x00280100U, 0x00280101U}) set.number(tag, 8);
         set.number(0x00280102, 7);
         set.number(0x00280103, 0);
         set.nest(0x00283000, {lut});
         set_values(set, v, k, k + 1);
       });
       for (std::size_t i = 0; i < v.count(); ++i) {
         v.values[i] = table[static_cast<std::size_t>(v.stored[i])];
       }
     }},
    {"pixel padding of any type and value becomes air", kRead, "",
     [](Series& f) {
       if (f.draw.coin())
         pad(f, VoxelType::int16, f.draw.of({-2000.0, -32768.0, 32767.0}));
       else
         pad(f, VoxelType::uint16, f.draw.of({63536.0, 65535.0, 32768.0}));
     }},
    {"pixel padding of a range", kRead, "",
     [](Series& f) {
       pad(f, VoxelType::uint16, 63536, f.draw.of({65535.0, 60000.0}));
     }},
    {"12 bits stored at the upper end of 16 (HighBit 15)", kEither, "bit",
     [](Series& f) {
       Numbered& v = f.volume();
       number_anew(f.draw, v, VoxelType::uint16, 12);
       for (double& value : v.stored) value *= 16;
       f.each([&](DataSet& set, int k) {
         set.number(0x00280100, 16);
         set.number(0x00280101, 12);
         set.number(0x00280102, 15);
         set.number(0x00280103, 0);
         set_values(set, v, k, k + 1);
       });
     }},
    {"SliceLocation, InstanceNumber and times that contradict the positions", kRead, "",
     [](Series& f) {
       f.each([&](DataSet& set, int k) {
         set.set(0x00201041, "DS", std::to_string(f.draw.below(50)));
         set.set(0x00200013, "IS", std::to_string(f.draw.coin() ? 7 : 100 - k));
         set.set(0x00080032, "TM", "1200" + std::to_string(10 + k));
       });
     }},
    {"no position, order by InstanceNumber; --spacing given", kEither, "position",
     [](Series& f) { without_positions(f, true); }},
    {"no position, --spacing not given", kEither, "",
     [](Series& f) {
       without_positions(f, true);
       f.out.options.spacing_mm.reset();
       f.volume().spacing_mm = {-1, -1, -1};  // no position is right
     }},
    {"no position, order by SliceLocation", kEither, "position",
     [](Series& f) { without_positions(f, false); }},
    {"neither position nor number", kRefused, "",
     [](Series& f) {
       without_positions(f, true);
       f.each([](DataSet& set, int) { set.erase(0x00200013); });
     }},
    {"all slices at one position", kEither, "position",
     [](Series& f) {
       const Vec first = f.volume().origin_mm;
       without_positions(f, true);
       f.each([&](DataSet& set, int) { set.set(0x00200032, "DS", ds(first)); });
     }},
    {"a slice is missing; --spacing given or not", kRefused, "missing",
     [](Series& f) {
       Numbered& v = f.volume();
       if (f.draw.coin()) f.out.options.spacing_mm = v.spacing_mm;
       f.slices.back().set(0x00200032, "DS", ds(v.position(0, 0, v.size[2] + f.draw.below(4))));
     }},
    {"a slice twice", kRefused, "",
     [](Series& f) {
       f.slices.push_back(f.slices[1]);
       f.slices.back().set(0x00080018, "UI", std::string(kSeries) + ".8.1");
       f.names.push_back("twice");
     }},
    {"two times of each slice", kRefused, "",
     [](Series& f) {
       for (int k = f.volume().size[2]; k-- > 0;) {
         DataSet again = f.slices[static_cast<std::size_t>(k)];
         again.set(0x00080018, "UI", std::string(kSeries) + ".8." + std::to_string(k));
         again.set(0x00200013, "IS", std::to_string(500 + k));
         f.slices.push_back(again);
         f.names.push_back("time2-" + std::to_string(k));
       }
     }},
    {"orientations that differ by 1e-9, spacings and positions rounded to few digits", kRead, "",
     [](Series& f) {
       Numbered& v = f.volume();
       const int kind = f.draw.below(3);
       if (kind == 1) v.spacing_mm[0] = v.spacing_mm[1] = 0.48828125;
       if (kind == 2) {
         v.spacing_mm[2] = f.draw.of({0.625, 1.25, 2.0 / 3});
         v.slack_mm = 0.15;  // half a unit in each coordinate
         v.digits = 1e-2;
       }
       if (kind == 1) v.digits = 1e-5;
       f.each([&](DataSet& set, int k) {
         if (kind == 0) {
           Numbered near = v;
           for (Vec& axis : near.axes) axis[std::size_t(k % 3)] += 1e-9 * (f.draw.below(3) - 1);
           set.set(0x00200037, "DS", orientation_of(near));
           v.digits = 1e-8;
         }
         if (kind == 1)
           set.set(0x00280030, "DS", k % 2 == 0 ? "0.488281\\0.488281" : "0.48828125\\0.48828125");
         set.set(0x00200032, "DS", ds(v.position(0, 0, k), kind == 2 ? 1 : 10));
       });
     }},
    {"SpacingBetweenSlices that is negative or contradicts the positions", kRead, "",
     [](Series& f) {
       f.each([&](DataSet& set, int) { set.set(0x00180088, "DS", ds(f.draw.of({-1.0, 9.0}))); });
     }},
    {"no PixelSpacing", kAsked, "--spacing",
     [](Series& f) { f.each([](DataSet& set, int) { set.erase(0x00280030); }); }},
    {"one slice has another size, spacing or orientation", kEither, "",
     [](Series& f) {
       Numbered& v = f.volume();
       DataSet& set = f.slices.back();
       Numbered other = v;
       const int kind = f.draw.below(3);
       if (kind == 0) ++other.size[1];
       if (kind == 1) other.spacing_mm[1] *= 1.1;
       if (kind == 2) std::swap(other.axes[0], other.axes[1]);
       number_anew(f.draw, other, v.type);
       set.number(0x00280010, other.size[1]);
       set.set(0x00280030, "DS", spacing_text(other));
       set.set(0x00200037, "DS", orientation_of(other));
       set_values(set, other, 1, 2);
       without_last(v);
       f.out.note = "series";
     }},
    {"tilted gantry", kRefused, "right angles",
     [](Series& f) {
       const Numbered& v = f.volume();
       f.each([&](DataSet& set, int k) {
         set.set(0x00200032, "DS",
                 ds(v.position(0, 0, k) + (0.3 * k * v.spacing_mm[2]) * v.axes[1]));
       });
     }},
    {"a screenshot, a report or an unreadable file of another series in the same folder", kRead, "",
     [](Series& f) { add_unfit(f, "1.2.3"); }},
    {"a screenshot, a report or an unreadable file of the same series", kEither, "",
     [](Series& f) { add_unfit(f, kSeries); }},
    {"a text file in the same folder", kRead, "",
     [](Series& f) { f.folder.write(f.draw.word("A.txt|zz"), "no image"); }},
    {"an encoding that is unknown", kRefused, "",
     [](Series& f) {
       for (std::size_t k = 0; k < f.slices.size(); ++k) {
         f.folder.write(f.names[k], dicom_bytes(f.slices[k], f.syntax, "1.2.840.10008.1.2.4.203"));
       }
       f.slices.clear();
     }},
    {"slices in sub-folders, beside an index or a text file", kRead, "",
     [](Series& f) {
       f.folder.write("DICOMDIR", "an index");
       if (f.draw.coin()) f.folder.write("README.TXT", "x");
       for (std::string& name : f.names) name = "DICOM/P1/" + name;
     }},
    {"two series; --series not given", kAsked, "--series",
     [](Series& f) {
       const auto count = f.slices.size();
       for (std::size_t k = 0; k < count; ++k) {
         DataSet other = f.slices[k];
         other.set(0x0020000E, "UI", "1.2.3");
         other.set(0x00080018, "UI", "1.2.3.4." + std::to_string(k));
         f.slices.push_back(other);
         f.names.push_back("other" + std::to_string(k));
       }
     }},
    {"--spacing that contradicts the files", kRefused, "spacing",
     [](Series& f) {
       f.out.options.spacing_mm = f.volume().spacing_mm;
       (*f.out.options.spacing_mm)[static_cast<std::size_t>(f.draw.below(3))] += 1;
     }},
    {"cut off", kRefused, "",
     [](Series& f) {
       Element& pixels = f.slices[1].elements[0x7FE00010];
       pixels.value.resize(pixels.value.size() / 2 / 2 * 2);
     }},
};

/// Enhanced CT: the frames in the order of the file.
struct Frames {
  Draw& draw;
  Written out{};
  DataSet set{};
  std::vector<int> slice{};       ///< of the volume, for each frame
  std::vector<DataSet> groups{};  ///< of each frame
  DataSet shared{};
  bool one_less = false;  ///< the last slice is not read
  Numbered& volume() { return out.truth; }
};

constexpr std::uint32_t kContent = 0x00209111, kPlane = 0x00209113, kPlaneWay = 0x00209116,
                        kMeasures = 0x00289110, kTransformation = 0x00289145;

DataSet one(std::uint32_t tag, const char* vr, const std::string& value) {
  DataSet set;
  set.set(tag, vr, value);
  return set;
}

DataSet rescale_item(double slope, double intercept) {
  DataSet set = one(0x00281052, "DS", ds(intercept));
  set.set(0x00281053, "DS", ds(slope));
  set.set(0x00281054, "LO", "HU");
  return set;
}

Frames frames_of(Draw& draw) {
  Frames f{draw, {{}, {}, dicom_volume(draw)}};
  Numbered& v = f.volume();
  f.set = common(draw, v, "1.2.840.10008.5.1.4.1.1.2.1", std::string(kSeries) + ".6");
  f.slice.resize(static_cast<std::size_t>(v.size[2]));
  std::iota(f.slice.begin(), f.slice.end(), 0);
  const int order = draw.below(3);
  if (order == 1) std::ranges::reverse(f.slice);
  for (std::size_t i = f.slice.size(); order == 2 && i > 1; --i) {
    std::swap(f.slice[i - 1], f.slice[static_cast<std::size_t>(draw.below(static_cast<int>(i)))]);
  }
  DataSet measures = one(0x00280030, "DS", spacing_text(v));
  measures.set(0x00180050, "DS", ds(draw.of({v.spacing_mm[2], 0.5, 5.0})));
  const bool each = draw.coin();
  const DataSet way = one(0x00200037, "DS", orientation_of(v));
  if (!each) {
    f.shared.nest(kMeasures, {measures});
    f.shared.nest(kPlaneWay, {way});
    f.shared.nest(kTransformation, {rescale_item(1, 0)});
  }
  for (std::size_t n = 0; n < f.slice.size(); ++n) {
    DataSet group;
    DataSet content = one(0x00209056, "SH", "1");
    content.set(0x00209057, "UL", bytes_of(static_cast<std::uint32_t>(f.slice[n] + 1)));
    group.nest(kContent, {content});
    group.nest(kPlane, {one(0x00200032, "DS", ds(v.position(0, 0, f.slice[n])))});
    if (each) {
      group.nest(kMeasures, {measures});
      group.nest(kPlaneWay, {way});
      group.nest(kTransformation, {rescale_item(1, 0)});
    }
    f.groups.push_back(group);
  }
  return f;
}

void write_frames(Frames& f, const TemporaryFolder& folder) {
  f.set.elements.try_emplace(0x00280008, Element{"IS", std::to_string(f.slice.size()), {}});
  f.set.nest(0x52009229, {f.shared});
  f.set.nest(0x52009230, f.groups);
  std::string pixels;
  for (const int k : f.slice) pixels += f.volume().bytes(k, k + 1);
  f.set.set(0x7FE00010, bytes_of(f.volume().type) == 1 ? "OB" : "OW", pixels);
  if (f.one_less) without_last(f.volume());
  f.out.path = folder.write(
      "a.dcm", dicom_bytes(f.set, f.draw.of({Syntax::explicit_little, Syntax::implicit_little})));
}

struct FramesRow {
  const char* name;
  Expected expected;
  const char* word;
  void (*change)(Frames&);
};

/// Leaves out, or says twice, the slice behind the first.
void repeat(Frames& f, std::size_t n, int times) {
  for (; times > 1; --times) {
    f.slice.push_back(f.slice[n]);
    f.groups.push_back(f.groups[n]);
  }
  if (times > 0) return;
  f.slice.erase(f.slice.begin() + static_cast<std::ptrdiff_t>(n));
  f.groups.erase(f.groups.begin() + static_cast<std::ptrdiff_t>(n));
}

constexpr FramesRow kFramesRows[] = {
    {"each type, orientation, order of frames; groups shared or of each frame", kRead, "",
     [](Frames&) {}},
    {"rescale shared", kRead, "",
     [](Frames& f) {
       const double slope = f.draw.of({0.5, 2.0}), intercept = -1024;
       for (DataSet& group : f.groups) group.erase(kTransformation);
       f.shared.nest(kTransformation, {rescale_item(slope, intercept)});
       f.volume().scale([=](int) { return std::array{slope, intercept}; });
     }},
    {"rescale of each frame", kRead, "",
     [](Frames& f) {
       f.shared.erase(kTransformation);
       const auto of = [](int k) {
         return std::array{std::array{0.5, 1.0, 0.25}[std::size_t(k % 3)], -2.0 * k};
       };
       for (std::size_t n = 0; n < f.groups.size(); ++n) {
         const auto [slope, intercept] = of(f.slice[n]);
         f.groups[n].nest(kTransformation, {rescale_item(slope, intercept)});
       }
       f.volume().scale(of);
     }},
    {"pixel padding", kRead, "",
     [](Frames& f) {
       Numbered& v = f.volume();
       number_anew(f.draw, v, VoxelType::uint16, 10);
       for (std::size_t i = 1; i < v.count(); i += 3) v.stored[i] = 63536, v.values[i] = NAN;
       for (const std::uint32_t tag : {0x00280100U, 0x00280101U}) f.set.number(tag, 16);
       f.set.number(0x00280102, 15);
       f.set.number(0x00280103, 0);
       f.set.number(0x00280120, 63536);
     }},
    {"MONOCHROME1", kRead, "", [](Frames& f) { f.set.set(0x00280004, "CS", "MONOCHROME1"); }},
    {"a frame is missing; --spacing given or not", kRefused, "",
     [](Frames& f) {
       Numbered& v = f.volume();
       if (f.draw.coin()) f.out.options.spacing_mm = v.spacing_mm;
       const auto n =
           static_cast<std::size_t>(std::ranges::find(f.slice, v.size[2] - 1) - f.slice.begin());
       f.groups[n].item(kPlane).set(0x00200032, "DS", ds(v.position(0, 0, v.size[2])));
     }},
    {"a frame twice", kRefused, "", [](Frames& f) { repeat(f, 1, 2); }},
    {"several times", kRefused, "",
     [](Frames& f) {
       for (std::size_t n = f.slice.size(); n-- > 0;) {
         repeat(f, n, 2);
         f.groups.back().item(kContent).set(0x00209128, "UL", bytes_of(std::uint32_t{2}));
       }
     }},
    {"frames without position, order by number in the stack; --spacing given", kEither, "position",
     [](Frames& f) {
       f.out.options.spacing_mm = f.volume().spacing_mm;
       f.volume().axes[2] = cross(f.volume().axes[0], f.volume().axes[1]);
       f.volume().any_origin = true;
       for (DataSet& group : f.groups) group.erase(kPlane);
     }},
    {"frames without position, --spacing not given", kEither, "",
     [](Frames& f) {
       for (DataSet& group : f.groups) group.erase(kPlane);
       f.volume().spacing_mm[2] = -1;  // no position is right
     }},
    {"a frame of another orientation", kEither, "",
     [](Frames& f) {
       Numbered turned = f.volume();
       std::swap(turned.axes[0], turned.axes[1]);
       const auto last = std::ranges::find(f.slice, turned.size[2] - 1) - f.slice.begin();
       f.shared.erase(kPlaneWay);
       for (std::size_t n = 0; n < f.groups.size(); ++n) {
         const Numbered& v = n == static_cast<std::size_t>(last) ? turned : f.volume();
         f.groups[n].nest(kPlaneWay, {one(0x00200037, "DS", orientation_of(v))});
       }
       f.one_less = true;
       f.out.note = "series";
     }},
    {"tilted gantry", kRefused, "right angles",
     [](Frames& f) {
       const Numbered& v = f.volume();
       for (std::size_t n = 0; n < f.groups.size(); ++n) {
         const int k = f.slice[n];
         f.groups[n].item(kPlane).set(
             0x00200032, "DS", ds(v.position(0, 0, k) + (0.3 * k * v.spacing_mm[2]) * v.axes[1]));
       }
     }},
    {"no PixelSpacing", kAsked, "--spacing",
     [](Frames& f) {
       f.shared.erase(kMeasures);
       for (DataSet& group : f.groups) group.erase(kMeasures);
     }},
    {"--spacing that contradicts the file", kRefused, "spacing",
     [](Frames& f) {
       f.out.options.spacing_mm = f.volume().spacing_mm;
       (*f.out.options.spacing_mm)[static_cast<std::size_t>(f.draw.below(3))] += 1;
     }},
    {"fewer frames than NumberOfFrames", kRefused, "",
     [](Frames& f) { f.set.set(0x00280008, "IS", "99"), f.slice.pop_back(); }},
};

}  // namespace

void add_dicom_series(std::vector<Situation>& all) {
  for (const SeriesRow& row : kSeriesRows) {
    all.push_back({"DICOM series", row.name, row.expected, row.word,
                   [=](Draw& draw, const TemporaryFolder& folder) {
                     Series series = series_of(draw, folder);
                     row.change(series);
                     write_series(series);
                     return series.out;
                   }});
  }
}

void add_dicom_frames(std::vector<Situation>& all) {
  for (const FramesRow& row : kFramesRows) {
    all.push_back({"DICOM, many frames", row.name, row.expected, row.word,
                   [=](Draw& draw, const TemporaryFolder& folder) {
                     Frames frames = frames_of(draw);
                     row.change(frames);
                     write_frames(frames, folder);
                     return frames.out;
                   }});
  }
}

}  // namespace kerf::test
