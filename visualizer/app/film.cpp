// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/film.hpp"

#include <algorithm>

#include "shared/posix/new_file.hpp"

namespace kerf {

Film::Film(const std::string& path, PictureSize size, int frames_per_s)
    : file_(path, size, frames_per_s), frames_per_s_(frames_per_s) {}

double Film::filmed_s(double servo_s) const noexcept {
  return servo_s_ < 0.0 ? 0.0 : filmed_s_ + std::max(servo_s - servo_s_, 0.0);
}

double Film::due_in_s(double servo_s) const noexcept {
  return static_cast<double>(file_.frames()) / frames_per_s_ - filmed_s(servo_s);
}

void Film::add(const RenderTarget& target, double servo_s) {
  if (target.size() != file_.size()) {
    throw FileError("video " + file_.path() + ": ends with " + std::to_string(file_.frames()) +
                    " frames, because the picture has another size; begin another one");
  }
  filmed_s_ = filmed_s(servo_s);
  servo_s_ = servo_s;
  if (!due(servo_s)) return;
  fill_yuv420(target.size(), target.read_rgb(), yuv_);
  while (due(servo_s)) file_.write_frame(yuv_);
}

std::optional<std::string> add_frame(std::optional<Film>& film, const RenderTarget& target,
                                     double servo_s) {
  if (!film) return std::nullopt;
  try {
    film->add(target, servo_s);
    return std::nullopt;
  } catch (const FileError& problem) {
    film.reset();
    return problem.what();
  }
}

}  // namespace kerf
