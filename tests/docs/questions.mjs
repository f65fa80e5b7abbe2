// SPDX-License-Identifier: Apache-2.0
// Whether the site's search answers:  node questions.mjs SEARCH_FOLDER QUESTIONS.json
// Each question of a kind of reader must have its answer, a pattern, in the text of one of the first three sections.
import {readFileSync} from 'node:fs';
import {runInThisContext} from 'node:vm';

const [folder, file] = process.argv.slice(2);
globalThis.module = {exports: {}};
runInThisContext(readFileSync(`${folder}/lunr.js`, 'utf8'));
const lunr = globalThis.lunr ?? globalThis.module.exports;
runInThisContext(readFileSync(`${folder}/find.js`, 'utf8'));
const sections = runInThisContext(`${readFileSync(`${folder}/index.js`, 'utf8')}; searchIndex`);
const find = globalThis.kerfFinder(lunr, sections);
let count = 0, wrong = 0;
for (const [readers, questions] of Object.entries(JSON.parse(readFileSync(file, 'utf8')))) {
  for (const [question, answer] of Object.entries(questions)) {
    const first = find(question).slice(0, 3);
    const at = first.findIndex(([, , title, text]) => new RegExp(answer, 's').test(text));
    count += 1;
    wrong += at < 0;
    if (at < 0 || process.env.VERBOSE) console.log(`${at + 1} ${readers}: ${question}: ${first.map(([place]) => place).join('  ')}`);
  }
}
console.log(`${count} questions, ${wrong} without an answer in the first three hits`);
process.exit(wrong || count < 40 ? 1 : 0);
