// SPDX-License-Identifier: Apache-2.0
// The files of a recording in this tab: which of the dropped ones they are, and how kerf.wasm reads them, by the calls of
// WASI. Ticks are read piece by piece from the user's file, so a long log takes no memory; the packed volumes and inputs
// are unpacked at once.
import {filesInMcap} from './mcap_log.js';

export const kMostUnpacked = 2 ** 30;  // bytes of all of them; the one that is being unpacked is in memory twice
const kTicks = /^ticks(-2)?\.npy(\.\d{4,})?$/, kTexts = /^(manifest|scene)\.json$/;
const kVolume = /^[0-9a-f]{16}(-labels)?\.npy\.gz$/, kInputs = /^\d{12}\.npy\.gz$/;
const kHow = 'drop the folder of a recording, as DIR/log of ./kerf demo --out DIR, or the MCAP of ./kerf record export';

/** A file that is in memory. */
export const ofBytes = bytes => ({size: bytes.length, read: (at, length) => bytes.subarray(at, at + length)});

const folderOf = path => path.slice(0, Math.max(path.lastIndexOf('/'), 0));
const nameOf = path => path.slice(path.lastIndexOf('/') + 1);

/** Where a file of a recording belongs below its folder; '' if it is none. Some choosers know no folders. */
function placeOf(path) {
  const parts = path.split('/'), name = parts.at(-1);
  if (parts.length === 1) {
    if (kTicks.test(name) || kTexts.test(name)) return name;
    if (kVolume.test(name)) return `volumes/${name}`;
    return kInputs.test(name) ? `inputs/${name}` : '';
  }
  const isKept = parts.length === 2 && (parts[0] === 'volumes' ? kVolume.test(name) :
    /^inputs(-2)?$/.test(parts[0]) && kInputs.test(name));
  return isKept ? path : '';
}

/**
 * Finds the recording among dropped files, each {path, ...}. Returns {folder, files: Map of place to file}. Throws an
 * error with one line. Of an MCAP it returns {folder: its name, mcap: file}.
 */
export function findRecording(dropped) {
  if (dropped.length === 0) throw new Error(`nothing was dropped that can be read; ${kHow}`);
  const folders = [...new Set(dropped.filter(({path}) => nameOf(path) === 'ticks.npy').map(({path}) => folderOf(path)))];
  if (folders.length > 1) {
    throw new Error(`${folders.length} recordings: ${folders.slice(0, 3).join(', ')}${folders.length > 3 ? ', …' : ''}; drop one of them`);
  }
  if (folders.length === 0) {
    const [{path}] = dropped;
    const mcaps = dropped.filter(one => /\.mcap$/i.test(one.path));
    if (mcaps.length === 1) return {folder: mcaps[0].path, mcap: mcaps[0]};
    if (mcaps.length > 1) throw new Error(`${mcaps.length} MCAP files; drop one of them`);
    const manifest = dropped.find(one => nameOf(one.path) === 'manifest.json');
    if (manifest) throw new Error(`${manifest.path}: ticks.npy is not beside it; ${kHow}`);
    throw new Error(`${path}${dropped.length > 1 ? ` and ${dropped.length - 1} more` : ''}: no recording; ${kHow}`);
  }
  const [folder] = folders;
  const files = new Map();
  for (const file of dropped) {
    if (folder !== '' && !file.path.startsWith(`${folder}/`)) continue;
    const place = placeOf(folder === '' ? file.path : file.path.slice(folder.length + 1));
    if (place !== '' && !files.has(place)) files.set(place, file);
  }
  return {folder: folder === '' ? 'recording' : folder, files};
}

/** Bytes of gzip, unpacked; as they are if they are damaged, which the reader reports. */
async function unpacked(bytes, most, name) {
  if (typeof DecompressionStream !== 'function') {
    throw new Error(`${name}: this browser unpacks no gzip; use a newer one`);
  }
  const parts = [];
  let total = 0;
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip')).getReader();
  for (;;) {
    let part;
    try {
      part = await reader.read();
    } catch {
      return bytes;
    }
    if (part.done) break;
    total += part.value.length;
    if (total > most) {
      await reader.cancel();
      throw new Error(`${name}: more than ${most} bytes unpacked, too large for a tab; replay it with ./kerf replay`);
    }
    parts.push(part.value);
  }
  const out = new Uint8Array(total);
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}

/** Throws if a file of a log is there behind a number that is missing: the module asks for one after the other. */
function checkParts(folder, files) {
  for (const log of ['ticks.npy', 'ticks-2.npy']) {
    const nameOf = number => `${log}.${String(number).padStart(4, '0')}`;
    const numbers = [...files.keys()].filter(place => place.startsWith(`${log}.`)).map(place => Number(place.slice(log.length + 1)));
    let missing = 2;
    while (files.has(nameOf(missing))) ++missing;
    const later = Math.min(...numbers.filter(number => number > missing && files.has(nameOf(number))));
    if (later !== Infinity) {
      throw new Error(`${folder}/${nameOf(missing)}: missing, or cut in its header, and ${nameOf(later)} is there; copy the recording again`);
    }
  }
}

/**
 * The recording ready to be read: {folder, files: Map of path to {size, read}}. `bytesOf` a file gives all of it as
 * Uint8Array, `piecesOf` gives {size, read}. Throws as `findRecording`.
 */
export async function readyRecording(dropped, bytesOf, piecesOf, most = kMostUnpacked) {
  const {folder, files, mcap} = findRecording(dropped);
  if (!mcap) checkParts(folder, files);
  const ready = new Map();
  let left = most;
  for (const [place, file] of mcap ? ofMcap(mcap, piecesOf) : files) {
    const path = `${folder}/${place}`;
    if (kTicks.test(place)) {
      ready.set(path, mcap ? file : piecesOf(file));
      continue;
    }
    if (file.size > left) throw new Error(`${path}: ${file.size} bytes, too large for a tab; replay it with ./kerf replay`);
    let bytes;
    try {
      bytes = mcap ? file.bytes() : await bytesOf(file);
    } catch (problem) {
      throw mcap ? problem : new Error(`${path}: cannot be read; drop the folder again`);
    }
    if (place.endsWith('.gz')) bytes = await unpacked(bytes, left, path);
    left -= bytes.length;
    ready.set(path, ofBytes(bytes));
  }
  return {folder, files: ready};
}

/** As findRecording has the files of a folder: those in an MCAP that belong to a recording. */
function ofMcap(mcap, piecesOf) {
  return [...filesInMcap(piecesOf(mcap), mcap.path)].filter(([place]) => placeOf(place) === place);
}

// -- WASI, preview 1: names of values and layouts as its documentation has them

const kGood = 0, kNoSuchDescriptor = 8, kBadInput = 28, kNotRead = 29, kNoSuchFile = 44;
const kRoot = 3, kFolder = 3, kRegular = 4;
const kAllRights = 0xffffffffffffffffn;
const encoder = new TextEncoder();

/** The files that one instance of the module sees, below the folder `/`. */
export class LogFiles {
  /** `module`: {calls, bytesAt, textAt}. */
  constructor(module) {
    Object.assign(this, {module, files: new Map(), open: new Map(), last: kRoot});
  }
  /** Path without a leading slash to {size, read}. */
  mount(files) {
    this.files = files;
  }

  /** Frees the files of a folder. */
  forget(folder) {
    for (const path of [...this.files.keys()]) {
      if (path.startsWith(folder)) this.files.delete(path);
    }
  }

  view() {
    return new DataView(this.module.calls.memory.buffer);
  }
  isFolder(path) {
    return path === '' || path === '.' || [...this.files.keys()].some(name => name.startsWith(`${path}/`));
  }
  putState(to, kind, size) {
    this.module.bytesAt(to, 64).fill(0);
    const view = this.view();
    view.setUint8(to + 16, kind);
    view.setBigUint64(to + 24, 1n, true);
    view.setBigUint64(to + 32, BigInt(size), true);
    return kGood;
  }

  calls() {
    const name = (at, bytes) => this.module.textAt(at, bytes).replace(/\/+$/, '');
    return {
      fd_prestat_get: (fd, to) => {
        if (fd !== kRoot) return kNoSuchDescriptor;
        this.view().setUint32(to, 0, true);  // a folder
        this.view().setUint32(to + 4, 1, true);
        return kGood;
      },
      fd_prestat_dir_name: (fd, to) => {
        this.module.bytesAt(to, 1).set(encoder.encode('/'));
        return kGood;
      },
      path_open: (root, flags, at, bytes, create, rights, inherited, more, to) => {
        const path = name(at, bytes);
        const file = this.files.get(path);
        if (!file) return kNoSuchFile;
        this.open.set(++this.last, {file, at: 0});
        this.view().setUint32(to, this.last, true);
        return kGood;
      },
      fd_fdstat_get: (fd, to) => {
        if (fd !== kRoot && !this.open.has(fd)) return kNoSuchDescriptor;
        this.module.bytesAt(to, 24).fill(0);
        this.view().setUint8(to, fd === kRoot ? kFolder : kRegular);
        this.view().setBigUint64(to + 8, kAllRights, true);
        this.view().setBigUint64(to + 16, kAllRights, true);
        return kGood;
      },
      fd_read: (fd, list, count, to) => {
        const open = this.open.get(fd);
        if (!open) return kNoSuchDescriptor;
        let done = 0;
        try {
          for (let i = 0; i < count; ++i) {
            const [at, length] = [0, 4].map(more => this.view().getUint32(list + 8 * i + more, true));
            const part = open.file.read(open.at, Math.min(length, Math.max(open.file.size - open.at, 0)));
            this.module.bytesAt(at, part.length).set(part);
            open.at += part.length;
            done += part.length;
            if (part.length < length) break;
          }
        } catch {
          return kNotRead;  // it has changed since it was dropped
        }
        this.view().setUint32(to, done, true);
        return kGood;
      },
      fd_seek: (fd, by, whence, to) => {
        const open = this.open.get(fd);
        if (!open) return kNoSuchDescriptor;
        const at = Number(by) + [0, open.at, open.file.size][whence];
        if (!(at >= 0)) return kBadInput;
        open.at = at;
        this.view().setBigUint64(to, BigInt(at), true);
        return kGood;
      },
      fd_close: fd => this.open.delete(fd) ? kGood : kNoSuchDescriptor,
      fd_filestat_get: (fd, to) => {
        const open = this.open.get(fd);
        return open ? this.putState(to, kRegular, open.file.size) : kNoSuchDescriptor;
      },
      path_filestat_get: (root, flags, at, bytes, to) => {
        const path = name(at, bytes);
        const file = this.files.get(path);
        if (file) return this.putState(to, kRegular, file.size);
        return this.isFolder(path) ? this.putState(to, kFolder, 0) : kNoSuchFile;
      },
    };
  }
}
