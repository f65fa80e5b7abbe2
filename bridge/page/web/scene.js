// SPDX-License-Identifier: Apache-2.0
// What does not change in a run, as visualizer/scene/scene_view makes it of descriptors and text.
import {boxCorners, length, rigid, scaled, subtract, determinant, column} from './math.js';

const kFull = 65535;

function volumeView(volume, text) {
  const {origin_mm, orientation, spacing_mm, iso} = volume.descriptor;
  const worldFromVoxel = scaled(rigid(origin_mm, orientation), spacing_mm);
  const edges = [0, 1, 2].map(i => length(column(worldFromVoxel, i)));
  const high = volume.size.map(n => n - 0.5);
  const corners = boxCorners([-0.5, -0.5, -0.5], high, worldFromVoxel);
  return {volume, name: text?.name ?? '', solid: text?.solid ?? true, worldFromVoxel, corners,
    // Iso 0 would make the air around a volume solid.
    iso: Math.min(Math.max(iso, 1), kFull),
    radius: 0.5 * length(subtract(corners[7], corners[0])),
    edges, edge: Math.min(...edges),
    voxelMm3: Math.abs(determinant(worldFromVoxel))};
}

function toolView(text) {
  const facets = text.mesh ?? {points_mm: [], triangles: []};
  const profile = text.profile ?? [];
  const radius = Math.max(0, ...profile.map(([, r]) => r));
  return {name: text.name, profile, facets, shaft: text.shaft ?? [],
    radius: facets.points_mm.reduce((most, [x, , z]) => Math.max(most, Math.hypot(x, z)), radius)};
}

/** The first solid volume, else the first one. */
export const mainVolume = scene => scene.volumes.find(view => view.solid) ?? scene.volumes[0];

/** {volumes, tools, materials, main, corners}; throws where the text is not of this version. */
export function sceneView(held) {
  const text = held.sceneJson;
  const volumes = held.volumes.map((volume, i) => volumeView(volume, text.volumes[i]));
  return {volumes, tools: text.tools.map(toolView),
    materials: text.materials.map(({name, iso, colour}) => ({name, iso, colour})),
    main: mainVolume({volumes}),
    corners: volumes.flatMap(view => view.corners)};
}

/** The scene with the iso value (null: each volume its own) and the opacities of a look. */
export function sceneIn(scene, {iso, opacities}) {
  return {...scene,
    volumes: scene.volumes.map(view => iso === null ? view : {...view, iso: Math.round(iso * kFull)}),
    materials: scene.materials.map(one => ({...one, opacity: opacities[one.name]}))};
}

/** The density from which a voxel is solid, by label and the volume's iso: as `MaterialRule::solid_from`. */
export function solidFrom(materials) {
  return (label, iso) => label > 0 && label < materials.length ?
    Math.min(iso, Math.trunc(materials[label].iso * kFull)) : iso;
}

/** The material of a voxel by its label, else by its density: which counts what is removed. */
export function materialOf(materials) {
  const byIso = materials.map((material, index) => ({iso: material.iso * kFull, index})).slice(1)
    .sort((a, b) => a.iso - b.iso);
  return (label, density) => {
    if (label > 0 && label < materials.length) return label;
    return (byIso.findLast(one => one.iso <= density) ?? byIso[0])?.index ?? 0;
  };
}
