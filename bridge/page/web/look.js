// SPDX-License-Identifier: Apache-2.0
// The controls of the look, as the visualizer's look panel has them: a renderer for each volume, iso
// value, opacity of each material, clip plane, stereo.
import {kIsoRange, kOpacityRange} from './constants.js';
import {defaultOpacity} from './matter.js';
import {mainVolume} from './scene.js';

const kKinds = {iso: 'iso: surface', blend: 'blend: inside'};
const kIsoStep = 0.01;
const kLeastOpacity = 0.001;  // its slider goes in equal ratios from here on, and has 0 at its left end
const element = id => document.getElementById(id);

const opacityAt = share => share <= 0 ? 0 : kLeastOpacity ** (1 - share) * kOpacityRange[1];
const shareOf = opacity => opacity < kLeastOpacity ? 0 : 1 - Math.log(opacity) / Math.log(kLeastOpacity);

/** A slider with what it says beside it; `taken(value)` when it is let go. */
function slider(id, label, [low, high], step, at, text, taken) {
  const row = document.createElement('label');
  const input = Object.assign(document.createElement('input'), {id, type: 'range', min: low, max: high, step});
  const says = document.createElement('output');
  input.value = at;
  const show = () => {
    says.textContent = text(Number(input.value));
    input.setAttribute('aria-valuetext', says.textContent);
  };
  input.addEventListener('input', show);
  input.addEventListener('change', () => taken(Number(input.value)));
  show();
  row.append(label, input, says);
  return row;
}

export class LookControls {
  /** `stage` null: there is no picture to look at. */
  constructor(stage) {
    this.stage = stage;
    const readClip = () => {
      const axis = Number(document.querySelector('input[name="axis"]:checked').value);
      element('plane').hidden = !element('clip').checked;
      stage?.setLook({clip: {on: element('clip').checked, axis, at: Number(element('place').value)}});
    };
    element('clip').addEventListener('change', readClip);
    element('plane').addEventListener('input', readClip);
    element('stereo').addEventListener('change', ({target}) => {
      stage?.setLook({stereo: target.checked});
      stage?.home();
    });
    element('home').addEventListener('click', () => stage?.home());
  }

  /** Of a scene that is shown from now on. */
  begin(scene) {
    this.scene = scene;
    if (!this.stage) return;
    const {look} = this.stage;
    const choices = scene.volumes.map(({name}, v) => {
      const row = document.createElement('label'), choice = document.createElement('select');
      choice.id = v === 0 ? 'renderer' : `renderer${v}`;
      choice.append(...Object.entries(kKinds).map(([kind, words]) => new Option(words, kind)));
      choice.value = this.stage.kindOf(v);
      choice.addEventListener('change', () => this.setKinds(this.chosen()));
      row.append(scene.volumes.length === 1 ? 'renderer' : name, choice);
      return row;
    });
    element('renderers').replaceChildren(...choices);
    const own = mainVolume(scene).iso / 65535;
    element('isos').replaceChildren(slider('iso', 'iso', kIsoRange, kIsoStep, look.iso ?? own,
      value => value.toFixed(2), iso => this.stage.setLook({iso})));
    const legend = document.createElement('p');
    legend.textContent = 'opacity of a voxel';
    element('opacities').replaceChildren(legend, ...scene.materials.map(({name}, m) => {
      const share = shareOf(look.opacities[name] ?? defaultOpacity(scene.materials, m));
      return slider(`opacity${m}`, name, [0, 1], 0.01, share, at => opacityAt(at).toFixed(3), at =>
        this.stage.setLook({opacities: {...this.stage.look.opacities, [name]: Number(opacityAt(at).toFixed(3))}}));
    }).slice(1));
    this.show();
  }

  chosen() {
    return [...element('renderers').querySelectorAll('select')].map(choice => choice.value);
  }
  setKinds(kinds) {
    this.stage.setLook({kinds});
    this.show();
  }
  /** The renderer after that of the first volume, for all. */
  nextRenderer() {
    const kinds = Object.keys(kKinds), choices = [...element('renderers').querySelectorAll('select')];
    if (choices.length === 0) return;
    const next = kinds[(kinds.indexOf(choices[0].value) + 1) % kinds.length];
    for (const choice of choices) choice.value = next;
    this.setKinds(this.chosen());
  }
  /** Only what makes a difference. */
  show() {
    const kinds = this.chosen();
    element('isos').hidden = !kinds.includes('iso');
    element('opacities').hidden = !kinds.includes('blend');
  }
}
