// SPDX-License-Identifier: Apache-2.0
// Runs a WebAssembly program with WASI:  node .ci/run-wasi.js PROGRAM [ARGUMENT...]
const fs = require('fs')
const {WASI} = require('wasi')
const wasi = new WASI({version: 'preview1', args: process.argv.slice(2)})
WebAssembly.instantiate(fs.readFileSync(process.argv[2]), {wasi_snapshot_preview1: wasi.wasiImport})
  .then(({instance}) => { process.exitCode = wasi.start(instance) })
  .catch(error => { console.error(`run-wasi: ${process.argv[2]}: ${error.message}`); process.exitCode = 2 })
