// The light in other axes, for the conversions of this module.
import type { Descriptor } from "../descriptor.js";
import { Lighting } from "../lighting.js";
import { evaluateHarmonics, gaussLegendre, harmonicsBasis } from "../lobes.js";
import { Pose, Quat, Rgb, Vec3, composed, inverse, rotate } from "../vector.js";

const identity: Quat = [0, 0, 0, 1];

/** T_a_c from T_a_b and T_b_c. */
export function composedPoses(ab: Pose, bc: Pose): Pose {
  return { rotation: composed(ab.rotation, bc.rotation), translation: transformed(ab, bc.translation) };
}

/** p_a from T_a_b and p_b. */
export function transformed({ rotation, translation }: Pose, p: Vec3): Vec3 {
  return rotate(rotation, p).map((v, k) => v + translation[k]) as Vec3;
}

/** Coefficients of f(R^-1 d) from those of f(d): projection by a quadrature that is exact for the band. */
function rotatedHarmonics(radiance: readonly Rgb[], band: number, rotation: Quat): Rgb[] {
  const back = inverse(rotation);
  const out = radiance.map((): Rgb => [0, 0, 0]);
  const columns = 2 * band + 1;
  for (const { x: z, weight } of gaussLegendre(band + 1)) {
    const sine = Math.sqrt(1 - z * z);
    for (let i = 0; i < columns; ++i) {
      const phi = (2 * Math.PI * i) / columns;
      const d: Vec3 = [sine * Math.cos(phi), sine * Math.sin(phi), z];
      const value = evaluateHarmonics(radiance, rotate(back, d));
      const share = (weight * 2 * Math.PI) / columns;
      harmonicsBasis(band, d).forEach((y, k) => {
        for (let c = 0; c < 3; ++c) out[k][c] += share * y * value[c];
      });
    }
  }
  return out;
}

/** The light in the axes a, with `rotation` of T_a_probe: harmonics, directions of lights, map. Covariances, positions
 *  and origin stay those of the probe's frame, because the conversions do not use them. */
export function rotatedLighting(light: Lighting, rotation: Quat): Lighting {
  const { descriptor, environment, ageMs } = light;
  if (descriptor === null || rotation.every((v, k) => v === identity[k])) return light;
  const rotated: Descriptor = {
    ...descriptor,
    radiance: rotatedHarmonics(descriptor.radiance, descriptor.band, rotation),
    lights: descriptor.lights.map((one) => ({ ...one, direction: rotate(rotation, one.direction) })),
  };
  return new Lighting(rotated, {
    ageMs, maxAgeMs: light.validity === "valid" ? Infinity : -1,
    environment: environment && { ...environment, rotation: composed(rotation, environment.rotation ?? identity) },
  });
}
