// Offset and drift between the probe's and the host's clock, estimated from round trips: method and numbers as in
// host_sdk/src/core/clock_map.hpp.

/** Largest drift between two quartz clocks of 50 ppm each. */
const maxDrift = 100e-6;
/** Largest change of the drift among the stored round trips. */
const maxDriftChange = 1e-6;
const maxRoundTrips = 32;
/** Of two round trips within this time the shorter is kept, so that 32 of them reach back two minutes. */
const minSpacingNs = 4_000_000_000n;
const rounding = 0.5;
/** 73 years: larger clock values are invalid. */
const far = 1n << 61n;

interface RoundTrip {
  at: bigint;
  offset: bigint;
  half: bigint;
}
/** Offset at the newest round trip (ns, minus its own offset) and drift. */
type Corner = readonly [number, number];

const isTime = (ns: bigint) => ns >= -far && ns <= far;
const bounded = (v: number, low: number, high: number) => Math.min(Math.max(v, low), high);

/** Each round trip bounds the offset to an interval of its duration. The feasible set is all lines (offset, drift) that
 *  pass through all intervals; the estimate is the centre of the feasible offsets, and the uncertainty half their
 *  width, which is a hard bound. If no line is feasible, a clock was reset: then only the newest round trip is used.
 *  All times in ns. */
export class ClockMap {
  private kept: RoundTrip[] = [];
  private corners: Corner[] = [];
  private slowest = 0;
  private fastest = 0;

  /** Adds a round trip: the host sent at `sent` and received the response at `received`; in between the probe read
   *  `probe` from its clock. Ignored if `received` is before `sent` or before the last round trip. */
  add(sent: bigint, probe: bigint, received: bigint): void {
    if (![sent, probe, received].every(isTime)) return;
    const last = this.kept[this.kept.length - 1];
    if (received < sent || (last && received < last.at)) return;
    const half = (received - sent) / 2n;
    const roundTrip = { at: received, offset: probe - (sent + half), half: half + 1n };
    const before = this.kept[this.kept.length - 2];
    if (before && last.at - before.at < minSpacingNs) this.kept.splice(last.half < before.half ? -2 : -1, 1);
    if (this.kept.length === maxRoundTrips) this.kept.shift();
    this.kept.push(roundTrip);
    if (this.fit()) return;
    this.kept = [roundTrip];
    this.fit();
  }

  get known(): boolean {
    return this.kept.length > 0;
  }

  /** Probe time minus host time at `now`; zero if not known. */
  offset(now: bigint): bigint {
    if (!this.known) return 0n;
    const { low, high } = this.offsets(now);
    return this.newest().offset + BigInt(Math.round((low + high) / 2));
  }

  /** Maximum error of offset(now); zero if not known. */
  uncertainty(now: bigint): bigint {
    if (!this.known) return 0n;
    const { low, high } = this.offsets(now);
    return BigInt(Math.ceil((high - low) / 2)) + 1n;
  }

  /** Drift of the probe's clock against the host's, s/s; zero if not known. */
  get drift(): number {
    return this.known ? (this.slowest + this.fastest) / 2 : 0;
  }

  /** A time of the probe on the host's clock. */
  toHost(probe: bigint): bigint {
    if (!this.known) return probe;
    const time = probe < -far ? -far : probe > far ? far : probe;
    // offset() needs the host time that is being computed; one iteration has a relative error of 100 ppm squared.
    return time - this.offset(time - this.newest().offset);
  }

  forget(): void {
    this.kept = [];
  }

  private newest(): RoundTrip {
    return this.kept[this.kept.length - 1];
  }

  /** Computes the feasible set of the stored round trips; false if it is empty. */
  private fit(): boolean {
    const newest = this.newest();
    const h = Number(newest.half);
    this.corners = [[-h, -maxDrift], [h, -maxDrift], [h, maxDrift], [-h, maxDrift]];
    for (const { at, offset, half } of this.kept.slice(0, -1)) {
      const t = Number(at - newest.at);
      const seen = Number(offset - newest.offset);
      const most = Number(half) + maxDriftChange * Math.abs(t);
      this.clip(1, t, seen, most);
      this.clip(-1, t, seen, most);
    }
    if (this.corners.length === 0) return false;
    const drifts = this.corners.map(([, drift]) => drift);
    this.slowest = Math.min(...drifts);
    this.fastest = Math.max(...drifts);
    return true;
  }

  /** Clips by a half-plane (Sutherland & Hodgman 1974): sign (offset + drift t - seen) <= most. */
  private clip(sign: number, t: number, seen: number, most: number): void {
    const beyond = ([offset, drift]: Corner) => sign * (offset + drift * t - seen) - most;
    const out: Corner[] = [];
    this.corners.forEach((a, i) => {
      const b = this.corners[(i + 1) % this.corners.length];
      const [ofA, ofB] = [beyond(a), beyond(b)];
      if (ofA <= rounding) out.push(a);
      if (ofA <= rounding !== ofB <= rounding && ofA !== ofB) {
        const f = bounded(ofA / (ofA - ofB), 0, 1);
        out.push([a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1])]);
      }
    });
    this.corners = out;
  }

  /** Range of the feasible offsets at `now`, minus the offset of the newest round trip. */
  private offsets(now: bigint): { low: number; high: number } {
    const t = Number(now - this.newest().at);
    const all = this.corners.map(([offset, drift]) => offset + drift * t);
    const margin = maxDriftChange * Math.abs(t) + rounding;
    return { low: Math.min(...all) - margin, high: Math.max(...all) + margin };
  }
}
