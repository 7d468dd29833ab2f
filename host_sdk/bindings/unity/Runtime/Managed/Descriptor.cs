// A LightingDescriptor: values as they are on the wire, checked. proto/README.md specifies the format.
using System;
using System.Collections.Generic;

namespace Lightwell.Managed
{
    /// <summary>A detected light (lamp, sun, window), modelled as a spherical cap of uniform radiance.</summary>
    public sealed class DiscreteLight
    {
        /// <summary>Unit, TOWARDS the light.</summary>
        public Vec3 Direction { get; internal set; }
        /// <summary>Irradiance at normal incidence.</summary>
        public Rgb Irradiance { get; internal set; }
        /// <summary>rad, 0 to pi/2.</summary>
        public float AngularRadius { get; internal set; }
        /// <summary>u·u, u·v, v·v in rad².</summary>
        public Vec3 DirectionCovariance { get; internal set; }
        /// <summary>Identity over time: the same light keeps its track. 0: not tracked.</summary>
        public uint Track { get; internal set; }
        /// <summary>From the origin, m. 0: distant or not known.</summary>
        public float Distance { get; internal set; }
        /// <summary>Standard deviation of the distance, m.</summary>
        public float DistanceSigma { get; internal set; }
        /// <summary>In the probe's frame, m; null if the distance is not known.</summary>
        public Vec3? Position { get; internal set; }

        internal Double3 Unit;
    }

    /// <summary>The lighting of one moment: at the origin, in the probe's axes.</summary>
    public sealed class Descriptor
    {
        public const int MaxBytes = 65536;
        public const int MaxBand = 6;
        public const int MaxLights = 64;

        public ulong Sequence { get; internal set; }
        /// <summary>Mid-exposure in the probe's clock.</summary>
        public long ProbeMidExposureNs { get; internal set; }
        public Units Units { get; internal set; }
        /// <summary>Highest band of Radiance.</summary>
        public int Band { get; internal set; }
        /// <summary>Spherical harmonics of the radiance without the lights: real, orthonormal, without the
        /// Condon-Shortley phase, in the order l(l+1)+m, (Band + 1)² of them. Not to be changed.</summary>
        public Rgb[] Radiance { get; internal set; }
        /// <summary>Strongest first. Not to be changed.</summary>
        public DiscreteLight[] Lights { get; internal set; }
        /// <summary>Bound of the irradiance error, RMS over normals relative to the RMS irradiance; infinite without
        /// one (see Flags).</summary>
        public float ErrorBound { get; internal set; }
        /// <summary>Fraction of the sphere that at least one pixel sees.</summary>
        public float Coverage { get; internal set; }
        public LightFlags Flags { get; internal set; }
        public uint ProbeId { get; internal set; }
        public uint CalibrationId { get; internal set; }
        /// <summary>T_probe_origin: the light holds at its translation, m. Turns no direction.</summary>
        public double OriginX { get; internal set; }
        public double OriginY { get; internal set; }
        public double OriginZ { get; internal set; }
        public Rotation OriginOrientation { get; internal set; }

        internal MapMessage Map;

        /// <summary>Decodes the first `count` bytes. Throws DecodeException for bytes that are not a message and for a
        /// message that violates the specification; unknown fields are ignored.</summary>
        public static Descriptor Decode(byte[] bytes, int count)
        {
            if (bytes == null) throw new ArgumentNullException("bytes");
            if (count < 0 || count > bytes.Length) throw new ArgumentOutOfRangeException("count");
            if (count > MaxBytes) throw new DecodeException(Status.DataLoss, "descriptor: longer than 64 KiB");
            return new DescriptorMessage(new WireReader(bytes, count, "descriptor")).Checked();
        }

        public static Descriptor Decode(byte[] bytes) => Decode(bytes, bytes == null ? 0 : bytes.Length);
    }

    /// <summary>The fields of a LightingDescriptor. All bytes are parsed before values are checked, so that a truncated
    /// message is DataLoss, whatever its content.</summary>
    internal sealed class DescriptorMessage
    {
        private const uint WireVersion = 1;
        private const uint Infinite = 0xffffffff;

        private readonly RadianceMessage radiance = new RadianceMessage();
        private readonly List<LightMessage> lights = new List<LightMessage>();
        private readonly List<uint> flags = new List<uint>();
        private PoseMessage origin;
        private MapMessage map;
        private ulong sequence;
        private long midExposure;
        private uint version, clock, units, totalBound, probeId, calibrationId;
        private float unseen, saturated;

        internal DescriptorMessage(WireReader wire)
        {
            uint ignored = 0;
            while (wire.Next(out var field))
            {
                WireReader part;
                switch (field)
                {
                    case 1: wire.UInt32(ref version); break;
                    case 2: wire.UInt64(ref sequence); break;
                    case 3: if (wire.Message(out part)) ReadTime(part); break;
                    case 4: wire.UInt32(ref units); break;
                    case 5: if (wire.Message(out part)) radiance.Read(part); break;
                    case 6: if (wire.Message(out part)) lights.Add(new LightMessage(part)); break;
                    case 7: if (wire.Message(out part)) (map ?? (map = new MapMessage())).Read(part); break;
                    case 8: wire.Float(ref unseen); break;
                    case 9: wire.Float(ref saturated); break;
                    case 10: if (wire.Message(out part)) ReadBound(part); break;
                    case 11: wire.Fixed32(ref probeId); break;
                    case 12: wire.Fixed32(ref calibrationId); break;
                    case 13: wire.UInt32s(flags); break;
                    case 14: case 15: wire.UInt32(ref ignored); break;
                    case 16: if (wire.Message(out part)) (origin ?? (origin = new PoseMessage())).Read(part); break;
                    default: wire.Skip(); break;
                }
            }
        }

        internal Descriptor Checked()
        {
            if (version != WireVersion)
                throw DecodeException.Invalid("wire_version is " + version + ", this reader knows 1");
            if (clock != 1) throw DecodeException.Invalid("time.clock is not known");
            if (units != 1 && units != 2) throw DecodeException.Invalid("units are not known");
            if (lights.Count > Descriptor.MaxLights) throw DecodeException.Invalid("more than 64 lights");
            var made = new Descriptor
            {
                Sequence = sequence, ProbeMidExposureNs = midExposure, Units = (Units)units, ProbeId = probeId,
                CalibrationId = calibrationId, Flags = FlagsOf(flags), OriginOrientation = new Rotation(0, 0, 0, 1),
                ErrorBound = totalBound == Infinite ? float.PositiveInfinity : (float)(totalBound * 1e-6)
            };
            if (origin != null) origin.CheckedInto(made);
            radiance.CheckedInto(made);
            made.Lights = new DiscreteLight[lights.Count];
            for (var i = 0; i < lights.Count; ++i) made.Lights[i] = lights[i].Checked(made);
            if (map != null) map.Check();
            made.Map = map;
            made.Coverage = (float)(1 - (double)Share(unseen, "unseen (1 - coverage)"));
            Share(saturated, "saturated");
            return made;
        }

        private void ReadTime(WireReader wire)
        {
            uint ignored = 0;
            while (wire.Next(out var field))
                switch (field)
                {
                    case 1: wire.Fixed64(ref midExposure); break;
                    case 2: wire.UInt32(ref clock); break;
                    case 3: case 4: wire.UInt32(ref ignored); break;
                    default: wire.Skip(); break;
                }
        }

        private void ReadBound(WireReader wire)
        {
            uint ignored = 0;
            while (wire.Next(out var field))
                if (field == 1) wire.UInt32(ref totalBound);
                else if (field <= 6) wire.UInt32(ref ignored);
                else wire.Skip();
        }

        private static LightFlags FlagsOf(List<uint> values)
        {
            LightFlags all = 0;
            foreach (var v in values) all |= v >= 1 && v <= 8 ? (LightFlags)(1u << (int)v) : LightFlags.Newer;
            return all;
        }

        private static float Share(float v, string what)
        {
            if (!(v >= 0 && v <= 1)) throw DecodeException.Invalid(what + " must be 0 to 1");
            return v;
        }
    }

    internal sealed class RadianceMessage
    {
        private readonly List<int> mantissa = new List<int>();
        private uint bands;
        private int exponent;

        internal void Read(WireReader wire)
        {
            while (wire.Next(out var field))
                switch (field)
                {
                    case 1: wire.UInt32(ref bands); break;
                    case 2: wire.SInt32(ref exponent); break;
                    case 3: wire.SInt32s(mantissa); break;
                    default: wire.Skip(); break;
                }
        }

        internal void CheckedInto(Descriptor descriptor)
        {
            if (bands >= 1u << (Descriptor.MaxBand + 1))
                throw DecodeException.Invalid("radiance.bands has a band above 6");
            int needed = 0, band = 0;
            for (var l = 0; l <= Descriptor.MaxBand; ++l)
                if ((bands >> l & 1) != 0)
                {
                    needed += 3 * (2 * l + 1);
                    band = l;
                }
            if (mantissa.Count != needed)
                throw DecodeException.Invalid("radiance.mantissa has " + mantissa.Count + " numbers, its bands need " +
                                              needed);
            Scaled.CheckExponent(exponent, "radiance.exponent");
            var values = new Rgb[(band + 1) * (band + 1)];
            var next = 0;
            for (var i = 0; i < values.Length; ++i)
                if ((bands >> Harmonics.BandOf(i) & 1) != 0)
                    values[i] = new Rgb(Value(next++), Value(next++), Value(next++));
            descriptor.Band = band;
            descriptor.Radiance = values;
        }

        private float Value(int k) => Scaled.Value(mantissa[k], exponent, Scaled.MantissaLimit, "radiance.mantissa");
    }

    /// <summary>Numbers of the wire: mantissa times a power of two.</summary>
    internal static class Scaled
    {
        internal const int MantissaLimit = 8191;

        internal static void CheckExponent(int e, string what)
        {
            if (e < -150 || e > 100) throw DecodeException.Invalid(what + " is out of range");
        }

        internal static int Checked(int m, int limit, string what)
        {
            if (m > limit || m < -limit) throw DecodeException.Invalid(what + " is larger than " + limit);
            return m;
        }

        internal static float Value(int m, int e, int limit, string what) =>
            (float)(Checked(m, limit, what) * Math.Pow(2, e));
    }

    internal sealed class LightMessage
    {
        private const int CovarianceLimit = 63;

        private readonly List<int> direction = new List<int>(3), irradiance = new List<int>(3),
            covariance = new List<int>(3);
        private int irradianceExponent, covarianceExponent;
        private uint radiusE5, track, distanceE4, distanceSigmaE4;

        internal LightMessage(WireReader wire)
        {
            while (wire.Next(out var field))
                switch (field)
                {
                    case 1: wire.SInt32s(direction); break;
                    case 2: wire.SInt32s(irradiance); break;
                    case 3: wire.SInt32(ref irradianceExponent); break;
                    case 4: wire.UInt32(ref radiusE5); break;
                    case 5: wire.SInt32s(covariance); break;
                    case 6: wire.UInt32(ref track); break;
                    case 7: wire.SInt32(ref covarianceExponent); break;
                    case 8: wire.UInt32(ref distanceE4); break;
                    case 9: wire.UInt32(ref distanceSigmaE4); break;
                    default: wire.Skip(); break;
                }
        }

        internal DiscreteLight Checked(Descriptor of)
        {
            if (direction.Count != 3) throw DecodeException.Invalid("light.direction needs three numbers");
            if (irradiance.Count != 3) throw DecodeException.Invalid("light.irradiance_mantissa needs three numbers");
            if (covariance.Count != 0 && covariance.Count != 1 && covariance.Count != 3)
                throw DecodeException.Invalid("light.covariance_mantissa needs three numbers, one or none");
            Scaled.CheckExponent(irradianceExponent, "light.irradiance_exponent");
            Scaled.CheckExponent(covarianceExponent, "light.covariance_exponent");
            var raw = new Double3((float)direction[0], (float)direction[1], (float)direction[2]);
            if (!Double3.TryNormalizeFloats(raw,
                out var rounded)) throw DecodeException.Invalid("light.direction is zero");
            var radius = radiusE5 * 1e-5;
            if (radius > Math.PI / 2 + 2e-5) throw DecodeException.Invalid("light.angular_radius_e5 is above pi/2");
            Rgb power = new Rgb(Power(0), Power(1), Power(2));
            for (var k = 0; k < covariance.Count; ++k)
                Scaled.Checked(covariance[k], CovarianceLimit, "light.covariance_mantissa");
            if ((distanceE4 == 0) != (distanceSigmaE4 == 0))
                throw DecodeException.Invalid("light.distance_e4 without distance_sigma_e4, or the reverse");
            Double3.TryNormalize(rounded, out var unit);
            var distance = (float)(distanceE4 * 1e-4);
            return new DiscreteLight
            {
                Direction = rounded.ToFloats(), Unit = unit, Irradiance = power, Track = track,
                AngularRadius = (float)Math.Min(radius, Math.PI / 2), DirectionCovariance = Covariance(),
                Distance = distance, DistanceSigma = (float)(distanceSigmaE4 * 1e-4),
                Position = distance > 0
                    ? new Double3(of.OriginX + unit.X * distance, of.OriginY + unit.Y * distance,
                                  of.OriginZ + unit.Z * distance).ToFloats() : (Vec3?)null
            };
        }

        private float Power(int k) =>
            Scaled.Value(irradiance[k], irradianceExponent, Scaled.MantissaLimit, "light.irradiance_mantissa");

        /// <summary>Rounded to float and positive semi-definite: negative eigenvalues become zero (Higham 1988,
        /// theorem 2.1).</summary>
        private Vec3 Covariance()
        {
            if (covariance.Count == 0) return new Vec3();
            double uu = covariance[0], uv = covariance.Count == 3 ? covariance[1] : 0;
            var vv = covariance.Count == 3 ? covariance[2] : uu;
            if (!(uu >= 0 && vv >= 0 && uv * uv <= uu * vv))
            {
                double h = (uu - vv) / 2, r = Math.Sqrt(h * h + uv * uv), largest = (uu + vv) / 2 + r;
                if (!(largest > 0)) return new Vec3();
                uu = largest * (r + h) / (2 * r);
                uv = largest * uv / (2 * r);
                vv = largest * (r - h) / (2 * r);
            }
            var unit = Math.Pow(2, covarianceExponent);
            float a = (float)(uu * unit), b = (float)(uv * unit), c = (float)(vv * unit);
            // Rounding to float may make it too large. One less in its bits is the next float towards zero.
            while ((double)b * b > (double)a * c)
                b = BitConverter.ToSingle(BitConverter.GetBytes(BitConverter.ToUInt32(BitConverter.GetBytes(b),
                    0) - 1), 0);
            return new Vec3(a, b, c);
        }
    }

    internal sealed class PoseMessage
    {
        private readonly double[] numbers = new double[7];

        internal void Read(WireReader wire)
        {
            while (wire.Next(out var field))
                if (field <= 7) wire.Double(ref numbers[field - 1]);
                else wire.Skip();
        }

        internal void CheckedInto(Descriptor descriptor)
        {
            double x = numbers[0], y = numbers[1], z = numbers[2], w = numbers[3];
            var squared = x * x + y * y + z * z + w * w;
            if (!(squared > 1e-18 && squared < double.PositiveInfinity))
                throw DecodeException.Invalid("T_probe_origin has no rotation");
            for (var k = 4; k < 7; ++k)
                if (!(Math.Abs(numbers[k]) <= 1e6))
                    throw DecodeException.Invalid("T_probe_origin: tx, ty, tz must be within 1e6 m");
            var length = Math.Sqrt(squared);
            descriptor.OriginOrientation = new Rotation(x / length, y / length, z / length, w / length);
            descriptor.OriginX = numbers[4];
            descriptor.OriginY = numbers[5];
            descriptor.OriginZ = numbers[6];
        }
    }
}
