/** Pauses between connection attempts: they double from `minMs` to `maxMs`, each with uniform jitter of +-20 %, so that
 *  the clients of a restarted probe do not reconnect all at the same moment. As proto/include/lightwell/backoff.hpp. */
export class Backoff {
  private nextMs: number;

  /** random: uniform, 0 to 1. */
  constructor(private readonly minMs: number, private readonly maxMs: number, private readonly random = Math.random) {
    this.nextMs = minMs;
  }

  next(): number {
    const pause = this.nextMs * (0.8 + 0.4 * this.random());
    this.nextMs = Math.min(2 * this.nextMs, this.maxMs);
    return pause;
  }

  /** Starts again at `minMs`, after a success. */
  reset(): void {
    this.nextMs = this.minMs;
  }
}
