// SPDX-License-Identifier: Apache-2.0
#include "hil/hil_error.hpp"
#include "hil/script/fault_script.hpp"
#include "tests/fuzz/text_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kerf::fuzz::must_read_or_explain<kerf::HilError>(data, size, [](std::string_view text) {
    return kerf::parse_fault_script(text, "fault.toml");
  });
  return 0;
}
