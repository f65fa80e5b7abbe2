// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/volume_files.hpp"

#include <cmath>
#include <sstream>

#include <doctest/doctest.h>
#include <zlib.h>

#include "controller/input/load_error.hpp"
#include "controller/volume_tool/volume_commands.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::test {
namespace fs = std::filesystem;

std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string in = bytes;
  std::string out(deflateBound(&stream, in.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string nrrd(const std::string& type, const std::string& more, const std::string& encoding,
                 const std::string& sizes) {
  return "NRRD0004\n# by hand\ntype: " + type + "\ndimension: 3\nsizes: " + sizes +
         "\nencoding: " + encoding + "\n" + more;
}

std::string meta(const std::string& type, const std::string& more, const std::string& data_file) {
  return "ObjectType = Image\nNDims = 3\nDimSize = 3 4 5\nElementType = " + type + "\n" + more +
         "ElementDataFile = " + data_file + "\n";
}

std::string nifti(const NiftiSpec& spec) {
  std::string header(352, '\0');
  const auto put = [&](std::size_t offset, auto value) {
    const std::string raw = bytes_of(value, spec.order);
    std::copy(raw.begin(), raw.end(), header.begin() + static_cast<std::ptrdiff_t>(offset));
  };
  put(0, std::int32_t{348});
  put(40, static_cast<std::int16_t>(spec.dim.size()));
  for (std::size_t i = 0; i < 7; ++i) {
    put(42 + 2 * i, i < spec.dim.size() ? spec.dim[i] : std::int16_t{1});
  }
  put(70, spec.datatype);
  put(72, spec.bits);
  put(76, 1.0F);
  for (std::size_t i = 0; i < 3; ++i) put(80 + 4 * i, spec.pixdim[i]);
  put(108, 352.0F);
  header[123] = 2;  // mm
  put(254, static_cast<std::int16_t>(spec.sform ? 1 : 0));
  put(280, -spec.pixdim[0]);
  put(300, -spec.pixdim[1]);
  put(320, spec.pixdim[2]);
  header.replace(344, 3, "n+1");
  return header;
}

std::string tiff(const std::vector<TiffPage>& pages, std::endian order) {
  constexpr std::uint16_t kText = 2, kShort = 3, kLong = 4, kRatio = 5;
  std::string bytes =
      (order == std::endian::big ? "MM" : "II") + bytes_of(std::uint16_t{42}, order);
  std::size_t link = bytes.size();
  bytes += bytes_of(std::uint32_t{0}, order);
  const auto here = [&] { return bytes_of(static_cast<std::uint32_t>(bytes.size()), order); };
  for (const TiffPage& page : pages) {
    struct Field {
      std::uint16_t type;
      std::size_t count;
      std::string value;
    };
    std::map<std::uint16_t, Field> fields;
    const auto longs = [&](std::uint16_t tag, std::uint32_t value) {
      fields[tag] = {kLong, 1, bytes_of(value, order)};
    };
    const auto shorts = [&](std::uint16_t tag, std::uint16_t value) {
      fields[tag] = {kShort, 1, bytes_of(value, order)};
    };
    longs(256, page.width);
    longs(257, page.height);
    shorts(258, page.bits);
    shorts(259, 1);
    shorts(262, 1);
    fields[273] = {kLong, 1, here()};
    bytes += page.pixels + (page.pixels.size() % 2 == 1 ? "x" : "");
    shorts(277, 1);
    longs(278, page.height);
    longs(279, static_cast<std::uint32_t>(page.pixels.size()));
    for (const auto& [tag, values] : page.shorts) {
      fields[tag] = {kShort, values.size(), bytes_of(values, order)};
    }
    for (const auto& [tag, values] : page.longs) {
      fields[tag] = {kLong, values.size(), bytes_of(values, order)};
    }
    for (const auto& [tag, values] : page.ratios) {
      fields[tag] = {kRatio, values.size() / 2, bytes_of(values, order)};
    }
    if (!page.description.empty()) {
      fields[270] = {kText, page.description.size() + 1, page.description + '\0'};
    }
    for (auto& [tag, field] : fields) {
      if (field.value.size() <= 4) {
        field.value.resize(4);
        continue;
      }
      const std::string at = here();
      bytes += field.value + (field.value.size() % 2 == 1 ? "x" : "");
      field.value = at;
    }
    bytes.replace(link, 4, here());
    bytes += bytes_of(static_cast<std::uint16_t>(fields.size()), order);
    for (const auto& [tag, field] : fields) {
      bytes += bytes_of(tag, order) + bytes_of(field.type, order) +
               bytes_of(static_cast<std::uint32_t>(field.count), order) + field.value;
    }
    link = bytes.size();
    bytes += bytes_of(std::uint32_t{0}, order);
  }
  return bytes;
}

std::string dicom_element(std::uint16_t group, std::uint16_t number, const std::string& type,
                          std::string value) {
  const bool text = type != "OB" && type != "OW" && type != "UI" && type != "SQ" && type != "UN";
  if (value.size() % 2 == 1) value += text ? ' ' : '\0';
  std::string bytes = bytes_of(group) + bytes_of(number) + type;
  if (type[0] == 'O' || type == "SQ" || type == "UN") {
    bytes += std::string(2, '\0') + bytes_of(static_cast<std::uint32_t>(value.size()));
  } else {
    bytes += bytes_of(static_cast<std::uint16_t>(value.size()));
  }
  return bytes + value;
}

std::string dicom_item(const std::string& elements) {
  return bytes_of(std::uint16_t{0xfffe}) + bytes_of(std::uint16_t{0xe000}) +
         bytes_of(static_cast<std::uint32_t>(elements.size())) + elements;
}

std::string dicom(const DicomSpec& spec) {
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2";
  const std::string instance = spec.series + ".7." + std::to_string(spec.instance);
  const auto text = [](double value) {
    std::ostringstream out;
    out << value;
    return out.str();
  };
  DicomSpec all;  // its `others` have all elements, in the order of their tags
  all.set(0x0008, 0x0016, "UI", ct);
  all.set(0x0008, 0x0018, "UI", instance);
  all.set(0x0008, 0x0060, "CS", "CT");
  all.set(0x0020, 0x000d, "UI", "1.2.826.0.1.9");
  all.set(0x0020, 0x000e, "UI", spec.series);
  all.set(0x0020, 0x0013, "IS", std::to_string(spec.instance));
  all.set(0x0020, 0x0032, "DS",
          text(spec.position_mm[0]) + "\\" + text(spec.position_mm[1]) + "\\" +
              text(spec.position_mm[2]));
  all.set(0x0020, 0x0037, "DS", spec.orientation);
  all.set(0x0028, 0x0002, "US", u16(1));
  all.set(0x0028, 0x0004, "CS", "MONOCHROME2");
  all.set(0x0028, 0x0010, "US", u16(spec.rows));
  all.set(0x0028, 0x0011, "US", u16(spec.columns));
  if (spec.pixel_spacing) all.set(0x0028, 0x0030, "DS", *spec.pixel_spacing);
  all.set(0x0028, 0x0100, "US", u16(16));
  all.set(0x0028, 0x0101, "US", u16(16));
  all.set(0x0028, 0x0102, "US", u16(15));
  all.set(0x0028, 0x0103, "US", u16(1));
  all.set(0x0028, 0x1052, "DS", text(spec.intercept));
  all.set(0x0028, 0x1053, "DS", text(spec.slope));
  all.set(0x7fe0, 0x0010, "OW", bytes_of(spec.values));
  for (const auto& [tag, element] : spec.others) all.others[tag] = element;

  std::string meta = dicom_element(0x0002, 0x0001, "OB", std::string("\0\1", 2)) +
                     dicom_element(0x0002, 0x0002, "UI", ct) +
                     dicom_element(0x0002, 0x0003, "UI", instance) +
                     dicom_element(0x0002, 0x0010, "UI", spec.syntax);
  const auto meta_size = static_cast<std::uint32_t>(meta.size());
  std::string bytes = std::string(128, '\0') + "DICM" +
                      dicom_element(0x0002, 0x0000, "UL", bytes_of(meta_size)) + meta;
  for (const auto& [tag, element] : all.others) bytes += element;
  return bytes;
}

DicomSpec dicom_slice(int k) {
  DicomSpec spec;
  spec.instance = k + 1;
  spec.position_mm = {-10, 20, 100.0 + 2 * k};
  for (int i = 0; i < 12; ++i) spec.values.push_back(static_cast<std::int16_t>(12 * k + i));
  return spec;
}

void write_dicom_series(const TemporaryFolder& folder,
                        const std::function<void(DicomSpec&, int)>& change) {
  for (int k = 0; k < 5; ++k) {
    DicomSpec spec = dicom_slice(k);
    change(spec, k);
    folder.write("image" + std::to_string((k * 3) % 5) + ".dcm", dicom(spec));
  }
}

std::string series_message(const std::function<void(DicomSpec&, int)>& change) {
  const TemporaryFolder folder;
  write_dicom_series(folder, change);
  std::string message = refusal(folder.path());
  const bool fine = message == "no error" || is_one_line(message);
  CHECK(fine);
  return message;
}

std::string refusal(const fs::path& path, const ReadOptions& options) {
  try {
    static_cast<void>(read_volume(path, options));
  } catch (const LoadError& error) {
    return error.what();
  }
  return "no error";
}

bool same_values(const SourceVolume& volume, const std::vector<float>& values) {
  return volume.values.visit([&](auto held) { return std::ranges::equal(held, values); });
}

std::array<double, 3> position_of(const VolumeFrame& frame, double i, double j, double k) {
  std::array<double, 3> p = frame.origin_mm;
  const std::array<double, 3> step{i * frame.spacing_mm[0], j * frame.spacing_mm[1],
                                   k * frame.spacing_mm[2]};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) p[r] += frame.direction[3 * r + c] * step[c];
  }
  return p;
}

std::string misplaced(const SourceVolume& volume, const FilePlaces& places) {
  if (!(volume.grid == kSmall)) return "another size";
  std::vector<int> seen(kSmall.voxel_count());
  for (const auto& [a, b, c] : voxels(kSmall)) {
    const float value = volume.values[kSmall.index(a, b, c)];
    const int number = value >= 0 && value < 60 ? static_cast<int>(value) : 0;
    if (static_cast<float>(number) != value || seen[static_cast<std::size_t>(number)]++ > 0) {
      return "value " + std::to_string(value);
    }
    const std::array in_file{number % 3, number / 3 % 4, number / 12};
    const std::array<double, 3> is = position_of(volume, a, b, c);
    for (std::size_t row = 0; row < 3; ++row) {
      double should = places.origin[row];
      for (std::size_t axis = 0; axis < 3; ++axis)
        should += places.steps[axis][row] * in_file[axis];
      if (std::abs(is[row] - should) > 1e-9) {
        return "voxel " + std::to_string(number) + ": coordinate " + std::to_string(row) + " is " +
               std::to_string(is[row]) + ", should be " + std::to_string(should);
      }
    }
  }
  return {};
}

bool is_one_line(const std::string& message) {
  return message.find('\n') == std::string::npos && message.find(": ") != std::string::npos &&
         message.find("; ") != std::string::npos;
}

Outcome run(const std::vector<std::string>& arguments) {
  std::vector<const char*> argv{"kerf-volume"};
  for (const std::string& a : arguments) argv.push_back(a.c_str());
  std::ostringstream out;
  std::ostringstream err;
  Outcome outcome;
  outcome.code = run_volume_tool(static_cast<int>(argv.size()), argv.data(), out, err);
  outcome.out = out.str();
  outcome.err = err.str();
  return outcome;
}

VolumeImage air(VoxelGrid grid) {
  VolumeImage image;
  image.grid = grid;
  image.density.assign(grid.voxel_count(), 0);
  return image;
}

}  // namespace kerf::test
