// CRC-32C (Castagnoli), as in RFC 3720 B.4.

const table = new Uint32Array(256).map((_, i) => {
  let v = i;
  for (let k = 0; k < 8; ++k) v = v & 1 ? (v >>> 1) ^ 0x82f63b78 : v >>> 1;
  return v;
});

export function crc32c(bytes: Uint8Array, seed = 0): number {
  let crc = ~seed;
  for (const b of bytes) crc = (crc >>> 8) ^ table[(crc ^ b) & 255];
  return ~crc >>> 0;
}
