// Correlated colour temperatures: as color_temperature() of the C++ SDK.
using System;

namespace Lightwell.Managed
{
    public static class ColorTemperatures
    {
        private const double MaxDuv = 0.05;
        private static readonly int Entries = PlanckianLocus.Uv.Length / 2;

        /// <summary>Of a linear Rec. 709 colour, K, and its distance from the Planckian locus in CIE 1960 u, v
        /// (positive above it). False where it has no meaning: black, more than 0.05 from the locus, below 1,000 K or
        /// above 100,000 K.</summary>
        public static bool TryGet(Rgb color, out double kelvin, out double duv)
        {
            kelvin = duv = 0;
            // Linear Rec. 709 to CIE XYZ (IEC 61966-2-1).
            double r = color.R, g = color.G, b = color.B;
            var x = 0.4123907992659595 * r + 0.3575843393838780 * g + 0.1804807884018343 * b;
            var y = 0.2126390058715104 * r + 0.7151686787677559 * g + 0.0721923153607337 * b;
            var z = 0.0193308187155918 * r + 0.1191947797946259 * g + 0.9505321522496608 * b;
            var denominator = x + 15 * y + 3 * z;
            if (!(x > 0 && y > 0 && x + y + z > 0 && denominator > 0) || !Double3.IsFinite(denominator)) return false;
            double u = 4 * x / denominator, v = 6 * y / denominator;
            var closest = 0;
            for (var i = 1; i < Entries; ++i)
                if (Squared(i, u, v) < Squared(closest, u, v)) closest = i;
            var k = Math.Min(Entries - 3, Math.Max(2, closest));
            var below = new NearestPoint(k - 1, u, v);
            var above = new NearestPoint(k, u, v);
            var nearest = below.Squared < above.Squared ? below : above;
            var found = PlanckianLocus.Lowest * Math.Pow(PlanckianLocus.Step, nearest.Position - 1);
            var distance = Math.Sqrt(nearest.Squared) * (nearest.Above < 0 ? -1 : 1);
            if (!(nearest.Position > 1 && found <= PlanckianLocus.Highest && Math.Abs(distance) <= MaxDuv))
                return false;
            kelvin = found;
            duv = distance;
            return true;
        }

        private static double Squared(int i, double u, double v) =>
            (PlanckianLocus.Uv[2 * i] - u) * (PlanckianLocus.Uv[2 * i] - u) +
            (PlanckianLocus.Uv[2 * i + 1] - v) * (PlanckianLocus.Uv[2 * i + 1] - v);

        /// <summary>A coordinate between entries k and k + 1: the cubic of Catmull and Rom through entries k - 1 to
        /// k + 2.</summary>
        private struct Cubic
        {
            private readonly double a, b, c, d;

            internal Cubic(int k, int offset)
            {
                double p = PlanckianLocus.Uv[2 * (k - 1) + offset], q = PlanckianLocus.Uv[2 * k + offset];
                double r = PlanckianLocus.Uv[2 * (k + 1) + offset], s = PlanckianLocus.Uv[2 * (k + 2) + offset];
                a = q;
                b = (r - p) / 2;
                c = p - 2.5 * q + 2 * r - 0.5 * s;
                d = (3 * (q - r) + s - p) / 2;
            }

            internal double At(double t) => a + t * (b + t * (c + t * d));
            internal double Slope(double t) => b + t * (2 * c + 3 * t * d);
            internal double Curvature(double t) => 2 * c + 6 * t * d;
        }

        /// <summary>The point nearest to u, v between entries k and k + 1, by Newton's method.</summary>
        private struct NearestPoint
        {
            internal readonly double Squared, Position, Above;

            internal NearestPoint(int k, double u, double v)
            {
                Cubic cu = new Cubic(k, 0), cv = new Cubic(k, 1);
                var t = 0.5;
                for (var i = 0; i < 8; ++i)
                {
                    double du = cu.At(t) - u, dv = cv.At(t) - v, su = cu.Slope(t), sv = cv.Slope(t);
                    var curvature = su * su + sv * sv + du * cu.Curvature(t) + dv * cv.Curvature(t);
                    if (!(curvature > 0)) break;
                    t = Math.Min(1, Math.Max(0, t - (du * su + dv * sv) / curvature));
                }
                double pu = cu.At(t), pv = cv.At(t);
                Squared = (pu - u) * (pu - u) + (pv - v) * (pv - v);
                Position = k + t;
                Above = v - pv;
            }
        }
    }
}
