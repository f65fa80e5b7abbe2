// SPDX-License-Identifier: Apache-2.0
// NRRD (teem.sourceforge.net/nrrd/format.html) and MetaImage (itk.org/Wiki/MetaIO/Documentation).
#include <algorithm>
#include <cmath>
#include <sstream>

#include "tests/volume/import_truth/numbered.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::test {
namespace {
using vec3::operator*, vec3::operator+;

/// A header of named fields in their order, and the bytes of the voxels.
struct TextFile {
  Draw& draw;
  const TemporaryFolder& folder;
  Written out{};
  std::string magic{}, between{}, end{};
  std::vector<std::pair<std::string, std::string>> fields{};
  std::string more{};       ///< whole lines before the last field
  std::string data{};       ///< of the voxels
  std::string line = "\n";  ///< end of a line
  std::string detached{};   ///< name of the file of the voxels

  Numbered& volume() { return out.truth; }
  std::string& operator[](const std::string& key) {
    const auto at = std::ranges::find(fields, key, [](const auto& field) { return field.first; });
    if (at != fields.end()) return at->second;
    return fields.emplace_back(key, "").second;
  }
  void erase(const std::string& key) {
    std::erase_if(fields, [&](const auto& field) { return field.first == key; });
  }
  std::string numbers(std::initializer_list<double> list) const {
    std::string text;
    for (const double x : list) text += (text.empty() ? "" : " ") + decimal_text(draw, x);
    return text;
  }
  std::string sizes() {
    const auto& n = volume().size;
    return std::to_string(n[0]) + " " + std::to_string(n[1]) + " " + std::to_string(n[2]);
  }
  void write(const std::string& name) {
    std::string text = magic;
    for (const auto& [key, value] : fields) text += key + between + value + line;
    text += more;
    if (!detached.empty()) folder.write(detached, data);
    out.path = folder.write(name, text + end + (detached.empty() ? data : ""));
  }
};

std::string ascii_of(const Numbered& volume) {
  std::ostringstream text;
  text.precision(17);
  for (std::size_t i = 0; i < volume.count(); ++i) {
    text << volume.stored[i] << (i % 9 == 8 ? "\n" : " ");
  }
  return text.str();
}

std::string hex_of(const std::string& bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    constexpr char kDigits[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(bytes[i]);
    text += {kDigits[byte >> 4], kDigits[byte & 15]};
    if (i % 35 == 34) text += '\n';
  }
  return text;
}

/// The directions and the origin of a file in a space of which axis a has the sign `to_lps[a]`.
void set_space(TextFile& f, const vec3::Vec& to_lps) {
  const auto vector = [&](const vec3::Vec& v) {
    const std::string comma = f.draw.of({",", ", "});
    std::string text;  // one after the other: the order within a sum is the compiler's
    for (std::size_t a = 0; a < 3; ++a) {
      text += (a == 0 ? "(" : comma) + decimal_text(f.draw, v[a] * to_lps[a]);
    }
    return text + ")";
  };
  std::string directions;
  for (std::size_t a = 0; a < 3; ++a) {
    directions += (a == 0 ? "" : " ") + vector(f.volume().spacing_mm[a] * f.volume().axes[a]);
  }
  f["space directions"] = directions;
  f["space origin"] = vector(f.volume().origin_mm);
}

TextFile nrrd_file(Draw& draw, const TemporaryFolder& folder) {
  constexpr std::string_view kWords[] = {
      "uchar|unsigned char|uint8|uint8_t",
      "signed char|int8|int8_t",
      "ushort|unsigned short|unsigned short int|uint16|uint16_t",
      "short|short int|signed short|signed short int|int16|int16_t",
      "uint|unsigned int|uint32|uint32_t",
      "int|signed int|int32|int32_t",
      "ulonglong|unsigned long long|unsigned long long int|uint64|uint64_t",
      "longlong|long long|long long int|signed long long|signed long long int|int64|int64_t",
      "float",
      "double"};
  const int type = draw.below(10);
  TextFile f{draw, folder, {{}, {}, numbered(draw, static_cast<VoxelType>(type))}};
  f.magic = std::string("NRRD000") + draw.of({"4", "5"}) + "\n";
  f.between = ": ";
  f.end = "\n";
  f["type"] = draw.word(kWords[type]);
  f["dimension"] = "3";
  f["space"] = draw.of({"left-posterior-superior", "LPS", "Left-Posterior-Superior"});
  f["sizes"] = f.sizes();
  set_space(f, {1, 1, 1});
  if (draw.coin()) f["kinds"] = "domain domain domain";
  f["endian"] = f.volume().order == std::endian::little ? "little" : "big";
  f["encoding"] = "raw";
  f.data = f.volume().bytes();
  return f;
}

void pack(TextFile& f, const std::string& encoding) {
  f["encoding"] = encoding;
  if (encoding[0] == 'g') f.data = gzipped(f.data);
  if (encoding[0] == 'b') f.data = bzip2_packed(f.data);
  if (encoding == "hex") f.data = hex_of(f.data);
  if (encoding[0] == 't' || encoding[0] == 'a') f.data = ascii_of(f.volume());
}

/// One row: its name and outcome, and the change of a plain file.
struct Row {
  const char* name;
  Expected expected;
  const char* word;
  void (*change)(TextFile&);
};

void spaced(TextFile& f) {
  f.volume().lay_flat();
  for (const char* key : {"space", "space directions", "space origin"}) f.erase(key);
  const auto& s = f.volume().spacing_mm;
  f["spacings"] = f.numbers({s[0], s[1], s[2]});
}

void unknown_spacing(TextFile& f) {
  spaced(f);
  f.erase("spacings");
}

constexpr Row kNrrdRows[] = {
    {"each type, byte order, orientation", kRead, "", [](TextFile&) {}},
    {"encoding gzip, bzip2, hex, text", kRead, "",
     [](TextFile& f) { pack(f, f.draw.word("gzip|gz|bzip2|bz2|hex|txt|text|ascii")); }},
    {"voxels in a separate file", kRead, "",
     [](TextFile& f) {
       f[f.draw.of({"data file", "datafile"})] = f.detached = "voxels.raw";
     }},
    {"voxels in a file for each slice (LIST)", kRead, "",
     [](TextFile& f) {
       std::string list = "LIST";
       for (int k = 0; k < f.volume().size[2]; ++k) {
         f.folder.write("slice" + std::to_string(k), f.volume().bytes(k, k + 1));
         list += "\nslice" + std::to_string(k);
       }
       f["data file"] = list;
       f.end = "";
       f.data = "";
     }},
    {"bytes or lines before the voxels (byte skip, line skip)", kRead, "",
     [](TextFile& f) {
       f["data file"] = f.detached = "voxels.raw";
       const int kind = f.draw.below(3);
       if (kind == 0) f["byte skip"] = "7", f.data = "ignored" + f.data;
       if (kind == 1) f["line skip"] = "2", f.data = "one\ntwo\n" + f.data;
       if (kind == 2) f["byte skip"] = "-1", f.data = "any header" + f.data;
     }},
    {"space RAS", kRead, "",
     [](TextFile& f) {
       f["space"] = f.draw.of({"right-anterior-superior", "RAS"});
       set_space(f, {-1, -1, 1});
     }},
    {"space LAS", kRead, "",
     [](TextFile& f) {
       f["space"] = f.draw.of({"left-anterior-superior", "LAS"});
       set_space(f, {1, -1, 1});
     }},
    {"space of no patient (scanner-xyz, 3D-right-handed)", kRead, "",
     [](TextFile& f) { f["space"] = f.draw.word("scanner-xyz|3D-right-handed"); }},
    {"space of no patient, left-handed (3D-left-handed)", kEither, "space",
     [](TextFile& f) {
       f["space"] = "3D-left-handed";
       set_space(f, {1, 1, -1});
     }},
    {"unknown space", kRefused, "space",
     [](TextFile& f) {
       f["space"] = f.draw.word("left-posterior-inferior|right-posterior-superior|LPI|LP|none|0");
     }},
    {"space of a time axis (RAST, LAST, LPST) for three axes", kEither, "space",
     [](TextFile& f) {
       f["space"] = f.draw.of({"RAST", "left-anterior-superior-time", "LPST"});
     }},
    {"spacings without a space", kRead, "", spaced},
    {"space dimension in place of a space; no space origin", kRead, "",
     [](TextFile& f) {
       if (f.draw.coin()) {
         f.volume().origin_mm = {};
         f.erase("space origin");
       }
       if (f.draw.coin()) f["space"] = "3";
       for (auto& [key, value] : f.fields) {
         if (key == "space" && value == "3") key = "space dimension";
       }
     }},
    {"spacings that contradict the space directions", kRefused, "spacing",
     [](TextFile& f) { f.more = "spacings: 9 9 9\n"; }},
    {"axis mins and maxs in place of spacings", kEither, "",
     [](TextFile& f) {
       unknown_spacing(f);
       const Numbered& v = f.volume();
       const auto last = v.position(v.size[0] - 1, v.size[1] - 1, v.size[2] - 1);
       f.more = "axis mins: 0 0 0\naxis maxs: " + f.numbers({last[0], last[1], last[2]}) +
                "\ncenters: node node node\n";
     }},
    {"no spacing", kAsked, "--spacing", unknown_spacing},
    {"no spacing, --spacing given", kRead, "",
     [](TextFile& f) {
       unknown_spacing(f);
       f.out.options.spacing_mm = f.volume().spacing_mm;
     }},
    {"spacing of one axis is nan", kAsked, "--spacing",
     [](TextFile& f) {
       spaced(f);
       const auto& s = f.volume().spacing_mm;
       f["spacings"] = f.numbers({s[0], s[1]}) + " nan";
     }},
    {"spacing 0", kRefused, "spacing",
     [](TextFile& f) {
       spaced(f);
       f["spacings"] = "0.5 0 0.5";
     }},
    {"--spacing that contradicts the file", kRefused, "spacing",
     [](TextFile& f) {
       f.out.options.spacing_mm = f.volume().spacing_mm;
       (*f.out.options.spacing_mm)[static_cast<std::size_t>(f.draw.below(3))] += 1;
     }},
    {"--override-spacing", kRead, "",
     [](TextFile& f) {
       for (double& edge : f.volume().spacing_mm) edge = std::max(0.05, f.draw.decimal(0.05, 3));
       f.out.options.override_spacing_mm = f.volume().spacing_mm;
     }},
    {"key/value pairs named like fields", kRead, "",
     [](TextFile& f) {
       f.more = f.draw.of({"type:=CT\n", "sizes:=9 9 9\n", "encoding:=gzip\n", "space:=RAS\n",
                           "spacings:=1 1 1\n", "kinds:=none of them\n", "dimension:=9\n",
                           "units:=um\n", "space units:=\"cm\"\n", "data file:=a:b\n"});
     }},
    {"key/value pairs of any length and number; comments", kRead, "",
     [](TextFile& f) {
       f.more = "long:=" + std::string(static_cast<std::size_t>(f.draw.below(30000)), 'x') + "\n";
       for (int i = f.draw.below(3) * 1000; i > 0; --i) {
         f.more += (i % 3 == 0 ? "# comment: " : "key" + std::to_string(i) + ":=") + "v\n";
       }
     }},
    {"fields that do not affect voxels (content, labels, thicknesses, centers, measurement frame)",
     kRead, "",
     [](TextFile& f) {
       f.more = f.draw.of({"content: a: b\n", "labels: \"x\" \"y\" \"z\"\n", "thicknesses: 9 9 9\n",
                           "centers: cell cell cell\n", "old min: -5\n",
                           "measurement frame: (0,1,0) (1,0,0) (0,0,1)\n", "number: 5\n",
                           "space units: \"mm\" \"mm\" \"mm\"\n"});
     }},
    {"lines end in CR LF", kEither, "",
     [](TextFile& f) {
       f.line = "\r\n";
       f.magic = "NRRD0004\r\n";
       f.end = "\r\n";
     }},
    {"lengths in cm, um, m or inches", kEither, "",
     [](TextFile& f) {
       const int kind = f.draw.below(4);
       const std::string unit =
           std::array{"\"cm\"", "\"um\"", "\"m\"", "\"inches\""}[std::size_t(kind)];
       f["space units"] = unit + " " + unit + " " + unit;
       const double mm = std::array{10.0, 1e-3, 1e3, 25.4}[std::size_t(kind)];
       for (double& edge : f.volume().spacing_mm) edge *= mm;
       f.volume().origin_mm = mm * f.volume().origin_mm;
     }},
    {"a fourth axis of length 1", kRead, "",
     [](TextFile& f) {
       f["dimension"] = "4";
       f["sizes"] += " 1";
       f["space directions"] += " none";
       f.erase("kinds");
     }},
    {"a first axis of length 1", kEither, "axes",
     [](TextFile& f) {
       f["dimension"] = "4";
       f["sizes"] = "1 " + f["sizes"];
       f["space directions"] = "none " + f["space directions"];
       f.erase("kinds");
     }},
    {"a fourth axis of several times", kRefused, "",
     [](TextFile& f) {
       f["dimension"] = "4";
       f["sizes"] += " 2";
       f["space directions"] += " none";
       f.erase("kinds");
       f.data += f.data;
     }},
    {"axes not at right angles", kRefused, "right angles",
     [](TextFile& f) {
       Numbered& v = f.volume();
       v.axes[1] = vec3::unit(v.axes[1] + 0.2 * v.axes[0]);
       set_space(f, {1, 1, 1});
     }},
    {"a direction or an origin that is no number", kRefused, "",
     [](TextFile& f) {
       f[f.draw.of({"space directions", "space origin"})] =
           f.draw.of({"(nan,0,0)", "(1,0)", "(1e999,0,0)", "1 0 0"});
     }},
    {"cut off", kRefused, "",
     [](TextFile& f) {
       f.data.resize(static_cast<std::size_t>(f.draw.below(int(f.data.size()))));
     }},
    {"a field twice, with two values", kEither, "",
     [](TextFile& f) {
       f.more = f.draw.of({"sizes: 3 1 1\n", "type: uint8\n", "space: RAS\n", "endian: big\n"});
     }},
    {"a voxel that is no number", kRefused, "NaN",
     [](TextFile& f) {
       number_anew(f.draw, f.volume(), VoxelType::float32);
       f["type"] = "float";
       f.volume().stored[f.volume().count() / 2] = f.draw.of<double>({NAN, -INFINITY});
       f.data = f.volume().bytes();
     }},
};

TextFile meta_file(Draw& draw, const TemporaryFolder& folder) {
  constexpr const char* kWords[] = {"UCHAR", "CHAR",       "USHORT",    "SHORT", "UINT",
                                    "INT",   "ULONG_LONG", "LONG_LONG", "FLOAT", "DOUBLE"};
  const int type = draw.below(10);
  TextFile f{draw, folder, {{}, {}, numbered(draw, static_cast<VoxelType>(type))}};
  f.between = draw.of({" = ", "=", " =  "});
  const Numbered& v = f.volume();
  f["ObjectType"] = "Image";
  f["NDims"] = "3";
  f["BinaryData"] = "True";
  f[draw.of({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"})] =
      v.order == std::endian::big ? "True" : "False";
  f["CompressedData"] = "False";
  const auto& [x, y, z] = v.axes;
  f[draw.of({"TransformMatrix", "Rotation", "Orientation"})] =
      f.numbers({x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]});
  f[draw.of({"Offset", "Position", "Origin"})] =
      f.numbers({v.origin_mm[0], v.origin_mm[1], v.origin_mm[2]});
  f["ElementSpacing"] = f.numbers({v.spacing_mm[0], v.spacing_mm[1], v.spacing_mm[2]});
  f["DimSize"] = f.sizes();
  f["ElementType"] = std::string("MET_") + kWords[type];
  f["ElementDataFile"] = "LOCAL";
  f.data = v.bytes();
  return f;
}

/// Puts a field before the last one, which ends the header.
void before_data(TextFile& f, const std::string& key, const std::string& value) {
  f.fields.insert(f.fields.end() - 1, {key, value});
}

constexpr Row kMetaRows[] = {
    {"each type, byte order, orientation", kRead, "", [](TextFile&) {}},
    {"packed", kRead, "",
     [](TextFile& f) {
       std::string packed = zlib_packed(f.data);
       f["CompressedData"] = "True";
       before_data(f, "CompressedDataSize", std::to_string(packed.size()));
       f.data = packed;
     }},
    {"packed, without CompressedDataSize", kEither, "",
     [](TextFile& f) {
       f["CompressedData"] = "True";
       f.data = zlib_packed(f.data);
     }},
    {"voxels as text", kRead, "",
     [](TextFile& f) {
       f["BinaryData"] = "False";
       f.data = ascii_of(f.volume());
     }},
    {"voxels in a separate file, which may begin with a header", kRead, "",
     [](TextFile& f) {
       f["ElementDataFile"] = f.detached = "voxels.raw";
       const int kind = f.draw.below(3);
       if (kind == 0) before_data(f, "HeaderSize", "9"), f.data = "nine byte" + f.data;
       if (kind == 1) before_data(f, "HeaderSize", "-1"), f.data = "any" + f.data;
     }},
    {"voxels in a file for each slice (LIST, pattern)", kRead, "",
     [](TextFile& f) {
       std::string list = "LIST";
       for (int k = 0; k < f.volume().size[2]; ++k) {
         f.folder.write("slice" + std::to_string(k), f.volume().bytes(k, k + 1));
         list += "\nslice" + std::to_string(k);
       }
       const std::string last = std::to_string(f.volume().size[2] - 1);
       f["ElementDataFile"] = f.draw.coin() ? list : "slice%d 0 " + last + " 1";
       f.data = "";
     }},
    {"no orientation and origin", kRead, "",
     [](TextFile& f) {
       f.volume().lay_flat();
       for (const char* key :
            {"TransformMatrix", "Rotation", "Orientation", "Offset", "Position", "Origin"}) {
         f.erase(key);
       }
     }},
    {"no spacing", kAsked, "--spacing", [](TextFile& f) { f.erase("ElementSpacing"); }},
    {"no spacing, --spacing given", kRead, "",
     [](TextFile& f) {
       f.erase("ElementSpacing");
       f.out.options.spacing_mm = f.volume().spacing_mm;
     }},
    {"ElementSize in place of ElementSpacing", kRead, "",
     [](TextFile& f) {
       before_data(f, "ElementSize", f["ElementSpacing"]);
       f.erase("ElementSpacing");
     }},
    {"ElementSize that differs from ElementSpacing", kEither, "ElementSize",
     [](TextFile& f) { before_data(f, "ElementSize", "9 9 9"); }},
    {"spacing that is 0, negative or no number", kRefused, "",
     [](TextFile& f) {
       f["ElementSpacing"] = f.draw.of({"0.5 0 0.5", "0.5 0.5 -1", "abc 1 1", "1 1", "nan 1 1"});
     }},
    {"decimal commas", kEither, "",
     [](TextFile& f) {
       const char* key = f.draw.of({"ElementSpacing", "Offset", "TransformMatrix"});
       for (auto& [name, text] : f.fields) {
         if (name == key && text.find('.') != std::string::npos)
           std::ranges::replace(text, '.', ',');
       }
     }},
    {"scaling of values (ElementToIntensityFunction)", kEither, "",
     [](TextFile& f) {
       before_data(f, "ElementToIntensityFunctionSlope", "2");
       before_data(f, "ElementToIntensityFunctionOffset", "-5");
       f.volume().scale([](int) { return std::array{2.0, -5.0}; });
     }},
    {"CenterOfRotation that is not 0", kEither, "CenterOfRotation",
     [](TextFile& f) { before_data(f, "CenterOfRotation", "1 2 3"); }},
    {"AnatomicalOrientation that does not fit the axes", kEither, "AnatomicalOrientation",
     [](TextFile& f) { before_data(f, "AnatomicalOrientation", f.draw.word("RAI|LPS|RAS")); }},
    {"fields that do not affect voxels (Modality, Comment, ElementMin)", kRead, "",
     [](TextFile& f) {
       const auto [key, value] =
           f.draw.of<std::pair<const char*, const char*>>({{"CenterOfRotation", "0 0 0"},
                                                           {"Modality", "MET_MOD_CT"},
                                                           {"Comment", "a = b: c"},
                                                           {"ElementMin", "3"},
                                                           {"Name", "NDims"}});
       before_data(f, key, value);
     }},
    {"a fourth axis of length 1", kEither, "axes",
     [](TextFile& f) {
       f["NDims"] = "4";
       f["DimSize"] += " 1";
       f["ElementSpacing"] += " 1";
       for (const char* key :
            {"TransformMatrix", "Rotation", "Orientation", "Offset", "Position", "Origin"}) {
         f.erase(key);
       }
       f.volume().lay_flat();
     }},
    {"several values a voxel", kRefused, "values",
     [](TextFile& f) {
       before_data(f, "ElementNumberOfChannels", "2");
       f.data += f.data;
     }},
    {"axes not at right angles", kRefused, "right angles",
     [](TextFile& f) {
       for (const char* key : {"TransformMatrix", "Rotation", "Orientation"}) f.erase(key);
       before_data(f, "TransformMatrix", "1 0 0 0.2 1 0 0 0 1");
     }},
    {"cut off", kRefused, "",
     [](TextFile& f) {
       f.data.resize(static_cast<std::size_t>(f.draw.below(int(f.data.size()))));
     }},
};

template <std::size_t N>
void add_rows(const char* format, const char* name, const Row (&rows)[N],
              TextFile (*plain)(Draw&, const TemporaryFolder&), std::vector<Situation>& all) {
  for (const Row& row : rows) {
    all.push_back(
        {format, row.name, row.expected, row.word, [=](Draw& draw, const TemporaryFolder& folder) {
           TextFile file = plain(draw, folder);
           row.change(file);
           file.write(name);
           return file.out;
         }});
  }
}

}  // namespace

void add_nrrd(std::vector<Situation>& all) {
  add_rows("NRRD", "a.nrrd", kNrrdRows, nrrd_file, all);
}

void add_meta(std::vector<Situation>& all) {
  add_rows("MetaImage", "a.mha", kMetaRows, meta_file, all);
}

}  // namespace kerf::test
