// The lighting of one moment: the queries of C++'s Lighting, with the same results to 1e-6 of all light.
using System;

namespace Lightwell.Managed
{
    /// <summary>A value with its validity, age and error bound.</summary>
    public struct LightAnswer
    {
        /// <summary>Linear Rec. 709. Luminance of irradiance in lux, of radiance in cd/m², if units are
        /// absolute.</summary>
        public Rgb Value;
        public Validity Validity;
        /// <summary>Time since mid-exposure, ms.</summary>
        public double AgeMs;
        /// <summary>RMS relative to the RMS irradiance, 0.01 is 1 %; infinite without a bound (see Flags).</summary>
        public float ErrorBound;
        public LightFlags Flags;
        /// <summary>False for radiance at roughness 0, which excludes the discrete lights.</summary>
        public bool LightsIncluded;
        public Units Units;
    }

    /// <summary>The lighting of one moment, immutable. Directions and normals: right-handed, +X right, +Y up, -Z
    /// forward; any length. For any number of threads.</summary>
    public sealed class Lighting
    {
        private static readonly double[] MirrorLobe = { 1, 1, 1, 1, 1, 1, 1 };

        private readonly LazyReconstruction reconstruction;
        /// <summary>The last lobe, because shading usually evaluates many directions at one roughness.</summary>
        private volatile GgxLobe lobe;

        /// <summary>Null: no descriptor has been received yet.</summary>
        public Descriptor Descriptor { get; }
        /// <summary>Null without one.</summary>
        public EnvironmentMapView Environment { get; }
        public Validity Validity { get; }
        /// <summary>Time since mid-exposure, ms.</summary>
        public double AgeMs { get; }

        /// <summary>ageMs: time since mid-exposure. maxAgeMs: age above which the lighting is stale. environment: the
        /// current map, from an EnvironmentKeeper.</summary>
        public Lighting(Descriptor descriptor, double ageMs = 0, double maxAgeMs = 250,
                        EnvironmentMapView environment = null)
            : this(descriptor, ageMs, maxAgeMs, environment, new LazyReconstruction()) { }

        internal Lighting(Descriptor descriptor, double ageMs, double maxAgeMs, EnvironmentMapView environment,
                          LazyReconstruction reconstruction)
        {
            Descriptor = descriptor;
            Environment = environment;
            AgeMs = Math.Max(0, ageMs);
            Validity = descriptor == null ? Validity.None : AgeMs <= maxAgeMs ? Validity.Valid : Validity.Stale;
            this.reconstruction = reconstruction;
        }

        /// <summary>Irradiance of a flat receiver that faces `normal`. Not divided by pi, not clamped: can be slightly
        /// negative where the truncated series rings.</summary>
        public LightAnswer Irradiance(Vec3 normal)
        {
            var good = Double3.TryNormalize(new Double3(normal), out var n);
            if (!good || Descriptor == null) return Answer(new Double3(), good, true);
            var value = Harmonics.Evaluate(Descriptor.Radiance, Descriptor.Band, n, Harmonics.CosineLobe);
            foreach (var light in Descriptor.Lights)
                value = Plus(value, light, Cap.Irradiance(Double3.Dot(light.Unit, n), light.AngularRadius));
            return Answer(value, true, true);
        }

        /// <summary>Radiance as reflected by a surface of that perceptual roughness (alpha = roughness²): the
        /// GGX-weighted mean with N = V = R = direction. At roughness 0 (a mirror) the discrete lights are excluded.
        /// Never negative. Without a map, the first query of a descriptor takes a few milliseconds.</summary>
        public LightAnswer Radiance(Vec3 direction, float roughness)
        {
            var mirror = roughness <= 0;
            var good = Double3.TryNormalize(new Double3(direction), out var d) && Double3.IsFinite(roughness);
            if (!good || Descriptor == null) return Answer(new Double3(), good, !mirror);
            var r = mirror ? 0 : Cap.Clamp(roughness, GgxLobe.MinRoughness, 1);
            var ggx = mirror ? null : LobeOf((float)r);
            var value = Environment != null ? Environment.Radiance(new Double3(direction), r)
                : reconstruction.Of(Descriptor).RadianceAt(d, r, mirror ? MirrorLobe : ggx.Coefficients);
            if (mirror) return Answer(value, true, false);
            // As far as the first level has a share, lights that its texels show are these texels, not caps.
            var share = Environment == null ? 0 : Environment.MirrorShare(r);
            foreach (var light in Descriptor.Lights)
            {
                var asCap = share > 0 && Environment.ShownInMirror(light) ? 1 - share : 1;
                value = Plus(value, light,
                             asCap * Cap.Radiance(Double3.Dot(light.Unit, d), light.AngularRadius, ggx));
            }
            if (share > 0)
            {
                var added = Environment.LightInMirror(new Double3(direction));
                value = new Double3(Math.Max(0, value.X + share * added.X), Math.Max(0, value.Y + share * added.Y),
                                    Math.Max(0, value.Z + share * added.Z));
            }
            return Answer(value, true, true);
        }

        /// <summary>For a RenderSettings.ambientProbe and a directional Light: as to_unity() of the C++ SDK. `exposure`
        /// multiplies every colour: 1 keeps cd/m² and lux.</summary>
        public ManagedUnityLighting ToUnity(UnityPipeline pipeline, MainLight mainLight = MainLight.Apart,
                                            double exposure = 1) =>
            ManagedUnityLighting.Of(this, pipeline, mainLight, exposure);

        /// <summary>The light in a few numbers: as estimate_light() of the C++ SDK. `gain`: factor on all light.
        /// `neutralIlluminance`: lux that are 1000 "lumens". InvalidQuery if one is not above 0 and finite.</summary>
        public ManagedLightEstimate Estimate(LightRequest requested = LightRequest.All, float gain = 1,
                                             float neutralIlluminance = 1000) =>
            ManagedLightEstimate.Of(this, requested, gain, neutralIlluminance);

        private static Double3 Plus(Double3 sum, DiscreteLight light, double weight) => new Double3(
            sum.X + light.Irradiance.R * weight, sum.Y + light.Irradiance.G * weight,
            sum.Z + light.Irradiance.B * weight);

        private GgxLobe LobeOf(double roughness)
        {
            var last = lobe;
            if (last == null || last.Roughness != roughness) lobe = last = new GgxLobe(roughness);
            return last;
        }

        private LightAnswer Answer(Double3 value, bool good, bool lightsIncluded)
        {
            var d = Descriptor;
            return new LightAnswer
            {
                Value = new Rgb((float)value.X, (float)value.Y, (float)value.Z), AgeMs = AgeMs,
                Validity = good || d == null ? Validity : Validity.InvalidQuery, LightsIncluded = lightsIncluded,
                ErrorBound = d == null ? 0 : d.ErrorBound, Flags = d == null ? 0 : d.Flags,
                Units = d == null ? Units.Relative : d.Units
            };
        }
    }

    /// <summary>Computed at the first query that needs it; common to all Lightings of one descriptor.</summary>
    internal sealed class LazyReconstruction
    {
        private volatile Reconstruction made;

        internal Reconstruction Of(Descriptor descriptor) =>
            made ?? (made = new Reconstruction(descriptor.Radiance));
    }
}
