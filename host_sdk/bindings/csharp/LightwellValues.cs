// Values of Lightwell.cs: light, states, options. Conventions are those at the head of Lightwell.cs.
using System;
using System.Runtime.InteropServices;

namespace Lightwell
{
    /// <summary>A value with its validity, age and error bound.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Answer
    {
        internal uint size;
        public Validity Validity { get; }
        /// <summary>Time since mid-exposure when the lighting was obtained.</summary>
        public long AgeNs { get; }
        private IntPtr reason;
        /// <summary>Zero for a batch.</summary>
        public Rgb Value { get; }
        /// <summary>RMS relative to the RMS irradiance, 0.01 is 1 %; infinite without a bound (see Flags).</summary>
        public float ErrorBound { get; }
        public LightFlags Flags { get; }
        private int lightsIncluded;
        public Units Units { get; }
        /// <summary>Number of invalid inputs of a batch: their values are zero, and Validity is InvalidQuery.</summary>
        public uint Refused { get; }

        /// <summary>Why it is not valid; empty if it is. Allocates a string.</summary>
        public string Reason => Marshal.PtrToStringAnsi(reason) ?? "";
        /// <summary>False for radiance at roughness 0, which excludes the discrete lights.</summary>
        public bool LightsIncluded => lightsIncluded != 0;
    }

    /// <summary>Properties of a Lighting besides its light.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct LightingInfo
    {
        internal uint size;
        public Validity Validity { get; }
        public long AgeNs { get; }
        private IntPtr reason;
        /// <summary>Maximum error of AgeNs; stale if the age can exceed MaxAge within it.</summary>
        public long AgeUncertaintyNs;
        public ulong Sequence;
        /// <summary>In the clock of Probe.NowNs; 0 if there is none.</summary>
        public long MidExposureNs;
        public long ReceivedNs;
        /// <summary>In the probe's clock.</summary>
        public long ProbeMidExposureNs;
        public long DeliveredAfterNs;
        public long EncodedAfterNs;
        public ulong EncodedBytes;
        public Units Units { get; }
        public LightFlags Flags { get; }
        public float BoundTotal, BoundTruncation, BoundSampling, BoundNoise, BoundQuantization, BoundSmoothing;
        /// <summary>Fraction of the sphere that at least one pixel sees.</summary>
        public float Coverage;
        /// <summary>Fraction of the seen part that is saturated in every exposure.</summary>
        public float Saturated;
        public int Band;
        public uint LightCount;
        public uint ProbeId;
        public uint CalibrationId;
        /// <summary>1 fast, 2 balanced, 3 exact, 4 fastest.</summary>
        public int Setting;
        /// <summary>0 unknown, 1 none, 2 100 Hz, 3 120 Hz.</summary>
        public int Flicker;
        public Derivation Derivation { get; }
        private int reserved;
        /// <summary>Position at which the light holds, in the lighting's frame, m: of a marker, or of the probe
        /// itself.</summary>
        public double OriginX, OriginY, OriginZ;
        /// <summary>Of a marker's axes: p_lighting = OriginOrientation p_origin + position. Turns no
        /// direction.</summary>
        public Rotation OriginOrientation;

        public string Reason => Marshal.PtrToStringAnsi(reason) ?? "";
    }

    /// <summary>A detected light (lamp, sun, window), modelled as a spherical cap of uniform radiance.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct LightSource
    {
        internal uint size;
        /// <summary>Identity over time: the same light keeps its track. 0: not tracked.</summary>
        public uint Track;
        /// <summary>Unit, TOWARDS the light.</summary>
        public Vec3 Direction;
        /// <summary>Irradiance at normal incidence.</summary>
        public Rgb Irradiance;
        /// <summary>rad</summary>
        public float AngularRadius;
        /// <summary>u·u, u·v, v·v in rad².</summary>
        public Vec3 DirectionCovariance;
        /// <summary>From the origin, m. 0: distant or not known.</summary>
        public float Distance;
        /// <summary>Standard deviation of the distance, m.</summary>
        public float DistanceSigma;
        private Vec3 position;

        /// <summary>In the lighting's frame, m, as LightingInfo.OriginX; null if the distance is not known.</summary>
        public Vec3? Position => Distance > 0 ? position : (Vec3?)null;
    }

    /// <summary>The prefiltered environment map for reflections.</summary>
    public sealed class EnvironmentMap
    {
        /// <summary>In order of increasing roughness.</summary>
        public EnvironmentLevel[] Levels { get; internal set; }
        /// <summary>Sequence number of the descriptor with the map: upload the map when this changes.</summary>
        public ulong Sequence { get; internal set; }
        public long OlderByNs { get; internal set; }
        /// <summary>p_lighting = Rotation p_map.</summary>
        public Rotation Rotation { get; internal set; }
        public uint Key { get; internal set; }
    }

    /// <summary>Light for RenderSettings.ambientProbe and a directional Light, in Unity's axes (left-handed, +Z
    /// forward).
    /// <code>
    /// var probe = new SphericalHarmonicsL2();
    /// for (int rgb = 0; rgb &lt; 3; ++rgb)
    ///     for (int i = 0; i &lt; 9; ++i) probe[rgb, i] = unity.SphericalHarmonicsL2[9 * rgb + i];
    /// sun.transform.forward = new Vector3(unity.Forward.X, unity.Forward.Y, unity.Forward.Z);
    /// sun.color = new Color(unity.Color.R, unity.Color.G, unity.Color.B).gamma;
    /// sun.intensity = unity.Intensity;
    /// </code></summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct UnityLighting
    {
        internal uint size;
        public Validity Validity { get; }
        /// <summary>Relative irradiance error due to what Unity cannot represent; -1 if it was not
        /// computed.</summary>
        public float Residual { get; }
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 27)] private float[] harmonics;
        /// <summary>Direction in which the main light shines; unit.</summary>
        public Vec3 Forward;
        /// <summary>Linear, largest channel 1.</summary>
        public Rgb Color;
        /// <summary>0 if there is no main light or no estimate.</summary>
        public float Intensity;

        /// <summary>this[rgb, coefficient] at 9 rgb + coefficient, pre-scaled as in Unity.</summary>
        public float[] SphericalHarmonicsL2 => harmonics;
    }

    /// <summary>Options of a connection. Zero means the default of ProbeOptions in probe.hpp.</summary>
    public sealed class ProbeOptions
    {
        /// <summary>Number of descriptors stored for At; 64.</summary>
        public int History;
        /// <summary>Older answers are stale; 250 ms.</summary>
        public TimeSpan MaxAge;
        /// <summary>How far beyond the newest descriptor At extrapolates lights; 50 ms. Negative: not at all.</summary>
        public TimeSpan Extrapolation;
        public TimeSpan ConnectTimeout, RetryMin, RetryMax, SilenceLimit;
        /// <summary>For a grpcs:// probe, as written by `lightwell pair`; looked up by address if
        /// null.</summary>
        public string CredentialsFolder;
        /// <summary>Credentials for a broker; files are PEM.</summary>
        public string MqttCaFile, MqttCertificateFile, MqttKeyFile, MqttUser, MqttPassword;
        /// <summary>Receives captured planes, for Probe.Plane (LightwellPlanes.cs).</summary>
        public bool Plane;
    }

    /// <summary>Fields and defaults of EstimatorConfig in proto/lightwell/v1/config.proto.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct EstimatorConfig
    {
        internal uint size;
        public int Band, MaxLights;
        /// <summary>1 fast, 2 balanced, 3 exact, 4 fastest.</summary>
        public int Setting;
        /// <summary>1 none, 2 mirror, 3 average.</summary>
        public int Unseen;
        /// <summary>1 none, 2 the 1 euro filter.</summary>
        public int Smoothing;
        /// <summary>0, 8, 16, 32 or 64.</summary>
        public int EnvironmentEdge;
        private int reserved;
        public double LightThreshold, Epsilon, RadianceEpsilon, EnvironmentRate;
        /// <summary>Option of the marker estimator; Unseen to EnvironmentRate are options of the panorama
        /// estimator.</summary>
        public double MarkerDecimation, MarkerSearchDecimation;
        public int MarkerMaxFaces;
        /// <summary>Option of the specular estimator: 0, 8, 16, 32 or 64.</summary>
        public int SpecularEnvironmentEdge;
        /// <summary>Option of the panorama estimator: 1 to 16.</summary>
        public int Interleave;
        /// <summary>Option of the panorama estimator: 0 (no limit), or at least 96.</summary>
        public int MaxBytes;

        public static EstimatorConfig Defaults() =>
            Native.Filled(Sized(), (ref EstimatorConfig config) => Native.lw_estimator_config_defaults(ref config));

        /// <summary>Zero except for its size.</summary>
        internal static EstimatorConfig Sized() =>
            new EstimatorConfig { size = (uint)Marshal.SizeOf(typeof(EstimatorConfig)) };
    }

    /// <summary>Partial update of an EstimatorConfig: fields that are null are not changed.</summary>
    public sealed class EstimatorUpdate
    {
        public int? Band, MaxLights, Setting, Unseen, Smoothing, EnvironmentEdge;
        public double? LightThreshold, Epsilon, RadianceEpsilon, EnvironmentRate;
        public double? MarkerDecimation, MarkerSearchDecimation;
        public int? MarkerMaxFaces, SpecularEnvironmentEdge, Interleave, MaxBytes;

        /// <summary>Copies the fields that are set into `config`; returns their LW_FIELD_ bits.</summary>
        internal ulong Fill(ref EstimatorConfig config) =>
            Put(Band, 0, ref config.Band) | Put(MaxLights, 1, ref config.MaxLights) |
            Put(Setting, 2, ref config.Setting) | Put(Unseen, 3, ref config.Unseen) |
            Put(Smoothing, 4, ref config.Smoothing) | Put(EnvironmentEdge, 5, ref config.EnvironmentEdge) |
            Put(LightThreshold, 6, ref config.LightThreshold) | Put(Epsilon, 7, ref config.Epsilon) |
            Put(RadianceEpsilon, 8, ref config.RadianceEpsilon) |
            Put(EnvironmentRate, 9, ref config.EnvironmentRate) |
            Put(MarkerDecimation, 10, ref config.MarkerDecimation) |
            Put(MarkerSearchDecimation, 11, ref config.MarkerSearchDecimation) |
            Put(MarkerMaxFaces, 12, ref config.MarkerMaxFaces) |
            Put(SpecularEnvironmentEdge, 13, ref config.SpecularEnvironmentEdge) |
            Put(Interleave, 14, ref config.Interleave) | Put(MaxBytes, 15, ref config.MaxBytes);

        private static ulong Put<T>(T? value, int bit, ref T field) where T : struct
        {
            if (!value.HasValue) return 0;
            field = value.Value;
            return 1UL << bit;
        }
    }

    /// <summary>What light is estimated from: a panoramic view of the surroundings, a marker in view, or the mirror
    /// image in a glossy plane.</summary>
    public enum EstimatorKind { Panorama = 1, Marker = 2, Specular = 3 }

    /// <summary>Identity and clock of a probe, and its counters since its start.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct ProbeInfo
    {
        internal uint size;
        public uint Id, CalibrationId, Clients;
        /// <summary>The probe's clock minus the host's; the true value is within ClockUncertaintyNs of it.</summary>
        public long ClockOffsetNs, ClockUncertaintyNs;
        public double ClockDriftPpm;
        public ulong Frames, CapturesDropped, BracketsIncomplete, Estimates, EstimatesFailed, DescriptorsCoalesced,
            FramesRecorded, RecordingFaults, FramesLost, SettingMoves, EstimatesLate, EstimatesLateAtFast,
            MessagesRefused, AuthenticationFailures;
        private int mounted, reserved;
        /// <summary>Position of the probe in its room, m; zero if it is not Mounted.</summary>
        public double PositionX, PositionY, PositionZ;
        /// <summary>p_world = Orientation p_probe + position.</summary>
        public Rotation Orientation;
        /// <summary>Number of changes of the probe's client list that made it invalid.</summary>
        public ulong ClientListFaults;

        /// <summary>Whether the probe's pose in its room is configured.</summary>
        public bool Mounted => mounted != 0;
    }

    /// <summary>Statistics of the connection since it was made.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct LinkStats
    {
        internal uint size;
        public LinkState State { get; }
        public ulong Received, Bytes, Gaps, Oversized, Undecodable, Replayed, Reconnects, Maps, MapsWithoutKey,
            FramesLost, FramesRefused, Untimely;
    }
}
