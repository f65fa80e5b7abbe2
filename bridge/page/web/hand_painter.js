// SPDX-License-Identifier: Apache-2.0
import {clipFromEye} from './camera.js';
import {kFaint, kForce, kHeadBare, kHeadLength, kHeadRadius, kSteel} from './constants.js';
import {GpuMesh, Program} from './gl.js';
import {arrowOf, poseOf} from './hand.js';
import {multiply, normalMatrix, turn} from './math.js';
import {toolMesh, unitCone, unitCylinder} from './mesh.js';

/** Draws tool and force arrow into the place to draw, under its depth. */
export class HandPainter {
  constructor(gl, scene) {
    Object.assign(this, {gl, scene});
    this.metal = new Program(gl, 'mesh', '#define KERF_METAL 1\n');
    this.plain = new Program(gl, 'mesh', '#define KERF_METAL 0\n');
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
    for (const one of [...this.tools, this.cylinder, this.cone, this.metal, this.plain]) one.free();
  }
}
