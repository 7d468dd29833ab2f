// Vectors and rotations in double. Right-handed, +X right, +Y up, -Z forward, metres.
using System;

namespace Lightwell.Managed
{
    internal struct Double3
    {
        internal readonly double X, Y, Z;

        internal Double3(double x, double y, double z)
        {
            X = x;
            Y = y;
            Z = z;
        }

        internal Double3(Vec3 v) : this(v.X, v.Y, v.Z) { }

        internal static double Dot(Double3 a, Double3 b) => a.X * b.X + a.Y * b.Y + a.Z * b.Z;

        internal Vec3 ToFloats() => new Vec3((float)X, (float)Y, (float)Z);

        /// <summary>The unit vector; false for zero, NaN or infinite input.</summary>
        internal static bool TryNormalize(Double3 v, out Double3 unit)
        {
            unit = v;
            var largest = Math.Max(Math.Abs(v.X), Math.Max(Math.Abs(v.Y), Math.Abs(v.Z)));
            if (!(largest > 0) || !IsFinite(v.X + v.Y + v.Z)) return false;
            double x = v.X / largest, y = v.Y / largest, z = v.Z / largest;
            var k = 1 / Math.Sqrt(x * x + y * y + z * z);
            unit = new Double3(x * k, y * k, z * k);
            return true;
        }

        /// <summary>The same with every step rounded to float, as in C++.</summary>
        internal static bool TryNormalizeFloats(Double3 v, out Double3 unit)
        {
            unit = v;
            var largest = Math.Max(Math.Abs(v.X), Math.Max(Math.Abs(v.Y), Math.Abs(v.Z)));
            if (!(largest > 0) || !IsFinite(F(F(v.X + v.Y) + v.Z))) return false;
            double x = F(v.X / largest), y = F(v.Y / largest), z = F(v.Z / largest);
            var squared = F(F(F(x * x) + F(y * y)) + F(z * z));
            var k = F(1 / F(Math.Sqrt(squared)));
            unit = new Double3(F(x * k), F(y * k), F(z * k));
            return true;
        }

        internal static bool IsFinite(double v) => !double.IsNaN(v) && !double.IsInfinity(v);

        /// <summary>Rounded to float.</summary>
        internal static double F(double v) => (float)v;
    }

    internal static class Rotations
    {
        internal static Rotation Inverse(Rotation q) => new Rotation(-q.X, -q.Y, -q.Z, q.W);

        internal static bool Same(Rotation a, Rotation b) => a.X == b.X && a.Y == b.Y && a.Z == b.Z && a.W == b.W;

        /// <summary>First b, then a.</summary>
        internal static Rotation Composed(Rotation a, Rotation b) => new Rotation(
            a.W * b.X + a.X * b.W + a.Y * b.Z - a.Z * b.Y, a.W * b.Y - a.X * b.Z + a.Y * b.W + a.Z * b.X,
            a.W * b.Z + a.X * b.Y - a.Y * b.X + a.Z * b.W, a.W * b.W - a.X * b.X - a.Y * b.Y - a.Z * b.Z);

        internal static Double3 Rotate(Rotation q, Double3 v)
        {
            var t = new Double3(2 * (q.Y * v.Z - q.Z * v.Y), 2 * (q.Z * v.X - q.X * v.Z), 2 * (q.X * v.Y - q.Y * v.X));
            return new Double3(v.X + q.W * t.X + q.Y * t.Z - q.Z * t.Y, v.Y + q.W * t.Y + q.Z * t.X - q.X * t.Z,
                               v.Z + q.W * t.Z + q.X * t.Y - q.Y * t.X);
        }
    }
}
