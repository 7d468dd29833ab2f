// What this module uses of its platform, a browser or Node: clock, timers, UTF-8 and WebSocket. Declared here so that
// the module compiles with the library of ES2020 alone.

declare const performance: { now(): number };
declare const setTimeout: (callback: () => void, ms: number) => unknown;
declare const clearTimeout: (timer: unknown) => void;
declare class TextEncoder {
  encode(text: string): Uint8Array;
}
declare class TextDecoder {
  constructor(label: string, options: { fatal: boolean; ignoreBOM: boolean });
  decode(bytes: Uint8Array): string;
}

/** The part of the standard WebSocket that is used here; the one of the package `ws` has it too. */
export interface WebSocketLike {
  binaryType: string;
  readonly bufferedAmount: number;
  onopen: ((event: never) => void) | null;
  onmessage: ((event: never) => void) | null;
  onerror: ((event: never) => void) | null;
  onclose: ((event: never) => void) | null;
  send(data: Uint8Array): void;
  close(code?: number, reason?: string): void;
}
export type WebSocketConstructor = new (url: string, protocols: string[]) => WebSocketLike;

/** The WebSocket of the platform; null before Node 22, which needs the package `ws` or --experimental-websocket. */
export function platformWebSocket(): WebSocketConstructor | null {
  return (globalThis as { WebSocket?: WebSocketConstructor }).WebSocket ?? null;
}

/** The monotonic clock of this page or process, ns. */
export function hostNowNs(): bigint {
  return BigInt(Math.round(performance.now() * 1e6));
}

/** Of Firefox with resistance to fingerprinting. */
const coarsestStepMs = 100;
let resolution: bigint | null = null;

/** By how much hostNowNs() may be wrong, ns: browsers round performance.now() to between 5 µs and 100 ms so that pages
 *  cannot time the processor. Measured once, in at most 5 ms. */
export function hostResolutionNs(): bigint {
  if (resolution !== null) return resolution;
  const begin = performance.now();
  let step = 0;
  let last = begin;
  // The limit of readings is for a clock whose step is longer than the measurement.
  for (let readings = 0, steps = 0; steps < 3 && last - begin < 5 && readings < 100_000; ++readings) {
    const now = performance.now();
    if (now === last) continue;
    step = Math.max(step, now - last);
    last = now;
    ++steps;
  }
  return (resolution = BigInt(Math.round((step || coarsestStepMs) * 1e6)));
}

/** A timer that can be set again and cancelled. */
export class Timer {
  private timer: unknown = null;

  start(ms: number, callback: () => void): void {
    this.stop();
    this.timer = setTimeout(() => {
      this.timer = null;
      callback();
    }, ms);
  }
  stop(): void {
    if (this.timer !== null) clearTimeout(this.timer);
    this.timer = null;
  }
}

export const encodeUtf8 = (text: string): Uint8Array => new TextEncoder().encode(text);

/** Throws for bytes that are not UTF-8. */
export const decodeUtf8 = (bytes: Uint8Array): string =>
  new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(bytes);
