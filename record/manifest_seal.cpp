// SPDX-License-Identifier: Apache-2.0
#include "record/manifest_seal.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include <zlib.h>

#include "record/input_rows.hpp"
#include "record/kept_volumes.hpp"
#include "record/log_clock.hpp"
#include "record/manifest.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSealKey = "crc32";
constexpr std::string_view kBeforeSeal = ",\n  \"crc32\": \"";
constexpr std::string_view kBehindSeal = "\"\n}\n";

std::string hex32(std::uint32_t value) {
  return hex64(value).substr(8);
}

std::uint32_t crc32_of(std::uint32_t crc, const void* data, std::size_t bytes) {
  return static_cast<std::uint32_t>(crc32_z(crc, static_cast<const Bytef*>(data), bytes));
}

std::string seal_text(std::string_view text) {
  return std::string(kBeforeSeal) + crc32_of_bytes(text) + std::string(kBehindSeal);
}

}  // namespace

std::string crc32_of_file(const fs::path& path) {
  std::error_code fault;
  if (!fs::is_regular_file(path, fault)) return {};  // a pipe would block
  std::ifstream file(path, std::ios::binary);
  std::array<char, 1 << 16> piece;
  std::uint32_t crc = 0;
  while (file) {
    file.read(piece.data(), piece.size());
    crc = crc32_of(crc, piece.data(), static_cast<std::size_t>(file.gcount()));
  }
  return file.eof() ? hex32(crc) : std::string();
}

std::string crc32_of_bytes(std::string_view bytes) {
  return hex32(crc32_of(0, bytes.data(), bytes.size()));
}

std::vector<std::string> names_below(const fs::path& folder, std::string_view below) {
  std::vector<std::string> names;
  std::error_code fault;
  for (fs::directory_iterator file(folder / below, fault), end; !fault && file != end;
       file.increment(fault)) {
    names.push_back(std::string(below) + "/" + file->path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

std::vector<std::string> names_of_files(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code none;
  for (const std::string_view name : {kClockName, kSceneName}) {
    if (fs::exists(folder / name, none)) names.emplace_back(name);
  }
  for (const std::string_view below : {inputs_name(0), inputs_name(1), kVolumesName}) {
    for (std::string& name : names_below(folder, below)) names.push_back(std::move(name));
  }
  std::ranges::sort(names);
  return names;
}

Json checksums_of(const fs::path& folder) {
  Json files = Json::Members{};
  for (const std::string& name : names_of_files(folder)) {
    files[name] = crc32_of_file(folder / name);
  }
  return files;
}

std::string sealed(const Json& manifest) {
  std::string text = manifest.without(kSealKey).document();
  text.resize(text.size() - std::string_view("\n}\n").size());
  return text + seal_text(text);
}

Seal seal_of(std::string_view manifest_text) {
  const std::size_t at = manifest_text.rfind(kBeforeSeal);
  if (at == std::string_view::npos) return Seal::none;
  const std::string_view before = manifest_text.substr(0, at);
  return manifest_text.substr(at) == seal_text(before) ? Seal::whole : Seal::broken;
}

}  // namespace kerf
