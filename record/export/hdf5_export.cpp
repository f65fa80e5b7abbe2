// SPDX-License-Identifier: Apache-2.0
#include "record/export/hdf5_export.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <hdf5.h>

#include "record/recording.hpp"
#include "record/scene_facts.hpp"
#include "record/tick_text.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/segment/tick_table.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

constexpr unsigned kDeflate = 1;  // the fastest

/// The library has failed; the caller knows the path.
struct Hdf5Failure {};

hid_t checked(hid_t id) {
  if (id < 0) throw Hdf5Failure{};
  return id;
}

/// An identifier of the library, released with its owner.
class Handle {
 public:
  Handle(hid_t id, herr_t (*release)(hid_t)) : id_(checked(id)), release_(release) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), release_(other.release_) {}
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) release_(id_);
  }
  operator hid_t() const noexcept { return id_; }  // NOLINT(google-explicit-constructor): as such

 private:
  hid_t id_;
  herr_t (*release_)(hid_t);
};

/// The type in the file: little-endian, as the log has it.
hid_t type_of(std::string_view type) {
  if (type == "u16") return H5T_STD_U16LE;
  if (type == "u32") return H5T_STD_U32LE;
  if (type == "u64") return H5T_STD_U64LE;
  if (type == "i16") return H5T_STD_I16LE;
  if (type == "i32") return H5T_STD_I32LE;
  if (type == "i64") return H5T_STD_I64LE;
  return type == "f32" ? H5T_IEEE_F32LE : H5T_IEEE_F64LE;
}

bool is_ascii(std::string_view text) {
  return std::ranges::all_of(text, [](char byte) { return (byte & 0x80) == 0; });
}

/// Of a text, or of texts that are padded to one length. ASCII unless `all` has other characters:
/// some readers have no UTF-8. The library has no type of 0 bytes.
Handle text_type(std::size_t bytes, std::string_view all) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  checked(H5Tset_size(type, std::max<std::size_t>(bytes, 1)));
  checked(H5Tset_cset(type, is_ascii(all) ? H5T_CSET_ASCII : H5T_CSET_UTF8));
  checked(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return type;
}

/// Without the time of the export: the same log gives the same bytes.
Handle dataset_properties() {
  Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  checked(H5Pset_obj_track_times(properties, false));
  return properties;
}

void put_attribute(hid_t object, const char* name, hid_t type, const Handle& space,
                   const void* data) {
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  checked(H5Awrite(attribute, type, data));
}

void put_text(hid_t object, const char* name, std::string_view text) {
  constexpr std::size_t kMost = 4096;  // the library has no attributes above 64 KiB
  const std::string ended(text.substr(0, kMost));
  put_attribute(object, name, text_type(ended.size(), ended),
                Handle(H5Screate(H5S_SCALAR), H5Sclose), ended.c_str());
}

void put_number(hid_t object, const char* name, std::uint64_t number) {
  put_attribute(object, name, H5T_NATIVE_UINT64, Handle(H5Screate(H5S_SCALAR), H5Sclose), &number);
}

/// Several texts of one attribute, each padded to the longest.
void put_codes(hid_t object, std::span<const TickCode> codes) {
  std::vector<std::string> lines;
  std::size_t longest = 1;
  for (const TickCode& code : codes) {
    lines.push_back(std::to_string(code.value) + " " + std::string(code.name) +
                    (code.meaning.empty() ? "" : ": " + std::string(code.meaning)));
    longest = std::max(longest, lines.back().size());
  }
  std::string all;
  for (std::string& line : lines) {
    line.resize(longest, '\0');
    all += line;
  }
  const hsize_t count = lines.size();
  put_attribute(object, "codes", text_type(longest, all),
                Handle(H5Screate_simple(1, &count, nullptr), H5Sclose), all.data());
}

/// What a column means, with all its codes or bits.
std::string description_of(const TickField& column) {
  std::string text(column.meaning);
  const char* before = "; ";
  for (const TickCode& code : tick_codes(column.layout.name)) {
    text += before + std::to_string(code.value) + " " + std::string(code.name);
    if (!code.meaning.empty()) text += " (" + std::string(code.meaning) + ")";
    before = ", ";
  }
  return text;
}

/// One column of the log as a dataset that grows.
class Column {
 public:
  Column(hid_t group, const TickField& column)
      : field_(column.layout), dataset_(create(group, field_), H5Dclose) {
    put_text(dataset_, "units", column.unit);
    put_text(dataset_, "description", description_of(column));
    put_text(dataset_, "valid", column.valid.empty() ? "in every row" : column.valid);
    if (const auto codes = tick_codes(field_.name); !codes.empty()) put_codes(dataset_, codes);
  }

  /// Adds the column of `rows` behind the `before` rows that it has.
  void append(std::span<const TickRecord> rows, hsize_t before) {
    const std::size_t bytes = field_.count * type_bytes(field_.type);
    values_.resize(rows.size() * bytes);
    std::byte* to = values_.data();
    for (const TickRecord& row : rows) {
      const auto* const from = reinterpret_cast<const std::byte*>(&row) + field_.offset;
      to = std::copy_n(from, bytes, to);
    }
    const std::array<hsize_t, 2> size{before + rows.size(), field_.count};
    checked(H5Dset_extent(dataset_, size.data()));
    const std::array<hsize_t, 2> start{before, 0}, count{rows.size(), field_.count};
    const Handle in_file(H5Dget_space(dataset_), H5Sclose);
    checked(
        H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
    const Handle in_memory(H5Screate_simple(rank(field_), count.data(), nullptr), H5Sclose);
    checked(
        H5Dwrite(dataset_, type_of(field_.type), in_memory, in_file, H5P_DEFAULT, values_.data()));
  }

 private:
  static int rank(const LayoutField& field) noexcept { return field.count > 1 ? 2 : 1; }

  static hid_t create(hid_t group, const LayoutField& field) {
    const std::array<hsize_t, 2> size{0, field.count}, most{H5S_UNLIMITED, field.count};
    const std::array<hsize_t, 2> chunk{TickLogReader::kChunkRows, field.count};
    const Handle space(H5Screate_simple(rank(field), size.data(), most.data()), H5Sclose);
    const Handle layout = dataset_properties();
    checked(H5Pset_chunk(layout, rank(field), chunk.data()));
    checked(H5Pset_shuffle(layout));
    checked(H5Pset_deflate(layout, kDeflate));
    const std::string name(field.name);
    return H5Dcreate2(group, name.c_str(), type_of(field.type), space, H5P_DEFAULT, layout,
                      H5P_DEFAULT);
  }

  LayoutField field_;
  Handle dataset_;
  std::vector<std::byte> values_;
};

std::vector<Column> columns_in(hid_t group) {
  std::vector<Column> out;
  for (const TickField& field : kTickFields) out.emplace_back(group, field);
  return out;
}

/// The column of times, which no log has.
TickField time_column(const LogClock& clock) {
  return {.layout = {"", "time_ns", offsetof(TickRecord, start_ns), "i64", 1, 0, 0, ""},
          .unit = "ns",
          .made = {},
          .meaning = clock.has_date()
                         ? "when the tick began: UTC, since 1970-01-01, without leap seconds"
                         : "start_ns: when the tick began, CLOCK_MONOTONIC"};
}

void write_ticks(hid_t file, const char* name, const std::filesystem::path& path,
                 TickLogReader& log, TickRange range, const LogClock& clock) {
  const Handle group(H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  std::vector<Column> columns = columns_in(group);
  Column times(group, time_column(clock));
  std::vector<TickRecord> rows;
  hsize_t written = 0;
  const auto flush = [&] {
    for (Column& column : columns) column.append(rows, written);
    for (TickRecord& row : rows) row.start_ns += static_cast<std::uint64_t>(clock.offset_ns());
    times.append(rows, written);
    written += rows.size();
    rows.clear();
  };
  log.for_each(
      [&](const TickRecord& row) {
        rows.push_back(row);
        if (stop_requested()) throw RecordError(path.string() + ": stopped; nothing is written");
        if (rows.size() == TickLogReader::kChunkRows) flush();
      },
      range);
  if (!rows.empty()) flush();
}

/// `json`, which is valid, in ASCII: characters beyond it stand in strings only, and become
/// escapes. Octave reads no UTF-8, and then nothing of the file.
std::string ascii_json(std::string_view json) {
  std::string out;
  const auto escape = [&](std::uint32_t unit) {
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "\\u%04x", unit);
    out += text.data();
  };
  for (std::size_t at = 0; at < json.size();) {
    const auto first = static_cast<std::uint8_t>(json[at++]);
    if (first < 0x80) {
      out += static_cast<char>(first);
      continue;
    }
    const int more = first >= 0xf0 ? 3 : first >= 0xe0 ? 2 : 1;  // bytes of the character
    std::uint32_t point = first & (0x3fU >> more);
    for (int i = 0; i < more && at < json.size(); ++i) {
      point = point << 6 | (static_cast<std::uint8_t>(json[at++]) & 0x3fU);
    }
    if (point < 0x10000) {
      escape(point);
    } else {  // in UTF-16, as JSON has it
      escape(0xd800 + ((point - 0x10000) >> 10));
      escape(0xdc00 + ((point - 0x10000) & 0x3ff));
    }
  }
  return out;
}

void write_scene(hid_t file, const std::filesystem::path& folder) {
  std::string scene = recorded_scene(folder);
  try {
    static_cast<void>(Json::parse(scene));
  } catch (const JsonError&) {
    throw DamagedRecording((folder / kSceneName).string() + ": no JSON; copy the recording again");
  }
  scene = ascii_json(scene);
  const Handle type = text_type(scene.size(), scene);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle dataset(
      H5Dcreate2(file, "scene", type, space, H5P_DEFAULT, dataset_properties(), H5P_DEFAULT),
      H5Dclose);
  checked(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, scene.c_str()));
}

/// Writes `path`, which is there and has the name `hdf5` for people.
void write_file(const std::filesystem::path& path, const std::filesystem::path& hdf5,
                const std::filesystem::path& folder, const Manifest& manifest,
                std::span<TickLogReader> logs, TickRange range, const LogClock& clock) {
  // The last library that reads it: h5py and MATLAB from 2015 on.
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  checked(H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18));
  // Its other drivers resolve links in a name, and a file without a name has only one in /proc.
  checked(H5Pset_fapl_stdio(access));
  const Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  put_text(file, "kerf", KERF_VERSION);
  put_number(file, "tick_ns", manifest.tick_ns);
  put_text(file, "session_id", manifest.session_id);
  put_text(file, "end_reason", manifest.end_reason);
  put_text(file, "clock", clock.has_date() ? "UTC" : "CLOCK_MONOTONIC");
  write_scene(file, folder);
  write_ticks(file, "ticks", hdf5, logs[0], range, clock);
  if (logs.size() > 1) write_ticks(file, "ticks_2", hdf5, logs[1], range, clock);
  checked(H5Fflush(file, H5F_SCOPE_GLOBAL));  // a full disk is reported here, not by the release
}

}  // namespace

void export_hdf5(const std::filesystem::path& folder, const std::filesystem::path& hdf5,
                 TickRange range, const LogClock& clock) {
  check_outputs(recording_files(folder), {{"--hdf5", hdf5, ".h5"}});
  if (is_stream(hdf5)) {
    throw RecordError(hdf5.string() + ": HDF5 is no stream; give the name of a file");
  }
  const Manifest manifest = read_facts(folder);
  std::vector<TickLogReader> logs = open_logs(folder, manifest.arms);
  H5dont_atexit();  // after a full disk its clean-up at exit crashes (1.10.8)
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // else it prints its own stack
  AtomicFile file(hdf5);
  try {
    write_file(file.open_path(), hdf5, folder, manifest, logs, range, clock);
  } catch (const Hdf5Failure&) {
    throw RecordError(hdf5.string() +
                      ": cannot be written; is the disk full? free space, or choose another one");
  }
  file.close();
  file.commit();
}

}  // namespace kerf
