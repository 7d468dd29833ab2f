// Light in Unity's conventions: as to_unity() of conventions.hpp.
using System;

namespace Lightwell.Managed
{
    /// <summary>Light for RenderSettings.ambientProbe and a directional Light, in Unity's axes (left-handed, +Z
    /// forward): Lightwell's with z reversed.
    /// <code>
    /// var probe = new SphericalHarmonicsL2();
    /// for (int rgb = 0; rgb &lt; 3; ++rgb)
    ///     for (int i = 0; i &lt; 9; ++i) probe[rgb, i] = unity.SphericalHarmonicsL2[9 * rgb + i];
    /// sun.transform.forward = new Vector3(unity.Forward.X, unity.Forward.Y, unity.Forward.Z);
    /// sun.color = new Color(unity.Color.R, unity.Color.G, unity.Color.B).gamma;
    /// sun.intensity = unity.Intensity;
    /// </code></summary>
    public sealed class ManagedUnityLighting
    {
        /// <summary>That of the Lighting; InvalidQuery for an exposure that is not finite. Without an estimate all
        /// values are zero.</summary>
        public Validity Validity { get; private set; }
        /// <summary>this[rgb, coefficient] at 9 rgb + coefficient, pre-scaled as in Unity.</summary>
        public float[] SphericalHarmonicsL2 { get; } = new float[27];
        /// <summary>Direction in which the main light shines; unit.</summary>
        public Vec3 Forward { get; private set; } = new Vec3(0, -1, 0);
        /// <summary>Linear, largest channel 1.</summary>
        public Rgb Color { get; private set; } = new Rgb(1, 1, 1);
        /// <summary>0 if there is no main light or no estimate.</summary>
        public float Intensity { get; private set; }

        private const int Count = LightSplit.Count;

        internal static ManagedUnityLighting Of(Lighting lighting, UnityPipeline pipeline, MainLight mainLight,
                                                double exposure)
        {
            var made = new ManagedUnityLighting { Validity = lighting.Validity };
            if (lighting.Validity != Validity.Valid && lighting.Validity != Validity.Stale) return made;
            var split = new LightSplit(lighting.Descriptor, mainLight, exposure);
            if (!split.IsPresentable) return new ManagedUnityLighting { Validity = Validity.InvalidQuery };
            made.SetHarmonics(split.Harmonics);
            if (split.Main == null) return made;
            var sun = split.MainIrradiance;
            var most = Math.Max(sun.X, Math.Max(sun.Y, sun.Z));
            made.Forward = new Vec3((float)-split.Main.Unit.X, (float)-split.Main.Unit.Y, (float)split.Main.Unit.Z);
            made.Color = new Rgb((float)(sun.X / most), (float)(sun.Y / most), (float)(sun.Z / most));
            made.Intensity = (float)(pipeline == UnityPipeline.Universal ? most / Math.PI : most);
            return made;
        }

        /// <summary>Irradiance over pi as a polynomial: constants of the basis functions (Sloan 2008, appendix A2, all
        /// positive) times A_l / pi = 1, 2/3, 1/4. Functions that are odd in z change their sign.</summary>
        private void SetHarmonics(Double3[] kept)
        {
            var root = Math.Sqrt(Math.PI);
            double band0 = 1 / (2 * root), band1 = Math.Sqrt(3) / (3 * root), band2 = Math.Sqrt(15) / (8 * root);
            var factor = new[]
            {
                band0, band1, -band1, band1, band2, -band2, Math.Sqrt(5) / (16 * root), -band2, band2 / 2
            };
            for (var i = 0; i < Count; ++i)
            {
                SphericalHarmonicsL2[i] = (float)(kept[i].X * factor[i]);
                SphericalHarmonicsL2[Count + i] = (float)(kept[i].Y * factor[i]);
                SphericalHarmonicsL2[2 * Count + i] = (float)(kept[i].Z * factor[i]);
            }
        }
    }
}
