// Spherical harmonics, cosine and GGX lobes, caps of uniform radiance, as in proto/include/lightwell.
using System;

namespace Lightwell.Managed
{
    internal static class Harmonics
    {
        internal const int MaxCount = (Descriptor.MaxBand + 1) * (Descriptor.MaxBand + 1);

        /// <summary>Coefficients A_l of the clamped cosine (Ramamoorthi and Hanrahan 2001, eq. 8).</summary>
        internal static readonly double[] CosineLobe =
            { Math.PI, 2 * Math.PI / 3, Math.PI / 4, 0, -Math.PI / 24, 0, Math.PI / 64 };

        [ThreadStatic] private static double[] basis;

        /// <summary>The band of coefficient l(l+1)+m.</summary>
        internal static int BandOf(int index) => (int)Math.Sqrt(index);

        /// <summary>Values of the functions of bands 0 to `band` at the unit vector d, in the order l(l+1)+m: Legendre
        /// recursion without the sine factor (Sloan 2013). In memory of this thread, until the next call.</summary>
        internal static double[] Basis(int band, Double3 d)
        {
            var into = basis ?? (basis = new double[MaxCount]);
            Basis(band, d, into);
            return into;
        }

        internal static void Basis(int band, Double3 d, double[] into)
        {
            double re = 1, im = 0, diagonal = Math.Sqrt(0.25 / Math.PI);
            for (var m = 0; m <= band; ++m)
            {
                if (m > 0) diagonal *= Math.Sqrt((2.0 * m + 1) / (2.0 * m));
                double previous = 0, current = m > 0 ? Math.Sqrt(2) * diagonal : diagonal;
                for (var l = m; ; ++l)
                {
                    into[l * (l + 1) + m] = current * re;
                    if (m > 0) into[l * (l + 1) - m] = current * im;
                    if (l == band) break;
                    double next = l + 1;
                    var a = Math.Sqrt((4 * next * next - 1) / (next * next - m * m));
                    var b = Math.Sqrt((double)(l * l - m * m) / (4.0 * l * l - 1));
                    var value = a * (d.Z * current - b * previous);
                    previous = current;
                    current = value;
                }
                var turned = re * d.X - im * d.Y;
                im = re * d.Y + im * d.X;
                re = turned;
            }
        }

        /// <summary>The sum of coefficients times functions, each band l times factor[l].</summary>
        internal static Double3 Evaluate(Rgb[] coefficients, int band, Double3 d, double[] factor)
        {
            var y = Basis(band, d);
            double r = 0, g = 0, b = 0;
            for (int l = 0, i = 0; l <= band; ++l)
                for (; i < (l + 1) * (l + 1); ++i)
                {
                    var k = y[i] * factor[l];
                    r += coefficients[i].R * k;
                    g += coefficients[i].G * k;
                    b += coefficients[i].B * k;
                }
            return new Double3(r, g, b);
        }
    }

    internal static class Cap
    {
        /// <summary>Radius below which the cap is treated as a point.</summary>
        private const double PointRadius = 2e-5, HalfPi = Math.PI / 2;

        internal static double Clamp(double v, double low, double high) => Math.Min(Math.Max(v, low), high);

        /// <summary>Legendre polynomials P_(l-1), as `previous`, and P_l at x; P_-1 is 1.</summary>
        internal static double Legendre(int l, double x, out double previous)
        {
            previous = 1;
            var p = l > 0 ? x : 1;
            for (var n = 2; n <= l; ++n)
            {
                var next = ((2 * n - 1) * x * p - (n - 1) * previous) / n;
                previous = p;
                p = next;
            }
            return p;
        }

        /// <summary>Irradiance of a flat receiver per vector irradiance of the cap, clipped at the receiver's horizon
        /// (Snyder 1996).</summary>
        internal static double Irradiance(double cosAngle, double radius)
        {
            double sigma = Clamp(radius, 0, HalfPi), c = Clamp(cosAngle, -1, 1);
            if (sigma < PointRadius) return Math.Max(0, c);
            var omega = Math.Acos(c);
            if (omega <= HalfPi - sigma) return c;
            if (omega >= HalfPi + sigma) return 0;
            double sinS = Math.Sin(sigma), cosS = Math.Cos(sigma), sinW = Math.Sin(omega);
            var gamma = Math.Asin(Clamp(cosS / sinW, -1, 1));
            double cosG = Math.Cos(gamma), sinG = Math.Sin(gamma);
            var g = -2 * sinW * cosS * cosG + HalfPi - gamma + sinG * cosG;
            var h = c * (cosG * Math.Sqrt(Math.Max(0, sinS * sinS - cosG * cosG)) +
                         sinS * sinS * Math.Asin(Clamp(cosG / sinS, -1, 1)));
            var full = Math.PI * sinS * sinS;
            return Math.Max(0, (omega < HalfPi ? full * c + g - h : g + h) / full);
        }

        /// <summary>SH coefficient of the cap: c_lm = Zonal(l, radius) Y_lm(axis), per vector irradiance.</summary>
        internal static double Zonal(int l, double radius)
        {
            var sigma = Clamp(radius, 0, HalfPi);
            if (sigma < PointRadius) return 1;
            double a = Math.Cos(sigma), sinS = Math.Sin(sigma);
            Legendre(l, a, out var before);
            var after = Legendre(l + 1, a, out _);
            return 2 * Math.PI * (before - after) / (2 * l + 1) / (Math.PI * sinS * sinS);
        }

        /// <summary>radiance(d, r) of the cap per vector irradiance, sr⁻¹: the lobe around d integrated over the
        /// cap.</summary>
        internal static double Radiance(double cosAngle, double radius, GgxLobe lobe)
        {
            double sigma = Clamp(radius, 0, HalfPi), c = Clamp(cosAngle, -1, 1);
            if (sigma < PointRadius) return lobe.Value(c);
            var omega = Math.Acos(c);
            // Integrate over rings of polar angle t around the lobe's axis; a fraction of each is inside the cap.
            double first = Math.Max(0, omega - sigma), last = Math.Min(omega + sigma, HalfPi);
            if (first >= last) return 0;
            double sinW = Math.Sin(omega), cosS = Math.Cos(sigma);
            Func<double, double> share = x =>
            {
                var reach = sinW * Math.Sqrt(Math.Max(0, 1 - x * x));
                if (reach < 1e-15) return x * c >= cosS ? 1 : 0;
                return Math.Acos(Clamp((cosS - c * x) / reach, -1, 1)) / Math.PI;
            };
            var whole = sigma > omega ? sigma - omega : 0;
            double sum = 0;
            if (whole > 0) sum += lobe.Integral(Math.Cos(Math.Min(whole, HalfPi)), 1, x => 1);
            double a = Math.Cos(last), b = Math.Cos(Math.Max(first, whole));
            const int pieces = 4;
            for (var i = 0; i < pieces && a < b; ++i)
                sum += lobe.Integral(Knot(a, b, i, pieces), Knot(a, b, i + 1, pieces), share);
            var sinS = Math.Sin(sigma);
            return 2 * Math.PI * sum / (Math.PI * sinS * sinS);
        }

        private static double Knot(double a, double b, int k, int pieces) =>
            a + (b - a) * (0.5 - 0.5 * Math.Cos(Math.PI * k / pieces));
    }

    /// <summary>n-point Gauss-Legendre quadrature on [-1, 1], nodes decreasing.</summary>
    internal sealed class Quadrature
    {
        internal readonly double[] Nodes, Weights;

        internal Quadrature(int n)
        {
            Nodes = new double[n];
            Weights = new double[n];
            for (var i = 0; i < n; ++i)
            {
                double x = Math.Cos(Math.PI * (i + 0.75) / (n + 0.5)), slope = 1;
                for (var step = 0; step < 50; ++step)
                {
                    var p1 = Cap.Legendre(n, x, out var p0);
                    slope = n * (x * p1 - p0) / (x * x - 1);
                    x -= p1 / slope;
                }
                Nodes[i] = x;
                Weights[i] = 2 / ((1 - x * x) * slope * slope);
            }
        }
    }

    /// <summary>The lobe of radiance(d, r): GGX with N = V = R = d, weighted by N·L, normalised to one (Karis
    /// 2013).</summary>
    internal sealed class GgxLobe
    {
        internal const double MinRoughness = 0.02;
        private static readonly Quadrature Gauss = new Quadrature(32);

        internal readonly double Roughness;
        /// <summary>Legendre coefficients: convolution multiplies band l by the l-th of them.</summary>
        internal readonly double[] Coefficients = new double[Descriptor.MaxBand + 1];
        private readonly double alpha2, beta, norm;

        internal GgxLobe(double roughness)
        {
            Roughness = roughness;
            var r = roughness < 1 ? Math.Max(roughness, MinRoughness) : 1;
            alpha2 = r * r * r * r;
            beta = (1 - alpha2) / 2;
            norm = 1;
            norm = 1 / (2 * Math.PI * Integral(0, 1, x => 1));
            for (var l = 0; l < Coefficients.Length; ++l)
            {
                var band = l;
                Coefficients[l] = 2 * Math.PI * Integral(0, 1, x => Cap.Legendre(band, x, out _));
            }
        }

        internal double Value(double x)
        {
            if (!(x > 0)) return 0;
            var d = alpha2 + beta * Math.Max(0, 1 - x);
            return norm * x * alpha2 / (d * d);
        }

        /// <summary>Integral of Value(x) f(x) from x0 to x1 in the logarithm of the denominator, in which there is no
        /// sharp peak.</summary>
        internal double Integral(double x0, double x1, Func<double, double> f)
        {
            double y0 = 1 - x1, y1 = 1 - x0, sum = 0;
            var flat = beta < 1e-6;
            double u0 = flat ? y0 : Log1p(beta / alpha2 * y0), u1 = flat ? y1 : Log1p(beta / alpha2 * y1);
            for (var i = 0; i < Gauss.Nodes.Length; ++i)
            {
                double u = u0 + (u1 - u0) * (0.5 * (1 - Gauss.Nodes[i])), weight = 0.5 * Gauss.Weights[i];
                var y = flat ? u : alpha2 / beta * Expm1(u);
                var value = weight * Value(1 - y) * f(1 - y);
                sum += flat ? value : value * alpha2 * Math.Exp(u) / beta;
            }
            return sum * (u1 - u0);
        }

        /// <summary>log(1 + x), exact for small x (Kahan).</summary>
        private static double Log1p(double x)
        {
            var u = 1 + x;
            return u == 1 ? x : Math.Log(u) * x / (u - 1);
        }

        /// <summary>exp(x) - 1, exact for small x (Kahan).</summary>
        private static double Expm1(double x)
        {
            var u = Math.Exp(x);
            if (u == 1) return x;
            return u - 1 == -1 ? -1 : (u - 1) * x / Math.Log(u);
        }
    }
}
