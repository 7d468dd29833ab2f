// Reconstruction of radiance from a descriptor's harmonics, for reflections: non-negative and without the ringing of a
// truncated series. Method and numbers as in proto/include/lightwell/reconstruction.hpp.
using System;
using System.Collections.Generic;

namespace Lightwell.Managed
{
    /// <summary>Coefficients with the missing bands estimated by maximum entropy, and t of the window exp(-t l(l+1)) at
    /// roughness 0, 1/4, 1/2, 3/4, 1.</summary>
    internal sealed class Reconstruction
    {
        private const int Knots = 5;
        private const int EstimateBand = MaxEntropy.EstimateBand;
        private const double Rounding = 1e-5, Sphere = 4 * Math.PI;
        private static readonly double[][] LobesAtKnots = MakeLobes();

        private readonly Rgb[] coefficients;
        private readonly int band;
        private readonly double[] blur = new double[Knots];

        internal Reconstruction(Rgb[] harmonics)
        {
            coefficients = Completed(harmonics);
            band = Harmonics.BandOf(coefficients.Length - 1);
            if (coefficients.Length <= 1) return;
            var search = new WindowSearch(coefficients);
            double t = 0;
            for (var k = Knots - 1; k >= 0; --k)
            {
                t = search.Blur(LobesAtKnots[k], t);
                blur[k] = (float)t;
            }
        }

        /// <summary>Mean radiance over the lobe of `roughness` about the unit vector d; `lobe`: its coefficients, ones
        /// for a mirror.</summary>
        internal Double3 RadianceAt(Double3 d, double roughness, double[] lobe)
        {
            var at = Cap.Clamp(roughness, 0, 1) * (Knots - 1);
            var knot = Math.Min((int)Math.Floor(at), Knots - 2);
            var share = (at * at - knot * knot) / (2 * knot + 1);
            var t = blur[knot] * (1 - share) + blur[knot + 1] * share;
            var factor = Window(t);
            for (var l = 0; l < factor.Length; ++l) factor[l] *= lobe[l];
            var value = Harmonics.Evaluate(coefficients, band, d, factor);
            // The order of the comparison maps NaN to 0.
            return new Double3(value.X > 0 ? value.X : 0, value.Y > 0 ? value.Y : 0, value.Z > 0 ? value.Z : 0);
        }

        internal static double Channel(Rgb c, int k) => k == 0 ? c.R : k == 1 ? c.G : c.B;

        /// <summary>Mean over the sphere; 0 if the channel is not a valid radiance.</summary>
        internal static double MeanOf(Rgb[] sh, int k)
        {
            double mean = Channel(sh[0], k) * Math.Sqrt(0.25 / Math.PI), sum = 0;
            foreach (var c in sh) sum += Channel(c, k);
            return mean > 0 && Double3.IsFinite(sum) ? mean : 0;
        }

        /// <summary>The window exp(-t l(l+1)).</summary>
        internal static double[] Window(double t)
        {
            double q = Math.Exp(-2 * t), step = 1;
            var all = new double[Descriptor.MaxBand + 1];
            all[0] = 1;
            for (var l = 1; l < all.Length; ++l) all[l] = all[l - 1] * (step *= q);
            return all;
        }

        private static double[][] MakeLobes()
        {
            var all = new double[Knots][];
            for (var k = 1; k < Knots; ++k) all[k] = new GgxLobe(k / (Knots - 1.0)).Coefficients;
            all[0] = new double[] { 1, 1, 1, 1, 1, 1, 1 };
            return all;
        }

        private static Rgb[] Completed(Rgb[] sh)
        {
            var sent = new bool[Descriptor.MaxBand + 1];
            for (var i = 0; i < sh.Length; ++i)
                for (var k = 0; k < 3; ++k)
                    if (Math.Abs(Channel(sh[i], k)) > Rounding * Math.Abs(Channel(sh[0], k)))
                        sent[Harmonics.BandOf(i)] = true;
            var some = false;
            for (var l = 1; l <= EstimateBand; ++l) some |= sent[l];
            if (!some || Array.IndexOf(sent, false) < 0) return sh;
            var values = new double[3][];
            var entropy = new MaxEntropy(sent);
            for (var k = 0; k < 3; ++k)
            {
                values[k] = new double[Harmonics.MaxCount];
                for (var i = 0; i < sh.Length; ++i) values[k][i] = Channel(sh[i], k);
                var mean = MeanOf(sh, k);
                if (!(mean > 0)) continue;
                var all = entropy.Estimate(sh, k, mean);
                for (var i = 1; i < Harmonics.MaxCount; ++i)
                    if (!sent[Harmonics.BandOf(i)]) values[k][i] = (float)(Sphere * mean * all[i]);
            }
            var made = new Rgb[Harmonics.MaxCount];
            for (var i = 0; i < made.Length; ++i)
                made[i] = new Rgb((float)values[0][i], (float)values[1][i], (float)values[2][i]);
            return made;
        }
    }

    /// <summary>Maximum entropy by Newton's method on the dual problem.</summary>
    internal sealed class MaxEntropy
    {
        internal const int EstimateBand = 4;
        private const double Variance = 1e-3, Converged = 1e-7, MaxExponent = 40, Sphere = 4 * Math.PI;
        private const int MaxIterations = 20, Rows = 10, Columns = 20;
        private static readonly double[] GridWeights = new double[Rows * Columns];
        private static readonly double[][] Grid = MakeGrid();

        private readonly List<int> index = new List<int>();
        private readonly double[][] y;
        private readonly double[] flux = new double[Rows * Columns];
        private double[] lambda;

        internal MaxEntropy(bool[] sent)
        {
            for (var i = 0; i < (EstimateBand + 1) * (EstimateBand + 1); ++i)
                if (sent[Harmonics.BandOf(i)]) index.Add(i);
            y = new double[Grid.Length][];
            for (var n = 0; n < y.Length; ++n)
            {
                y[n] = new double[index.Count];
                for (var a = 0; a < index.Count; ++a) y[n][a] = Grid[n][index[a]];
            }
            lambda = new double[index.Count];
            lambda[0] = -Math.Log(Sphere) * Math.Sqrt(Sphere);
        }

        /// <summary>Quadrature that is exact up to band 19: Gauss-Legendre in z, equidistant in azimuth.</summary>
        private static double[][] MakeGrid()
        {
            var grid = new double[Rows * Columns][];
            var quadrature = new Quadrature(Rows);
            for (int row = 0, n = 0; row < Rows; ++row)
            {
                double z = quadrature.Nodes[row], sine = Math.Sqrt(1 - z * z);
                for (var i = 0; i < Columns; ++i, ++n)
                {
                    var phi = 2 * Math.PI * (i + 0.5) / Columns;
                    GridWeights[n] = quadrature.Weights[row] * 2 * Math.PI / Columns;
                    Harmonics.Basis(Descriptor.MaxBand, new Double3(sine * Math.Cos(phi), sine * Math.Sin(phi), z),
                                    grid[n] = new double[Harmonics.MaxCount]);
                }
            }
            return grid;
        }

        /// <summary>Coefficients of all bands, scaled to integral 1. Starts at the last channel's solution.</summary>
        internal double[] Estimate(Rgb[] sh, int k, double mean)
        {
            var target = Moments(sh, k, mean);
            var potential = Evaluate(lambda, target);
            for (var iteration = 0; iteration < MaxIterations; ++iteration)
            {
                var step = NewtonStep(target, out var decrement);
                if (!(decrement > Converged)) break;
                for (double share = 1; ; share /= 2)
                {
                    var next = new double[lambda.Length];
                    for (var a = 0; a < next.Length; ++a) next[a] = lambda[a] - share * step[a];
                    var there = Evaluate(next, target);
                    if (!(there < potential - 0.1 * share * decrement || share < 1e-4)) continue;
                    potential = there;
                    lambda = next;
                    break;
                }
            }
            var all = new double[Harmonics.MaxCount];
            for (var n = 0; n < Grid.Length; ++n)
                for (var i = 0; i < all.Length; ++i) all[i] += flux[n] * Grid[n][i];
            return all;
        }

        private double[] Moments(Rgb[] sh, int k, double mean)
        {
            var unit = 1 / (Sphere * mean);
            var target = new double[index.Count];
            var square = new double[Descriptor.MaxBand + 1];
            for (var a = 0; a < target.Length; ++a)
            {
                target[a] = Reconstruction.Channel(sh[index[a]], k) * unit;
                square[Harmonics.BandOf(index[a])] += target[a] * target[a];
            }
            for (var a = 1; a < target.Length; ++a)
            {
                var l = Harmonics.BandOf(index[a]);
                var most = 0.95 * Math.Sqrt((2 * l + 1) * square[0]);
                target[a] *= Math.Min(1, most / Math.Sqrt(Math.Max(square[l], 1e-30)));
            }
            return target;
        }

        private double Evaluate(double[] at, double[] target)
        {
            double sum = 0;
            for (var n = 0; n < y.Length; ++n)
            {
                double exponent = 0;
                for (var a = 0; a < at.Length; ++a) exponent += at[a] * y[n][a];
                flux[n] = GridWeights[n] * Math.Exp(Math.Min(exponent, MaxExponent));
                sum += flux[n];
            }
            for (var a = 0; a < at.Length; ++a)
                sum += at[a] * ((a > 0 ? Variance / 2 * at[a] / Sphere : 0) - target[a]);
            return sum;
        }

        private double[] NewtonStep(double[] target, out double decrement)
        {
            var m = target.Length;
            var h = new double[m, m];
            var g = new double[m];
            for (var n = 0; n < y.Length; ++n)
                for (var a = 0; a < m; ++a)
                {
                    var q = flux[n] * y[n][a];
                    g[a] += q;
                    for (var b = 0; b <= a; ++b) h[a, b] += q * y[n][b];
                }
            for (var a = 0; a < m; ++a)
            {
                g[a] -= target[a];
                h[a, a] += 1e-12;
                if (a == 0) continue;
                g[a] += Variance * lambda[a] / Sphere;
                h[a, a] += Variance / Sphere;
            }
            var step = (double[])g.Clone();
            for (var j = 0; j < m; ++j)
            {
                for (var k = 0; k < j; ++k) h[j, j] -= h[j, k] * h[j, k];
                h[j, j] = Math.Sqrt(Math.Max(h[j, j], 1e-12));
                for (var i = j + 1; i < m; ++i)
                {
                    for (var k = 0; k < j; ++k) h[i, j] -= h[i, k] * h[j, k];
                    h[i, j] /= h[j, j];
                }
            }
            for (var i = 0; i < m; ++i)
            {
                for (var k = 0; k < i; ++k) step[i] -= h[i, k] * step[k];
                step[i] /= h[i, i];
            }
            for (var i = m - 1; i >= 0; --i)
            {
                for (var k = i + 1; k < m; ++k) step[i] -= h[k, i] * step[k];
                step[i] /= h[i, i];
            }
            decrement = 0;
            for (var a = 0; a < m; ++a) decrement += g[a] * step[a];
            return step;
        }
    }

    /// <summary>Finds the weakest window under which the radiance stays above a floor in all directions.</summary>
    internal sealed class WindowSearch
    {
        private const int Directions = 512, Bisections = 11;
        private const double FloorShare = 0.1, Faint = 1e-3, BlurUnit = 0.1, MaxBlur = 100;
        private static readonly double[][] Spiral = MakeSpiral();
        private static readonly double[] PositiveKernel = MakeKernel();

        /// <summary>[channel][band][direction]</summary>
        private readonly List<double[][]> channels = new List<double[][]>();

        internal WindowSearch(Rgb[] sh)
        {
            var means = new double[3];
            for (var k = 0; k < 3; ++k) means[k] = Reconstruction.MeanOf(sh, k);
            var brightest = Math.Max(means[0], Math.Max(means[1], means[2]));
            for (var k = 0; k < 3; ++k)
            {
                if (!(means[k] > Faint * brightest)) continue;
                var channel = new double[Harmonics.BandOf(sh.Length - 1) + 1][];
                for (var l = 0; l < channel.Length; ++l) channel[l] = new double[Directions];
                for (var i = 0; i < sh.Length; ++i)
                {
                    var c = Reconstruction.Channel(sh[i], k) / means[k];
                    var row = channel[Harmonics.BandOf(i)];
                    for (var n = 0; n < Directions; ++n) row[n] += c * Spiral[n][i];
                }
                channels.Add(channel);
            }
        }

        /// <summary>t of the window for a lobe; at least `least`.</summary>
        internal double Blur(double[] lobe, double least)
        {
            var around = new double[lobe.Length];
            for (var l = 0; l < lobe.Length; ++l) around[l] = PositiveKernel[l] * lobe[l];
            var floors = new List<double[]>();
            foreach (var channel in channels)
            {
                var floor = Weigh(channel, around);
                for (var n = 0; n < Directions; ++n) floor[n] = FloorShare * Cap.Clamp(floor[n], 0, 1);
                floors.Add(floor);
            }
            if (KeepsFloor(lobe, floors, least)) return least;
            double low = least / (least + BlurUnit), high = 1;
            for (var step = 0; step < Bisections; ++step)
            {
                var s = 0.5 * (low + high);
                if (KeepsFloor(lobe, floors, BlurUnit * s / (1 - s))) high = s;
                else low = s;
            }
            return high < 1 ? BlurUnit * high / (1 - high) : MaxBlur;
        }

        private bool KeepsFloor(double[] lobe, List<double[]> floors, double t)
        {
            var factor = Reconstruction.Window(t);
            for (var l = 0; l < factor.Length; ++l) factor[l] *= lobe[l];
            for (var k = 0; k < channels.Count; ++k)
            {
                var value = Weigh(channels[k], factor);
                for (var n = 0; n < Directions; ++n)
                    if (value[n] < floors[k][n]) return false;
            }
            return true;
        }

        private static double[] Weigh(double[][] channel, double[] factor)
        {
            var sum = new double[Directions];
            for (var l = 0; l < channel.Length; ++l)
                for (var n = 0; n < Directions; ++n) sum[n] += factor[l] * channel[l][n];
            return sum;
        }

        /// <summary>Values of the basis functions on an equal-area spiral of directions, at which ringing is
        /// detected.</summary>
        private static double[][] MakeSpiral()
        {
            var all = new double[Directions][];
            for (var n = 0; n < Directions; ++n)
            {
                double z = 1 - (2 * n + 1) / (double)Directions, sine = Math.Sqrt(1 - z * z);
                var phi = n * Math.PI * (3 - Math.Sqrt(5));
                Harmonics.Basis(Descriptor.MaxBand, new Double3(sine * Math.Cos(phi), sine * Math.Sin(phi), z),
                                all[n] = new double[Harmonics.MaxCount]);
            }
            return all;
        }

        private static double[] MakeKernel()
        {
            var all = new double[Descriptor.MaxBand + 1];
            all[0] = 1;
            for (var l = 1; l < all.Length; ++l)
                all[l] = all[l - 1] * (Descriptor.MaxBand + 1 - l) / (Descriptor.MaxBand + 1 + l);
            return all;
        }
    }
}
