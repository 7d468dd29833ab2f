// Nine coefficients of radiance and the separated main light, in Lightwell's axes: for conversions and estimates.
using System;

namespace Lightwell.Managed
{
    internal sealed class LightSplit
    {
        internal const int Count = 9;
        private const double Largest = 3.4028234663852886e38 / 1e4;

        /// <summary>In the basis with all signs positive, times the gain.</summary>
        internal readonly Double3[] Harmonics = new Double3[Count];
        /// <summary>Null if it is in the harmonics, or no channel of a light is above zero.</summary>
        internal readonly DiscreteLight Main;
        /// <summary>Its irradiance at normal incidence times the gain; no channel is negative.</summary>
        internal readonly Double3 MainIrradiance;
        /// <summary>False if a value is no number that a float can hold.</summary>
        internal readonly bool IsPresentable;

        internal LightSplit(Descriptor d, MainLight mainLight, double gain)
        {
            for (var i = 0; i < Count && i < d.Radiance.Length; ++i) Harmonics[i] = Scaled(d.Radiance[i], gain);
            Main = mainLight == MainLight.Apart ? Strongest(d, gain) : null;
            if (Main != null) MainIrradiance = Positive(Scaled(Main.Irradiance, gain));
            foreach (var light in d.Lights)
            {
                var y = Managed.Harmonics.Basis(2, light.Unit);
                for (var i = 0; i < Count; ++i)
                {
                    Harmonics[i] = Sum(Harmonics[i], Scaled(light.Irradiance, gain),
                                       y[i] * Cap.Zonal(Managed.Harmonics.BandOf(i), light.AngularRadius));
                    // The main light is added as a point light, so the bands 0 to 2 of that are subtracted.
                    if (light == Main) Harmonics[i] = Sum(Harmonics[i], MainIrradiance, -y[i]);
                }
            }
            IsPresentable = Presentable(MainIrradiance) && Array.TrueForAll(Harmonics, Presentable);
        }

        /// <summary>Null without a light of which some channel is above zero.</summary>
        private static DiscreteLight Strongest(Descriptor d, double gain)
        {
            DiscreteLight main = null;
            foreach (var light in d.Lights)
                if (main == null || light.Irradiance.Luminance * gain > main.Irradiance.Luminance * gain) main = light;
            if (main == null) return null;
            var sun = Positive(Scaled(main.Irradiance, gain));
            return sun.X > 0 || sun.Y > 0 || sun.Z > 0 ? main : null;
        }

        internal static Double3 Scaled(Rgb c, double k) => new Double3(c.R * k, c.G * k, c.B * k);

        private static Double3 Positive(Double3 c) => new Double3(Math.Max(0, c.X), Math.Max(0, c.Y), Math.Max(0, c.Z));

        internal static Double3 Sum(Double3 a, Double3 b, double k) =>
            new Double3(a.X + b.X * k, a.Y + b.Y * k, a.Z + b.Z * k);

        private static bool Presentable(Double3 c) =>
            Math.Abs(c.X) <= Largest && Math.Abs(c.Y) <= Largest && Math.Abs(c.Z) <= Largest;
    }
}
