// SPDX-License-Identifier: Apache-2.0
// The line in place of the picture: why there is none. Of several reasons the first of this order is shown.
const kOrder = ['page', 'address', 'run', 'picture'];
const reasons = {};

/** `of`: one of kOrder; `why`: '' where nothing is missing any more. */
export function missing(of, why) {
  reasons[of] = why;
  const text = kOrder.map(each => reasons[each]).find(Boolean) ?? '';
  const line = document.getElementById('missing');
  line.hidden = text === '';
  line.textContent = text;
  document.getElementById('picture').classList.toggle('gone', text !== '');
}
