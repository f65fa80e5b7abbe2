// SPDX-License-Identifier: Apache-2.0
#include "controller/input/load_error.hpp"
#include "controller/scene/scene_file.hpp"
#include "tests/fuzz/text_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kerf::fuzz::must_read_or_explain<kerf::LoadError>(
      data, size, [](std::string_view text) { return kerf::parse_scene(text, "scene.toml"); });
  return 0;
}
