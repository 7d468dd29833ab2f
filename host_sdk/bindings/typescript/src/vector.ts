// Vectors and rotations. Right-handed, +X right, +Y up, -Z forward, metres.

export type Vec3 = [number, number, number];
/** Linear Rec. 709, D65. */
export type Rgb = [number, number, number];
/** Rotation quaternion x, y, z, w; Hamilton convention. */
export type Quat = [number, number, number, number];
/** T_a_b: p_a = rotation p_b + translation (m). */
export interface Pose {
  rotation: Quat;
  translation: Vec3;
}

/** Luminance in cd/m² of radiance, illuminance in lux of irradiance, if units are absolute. */
export function luminance(c: Rgb): number {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

/** The unit vector; null for zero, NaN or infinite input. `f` rounds each step: Math.fround as in C++'s floats. */
export function normalized(v: Vec3, f: (x: number) => number = (x) => x): Vec3 | null {
  const largest = Math.max(Math.abs(v[0]), Math.abs(v[1]), Math.abs(v[2]));
  if (!(largest > 0) || !Number.isFinite(f(f(v[0] + v[1]) + v[2]))) return null;
  const s = [f(v[0] / largest), f(v[1] / largest), f(v[2] / largest)];
  const squared = f(f(f(s[0] * s[0]) + f(s[1] * s[1])) + f(s[2] * s[2]));
  const k = f(1 / f(Math.sqrt(squared)));
  return [f(s[0] * k), f(s[1] * k), f(s[2] * k)];
}

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** The rotation that reverses the unit quaternion q. */
export function inverse([x, y, z, w]: Quat): Quat {
  return [-x, -y, -z, w];
}

/** First b, then a. */
export function composed(a: Quat, b: Quat): Quat {
  return [
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ];
}

/** v rotated by the unit quaternion q. */
export function rotate(q: Quat, v: Vec3): Vec3 {
  const [x, y, z, w] = q;
  const t: Vec3 = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
  return [
    v[0] + w * t[0] + y * t[2] - z * t[1],
    v[1] + w * t[1] + z * t[0] - x * t[2],
    v[2] + w * t[2] + x * t[1] - y * t[0],
  ];
}
