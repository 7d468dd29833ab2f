// The light in the few numbers that AR platforms' light estimation gives: as light_estimate.hpp of the C++ SDK.
using System;

namespace Lightwell.Managed
{
    /// <summary>Values that were not requested (Available), or are not known, are zero.</summary>
    public sealed class ManagedLightEstimate
    {
        private const double NeutralLumens = 1000;

        /// <summary>That of the Lighting; InvalidQuery for an option that is not allowed.</summary>
        public Validity Validity { get; private set; }
        public LightRequest Available { get; private set; }
        /// <summary>1000 * MeanIlluminance / neutralIlluminance.</summary>
        public float AmbientLumens { get; private set; }
        /// <summary>Over all orientations of a surface, lux.</summary>
        public float MeanIlluminance { get; private set; }
        /// <summary>K; 0 where it has no meaning.</summary>
        public float ColorTemperature { get; private set; }
        /// <summary>Distance from the Planckian locus.</summary>
        public float Duv { get; private set; }
        /// <summary>Linear, largest channel 1.</summary>
        public Rgb AmbientColor { get; private set; }
        /// <summary>Radiance, nine coefficients, all signs positive. Without the main light if both its direction and
        /// its intensity were requested.</summary>
        public Rgb[] AmbientSphericalHarmonics { get; } = new Rgb[LightSplit.Count];
        /// <summary>Towards the main light, unit; in the probe's axes, not Unity's.</summary>
        public Vec3 MainLightDirection { get; private set; }
        /// <summary>Linear, largest channel 1.</summary>
        public Rgb MainLightColor { get; private set; }
        public float MainLightLumens { get; private set; }

        internal static ManagedLightEstimate Of(Lighting lighting, LightRequest requested, float gain, float neutral)
        {
            var refused = new ManagedLightEstimate { Validity = Validity.InvalidQuery };
            if (!IsPositive(gain) || !IsPositive(neutral) || (requested & ~LightRequest.All) != 0) return refused;
            var made = new ManagedLightEstimate { Validity = lighting.Validity };
            if (lighting.Validity != Validity.Valid && lighting.Validity != Validity.Stale) return made;
            var apart = new LightSplit(lighting.Descriptor, MainLight.Apart, gain);
            if (!apart.IsPresentable) return refused;
            made.SetAmbient(lighting.Descriptor, requested, gain, neutral);
            made.SetHarmonics(lighting.Descriptor, requested, gain, apart);
            if (apart.Main != null) made.SetMain(apart, requested, neutral);
            return made;
        }

        private void SetAmbient(Descriptor d, LightRequest requested, double gain, double neutral)
        {
            var mean = MeanRadiance(d);
            if (Has(requested, LightRequest.AmbientIntensity))
            {
                var lux = Math.Max(0, gain * Math.PI * Luminance(mean));
                MeanIlluminance = (float)lux;
                AmbientLumens = (float)(NeutralLumens / neutral * lux);
                Available |= LightRequest.AmbientIntensity;
            }
            if (!Has(requested, LightRequest.AmbientColor) || !(Luminance(mean) > 0)) return;
            AmbientColor = Pure(mean);
            var color = new Rgb((float)mean.X, (float)mean.Y, (float)mean.Z);
            if (ColorTemperatures.TryGet(color, out var kelvin, out var duv))
            {
                ColorTemperature = (float)kelvin;
                Duv = (float)duv;
            }
            Available |= LightRequest.AmbientColor;
        }

        private void SetHarmonics(Descriptor d, LightRequest requested, double gain, LightSplit apart)
        {
            if (!Has(requested, LightRequest.AmbientSphericalHarmonics)) return;
            var both = Has(requested, LightRequest.MainLightDirection | LightRequest.MainLightIntensity);
            var from = (both ? apart : new LightSplit(d, MainLight.InHarmonics, gain)).Harmonics;
            for (var i = 0; i < from.Length; ++i)
                AmbientSphericalHarmonics[i] = new Rgb((float)from[i].X, (float)from[i].Y, (float)from[i].Z);
            Available |= LightRequest.AmbientSphericalHarmonics;
        }

        private void SetMain(LightSplit apart, LightRequest requested, double neutral)
        {
            if (Has(requested, LightRequest.MainLightDirection))
            {
                MainLightDirection = apart.Main.Unit.ToFloats();
                Available |= LightRequest.MainLightDirection;
            }
            if (!Has(requested, LightRequest.MainLightIntensity)) return;
            MainLightColor = Pure(apart.MainIrradiance);
            MainLightLumens = (float)(NeutralLumens / neutral * Luminance(apart.MainIrradiance));
            Available |= LightRequest.MainLightIntensity;
        }

        /// <summary>Mean over the sphere; a cap's radiance adds 2 E / (1 + cos rho) over 4 pi.</summary>
        private static Double3 MeanRadiance(Descriptor d)
        {
            var sum = LightSplit.Scaled(d.Radiance[0], 1 / Math.Sqrt(4 * Math.PI));
            foreach (var light in d.Lights)
                sum = LightSplit.Sum(sum, LightSplit.Scaled(light.Irradiance, 1),
                                     2 / (1 + Math.Cos(light.AngularRadius)) / (4 * Math.PI));
            return sum;
        }

        private static Rgb Pure(Double3 c)
        {
            var most = Math.Max(c.X, Math.Max(c.Y, c.Z));
            return new Rgb((float)(Math.Max(0, c.X) / most), (float)(Math.Max(0, c.Y) / most),
                           (float)(Math.Max(0, c.Z) / most));
        }

        private static double Luminance(Double3 c) => 0.2126 * c.X + 0.7152 * c.Y + 0.0722 * c.Z;

        private static bool Has(LightRequest set, LightRequest part) => (set & part) == part;

        private static bool IsPositive(float v) => v > 0 && Double3.IsFinite(v);
    }

    /// <summary>How the light of a probe gives way to an application's own.</summary>
    public static class Fade
    {
        /// <summary>1 up to the age `holdMs`, 0 after `holdMs` + `fadeMs`, without kinks between them. Light with
        /// weight * probe + (1 - weight) * own; for light that comes back, 1 - Weight(time since then, 0, fadeMs). NaN
        /// and negative times throw ArgumentOutOfRangeException.</summary>
        public static float Weight(double ageMs, double holdMs = 250, double fadeMs = 500)
        {
            if (!(holdMs >= 0)) throw new ArgumentOutOfRangeException("holdMs", holdMs, "it is not negative");
            if (!(fadeMs >= 0)) throw new ArgumentOutOfRangeException("fadeMs", fadeMs, "it is not negative");
            if (ageMs <= holdMs) return 1;
            var t = (ageMs - holdMs) / fadeMs;
            // NaN, of an age that is not known, is no light.
            return t < 1 ? (float)(1 - t * t * (3 - 2 * t)) : 0;
        }

        /// <summary>Of a lighting, by its age; 0 without light.</summary>
        public static float Weight(Lighting lighting, double holdMs = 250, double fadeMs = 500)
        {
            var weight = Weight(lighting.AgeMs, holdMs, fadeMs);
            return lighting.Validity == Validity.Valid || lighting.Validity == Validity.Stale ? weight : 0;
        }
    }
}
