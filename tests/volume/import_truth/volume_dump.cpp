// SPDX-License-Identifier: Apache-2.0
// volume_dump PATH [SPACING_MM]: a volume as kerf reads it, for other_readers.py. One line of text
// with size, spacing, origin and direction (row by row), then each value as float64, x fastest. A
// refusal goes to stderr, with exit code 2.
#include <cstdio>
#include <cstdlib>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/volume_io.hpp"

int main(int count, char** words) {
  if (count < 2) return 1;
  kerf::ReadOptions options;
  if (count > 2) options.spacing_mm.emplace().fill(std::atof(words[2]));
  try {
    const kerf::SourceVolume volume = kerf::read_volume(words[1], options);
    std::printf("%d %d %d", volume.grid.nx, volume.grid.ny, volume.grid.nz);
    for (const double x : volume.spacing_mm) std::printf(" %.17g", x);
    for (const double x : volume.origin_mm) std::printf(" %.17g", x);
    for (const double x : volume.direction) std::printf(" %.17g", x);
    std::printf("\n");
    for (std::size_t i = 0; i < volume.values.size(); ++i) {
      const double value{volume.values[i]};
      std::fwrite(&value, sizeof value, 1, stdout);
    }
  } catch (const kerf::LoadError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
