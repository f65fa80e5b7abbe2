// SPDX-License-Identifier: Apache-2.0
// The search box: what find.js finds in searchIndex, with excerpts.
'use strict';
// The script comes before what it searches in since mkdocs 1.6.
document.addEventListener('DOMContentLoaded', () => {
  const input = document.getElementById('mkdocs-search-query');
  const results = document.getElementById('mkdocs-search-results');
  const kMost = 30, kBefore = 60, kExcerpt = 200;  // results; characters of an excerpt
  const base = base_url.replace(/\/?$/, '/');
  let find = null;

  const loadScript = (name) => new Promise((done) => {  // a script may come from a folder, JSON may not
    const script = document.createElement('script');
    script.src = `${base}search/${name}`;
    script.onload = done;
    document.head.append(script);
  });

  const load = () => find ??= Promise.all(['lunr.js', 'find.js', 'index.js'].map(loadScript)).then(() => kerfFinder(lunr, searchIndex));

  function shown([place, page, title, text], at) {
    const article = document.createElement('article'), heading = document.createElement('h3');
    const link = document.createElement('a'), excerpt = document.createElement('p');
    link.href = base + place;
    link.textContent = page === title ? page : `${page}: ${title}`;
    const begin = Math.max(0, at - kBefore);
    excerpt.textContent = (begin ? '... ' : '') + text.slice(begin, begin + kExcerpt);
    heading.append(link);
    article.append(heading, excerpt);
    return article;
  }

  async function search() {
    const words = input.value.trim();
    const finder = await load();
    if (words !== input.value.trim()) return;  // typed on
    const found = words ? finder(words).slice(0, kMost) : [];
    results.replaceChildren(...found.map((one) => shown(one, finder.firstIn(one[3], words))));
    if (words && !found.length) results.textContent = results.dataset.noResultsText;
  }

  input.addEventListener('focus', load);
  input.addEventListener('input', search);
  const asked = new URLSearchParams(window.location.search).get('q');
  if (asked) {
    input.value = asked;
    search();
  }
});
