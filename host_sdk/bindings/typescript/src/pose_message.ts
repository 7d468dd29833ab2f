// The message Pose of the wire (proto/lightwell/v1/pose.proto).
import { Pose, Quat, Vec3 } from "./vector.js";
import { DecodeError, WireReader, double } from "./wire.js";

export class PoseMessage {
  private readonly numbers = [0, 0, 0, 0, 0, 0, 0];

  read(wire: WireReader): this {
    wire.fields(Object.fromEntries(this.numbers.map((_, i) => [i + 1, double((v) => (this.numbers[i] = v))])));
    return this;
  }

  /** `what` names the field in the message of `error`. */
  get(what: string, error: (problem: string) => DecodeError): Pose {
    const [x, y, z, w] = this.numbers;
    const translation = this.numbers.slice(4) as Vec3;
    const squared = x * x + y * y + z * z + w * w;
    if (!(squared > 1e-18 && squared < Infinity)) throw error(`${what} has no rotation`);
    if (!translation.every((v) => Math.abs(v) <= 1e6)) throw error(`${what}: tx, ty, tz must be within 1e6 m`);
    return { rotation: [x, y, z, w].map((v) => v / Math.sqrt(squared)) as Quat, translation };
  }
}
