// SPDX-License-Identifier: Apache-2.0

/**
 * Decodes one LZ4 block into all of `out`. Throws where the block is not one of exactly that
 * length; reads and writes nothing outside, whatever the bytes.
 */
export function unpack(block, out) {
  let from = 0, to = 0;
  const refuse = () => {
    throw new Error('LZ4 block: damaged');
  };
  const longer = length => {
    for (let more = 255; more === 255; length += more) {
      if (from >= block.length) refuse();
      more = block[from++];
    }
    return length;
  };
  while (from < block.length) {
    const token = block[from++];
    const literals = token >> 4 === 15 ? longer(15) : token >> 4;
    if (literals > block.length - from || literals > out.length - to) refuse();
    out.set(block.subarray(from, from + literals), to);
    from += literals;
    to += literals;
    if (from === block.length) break;  // the last sequence has literals only
    if (block.length - from < 2) refuse();
    const back = block[from] | block[from + 1] << 8;
    from += 2;
    const length = ((token & 15) === 15 ? longer(15) : token & 15) + 4;
    if (back === 0 || back > to || length > out.length - to) refuse();
    for (const end = to + length; to < end; ++to) out[to] = out[to - back];  // it may overlap itself
  }
  if (to !== out.length) refuse();
}
