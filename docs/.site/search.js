// SPDX-License-Identifier: Apache-2.0
// Searches searchIndex: [place, page, title, text] of each section. First come those that have the most of the words; then
// a word in a title counts most. Messages to wrong input come last among those that have as many.
'use strict';
// The script comes before what it searches in since mkdocs 1.6.
document.addEventListener('DOMContentLoaded', () => {
  const input = document.getElementById('mkdocs-search-query');
  const results = document.getElementById('mkdocs-search-results');
  const kMost = 30, kBefore = 60, kExcerpt = 200;  // results; characters of an excerpt
  let loading = null;

  const load = () => loading ??= new Promise((done) => {  // a script may come from a folder, JSON may not
    const script = document.createElement('script');
    script.src = base_url.replace(/\/?$/, '/') + 'search/index.js';
    script.onload = done;
    document.head.append(script);
  });

  const countOf = (word, text) => text.split(word).length - 1;

  function scoreOf(words, [place, page, title, text]) {
    const kAnotherWord = 1e6, kMessages = 'errors.html';
    let score = 0;
    for (const word of words) {
      const here = 20 * Math.min(2, countOf(word, title.toLowerCase())) + 10 * Math.min(1, countOf(word, page.toLowerCase())) +
        Math.min(10, countOf(word, text.toLowerCase()));
      if (here > 0) score += kAnotherWord + here;
    }
    return score > 0 && place.startsWith(kMessages) ? score - kAnotherWord / 2 : score;
  }

  function shown([place, page, title, text], words) {
    const article = document.createElement('article'), heading = document.createElement('h3');
    const link = document.createElement('a'), excerpt = document.createElement('p');
    link.href = base_url.replace(/\/?$/, '/') + place;
    link.textContent = `${page}: ${title}`;
    const at = words.map((word) => text.toLowerCase().indexOf(word)).find((place) => place >= 0) ?? 0;
    const begin = Math.max(0, at - kBefore);
    excerpt.textContent = (begin ? '... ' : '') + text.slice(begin, begin + kExcerpt);
    heading.append(link);
    article.append(heading, excerpt);
    return article;
  }

  async function search() {
    await load();
    const words = input.value.toLowerCase().split(/\s+/).filter((word) => word);
    const found = words.length === 0 ? [] : searchIndex
      .map((one) => [scoreOf(words, one), one])
      .filter(([score]) => score > 0)
      .sort((a, b) => b[0] - a[0]);
    results.replaceChildren(...found.slice(0, kMost).map(([, one]) => shown(one, words)));
    if (words.length && !found.length) results.textContent = results.dataset.noResultsText;
  }

  input.addEventListener('input', search);
  const asked = new URLSearchParams(window.location.search).get('q');
  if (asked) {
    input.value = asked;
    search();
  }
});
