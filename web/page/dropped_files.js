// SPDX-License-Identifier: Apache-2.0
// Files and folders that a user drops on the page or chooses, as a list of {path, size, file}.

export const kMostFiles = 2000;

const found = (path, file) => ({path, size: file.size, file});
const tooMany = () => new Error(`more than ${kMostFiles} files and folders; drop the folder of one recording alone`);
const calls = (object, name) => new Promise((done, failed) => object[name](done, failed));

/** `seen` counts files and folders: one in another without an end has no file. */
async function walk(entry, out, seen) {
  if (++seen.entries > kMostFiles) throw tooMany();
  const path = entry.fullPath.replace(/^\//, '');
  if (entry.isFile) return out.push(found(path, await calls(entry, 'file')));
  const reader = entry.createReader();
  for (let some; (some = await calls(reader, 'readEntries')).length > 0;) {
    for (const one of some) await walk(one, out, seen);
  }
}

/** Of a drop. Its items are gone once the event is over, so they are taken before the first wait. */
export async function droppedFiles(transfer) {
  const entries = [...transfer.items].map(item => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) return chosenFiles(transfer.files);
  const out = [], seen = {entries: 0};
  for (const entry of entries) await walk(entry, out, seen);
  return out;
}

/** Of an input. */
export function chosenFiles(files) {
  if (files.length > kMostFiles) throw tooMany();
  return [...files].map(file => found(file.webkitRelativePath || file.name, file));
}
