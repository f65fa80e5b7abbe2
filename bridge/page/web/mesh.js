// SPDX-License-Identifier: Apache-2.0
// Tool and arrow as triangles with normals, as visualizer/compose/tool_mesh makes them.
import {kCreaseDegrees, kNeckPerRadius, kNeckRadii, kShankPerRadius, kShankFromRadii,
  kShankToRadii, kSides} from './constants.js';
import {add, cross, dot, length, normalized, subtract} from './math.js';

const kCosCrease = Math.cos(kCreaseDegrees * Math.PI / 180);

/** {vertices: x y z nx ny nz ..., triangles: indices}. */
const emptyMesh = () => ({vertices: [], triangles: []});

function append(mesh, other) {
  const base = mesh.vertices.length / 6;
  for (const value of other.vertices) mesh.vertices.push(value);
  for (const index of other.triangles) mesh.triangles.push(base + index);
}

function appendRing(mesh, [y, r], [up, out]) {
  for (let i = 0; i <= kSides; ++i) {
    const c = Math.cos(2 * Math.PI * i / kSides), s = Math.sin(2 * Math.PI * i / kSides);
    mesh.vertices.push(r * c, y, r * s, out * c, up, out * s);
  }
}

/** The closed body that a profile of points (y, radius) sweeps about the y axis. */
export function lathe(profile) {
  const points = profile.filter(([y, r], i) =>
    i === 0 || y !== profile[i - 1][0] || r !== profile[i - 1][1]);
  const mesh = emptyMesh();
  if (points.length < 2) return mesh;
  if (points[0][1] > 0) points.unshift([points[0][0], 0]);
  if (points.at(-1)[1] > 0) points.push([points.at(-1)[0], 0]);
  const walls = points.length - 1;
  const unit = ([a, b]) => [a / Math.hypot(a, b), b / Math.hypot(a, b)];
  const wallNormal = wall => unit([points[wall][1] - points[wall + 1][1],
    points[wall + 1][0] - points[wall][0]]);
  const normalAt = (wall, point) => {
    const own = wallNormal(wall), other = point === wall ? wall - 1 : wall + 1;
    if (other < 0 || other >= walls) return own;
    const next = wallNormal(other);
    if (own[0] * next[0] + own[1] * next[1] < kCosCrease) return own;
    return unit([own[0] + next[0], own[1] + next[1]]);
  };
  for (let wall = 0; wall < walls; ++wall) {
    const base = mesh.vertices.length / 6;
    appendRing(mesh, points[wall], normalAt(wall, wall));
    appendRing(mesh, points[wall + 1], normalAt(wall, wall + 1));
    for (let low = base; low < base + kSides; ++low) {
      const high = low + kSides + 1;
      mesh.triangles.push(low, high, low + 1, low + 1, high, high + 1);
    }
  }
  return mesh;
}

/** A closed mesh with normals; sharp edges stay sharp. */
function shaded({points_mm: points, triangles}) {
  const area = triangles.map(([a, b, c]) =>
    cross(subtract(points[b], points[a]), subtract(points[c], points[a])));
  const meeting = points.map(() => []);
  triangles.forEach((corners, t) => corners.forEach(corner => meeting[corner].push(t)));
  const mesh = emptyMesh();
  triangles.forEach((corners, t) => {
    const own = length(area[t]);
    if (!(own > 1e-12)) return;
    for (const corner of corners) {
      const normal = meeting[corner]
        .filter(other => dot(area[t], area[other]) >= kCosCrease * own * length(area[other]))
        .reduce((sum, other) => add(sum, area[other]), [0, 0, 0]);
      mesh.triangles.push(mesh.vertices.length / 6);
      mesh.vertices.push(...points[corner], ...normalized(normal));
    }
  });
  return mesh;
}

/** Head, and what is felt behind it; else the neck and shank of a real bur in proportion. */
export function toolMesh(tool) {
  const mesh = emptyMesh();
  if (tool.radius === 0) return mesh;
  append(mesh, shaded(tool.facets));
  let ys = tool.facets.points_mm.map(([, y]) => y).concat(0);
  if (tool.facets.triangles.length === 0) {
    append(mesh, lathe(tool.profile));
    ys = [tool.profile[0][0], tool.profile.at(-1)[0]];
  }
  if (tool.shaft.length > 0) {
    append(mesh, lathe(tool.shaft));
    return mesh;
  }
  const low = ys.reduce((a, b) => Math.min(a, b)), high = ys.reduce((a, b) => Math.max(a, b));
  const neck = kNeckPerRadius * tool.radius, shank = kShankPerRadius * tool.radius;
  append(mesh, lathe([[0.5 * (low + high), neck], [high + kNeckRadii * tool.radius, neck],
    [high + kShankFromRadii * tool.radius, shank], [high + kShankToRadii * tool.radius, shank]]));
  return mesh;
}

export const unitCylinder = () => lathe([[0, 1], [1, 1]]);
export const unitCone = () => lathe([[0, 1], [1, 0]]);
