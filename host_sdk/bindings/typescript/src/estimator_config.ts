// The configuration of a probe's estimator. Meanings and defaults: proto/lightwell/v1/config.proto.
import type { Setting } from "./descriptor.js";
import { DecodeError, WireReader, double, message, uint32 } from "./wire.js";
import { WireWriter } from "./wire_writer.js";

/** What light is estimated from. The options of each kind are in the member of EstimatorConfig with the same name. */
export type EstimatorKind = "panorama" | "marker" | "specular";
export const estimatorKinds: readonly EstimatorKind[] = ["panorama", "marker", "specular"];

export interface EstimatorConfig {
  band: number;
  maxLights: number;
  setting: Setting;
  panorama: {
    lightThreshold: number;
    epsilon: number;
    radianceEpsilon: number;
    unseenFill: "none" | "mirror" | "average";
    smoothing: "none" | "one_euro";
    environmentEdge: number;
    environmentRate: number;
    interleave: number;
    maxBytes: number;
  };
  marker: { decimation: number; searchDecimation: number; maxFaces: number };
  specular: { environmentEdge: number };
}

/** The fields that are present are changed. */
export type EstimatorUpdate = {
  [Field in keyof EstimatorConfig]?:
    EstimatorConfig[Field] extends object ? Partial<EstimatorConfig[Field]> : EstimatorConfig[Field];
};

/** The active estimator and its options. */
export interface EstimatorState {
  kind: EstimatorKind;
  config: EstimatorConfig;
}

/** The settings that make a difference for an estimator of this kind. */
export function settingsOf(kind: EstimatorKind): readonly Setting[] {
  return kind === "panorama" ? ["fastest", "fast", "balanced", "exact"] : ["balanced"];
}

type Value = number | string;
type Fields = { [name: string]: Value };

/** One option: its number in its message, how it is encoded, its default and its limits. */
interface Option {
  readonly name: string;
  readonly field: number;
  /** Of an enum its words, from number 1. */
  readonly type: "uint32" | "double" | readonly string[];
  readonly initial: Value;
  readonly allow: (value: number) => boolean;
}

/** By number, from 1. */
export const settings: readonly Setting[] = ["fast", "balanced", "exact", "fastest"];
const within = (low: number, high: number) => (v: number) => v >= low && v <= high;
const fraction = (v: number) => v >= 0 && v < 1;
const edge = (v: number) => [0, 8, 16, 32, 64].includes(v);

const common: readonly Option[] = [
  { name: "band", field: 1, type: "uint32", initial: 6, allow: within(0, 6) },
  { name: "maxLights", field: 2, type: "uint32", initial: 16, allow: within(0, 64) },
  { name: "setting", field: 6, type: settings, initial: "balanced", allow: within(1, settings.length) },
];
const sections: readonly { name: EstimatorKind; field: number; options: readonly Option[] }[] = [
  {
    name: "panorama", field: 11, options: [
      { name: "lightThreshold", field: 1, type: "double", initial: 6, allow: (v) => v >= 1.5 && v < Infinity },
      { name: "epsilon", field: 2, type: "double", initial: 0.01, allow: fraction },
      { name: "radianceEpsilon", field: 3, type: "double", initial: 0, allow: fraction },
      { name: "unseenFill", field: 4, type: ["none", "mirror", "average"], initial: "none", allow: within(1, 3) },
      { name: "smoothing", field: 5, type: ["none", "one_euro"], initial: "one_euro", allow: within(1, 2) },
      { name: "environmentEdge", field: 6, type: "uint32", initial: 0, allow: edge },
      { name: "environmentRate", field: 7, type: "double", initial: 5, allow: (v) => v > 0 && v < Infinity },
      { name: "interleave", field: 8, type: "uint32", initial: 1, allow: within(1, 16) },
      { name: "maxBytes", field: 9, type: "uint32", initial: 0, allow: (v) => v === 0 || within(96, 2 ** 31 - 1)(v) },
    ],
  },
  {
    name: "marker", field: 12, options: [
      { name: "decimation", field: 1, type: "double", initial: 0, allow: (v) => v === 0 || within(1, 8)(v) },
      { name: "searchDecimation", field: 2, type: "double", initial: 1, allow: within(1, 8) },
      { name: "maxFaces", field: 3, type: "uint32", initial: 0, allow: within(0, 2 ** 31 - 1) },
    ],
  },
  { name: "specular", field: 13, options: [
    { name: "environmentEdge", field: 1, type: "uint32", initial: 0, allow: edge },
  ] },
];

/** The name of an option as config.proto has it: "panorama.light_threshold". */
export function optionName(section: string, name: string): string {
  return (section ? `${section}.` : "") + name.replace(/[A-Z]/g, (letter) => `_${letter.toLowerCase()}`);
}

function isSubmessage(value: unknown): value is Fields {
  return typeof value === "object" && value !== null;
}

function numberOf(option: Option, value: unknown, section: string): number {
  const name = optionName(section, option.name);
  if (typeof option.type !== "string") {
    const number = option.type.indexOf(value as string) + 1;
    if (number === 0) throw new TypeError(`${name}: '${value}' is not one of ${option.type.join(", ")}`);
    return number;
  }
  const whole = option.type === "uint32";
  if (typeof value !== "number" || (whole && !(Number.isInteger(value) && value >= 0 && value < 2 ** 32)))
    throw new TypeError(`${name}: '${value}' is not a ${whole ? "whole number from 0" : "number"}`);
  return value;
}

/** Writes the fields of an EstimatorConfig message. Throws TypeError for an unknown option, a value of another type,
 *  and an update without any field. */
export function writeEstimatorUpdate(update: EstimatorUpdate, out: WireWriter): void {
  let written = 0;
  const write = (options: readonly Option[], values: { [name: string]: unknown }, to: WireWriter, section: string) => {
    for (const [name, value] of Object.entries(values)) {
      if (value === undefined || isSubmessage(value)) continue;
      const option = options.find((o) => o.name === name);
      if (!option) throw new TypeError(`${section ? `${section}.` : ""}${name} is not an option of the estimator`);
      const number = numberOf(option, value, section);
      if (option.type === "double") to.double(option.field, number);
      else to.uint32(option.field, number);
      ++written;
    }
  };
  write(common, update, out, "");
  for (const [name, values] of Object.entries(update)) {
    if (!isSubmessage(values)) continue;
    const section = sections.find((s) => s.name === name);
    if (!section) throw new TypeError(`${name} is not an option of the estimator`);
    out.message(section.field, (part) => write(section.options, values, part, name));
  }
  if (written === 0) throw new TypeError("no option of the estimator is set");
}

function initialValues(options: readonly Option[]): Fields {
  return Object.fromEntries(options.map((option) => [option.name, option.initial]));
}

function readOptions(options: readonly Option[], values: Fields) {
  return Object.fromEntries(options.map(({ name, field, type }) => {
    if (type === "double") return [field, double((v) => (values[name] = v))];
    // A number that is not an enumerator of this version stays a number, which the check below refuses.
    return [field, uint32((v) => (values[name] = type === "uint32" ? v : type[v - 1] ?? v))];
  }));
}

/** Fields of a GetConfigResponse; `get` validates them. */
export class EstimatorStateMessage {
  private kind = 0;
  private readonly values = initialValues(common);
  private readonly parts = sections.map((section) => initialValues(section.options));

  read(wire: WireReader): void {
    wire.fields({
      1: uint32((v) => (this.kind = v)),
      2: message((config) => config.fields({
        ...readOptions(common, this.values),
        ...Object.fromEntries(sections.map(({ field, options }, k) =>
          [field, message((part) => part.fields(readOptions(options, this.parts[k])))])),
      })),
    });
  }

  /** Throws DecodeError where this version does not know the configuration. */
  get(): EstimatorState {
    const unknown = (what: string) => new DecodeError("data_loss",
      `${what}, in the probe's configuration; is this module older than its firmware?`);
    const kind = estimatorKinds[this.kind - 1];
    if (kind === undefined) throw unknown("the kind of estimator is not known");
    const check = (options: readonly Option[], values: Fields, section: string) => {
      for (const option of options) {
        const value = values[option.name];
        const number = typeof option.type === "string" ? value : option.type.indexOf(value as string) + 1;
        if (typeof number !== "number" || !option.allow(number))
          throw unknown(`${optionName(section, option.name)} is ${value}`);
        if (section && section !== kind && value !== option.initial)
          throw unknown(`${optionName(section, option.name)} is set, but the estimator is ${kind}`);
      }
    };
    check(common, this.values, "");
    sections.forEach(({ name, options }, k) => check(options, this.parts[k], name));
    const parts = Object.fromEntries(sections.map(({ name }, k) => [name, this.parts[k]]));
    return { kind, config: { ...this.values, ...parts } as unknown as EstimatorConfig };
  }
}
