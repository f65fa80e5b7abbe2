// SPDX-License-Identifier: Apache-2.0
// What the hand holds and feels, as visualizer/compose/tool_painter.
import {clipFromEye, screenBounds, unitedRect} from './camera.js';
import {kArrowScalesPerN, kArrowThickness, kFaint, kForce, kHeadBare, kHeadLength, kHeadRadius,
  kLeastArrowN, kSteel} from './constants.js';
import {GpuMesh, programOf} from './gl.js';
import {add, boxCorners, cross, fromAxes, length, multiply, normalized, normalMatrix, rigid, scaled, times,
  translated, turn} from './math.js';
import {toolMesh, unitCone, unitCylinder} from './mesh.js';

/** Of a TickRecord; null before docking, when the place is unknown. The tip is the proxy's. */
export function handOf(record) {
  if (!record || !Number.isFinite(record.position_mm[0])) return null;
  return {tip: add(record.position_mm, record.proxy_offset_mm), orientation: record.orientation,
    tool: record.active_tool, force: record.commanded_force_n};
}

export const sameHand = (a, b) => a === b || (a && b && JSON.stringify(a) === JSON.stringify(b));
/** Of two lists, a hand for each arm. */
export const sameHands = (a, b) => a.length === b.length && a.every((hand, arm) => sameHand(hand, b[arm]));

export const poseOf = hand => rigid(hand.tip, hand.orientation);

/** From the surface of the tool's head outwards; null for hardly a force. */
export function arrowOf(scene, hand) {
  const strength = length(hand.force), scale = scene.main.radius;
  if (!(strength >= kLeastArrowN)) return null;
  const foot = add(hand.tip, times(hand.force, (scene.tools[hand.tool]?.radius ?? 0) / strength));
  const along = times(hand.force, kArrowScalesPerN * scale), thick = kArrowThickness * scale;
  const y = normalized(along), all = length(along);
  const x = normalized(cross(y, Math.abs(y[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1]));
  const axes = fromAxes(x, y, cross(x, y), foot);
  return {foot, tip: add(foot, along), thick,
    shaft(headLength, bare) {
      return scaled(axes, [thick, all - bare * Math.min(all, headLength * thick), thick]);
    },
    head(headLength, radius) {
      const head = Math.min(all, headLength * thick);
      return scaled(translated(axes, [0, all - head, 0]), [radius * thick, head, radius * thick]);
    }};
}

/** Low and high corner of a tool in its own axes. */
function boxOf(tool) {
  if (!tool.box) {
    const {vertices} = toolMesh(tool);
    const low = [0, 0, 0], high = [0, 0, 0];
    for (let i = 0; i < vertices.length; i += 6) {
      for (let axis = 0; axis < 3; ++axis) {
        low[axis] = Math.min(low[axis], vertices[i + axis]);
        high[axis] = Math.max(high[axis], vertices[i + axis]);
      }
    }
    tool.box = {low, high};
  }
  return tool.box;
}

/** Pixels that tool and arrow may touch. */
export function toolBounds(scene, hand, view, width, height) {
  let bounds = null;
  const tool = scene.tools[hand.tool];
  if (tool) {
    const {low, high} = boxOf(tool);
    bounds = screenBounds(boxCorners(low, high, poseOf(hand)), view, width, height);
  }
  const arrow = arrowOf(scene, hand);
  if (!arrow) return bounds;
  const around = kHeadRadius * arrow.thick;
  const ends = [0, 1, 2].map(i => [arrow.foot[i], arrow.tip[i]]);
  return unitedRect(bounds, screenBounds(boxCorners(ends.map(pair => Math.min(...pair) - around),
    ends.map(pair => Math.max(...pair) + around)), view, width, height));
}

/** Of the program `mesh`. */
export const kMetal = '#define KERF_METAL 1\n', kPlain = '#define KERF_METAL 0\n';

/** Draws tool and force arrow into the place to draw, under its depth. */
export class HandPainter {
  constructor(gl, scene) {
    Object.assign(this, {gl, scene});
    this.metal = programOf(gl, 'mesh', kMetal);
    this.plain = programOf(gl, 'mesh', kPlain);
    this.tools = scene.tools.map(tool => new GpuMesh(gl, toolMesh(tool)));
    this.cylinder = new GpuMesh(gl, unitCylinder());
    this.cone = new GpuMesh(gl, unitCone());
  }

  drawMesh(program, mesh, worldFromMesh, colour, opacity, view) {
    const eyeFromMesh = multiply(view.eyeFromWorld, worldFromMesh);
    program.use();
    program.set({u_eye_from_mesh: eyeFromMesh, u_eye_from_mesh_normal: normalMatrix(eyeFromMesh),
      u_clip_from_eye: clipFromEye(view), u_colour: colour, u_opacity: opacity,
      u_up_eye: turn(view.eyeFromWorld, [0, 1, 0])});
    mesh.draw();
  }

  drawTool(view, hand) {
    const {gl} = this;
    const tool = this.tools[hand.tool];
    if (!tool) return;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.enable(gl.CULL_FACE);
    this.drawMesh(this.metal, tool, poseOf(hand), kSteel, 1, view);
    gl.disable(gl.CULL_FACE);
  }

  /** The part behind other things shines through, so that a force is seen in a deep cavity too. */
  drawForce(view, hand) {
    const arrow = arrowOf(this.scene, hand);
    if (!arrow) return;
    const {gl} = this;
    const pieces = [[this.cylinder, arrow.shaft(kHeadLength, kHeadBare)],
      [this.cone, arrow.head(kHeadLength, kHeadRadius)]];
    gl.enable(gl.CULL_FACE);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE);
    gl.depthFunc(gl.GREATER);
    gl.depthMask(false);
    for (const [mesh, pose] of pieces) this.drawMesh(this.plain, mesh, pose, kForce, kFaint, view);
    gl.depthMask(true);
    gl.depthFunc(gl.LESS);
    gl.disable(gl.BLEND);
    for (const [mesh, pose] of pieces) this.drawMesh(this.plain, mesh, pose, kForce, 1, view);
    gl.disable(gl.CULL_FACE);
  }

  free() {
    for (const one of [...this.tools, this.cylinder, this.cone]) one.free();
  }
}
