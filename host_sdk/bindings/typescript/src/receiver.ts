// Receives the descriptors of a connection and keeps the newest: acceptance and counters as in C++
// (host_sdk/src/core/descriptor_receiver.hpp).
import { ClockMap } from "./clock_map.js";
import { Descriptor, decodeDescriptor, maxDescriptorBytes } from "./descriptor.js";
import { EnvironmentKeeper, EnvironmentMap } from "./environment.js";
import { Lighting } from "./lighting.js";
import { printable } from "./probe_status.js";
import { DecodeError } from "./wire.js";

export type LinkState =
  | "connecting" // A connection attempt is in progress.
  | "connected" // Descriptors are received as the probe makes them.
  | "waiting" // The last attempt failed; the next follows after a pause.
  | "closed"; // By close().

/** Statistics since connect(). */
export interface LinkStats {
  /** Valid descriptors. */
  received: number;
  /** Total size of the valid descriptors. */
  bytes: number;
  /** Missing captures: gaps in the sequence numbers. */
  gaps: number;
  /** Messages above 64 KiB, dropped without decoding. */
  oversized: number;
  /** Messages that are neither a descriptor nor a response; the last valid descriptor is kept. */
  undecodable: number;
  /** Descriptors that were received again after a newer one: dropped. */
  replayed: number;
  reconnects: number;
  /** Environment maps received, whole or as changes. */
  maps: number;
  /** Changes to a whole map that was not received: the last map is kept until the next whole one. */
  mapsWithoutKey: number;
  state: LinkState;
  /** Last error of the link or of a rejected message; empty if there was none. */
  lastError: string;
}

/** One received descriptor. */
export interface Arrival {
  /** Exactly as received, unknown fields included. */
  bytes: Uint8Array;
  descriptor: Descriptor;
  /** The map that applies to it. */
  environment: EnvironmentMap | null;
  /** Mid-exposure mapped to the host's clock (performance.now()), ns; the error is at most `timeUncertaintyNs`. */
  midExposureNs: bigint;
  timeUncertaintyNs: bigint;
  /** When the message was received, on the host's clock, ns. */
  receivedNs: bigint;
}

export class DescriptorReceiver {
  readonly stats: LinkStats = {
    received: 0, bytes: 0, gaps: 0, oversized: 0, undecodable: 0, replayed: 0, reconnects: 0, maps: 0,
    mapsWithoutKey: 0, state: "connecting", lastError: "",
  };
  private readonly keeper = new EnvironmentKeeper();
  private newest: Arrival | null = null;
  /** Identity and order of descriptors; null after a reconnection, when they may start again. */
  private order: Descriptor | null = null;
  private newestSequence: bigint | null = null;
  private wasConnected = false;

  /** The descriptor if it is valid and newer than the last one. Everything else is counted and dropped. */
  receive(bytes: Uint8Array, receivedNs: bigint, clock: ClockMap): Arrival | null {
    if (bytes.length > maxDescriptorBytes) {
      ++this.stats.oversized;
      this.report(`a message of ${bytes.length} bytes; a descriptor has at most ${maxDescriptorBytes}`);
      return null;
    }
    let descriptor: Descriptor;
    try {
      descriptor = decodeDescriptor(bytes);
    } catch (cause) {
      if (!(cause instanceof DecodeError)) throw cause;
      this.refuse(cause.message);
      return null;
    }
    if (this.isDuplicate(descriptor)) {
      ++this.stats.replayed;
      this.report(`descriptor ${descriptor.sequence} was received again after a newer one`);
      return null;
    }
    this.order = descriptor;
    const understood = this.keeper.take(descriptor);
    this.count(descriptor, bytes.length, understood);
    return (this.newest = {
      bytes,
      descriptor,
      environment: this.keeper.mapFor(descriptor),
      midExposureNs: clock.toHost(descriptor.midExposureNs),
      timeUncertaintyNs: clock.uncertainty(receivedNs),
      receivedNs,
    });
  }

  latest(nowNs: bigint, maxAgeMs: number): Lighting {
    if (this.newest === null) return new Lighting(null);
    const { descriptor, environment, midExposureNs } = this.newest;
    return new Lighting(descriptor, { ageMs: Number(nowNs - midExposureNs) / 1e6, maxAgeMs, environment });
  }

  /** Counts an invalid message. */
  refuse(why: string): void {
    ++this.stats.undecodable;
    this.report(why);
  }

  report(error: string): void {
    this.stats.lastError = printable(error);
  }

  setState(state: LinkState): void {
    if (state === "connected" && this.stats.state !== "connected") {
      this.order = null;
      if (this.wasConnected) ++this.stats.reconnects;
      this.wasConnected = true;
    }
    this.stats.state = state;
  }

  private isDuplicate(d: Descriptor): boolean {
    // A restarted daemon counts from the start again, but the clock of its machine continues.
    return this.order !== null && d.probeId === this.order.probeId && d.sequence <= this.order.sequence &&
      d.midExposureNs <= this.order.midExposureNs;
  }

  private count(d: Descriptor, bytes: number, understood: boolean): void {
    const { stats } = this;
    ++stats.received;
    stats.bytes += bytes;
    if (d.environment) ++stats[understood ? "maps" : "mapsWithoutKey"];
    // If the sequence number does not increase, the probe was restarted and the number of missing captures is unknown.
    if (this.newestSequence !== null && d.sequence > this.newestSequence)
      stats.gaps += Number(d.sequence - this.newestSequence - 1n);
    this.newestSequence = d.sequence;
  }
}
