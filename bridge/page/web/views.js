// SPDX-License-Identifier: Apache-2.0
// A view that is shared: one viewer presents it, others follow it until their users move it.

const kStepMs = 33;  // as often as pictures are drawn
export const Presenter = {nobody: 0, another: 1, receiver: 2};  // of bridge/wire/messages.hpp

/** Whether a view can be looked from: as `is_valid` of shared/segment/presented_view.hpp. */
export function isView({eye, target, up}) {
  if (![...eye, ...target, ...up].every(value => Math.abs(value) <= 1e5)) return false;
  const away = eye.map((value, i) => value - target[i]);
  const square = v => v.reduce((sum, value) => sum + value * value, 0);
  const cross = [0, 1, 2].map(i => away[(i + 1) % 3] * up[(i + 2) % 3] - away[(i + 2) % 3] * up[(i + 1) % 3]);
  return square(away) >= 1e-12 && square(up) > 0 && square(cross) >= 1e-10 * square(away) * square(up);
}

export class SharedView {
  /** `send(view)` tells the bridge; null: no longer. `say(text)` tells the user. `follow` and `present` are checkboxes. */
  constructor(stage, {send, say, follow, present}) {
    Object.assign(this, {stage, send, say, follow, present});
    this.message = null;  // the last one of the bridge
    this.left = '';       // the camera as it was after the last step
    this.sent = '';
    this.timer = setInterval(() => this.step(), kStepMs);
  }
  pose() {
    return JSON.stringify(this.stage.camera.pose());
  }
  /** Whether there is anybody to follow, or was. */
  get known() {
    return this.message !== null;
  }
  /** What the bridge tells. */
  take(message) {
    const had = this.message?.presenter ?? Presenter.nobody;
    if (!isView(message)) return this.say('the presented view is none; it is left out');
    this.message = message;
    if (message.presenter === Presenter.another && this.present.checked) {
      this.present.checked = false;
      this.say('another viewer presents its view already');
    }
    if (message.presenter === Presenter.receiver) return;
    if (had === Presenter.another && message.presenter === Presenter.nobody) {
      this.say('the presenter has gone: this is the last view');
    }
    if (this.follow.checked) this.show();
  }
  show() {
    if (!this.message || !this.stage.scene || this.message.presenter === Presenter.receiver) return;
    this.stage.camera.lookFrom(this.message);
    this.stage.touch();
    this.left = this.pose();
  }
  step() {
    if (!this.stage.scene) return;
    const now = this.pose();
    if (this.follow.checked && this.left && now !== this.left) {
      this.follow.checked = false;
      this.say('your own view from here on');
    } else if (this.follow.checked && !this.left) {
      this.show();
    }
    if (!this.follow.checked) this.left = '';
    if (this.present.checked && now !== this.sent) {
      this.sent = now;
      this.send(this.stage.camera.pose());
    } else if (!this.present.checked && this.sent) {
      this.sent = '';
      this.send(null);
    }
  }
}
