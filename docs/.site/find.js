// SPDX-License-Identifier: Apache-2.0
// What the search finds, without a page: kerfFinder(lunr, sections) returns a function from a reader's words to sections, best first.
// A section is [place, page, title, text]. lunr gives stems, stop words and the weights of words (BM25, which counts a word of a short
// section more); a heading counts most. A reader's word also finds its other spelling, its synonyms, words that it begins, and
// without any of these, words that differ by a letter or two.
'use strict';
(() => {
  // Each row: words or terms for one thing. Pages use one of them, readers any.
  const kSynonyms = [
    'limit cycle, oscillation, oscillate, vibration, vibrate, chatter, buzz, swing, unstable, instability',
    'jitter, late ticks, wake-up latency, vibrate', 'latency, delay, lag, late', 'frame rate, fps, frames a second',
    'frequency response, bode, transfer function, system identification, kerf identify',
    'god object, proxy, virtual tool', 'virtual coupling, spring and damper, coupling',
    'passivity controller, passivity observer, energy observer, stabiliser', 'passivity, passive', 'z width, zwidth, stable stiffness', 'maximum, highest, most, upper limit',
    'sampling rate, update rate, servo rate, khz', 'quantization, encoder steps, resolution',
    'controller law, control law, force law', 'haptic rendering, contact force', 'sampling theorem, zero order hold, hold',
    'deformable, deformation, soft tissue, elastic, fem, finite elements', 'docker, container, podman, containerfile',
    'windows, macos, mac, osx, wsl', 'license, licence, apache, copyright, legal', 'faq, questions, answers',
    'troubleshooting, troubleshoot, does not work, does not run, goes wrong, problem, help, bug', 'commercial, sell, price, cost',
    'install, installation, setup, packages', 'supported, compatible, compatibility, works with',
    'unity, unreal, godot, game engine', 'paraview, vtk, blender', 'ros 2, ros2, ros, rosbag, crtk', 'matlab, octave, hdf5',
    'vr, virtual reality, headset, oculus, openxr, webxr', 'stereo, stereoscopic, 3d glasses', 'video, movie, film, mp4, screen recording',
    'tablet, phone, ipad, smartphone, browser', 'remote, second machine, network, distributed', 'image, picture, rendering',
    'certificate, tls, ssl, https, encryption', 'firewall, port, address', 'viewer, spectator, audience, client',
    'driver, firmware, device library', 'hardware in the loop, hil, emulator, emulated device', 'mock, fake, stand in, simulated device, without the hardware',
    'fault injection, faults, packet loss', 'unplugged, disconnected, cable, device goes away, lost device',
    'permission, rights, access denied, udev', 'emergency stop, motors off, watchdog, safety', 'calibration, calibrate, torque scale, homing',
    'ci, continuous integration, github actions, jenkins, gitlab', 'real time, realtime, preempt_rt, deadline', 'crash, kill, killed, dies, ends', 'error message, exit code', 'password, token', 'bandwidth, mbit, link', 'iframe, embed, sandbox',
    'projector, second monitor, class, classroom, full screen', 'statistics, percentile, p99, histogram', 'timing, overruns, late',
    'overheat, heat, thermal', 'tunnel, cross a wall, pop through', 'save, keep, export, write',
    'drill, bur, milling tool', 'drilling, milling, cutting, removal', 'dentine, dentin', 'gum, gingiva, soft tissue',
    'ct, dicom, scan, cbct', 'stl, mesh, obj, triangles, surface mesh', 'sound, audio, noise of the spindle', 'score, grade, assessment, evaluate, grading',
    'student, trainee, learner', 'stroke, cut', 'hardness, material properties, material', 'bimanual, two handed, both hands, two arms, two devices',
    '6 dof, six degrees of freedom, torque feedback, torque to the hand', 'admittance, impedance type', 'mouse, pointer, keyboard', 'replay, playback, repeat a run',
    'deterministic, determinism, reproducible, same bits', 'log, recording, recorded', 'cite, citation, bibtex, paper', 'api, header, interface',
    'arm64, aarch64, raspberry pi', 'embedded, microcontroller, bare metal, cortex', 'gpu, graphics card, opengl', 'plot, graph, chart', 'rotation, orientation',
  ].map((row) => row.split(', '));
  // Words of a question that say nothing beside others; lunr's own are never counted.
  const kStopWords = ['kerf', 'possible', 'want', 'need', 'try', 'use', 'using', 'work'];
  const kSpellings = new Map(Object.entries({gray: 'grey', licence: 'license', licences: 'licenses', dentine: 'dentin', catalogue: 'catalog'}));
  const kEndings = [[/is(e|es|ed|er|ers|ing|ation|ations)$/, 'iz$1'], [/ys(e|es|ed|er|ers|ing)$/, 'yz$1'], [/our(s|ed|ing|less)?$/, 'or$1'],
    [/tre(s|d)?$/, 'ter$1'], [/ll(ed|er|ers|ing)$/, 'l$1']];
  const kField = {title: 8, page: 2, text: 1};
  const kSynonym = 0.6, kBegins = 0.5, kLike = 0.4, kPart = 0.25;  // worth beside the word itself; of a term of which words are missing
  const kLists = /#(\d+-)?sources$/, kList = 0.2;  // papers repeat every word, and come last

  // One form for both spellings; not a word for readers.
  const spelled = (word) => kEndings.reduce((form, [end, other]) => form.length > 4 ? form.replace(end, other) : form, kSpellings.get(word) ?? word);

  // Words, names as a whole and in their parts: tick_record, tick, record.
  const wordsOf = (text) => (text.toLowerCase().match(/[\p{L}\p{N}_]+/gu) ?? [])
    .flatMap((name) => /[^_]_+[^_]/.test(name) ? [name, ...name.split('_').filter((part) => part)] : [name]);

  globalThis.kerfFinder = (lunr, sections) => {
    const stop = (word) => lunr.stopWordFilter(new lunr.Token(word)) === undefined;
    const stem = (word) => lunr.stemmer(new lunr.Token(spelled(word))).toString();
    const stemsOf = (text) => wordsOf(text).filter((word) => !stop(word)).map(stem);
    const stopStems = kStopWords.map(stem);
    const wordsOfQuestion = (question) => {
      const words = stemsOf(question), telling = words.filter((word) => !stopStems.includes(word));
      return telling.length ? telling : words;
    };
    const synonyms = kSynonyms.map((row) => row.map(stemsOf).filter((term) => term.some((word) => !stopStems.includes(word))));

    const builder = new lunr.Builder();
    builder.tokenizer = (text) => stemsOf(text).map((one) => new lunr.Token(one));
    builder.ref('at');
    for (const [field, boost] of Object.entries(kField)) builder.field(field, {boost});
    sections.forEach(([place, page, title, text], at) =>
      builder.add({at, page, title, text}, {boost: kLists.test(place) ? kList : 1}));
    const index = builder.build();

    const ask = (word, how = {}) => new Map(index.query((query) => query.term(word, how)).map(({ref, score}) => [Number(ref), score]));
    const asked = new Map();
    const scoresOf = (word) => asked.get(word) ?? asked.set(word, ask(word)).get(word);

    // Sections with the words of a term; with a part of them, for little.
    function scoresOfTerm(term) {
      const sum = new Map(), count = new Map();
      for (const word of term) {
        for (const [at, score] of scoresOf(word)) {
          sum.set(at, (sum.get(at) ?? 0) + score);
          count.set(at, (count.get(at) ?? 0) + 1);
        }
      }
      for (const [at, score] of sum) sum.set(at, count.get(at) === term.length ? score : kPart * score);
      return sum;
    }

    const begins = (term, words, at) => term.every((word, k) => words[at + k] === word);

    // The words as terms, each with its synonyms: the longest first.
    function termsOf(words) {
      const terms = [];
      for (let at = 0; at < words.length;) {
        const rows = synonyms.filter((row) => row.some((term) => begins(term, words, at)));
        const length = Math.max(1, ...rows.flat().filter((term) => begins(term, words, at)).map((term) => term.length));
        const own = words.slice(at, at + length);
        const others = rows.filter((row) => row.some((term) => term.length === length && begins(term, words, at))).flat()
          .filter((term) => term.join(' ') !== own.join(' '));
        terms.push({own, others});
        at += length;
      }
      return terms;
    }

    // `typing`: the last word may be the beginning of one.
    function scoresOfAll({own, others}, typing) {
      const best = scoresOfTerm(own);
      const take = (scores, worth) => scores.forEach((score, at) => best.set(at, Math.max(best.get(at) ?? 0, worth * score)));
      for (const other of others) take(scoresOfTerm(other), kSynonym);
      const last = own.at(-1);
      if (typing && own.length === 1 && last.length > 2) take(ask(last, {wildcard: lunr.Query.wildcard.TRAILING}), kBegins);
      for (const editDistance of [1, 2]) {
        if (best.size === 0 && last.length > 3 * editDistance) take(ask(last, {editDistance}), kLike);
      }
      return best;
    }

    const find = (question) => {
      const terms = termsOf(wordsOfQuestion(question));
      const scores = new Map(), met = new Map();
      terms.forEach((term, k) => scoresOfAll(term, k === terms.length - 1).forEach((score, at) => {
        scores.set(at, (scores.get(at) ?? 0) + score);
        met.set(at, (met.get(at) ?? 0) + 1);
      }));
      // A section with all terms comes before one that has a single one often.
      const worth = (at) => scores.get(at) * (met.get(at) / terms.length) ** 2;
      return [...scores.keys()].sort((a, b) => worth(b) - worth(a) || a - b).map((at) => sections[at]);
    };
    // Where a text has the first of a question's words, for an excerpt.
    find.firstIn = (text, question) => {
      const wanted = new Set(termsOf(wordsOfQuestion(question)).flatMap(({own, others}) => [...own, ...others.flat()]));
      for (const word of text.matchAll(/[\p{L}\p{N}_]+/gu)) {
        if (wanted.has(stem(word[0].toLowerCase()))) return word.index;
      }
      return 0;
    };
    return find;
  };
})();
