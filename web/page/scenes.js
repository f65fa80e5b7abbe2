// SPDX-License-Identifier: Apache-2.0
// The scenes of kerf whose volumes are computed, so that a tab can load them: `scenes/NAME.toml` beside the page.
export const scenes = [
  {name: 'phantom', hand: 'cut_cavity', title: 'a cavity in a molar'},
  {name: 'touch', hand: 'touch', title: 'touch a molar, without cutting'},
  {name: 'caries', hand: 'excavate', title: 'excavate a carious molar'},
  {name: 'class1', hand: 'class1', title: 'a class I preparation'},
  {name: 'crown', hand: 'round_crown', title: 'around a crown'},
  {name: 'two_teeth', hand: 'groove', title: 'a groove beside another tooth'},
  {name: 'shaft', hand: 'undercut', title: 'an undercut, by a tool with a shaft'},
  {name: 'torus', hand: 'stroke', title: 'a stroke over a torus'},
  {name: 'paper_small', hand: 'cut_cavity', title: 'the force of the paper, a small tool'},
];
