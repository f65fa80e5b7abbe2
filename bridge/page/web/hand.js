// SPDX-License-Identifier: Apache-2.0
// What the hand holds and feels, as visualizer/compose/hand_painter.
import {kArrowScalesPerN, kArrowThickness, kHeadRadius, kLeastArrowN} from './constants.js';
import {screenBounds, unitedRect} from './camera.js';
import {add, boxCorners, cross, fromAxes, length, normalized, rigid, scaled, times, translated} from './math.js';
import {toolMesh} from './mesh.js';

/** Of a TickRecord; null before docking, when the place is unknown. The tip is the proxy's. */
export function handOf(record) {
  if (!record || !Number.isFinite(record.position_mm[0])) return null;
  return {tip: add(record.position_mm, record.proxy_offset_mm), orientation: record.orientation,
    tool: record.active_tool, force: record.commanded_force_n};
}

export const sameHand = (a, b) => a === b || (a && b && JSON.stringify(a) === JSON.stringify(b));

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
