// SPDX-License-Identifier: Apache-2.0
#include "visualizer/texture/cell_faces.hpp"

#include <algorithm>

namespace kerf {

namespace {

VoxelIndex cell_of(const CellFaces::Face& face) {
  return {face[0], face[1], face[2]};
}

std::vector<CellFaces::Run> runs_of(const std::vector<std::size_t>& places) {
  std::vector<CellFaces::Run> runs;
  for (const std::size_t place : places) {
    if (runs.empty() || runs.back().end != place) runs.push_back({place, place});
    runs.back().end = place + 1;
  }
  return runs;
}

}  // namespace

CellFaces::CellFaces(const Macrocells& cells) : faces_(cells.boundary_faces()) {}

std::vector<CellFaces::Run> CellFaces::update(const Macrocells& cells, const VoxelBox& flipped) {
  const VoxelBox near = flipped.grown(1).clipped(cells.grid().box());
  const std::vector<Face> fresh = cells.boundary_faces(near);
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    if (near.contains(cell_of(faces_[i]))) places.push_back(i);
  }
  // Those that come take the places of those that go, and more at the end.
  for (std::size_t more = places.size(); more < fresh.size(); ++more) {
    places.push_back(faces_.size());
    faces_.emplace_back();
  }
  for (std::size_t i = 0; i < fresh.size(); ++i) faces_[places[i]] = fresh[i];
  // A place that is left takes the last face, so the highest comes first: the last is none of them.
  for (std::size_t left = places.size(); left > fresh.size(); --left) {
    faces_[places[left - 1]] = faces_.back();
    faces_.pop_back();
  }
  while (!places.empty() && places.back() >= faces_.size()) places.pop_back();
  return runs_of(places);
}

VoxelBox CellFaces::active_box() const {
  VoxelBox box;
  for (const Face& face : faces_) {
    const auto [x, y, z] = cell_of(face);
    box = box.united({{x, y, z}, {x + 1, y + 1, z + 1}});
  }
  return box;
}

}  // namespace kerf
