// SPDX-License-Identifier: Apache-2.0
// What a picture is seen through: the lens, the first view and the limits of visualizer/scene/camera.
import {kEyesPerConvergence, kFarthest, kHalfHeightRad, kHomePitchRad, kHomeYawRad, kMargin,
  kMaxPitchRad, kNearest, kNearPlane, kZoomStep} from './constants.js';
import {affineInverse, clamp, cross, dot, length, subtract, times, transform} from './math.js';

/** A view: {eyeFromWorld, tanHalfHeight, aspect, middleRight, near, far, shown}; lengths in mm. */
export function clipFromEye(view) {
  const {far, near} = view;
  const wide = view.tanHalfHeight * view.aspect;
  return [1 / wide, 0, 0, 0, 0, 1 / view.tanHalfHeight, 0, 0,
    view.middleRight / wide, 0, -(far + near) / (far - near), -1,
    0, 0, -2 * far * near / (far - near), 0];
}

/** A plane goes to the eye as a row. */
export function shownInEye(view) {
  const back = affineInverse(view.eyeFromWorld);
  return [0, 1, 2, 3].map(c =>
    [0, 1, 2, 3].reduce((sum, r) => sum + view.shown[r] * back[4 * c + r], 0));
}

/** Turns about a point. Yaw 0 looks from +z, pitch is the height above the horizon; a presented view may be rolled. */
export class OrbitCamera {
  roll = 0;
  /** Shows boxes with these corners, from above and in front. */
  frame(corners, aspect) {
    const low = [0, 1, 2].map(i => Math.min(...corners.map(c => c[i])));
    const high = [0, 1, 2].map(i => Math.max(...corners.map(c => c[i])));
    this.centre = times(low.map((value, i) => value + high[i]), 0.5);
    this.target = this.centre;
    this.roll = 0;
    this.yaw = kHomeYawRad;
    this.pitch = kHomePitchRad;
    this.radius = Math.max(...corners.map(c => length(subtract(c, this.centre))));
    const half = Math.tan(kHalfHeightRad) / kMargin;
    const axes = this.axes();
    this.distance = 0;
    for (const corner of corners) {
      const [x, y, z] = axes.map(axis => dot(axis, subtract(corner, this.centre)));
      const needed = Math.max(Math.abs(x) / Math.max(aspect, 1), Math.abs(y) * Math.min(aspect, 1));
      this.distance = Math.max(this.distance, z + needed / half);
    }
  }

  /** From here; as near and as far as the wheel goes. */
  look({yaw, pitch, distance, target}) {
    Object.assign(this, {roll: 0, yaw, pitch: clamp(pitch, -kMaxPitchRad, kMaxPitchRad), target});
    this.distance = clamp(distance, kNearest * this.radius, kFarthest * this.radius);
  }

  /** From `eye`, with `target` in the middle and `up` upright: as OrbitCamera::look of visualizer/scene/camera. */
  lookFrom({eye, target, up}) {
    const away = subtract(eye, target);
    this.distance = length(away);
    const backward = times(away, 1 / this.distance);
    const level = Math.hypot(backward[0], backward[2]) > 1e-9 ? backward : times(up, backward[1] > 0 ? -1 : 1);
    Object.assign(this, {roll: 0, target: [...target], yaw: Math.atan2(level[0], level[2]),
      pitch: Math.asin(clamp(backward[1], -1, 1))});
    const [x, y] = this.axes();
    this.roll = Math.atan2(-dot(x, up), dot(y, up));
  }
  pose() {
    const [, up, backward] = this.axes();
    return {eye: this.target.map((at, i) => at + this.distance * backward[i]), target: [...this.target], up};
  }

  /** Drags, in heights of the picture. */
  orbit(right, up) {
    const [sine, cosine] = [Math.sin(this.roll), Math.cos(this.roll)];
    [right, up] = [cosine * right - sine * up, sine * right + cosine * up];
    this.yaw -= right * Math.PI;
    this.pitch = clamp(this.pitch - up * Math.PI, -kMaxPitchRad, kMaxPitchRad);
  }
  pan(right, up) {
    const mm = 2 * this.distance * Math.tan(kHalfHeightRad);
    const [x, y] = this.axes();
    this.target = this.target.map((at, i) => at - mm * (right * x[i] + up * y[i]));
  }
  /** Steps of the wheel; positive is nearer. */
  zoom(steps) {
    this.distance = clamp(this.distance * kZoomStep ** steps, Math.min(kNearest * this.radius, this.distance),
      Math.max(kFarthest * this.radius, this.distance));
  }

  /** Right, up and backward. */
  axes() {
    const backward = [Math.cos(this.pitch) * Math.sin(this.yaw), Math.sin(this.pitch),
      Math.cos(this.pitch) * Math.cos(this.yaw)];
    const level = [Math.cos(this.yaw), 0, -Math.sin(this.yaw)], upright = cross(backward, level);
    const [sine, cosine] = [Math.sin(this.roll), Math.cos(this.roll)];
    return [level.map((value, i) => cosine * value + sine * upright[i]),
      upright.map((value, i) => cosine * value - sine * level[i]), backward];
  }

  /** Near and far plane hold all within `reach` of the centre of what is framed. */
  view(aspect, reach) {
    const [right, up, backward] = this.axes();
    const eye = this.target.map((at, i) => at + this.distance * backward[i]);
    const eyeFromWorld = [right[0], up[0], backward[0], 0, right[1], up[1], backward[1], 0,
      right[2], up[2], backward[2], 0, -dot(right, eye), -dot(up, eye), -dot(backward, eye), 1];
    const away = length(subtract(eye, this.centre));
    const near = Math.max(away - reach, kNearPlane * this.radius);
    return {eyeFromWorld, aspect, middleRight: 0, near, far: Math.max(away + reach, 2 * near),
      // A picture higher than wide shows the same sphere: the lens opens, the camera stays.
      tanHalfHeight: Math.tan(kHalfHeightRad) / Math.min(1, aspect), shown: [0, 0, 0, 1]};
  }
}

/** Left and right eye before one window. */
export function eyeViews(middle, convergence) {
  const half = 0.5 * kEyesPerConvergence * convergence;
  return [-half, half].map(right => {
    const eyeFromWorld = middle.eyeFromWorld.slice();
    eyeFromWorld[12] -= right;
    return {...middle, eyeFromWorld, middleRight: middle.middleRight - right / convergence};
  });
}

/** Pixels {x0, y0, x1, y1}, from the lowest row, that the hull of `corners` can cover. */
export function screenBounds(corners, view, width, height) {
  const all = {x0: 0, y0: 0, x1: width, y1: height};
  const bounds = {x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity};
  for (const corner of corners) {
    const eye = transform(view.eyeFromWorld, corner);
    if (!(-eye[2] > view.near)) return all;
    const up = eye[1] / (-eye[2] * view.tanHalfHeight);
    const right = (eye[0] / -eye[2] - view.middleRight) / (view.tanHalfHeight * view.aspect);
    const [x, y] = [(right + 1) / 2 * width, (up + 1) / 2 * height];
    bounds.x0 = Math.min(bounds.x0, x - 1);
    bounds.x1 = Math.max(bounds.x1, x + 1);
    bounds.y0 = Math.min(bounds.y0, y - 1);
    bounds.y1 = Math.max(bounds.y1, y + 1);
  }
  return clippedRect({x0: Math.floor(bounds.x0), y0: Math.floor(bounds.y0),
    x1: Math.ceil(bounds.x1), y1: Math.ceil(bounds.y1)}, all);
}

export const clippedRect = (r, all) => ({x0: clamp(r.x0, all.x0, all.x1),
  y0: clamp(r.y0, all.y0, all.y1), x1: clamp(r.x1, all.x0, all.x1), y1: clamp(r.y1, all.y0, all.y1)});
export const isEmptyRect = r => !r || r.x0 >= r.x1 || r.y0 >= r.y1;
/** The smallest one that holds both; either may be null. */
export function unitedRect(a, b) {
  if (isEmptyRect(a)) return b;
  if (isEmptyRect(b)) return a;
  return {x0: Math.min(a.x0, b.x0), y0: Math.min(a.y0, b.y0), x1: Math.max(a.x1, b.x1),
    y1: Math.max(a.y1, b.y1)};
}
export const grownRect = (r, by) => ({x0: r.x0 - by, y0: r.y0 - by, x1: r.x1 + by, y1: r.y1 + by});
