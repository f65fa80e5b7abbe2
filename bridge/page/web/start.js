// SPDX-License-Identifier: Apache-2.0
// Why the page did not start, and what to do. A classic script in the words of old browsers, since it speaks where modules do
// not run: it loads from a file, in a sandboxed frame and without modules. Once the page speaks itself, it is silent.
(function () {
  'use strict';
  var forbidden = '';  // what a policy kept from the page
  var lost = [];       // names of files that did not come
  var told = null;     // what did not start, to be told again as more of it is known

  function say(text) {
    var line = document.getElementById('missing');
    line.textContent = text;
    line.hidden = false;
    document.getElementById('state').textContent = 'not started';
  }

  function whyNotLoaded() {
    if (location.protocol === 'file:') {
      return 'This page was opened as a file, and browsers load no modules from files. Serve its folder: in it, run ' +
        'python3 -m http.server, then open http://localhost:8000.';
    }
    if (window.origin === 'null') {
      return 'This page stands in a sandboxed frame, which may not load its modules. Add allow-scripts and allow-same-origin to ' +
        'the sandbox of the frame, or open ' + location.href.split(/[?#]/)[0] + ' in a tab of its own.';
    }
    if (forbidden) {
      return 'The policy (Content-Security-Policy) of this page forbids ' + forbidden + '. Have the server allow it: ' +
        "script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'.";
    }
    var names = lost.slice(0, 3).join(', ') + (lost.length > 3 ? ' and ' + (lost.length - 3) + ' more' : '');
    var files = names ? 'Of this page there did not come: ' + names + ', or a module of it. ' : 'A part of this page did not come. ';
    if (navigator.onLine === false) return files + 'This machine is offline; load the page again once it has a network.';
    return files + 'Load the page again once its server is reached; have it serve the whole folder, .js as text/javascript.';
  }

  function whyNotStarted(problem) {
    if (!problem || /dynamically imported module|module script/i.test(problem.message)) return whyNotLoaded();
    if (window.origin === 'null') return whyNotLoaded();  // what is forbidden there is thrown too
    if (problem instanceof SyntaxError) return 'This browser is too old for this page; use a newer one.';
    return 'This page did not start (' + problem.message + '). Load it again, or use a newer browser.';
  }

  /** For modules too: what a part of the page did not come or begin for, as text. */
  window.whyNotStarted = whyNotStarted;

  function fail(problem) {
    if (document.body.dataset.state) return;  // the page speaks itself
    told = problem || true;
    say(whyNotStarted(problem));
  }

  document.addEventListener('securitypolicyviolation', function (event) {
    if (event.disposition === 'report') return;
    if (!/^(script|worker|child|connect|default)-src/.test(event.effectiveDirective)) return;
    forbidden = event.blockedURI.split('/').pop() + ' (' + event.effectiveDirective + ')';
    if (told) fail(told === true ? null : told);
  });
  window.addEventListener('error', function (event) {
    var from = event.target;
    if (from === window) return fail(event.error || {message: event.message});
    if (from.tagName !== 'SCRIPT' && from.rel !== 'modulepreload') return;
    var name = (from.src || from.href).split(/[?#]/)[0].split('/').pop();
    if (lost.indexOf(name) < 0) lost.push(name);
    // A file that was to be there early may still come; a script that did not is none.
    if (from.tagName === 'SCRIPT' || told) fail(null);
  }, true);

  if (!('noModule' in document.createElement('script'))) {
    say('This browser is too old: it has no modules of JavaScript. Use a newer one.');
  }
})();
