// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/import_truth/numbered.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <archive.h>
#include <archive_entry.h>
#include <zlib.h>

#include "tests/volume/volume_files.hpp"

namespace kerf::test {
using vec3::Vec, vec3::operator+, vec3::operator*;

namespace {

template <class T>
struct As {
  using Type = T;
};

/// Calls `use` with the C++ type of a type of a file.
template <class Use>
auto with_type(VoxelType type, const Use& use) {
  switch (type) {
    case VoxelType::uint8:
      return use(As<std::uint8_t>());
    case VoxelType::int8:
      return use(As<std::int8_t>());
    case VoxelType::uint16:
      return use(As<std::uint16_t>());
    case VoxelType::int16:
      return use(As<std::int16_t>());
    case VoxelType::uint32:
      return use(As<std::uint32_t>());
    case VoxelType::int32:
      return use(As<std::int32_t>());
    case VoxelType::uint64:
      return use(As<std::uint64_t>());
    case VoxelType::int64:
      return use(As<std::int64_t>());
    case VoxelType::float32:
      return use(As<float>());
    case VoxelType::float64:
      break;
  }
  return use(As<double>());
}

std::string printed(const char* format, int digits, double value) {
  std::array<char, 64> text{};
  return {text.data(),
          static_cast<std::size_t>(std::snprintf(text.data(), text.size(), format, digits, value))};
}

/// A random rotation, from a quaternion.
std::array<Vec, 3> rotation(Draw& draw) {
  std::array<double, 4> q{};
  double square = 0;
  while (square < 0.01) {
    square = 0;
    for (double& x : q) {
      x = draw.decimal(-1, 1);
      square += x * x;
    }
  }
  for (double& x : q) x /= std::sqrt(square);
  const auto m = rotation_of({q[0], q[1], q[2], q[3]});
  return {{{m[0], m[3], m[6]}, {m[1], m[4], m[7]}, {m[2], m[5], m[8]}}};
}

}  // namespace

std::string Draw::word(std::string_view list) {
  for (auto n = below(1 + static_cast<int>(std::ranges::count(list, '|'))); n > 0; --n) {
    list.remove_prefix(list.find('|') + 1);
  }
  return std::string(list.substr(0, list.find('|')));
}

double Draw::decimal(double low, double high) {
  const double step = std::pow(10.0, 1 + below(4));
  const auto steps = static_cast<std::uint64_t>((high - low) * step);
  return std::round(low * step +
                    static_cast<double>(engine_() % std::max<std::uint64_t>(steps, 1))) /
         step;
}

Vec Numbered::position(double i, double j, double k) const {
  return origin_mm + (spacing_mm[0] * i) * axes[0] + (spacing_mm[1] * j) * axes[1] +
         (spacing_mm[2] * k) * axes[2];
}

std::string Numbered::bytes(int first, int last) const {
  return with_type(type, [&](auto as) {
    std::string all;
    for (std::size_t i = layer() * static_cast<std::size_t>(first);
         i < layer() * static_cast<std::size_t>(last); ++i) {
      all += bytes_of(static_cast<typename decltype(as)::Type>(stored[i]), order);
    }
    return all;
  });
}

void Numbered::scale(const std::function<std::array<double, 2>(int)>& slope_and_intercept) {
  for (std::size_t i = 0; i < count(); ++i) {
    const auto [slope, intercept] = slope_and_intercept(static_cast<int>(i / layer()));
    values[i] = stored[i] * slope + intercept;
  }
  value_slack = 4 * double{std::numeric_limits<float>::epsilon()};
}

void Numbered::lay_flat() {
  origin_mm = {};
  axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

void number_anew(Draw& draw, Numbered& volume, VoxelType type, int bits) {
  volume.type = type;
  volume.stored.resize(static_cast<std::size_t>(volume.size[0] * volume.size[1] * volume.size[2]));
  with_type(type, [&](auto as) {
    using T = typename decltype(as)::Type;
    for (double& value : volume.stored) {
      if constexpr (std::is_floating_point_v<T>) {
        const double digits = draw.decimal(-1, 1);
        value = double{static_cast<float>(std::ldexp(digits, draw.below(40) - 20))};
        if (value == 0) value = 0.25;
        if (draw.invert_values) value = -value;
      } else {
        const int width = std::min({bits, static_cast<int>(8 * sizeof(T)), 53});
        const auto any = static_cast<double>(draw.bits() >> (64 - width));
        const double low = std::is_signed_v<T> ? -std::ldexp(1, width - 1) : 0;
        const double high = low + std::ldexp(1, width) - 1;
        const int end = draw.below(40);  // now and then an end of the range
        value = end == 0 ? low : end == 1 ? high : low + any;
        if (draw.invert_values) value = low + high - value;  // of an even number of values
      }
    }
  });
  volume.values = volume.stored;
}

Numbered numbered(Draw& draw, VoxelType type, int slices) {
  Numbered volume;
  for (int& side : volume.size) side = 1 + draw.below(draw.longest());
  volume.size[2] = std::max(volume.size[2], slices);
  for (double& edge : volume.spacing_mm) edge = std::max(draw.decimal(0.05, 4), 0.05);
  for (double& x : volume.origin_mm) x = draw.decimal(-300, 300);
  if (draw.coin()) {
    volume.axes = rotation(draw);
    if (draw.coin()) volume.axes[2] = -1.0 * volume.axes[2];
  } else {
    std::array<std::size_t, 3> order{0, 1, 2};
    for (const std::size_t i : {2U, 1U}) {
      std::swap(order[i], order[static_cast<std::size_t>(draw.below(static_cast<int>(i) + 1))]);
    }
    for (std::size_t i = 0; i < 3; ++i) volume.axes[i][order[i]] = draw.coin() ? 1 : -1;
  }
  volume.order = draw.coin() ? std::endian::little : std::endian::big;
  number_anew(draw, volume, type);
  return volume;
}

std::string zlib_packed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  packed.resize(size);
  return packed;
}

std::string bzip2_packed(const std::string& bytes) {
  std::string packed(2 * bytes.size() + 1000, '\0');
  std::size_t size = 0;
  archive* out = archive_write_new();
  archive_write_set_format_raw(out);
  archive_write_add_filter_bzip2(out);
  archive_write_set_bytes_in_last_block(out, 1);  // no zeros behind the end
  archive_write_open_memory(out, packed.data(), packed.size(), &size);
  archive_entry* entry = archive_entry_new();
  archive_entry_set_filetype(entry, AE_IFREG);
  archive_write_header(out, entry);
  archive_write_data(out, bytes.data(), bytes.size());
  archive_entry_free(entry);
  archive_write_close(out);
  archive_write_free(out);
  packed.resize(size);
  return packed;
}

std::string fixed_text(double value, int digits) {
  return printed("%.*f", digits, value);
}

std::string decimal_text(Draw& draw, double value) {
  return printed(draw.of({"%.*g", "%.*g", "%.*e", "%.*E"}), 17, value);
}

}  // namespace kerf::test
