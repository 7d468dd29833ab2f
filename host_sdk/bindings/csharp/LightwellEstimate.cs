// The light in the few numbers that AR platforms' light estimation gives, for C#: the part of Lightwell.cs over
// light_estimate.h. Needs Lightwell.cs. Meanings: light_estimate.hpp.
using System;
using System.Runtime.InteropServices;

namespace Lightwell
{
    /// <summary>Values that were not requested (Available), or are not known, are zero.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct LightEstimate
    {
        internal uint size;
        public Validity Validity { get; }
        public LightRequest Available { get; }
        /// <summary>1000 * MeanIlluminance / neutralIlluminance.</summary>
        public float AmbientLumens { get; }
        /// <summary>Over all orientations of a surface, lux.</summary>
        public float MeanIlluminance { get; }
        /// <summary>K; 0 where it has no meaning.</summary>
        public float ColorTemperature { get; }
        /// <summary>Distance from the Planckian locus.</summary>
        public float Duv { get; }
        /// <summary>Linear, largest channel 1.</summary>
        public Rgb AmbientColor { get; }
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 9)] private Rgb[] harmonics;
        /// <summary>Towards the main light, unit; the axes are the lighting's, not Unity's.</summary>
        public Vec3 MainLightDirection { get; }
        /// <summary>Linear, largest channel 1.</summary>
        public Rgb MainLightColor { get; }
        public float MainLightLumens { get; }

        /// <summary>Radiance, nine coefficients, all signs positive. Without the main light if both its direction and
        /// its intensity were requested.</summary>
        public Rgb[] AmbientSphericalHarmonics => harmonics;
    }

    public sealed partial class Lighting
    {
        /// <summary>`gain`: factor on all light. `neutralIlluminance`: lux that are 1000 "lumens". InvalidArgument if
        /// one of them is not above 0 and finite. Makes an array.</summary>
        public LightEstimate Estimate(LightRequest requested = LightRequest.All, float gain = 1,
                                      float neutralIlluminance = 1000)
        {
            var options = new Native.CLightEstimateOptions
            {
                size = (uint)Marshal.SizeOf(typeof(Native.CLightEstimateOptions)), requested = (uint)requested,
                gain = gain, neutralIlluminance = neutralIlluminance
            };
            var estimate = new LightEstimate { size = (uint)Marshal.SizeOf(typeof(LightEstimate)) };
            Native.Check(Native.lw_lighting_estimate(Handle, ref options, ref estimate));
            return estimate;
        }

        /// <summary>Weight of this light: 1 up to the age `holdNs`, 0 after `holdNs` + `fadeNs`, and without light.
        /// InvalidArgument for negative times.</summary>
        public float FadeWeight(long holdNs = 250000000, long fadeNs = 500000000)
        {
            Native.Check(Native.lw_lighting_fade_weight(Handle, holdNs, fadeNs, out var weight));
            return weight;
        }
    }

    /// <summary>Colour temperatures and weights that need no Lighting.</summary>
    public static class LightEstimates
    {
        /// <summary>Correlated colour temperature of a linear Rec. 709 colour, K, and its distance from the Planckian
        /// locus; false where it has no meaning.</summary>
        public static bool TryColorTemperature(Rgb color, out double kelvin, out double duv)
        {
            Native.CheckVersion();
            Native.Check(Native.lw_color_temperature(ref color, out kelvin, out duv));
            return kelvin > 0;
        }

        /// <summary>As Lighting.FadeWeight, of an age.</summary>
        public static float FadeWeight(long ageNs, long holdNs, long fadeNs)
        {
            Native.CheckVersion();
            Native.Check(Native.lw_fade_weight(ageNs, holdNs, fadeNs, out var weight));
            return weight;
        }
    }

    internal static partial class Native
    {
        [StructLayout(LayoutKind.Sequential)]
        internal struct CLightEstimateOptions
        {
            internal uint size, requested;
            internal float gain, neutralIlluminance;
        }

        [DllImport(Library)] internal static extern int lw_lighting_estimate(
            LightingHandle lighting, ref CLightEstimateOptions options, ref LightEstimate estimate);
        [DllImport(Library)] internal static extern int lw_lighting_fade_weight(
            LightingHandle lighting, long hold, long fade, out float weight);
        [DllImport(Library)] internal static extern int lw_fade_weight(
            long age, long hold, long fade, out float weight);
        [DllImport(Library)] internal static extern int lw_color_temperature(
            ref Rgb color, out double kelvin, out double duv);
    }
}
