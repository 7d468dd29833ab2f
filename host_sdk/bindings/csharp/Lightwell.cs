// Lightwell for C# over the C ABI (lightwell.h), for Unity and other applications. Put this file, and of
// LightwellPlanes.cs, LightwellProbeStatus.cs and LightwellCubeMap.cs what is needed, into the project with
// liblightwell.so beside them (Unity: Assets/Plugins). C# 7.2 and .NET Standard 2.0 are enough; there is no unsafe
// code. Directions and normals are in the probe's frame: right-handed, +X right, +Y up, -Z forward, metres; they need
// not be normalised. UNITY'S AXES DIFFER: Lighting.ToUnity returns values in Unity's axes, and a normal (x, y, z) of
// Unity is (x, y, -z) here. Colours are linear Rec. 709, D65: the luminance of irradiance is in lux and of radiance in
// cd/m² if Units are Absolute.
//
// A render loop creates one Lighting and calls probe.Latest(light) every frame: lock-free, without waiting or garbage.
// Any thread may call anything, but a Lighting may be filled only while no other thread uses it.
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;
using Microsoft.Win32.SafeHandles;

namespace Lightwell
{
    public enum Status
    {
        Ok, InvalidArgument, NotFound, DataLoss, FailedPrecondition, Unavailable, ResourceExhausted, Internal
    }

    /// <summary>Whether an answer can be used.</summary>
    public enum Validity
    {
        Valid,
        /// <summary>Measured, but older than ProbeOptions.MaxAge.</summary>
        Stale,
        /// <summary>No descriptor has been received yet; the value is zero.</summary>
        None,
        /// <summary>The time is before the oldest stored descriptor; the value is zero.</summary>
        BeforeHistory,
        /// <summary>An argument is invalid; the value is zero.</summary>
        InvalidQuery
    }

    public enum Units { Relative = 1, Absolute = 2 }

    /// <summary>Conditions under which a value may be wrong; documented in lightwell.h.</summary>
    [Flags]
    public enum LightFlags : uint
    {
        Unseen = 1 << 1, Clipped = 1 << 2, Cleaned = 1 << 3, Dark = 1 << 4, Moved = 1 << 5, Filled = 1 << 6,
        Recovered = 1 << 7, Unsure = 1 << 8, Newer = 1u << 31
    }

    /// <summary>How an answer was derived: from one descriptor, interpolated between two, extrapolated after the newest
    /// with its lights moved on, or later than that the newest unchanged.</summary>
    public enum Derivation { Measured, Interpolated, Extrapolated, Held }

    public enum LinkState
    {
        Connecting, Connected, Waiting, Ended,
        /// <summary>MQTT: the broker reports that the probe is offline.</summary>
        Gone
    }

    /// <summary>A failed call: the kind of the failure, and what to do.</summary>
    public sealed class LightwellException : Exception
    {
        public Status Status { get; }

        public LightwellException(Status status, string message) : base(message) => Status = status;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Vec3
    {
        public float X, Y, Z;

        public Vec3(float x, float y, float z) { X = x; Y = y; Z = z; }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Rgb
    {
        public float R, G, B;

        public Rgb(float r, float g, float b) { R = r; G = g; B = b; }

        /// <summary>Luminance in cd/m² of radiance, illuminance in lux of irradiance, if units are absolute.</summary>
        public float Luminance => 0.2126f * R + 0.7152f * G + 0.0722f * B;
    }

    /// <summary>Rotation quaternion, Hamilton convention: p_new = q p_old.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Rotation
    {
        public double X, Y, Z, W;

        public Rotation(double x, double y, double z, double w) { X = x; Y = y; Z = z; W = w; }
    }

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
        /// <summary>1 fast, 2 balanced, 3 exact.</summary>
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

    /// <summary>One octahedral level of the environment map: +Y at the centre, u from x, v from z, rows from the top,
    /// without the lights.</summary>
    public sealed class EnvironmentLevel
    {
        public int Edge { get; internal set; }
        /// <summary>Perceptual roughness.</summary>
        public float Roughness { get; internal set; }
        public Rgb[] Radiance { get; internal set; }
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

    /// <summary>Unit of a Unity light's intensity: irradiance over pi (built-in pipeline, URP) or lux (HDRP).</summary>
    public enum UnityPipeline { Universal, HighDefinition }

    /// <summary>How the strongest light is represented.</summary>
    public enum MainLight { Apart, InHarmonics }

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
        /// <summary>1 fast, 2 balanced, 3 exact.</summary>
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
        public int? MarkerMaxFaces, SpecularEnvironmentEdge;

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
            Put(SpecularEnvironmentEdge, 13, ref config.SpecularEnvironmentEdge);

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

    /// <summary>The lighting of one moment. It is not updated automatically: Probe.Latest fills it again.</summary>
    public sealed partial class Lighting : IDisposable
    {
        public const int MaxBand = 6, MaxLights = 64;

        internal readonly LightingHandle Handle;

        /// <summary>Empty: Validity.None.</summary>
        public Lighting()
        {
            Native.CheckVersion();
            Native.Check(Native.lw_lighting_create(out var made));
            Handle = made;
        }

        public void Dispose() => Handle.Dispose();

        /// <summary>Decodes the bytes of a LightingDescriptor that was received without a Probe.</summary>
        public static Lighting Decode(byte[] message, long ageNs = 0)
        {
            if (message == null) throw new ArgumentNullException("message");
            return Filled(into => Native.lw_lighting_decode(message, Native.Size(message.Length), ageNs, into));
        }

        public Lighting Copy() => Filled(into => Native.lw_lighting_copy(Handle, into));

        /// <summary>The lighting rotated by q about the probe: with the rotation of T_world_probe, in the world's
        /// axes.</summary>
        public Lighting Rotated(Rotation q) => Filled(into => Native.lw_lighting_rotated(Handle, ref q, into));

        /// <summary>The same, into an existing object; `into` may be this.</summary>
        public void Rotated(Rotation q, Lighting into) =>
            Native.Check(Native.lw_lighting_rotated(Handle, ref q, into.Handle));

        /// <summary>The lighting in a world frame: p_new = orientation p_old + (x, y, z), m. Also moves the origin and
        /// the positions of lights.</summary>
        public Lighting InWorld(double x, double y, double z, Rotation orientation) =>
            Filled(into => Native.lw_lighting_in_world(Handle, new[] { x, y, z }, ref orientation, into));

        public LightingInfo Info
        {
            get
            {
                var info = new LightingInfo { size = Native.SizeOfLightingInfo };
                Native.Check(Native.lw_lighting_get_info(Handle, ref info));
                return info;
            }
        }

        /// <summary>Why it is not valid, with numbers; empty if it is.</summary>
        public string Reason => Native.Text((m, c, l) => Native.lw_lighting_reason(Handle, m, c, l));

        /// <summary>Irradiance of a flat receiver that faces `normal`. Not divided by pi, not clamped.</summary>
        public Answer Irradiance(Vec3 normal)
        {
            var answer = new Answer { size = Native.SizeOfAnswer };
            Native.Check(Native.lw_lighting_irradiance(Handle, ref normal, ref answer));
            return answer;
        }

        /// <summary>Radiance as reflected by a surface of that roughness with this reflection direction.</summary>
        public Answer Radiance(Vec3 direction, float roughness)
        {
            var answer = new Answer { size = Native.SizeOfAnswer };
            Native.Check(Native.lw_lighting_radiance(Handle, ref direction, roughness, ref answer));
            return answer;
        }

        /// <summary>values[i] is for normals[i]; both have the same length. The arrays are not copied.</summary>
        public Answer Irradiance(Vec3[] normals, Rgb[] values)
        {
            SameLength(normals, values);
            var about = new Answer { size = Native.SizeOfAnswer };
            Native.Check(Native.lw_lighting_irradiance_batch(Handle, normals, UIntPtr.Zero, Native.Size(normals.Length),
                                                             values, UIntPtr.Zero, ref about));
            return about;
        }

        public Answer Radiance(Vec3[] directions, float roughness, Rgb[] values)
        {
            SameLength(directions, values);
            var about = new Answer { size = Native.SizeOfAnswer };
            Native.Check(Native.lw_lighting_radiance_batch(Handle, directions, UIntPtr.Zero,
                                                           Native.Size(directions.Length), roughness, values,
                                                           UIntPtr.Zero, ref about));
            return about;
        }

        /// <summary>Spherical harmonics of the radiance without the lights: real, orthonormal, no Condon-Shortley
        /// phase, in the order l(l+1)+m. (maxBand + 1)² coefficients, zeros above Info.Band.</summary>
        public Rgb[] RadianceCoefficients(int maxBand) => Coefficients(0, maxBand);

        /// <summary>The same convolved with the clamped cosine: evaluate at a normal, and add the lights.</summary>
        public Rgb[] IrradianceCoefficients(int maxBand) => Coefficients(1, maxBand);

        /// <summary>Strongest first.</summary>
        public LightSource[] Lights
        {
            get
            {
                var lights = new LightSource[MaxLights];
                Native.Check(Native.lw_lighting_lights(Handle, lights, Native.Size(Marshal.SizeOf(typeof(LightSource))),
                                                       Native.Size(MaxLights), out var count));
                Array.Resize(ref lights, (int)count);
                return lights;
            }
        }

        /// <summary>Null if the probe sends none.</summary>
        public EnvironmentMap Environment
        {
            get
            {
                var c = new Native.CEnvironment { size = (uint)Marshal.SizeOf(typeof(Native.CEnvironment)) };
                Native.Check(Native.lw_lighting_environment(Handle, ref c));
                if (c.levelCount == 0) return null;
                var levels = new EnvironmentLevel[c.levelCount];
                for (uint k = 0; k < levels.Length; ++k)
                {
                    var edge = (int)c.edge[k];
                    var radiance = new Rgb[edge * edge];
                    Native.Check(Native.lw_lighting_environment_radiance(Handle, k, radiance,
                                                                         Native.Size(3 * radiance.Length)));
                    levels[k] = new EnvironmentLevel { Edge = edge, Roughness = c.roughness[k], Radiance = radiance };
                }
                return new EnvironmentMap
                {
                    Levels = levels, Sequence = c.sequence, OlderByNs = c.olderBy, Rotation = c.rotation, Key = c.key
                };
            }
        }

        /// <summary>Conversion to Unity. Transform the lighting to the application's world first, in Lightwell's axes
        /// (Rotated). `exposure` multiplies every colour: 1 keeps cd/m² and lux.</summary>
        public UnityLighting ToUnity(UnityPipeline pipeline, MainLight mainLight = MainLight.Apart, float exposure = 1)
        {
            var options = new Native.CConversionOptions
            {
                size = (uint)Marshal.SizeOf(typeof(Native.CConversionOptions)),
                color = new[] { exposure, 0, 0, 0, exposure, 0, 0, 0, exposure }
            };
            // A zero matrix means no matrix in the C ABI, so it would not scale the light.
            if (exposure == 0) throw new ArgumentOutOfRangeException("exposure", "it is not zero");
            var unity = new UnityLighting { size = (uint)Marshal.SizeOf(typeof(UnityLighting)) };
            Native.Check(Native.lw_lighting_to_unity(Handle, (int)pipeline, (int)mainLight, ref options, ref unity));
            return unity;
        }

        /// <summary>A new Lighting that a function of the C ABI fills.</summary>
        internal static Lighting Filled(Func<LightingHandle, int> fill)
        {
            var made = new Lighting();
            Native.Check(fill(made.Handle));
            return made;
        }

        private Rgb[] Coefficients(int quantity, int maxBand)
        {
            if (maxBand < 0 || maxBand > MaxBand)
                throw new ArgumentOutOfRangeException("maxBand", maxBand, "it is 0 to 6");
            var values = new Rgb[(maxBand + 1) * (maxBand + 1)];
            Native.Check(Native.lw_lighting_harmonics(Handle, quantity, maxBand, values, out var band));
            return values;
        }

        private static void SameLength(Vec3[] questions, Rgb[] values)
        {
            if (questions == null) throw new ArgumentNullException("questions");
            if (values == null) throw new ArgumentNullException("values");
            if (questions.Length != values.Length)
                throw new ArgumentException(questions.Length + " questions, and room for " + values.Length + " values");
        }
    }

    /// <summary>A connection to one probe, from Connect to Dispose. Dispose does not wait for calls of other threads:
    /// the connection is closed when the last one returns.</summary>
    public sealed partial class Probe : IDisposable
    {
        /// <summary>Period in which a blocking wait checks for Dispose.</summary>
        private const long SliceNs = 100000000;

        private readonly ProbeHandle handle;

        private Probe(ProbeHandle handle) => this.handle = handle;

        /// <summary>uri: "grpc://host:port", "grpcs://" with TLS, "ws://host:port" (WebSocket), "wss://",
        /// "usb:SERIAL", "mqtt://broker/venue/probe", "mqtts://", or "replay:PATH", a recording of descriptors.
        /// Blocks, at most ConnectTimeout.</summary>
        public static Probe Connect(string uri, ProbeOptions options = null)
        {
            if (uri == null) throw new ArgumentNullException("uri");
            Native.CheckVersion();
            options = options ?? new ProbeOptions();
            var c = new Native.COptions
            {
                size = (uint)Marshal.SizeOf(typeof(Native.COptions)),
                history = options.History,
                maxAge = Ns(options.MaxAge),
                extrapolation = options.Extrapolation < TimeSpan.Zero ? -1 : Ns(options.Extrapolation),
                connectTimeout = Ns(options.ConnectTimeout),
                retryMin = Ns(options.RetryMin),
                retryMax = Ns(options.RetryMax),
                silenceLimit = Ns(options.SilenceLimit),
                plane = options.Plane ? 1 : 0
            };
            var bytes = Encoding.UTF8.GetBytes(uri);
            var texts = new List<GCHandle>();
            try
            {
                c.credentialsFolder = Pinned(options.CredentialsFolder, texts);
                c.mqttCaFile = Pinned(options.MqttCaFile, texts);
                c.mqttCertificateFile = Pinned(options.MqttCertificateFile, texts);
                c.mqttKeyFile = Pinned(options.MqttKeyFile, texts);
                c.mqttUser = Pinned(options.MqttUser, texts);
                c.mqttPassword = Pinned(options.MqttPassword, texts);
                Native.Check(Native.lw_probe_connect(bytes, Native.Size(bytes.Length), ref c, out var made));
                return new Probe(made);
            }
            finally
            {
                foreach (var text in texts) text.Free();
            }
        }

        /// <summary>Zero-terminated UTF-8, pinned until its handle is freed.</summary>
        private static IntPtr Pinned(string text, List<GCHandle> texts)
        {
            if (text == null) return IntPtr.Zero;
            texts.Add(GCHandle.Alloc(Encoding.UTF8.GetBytes(text + "\0"), GCHandleType.Pinned));
            return texts[texts.Count - 1].AddrOfPinnedObject();
        }

        public void Dispose() => handle.Dispose();

        /// <summary>This machine's clock, used by At and for host times.</summary>
        public static long NowNs => Native.lw_now_ns();

        /// <summary>The newest, into an existing object, for render loops. Validity.None if there is none.</summary>
        public void Latest(Lighting into) => Native.Check(Native.lw_probe_latest(handle, into.Handle));

        public Lighting Latest() => Lighting.Filled(into => Native.lw_probe_latest(handle, into));

        /// <summary>The newest in the axes of the room in which the probe is mounted; Validity.InvalidQuery if it is
        /// not Mounted.</summary>
        public Lighting LatestInWorld() => Lighting.Filled(into => Native.lw_probe_latest_in_world(handle, into));

        /// <summary>The lighting at a time of NowNs, interpolated between two descriptors.</summary>
        public Lighting At(long hostTimeNs) => Lighting.Filled(into => Native.lw_probe_at(handle, hostTimeNs, into));

        /// <summary>Waits for a newest descriptor with a sequence number other than `seen` (null: any).
        /// Status.Unavailable after `timeout`, FailedPrecondition if the recording has ended. Blocks.</summary>
        public Lighting WaitForNext(ulong? seen, TimeSpan timeout)
        {
            var made = new Lighting();
            var known = seen.HasValue ? new[] { seen.Value } : null;
            var end = NowNs + Ns(timeout);
            for (;;)
            {
                var left = end - NowNs;
                var wait = Math.Max(0, Math.Min(left, SliceNs));
                var status = Native.lw_probe_wait_for_next(handle, known, wait, made.Handle);
                if (status == (int)Status.Unavailable && left > SliceNs) continue;
                Native.Check(status);
                return made;
            }
        }

        /// <summary>Blocks briefly, as the following.</summary>
        public ProbeInfo Info =>
            Native.Filled(new ProbeInfo { size = (uint)Marshal.SizeOf(typeof(ProbeInfo)) },
                          (ref ProbeInfo info) => Native.lw_probe_get_info(handle, ref info));

        public LinkStats Stats =>
            Native.Filled(new LinkStats { size = (uint)Marshal.SizeOf(typeof(LinkStats)) },
                          (ref LinkStats stats) => Native.lw_probe_get_stats(handle, ref stats));

        public string Name => Text(0);
        public string Version => Text(1);
        public string Camera => Text(2);
        /// <summary>Last error of the link or of a rejected message; empty if there was none.</summary>
        public string LastError => Text(3);

        /// <summary>The current configuration: the probe's file with the changes of all clients. Blocks until the probe
        /// responds. FailedPrecondition for a recording, and if the probe's firmware is too old to report it.</summary>
        public EstimatorConfig EstimatorConfig() =>
            Native.Filled(Lightwell.EstimatorConfig.Sized(),
                          (ref EstimatorConfig config) => Native.lw_probe_get_estimator(handle, ref config));

        /// <summary>The active estimator. Blocks and fails as EstimatorConfig().</summary>
        public EstimatorKind EstimatorKind()
        {
            Native.Check(Native.lw_probe_get_estimator_kind(handle, out var kind));
            return (EstimatorKind)kind;
        }

        /// <summary>Sets the fields that are not null, for all clients of the probe, and leaves the others unchanged:
        /// ChangeEstimator(new EstimatorUpdate { Epsilon = 0.02 }). Blocks until the probe responds.</summary>
        public void ChangeEstimator(EstimatorUpdate update)
        {
            var config = Lightwell.EstimatorConfig.Sized();
            Native.Check(Native.lw_probe_change_estimator(handle, ref config, update.Fill(ref config)));
        }

        /// <summary>Replaces the whole configuration, including what other clients or the probe's file have set. Start
        /// with EstimatorConfig(), or use ChangeEstimator. Blocks until the probe responds.</summary>
        public void SetEstimator(EstimatorConfig config)
        {
            config.size = (uint)Marshal.SizeOf(typeof(EstimatorConfig));
            Native.Check(Native.lw_probe_set_estimator(handle, ref config));
        }

        /// <summary>Reports the reading of a lux meter beside the probe that faces `normal`; then units are absolute.
        /// Returns the factor that was applied. Blocks until the probe responds.</summary>
        public double ReportLux(double lux, Vec3 normal)
        {
            Native.Check(Native.lw_probe_report_lux(handle, lux, ref normal, out var factor));
            return factor;
        }

        private string Text(int kind) => Native.Text((m, c, l) => Native.lw_probe_text(handle, kind, m, c, l));

        private static long Ns(TimeSpan span) =>
            span.Ticks > long.MaxValue / 100 ? long.MaxValue / 100 : span.Ticks * 100;
    }

    internal sealed class LightingHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        private LightingHandle() : base(true) { }

        protected override bool ReleaseHandle()
        {
            Native.lw_lighting_release(handle);
            return true;
        }
    }

    internal sealed class ProbeHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        private ProbeHandle() : base(true) { }

        protected override bool ReleaseHandle()
        {
            Native.lw_probe_close(handle);
            return true;
        }
    }

    /// <summary>The functions of lightwell.h. Arrays of plain structs are pinned, not copied.</summary>
    internal static partial class Native
    {
        private const string Library = "lightwell";

        /// <summary>LW_ABI_VERSION of the header for which this file is written.</summary>
        private const uint AbiVersion = 0x00010006;

        internal static readonly uint SizeOfAnswer = (uint)Marshal.SizeOf(typeof(Answer));
        internal static readonly uint SizeOfLightingInfo = (uint)Marshal.SizeOf(typeof(LightingInfo));

        [StructLayout(LayoutKind.Sequential)]
        internal struct COptions
        {
            internal uint size;
            internal int history;
            internal long maxAge, extrapolation, connectTimeout, retryMin, retryMax, silenceLimit;
            internal IntPtr credentialsFolder, mqttCaFile, mqttCertificateFile, mqttKeyFile, mqttUser, mqttPassword;
            internal int plane, reserved;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct CEnvironment
        {
            internal uint size, levelCount;
            internal ulong sequence;
            internal long olderBy;
            internal Rotation rotation;
            internal uint key;
            internal int exponent;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 8)] internal uint[] edge;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 8)] internal float[] roughness;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct CConversionOptions
        {
            internal uint size;
            internal int residual;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 9)] internal float[] color;
        }

        internal delegate int FillStruct<T>(ref T value);

        /// <summary>`value`, with its size set, after a function of the C ABI has filled it.</summary>
        internal static T Filled<T>(T value, FillStruct<T> fill)
        {
            Check(fill(ref value));
            return value;
        }

        internal delegate int FillText(byte[] text, UIntPtr capacity, UIntPtr[] length);

        internal static UIntPtr Size(int n) => new UIntPtr((uint)n);

        internal static void CheckVersion()
        {
            var found = lw_abi_version();
            if (found >> 16 == AbiVersion >> 16 && found >= AbiVersion) return;
            throw new LightwellException(Status.FailedPrecondition,
                "liblightwell.so has the ABI 0x" + found.ToString("x8") + ", Lightwell.cs needs 0x" +
                AbiVersion.ToString("x8") + ": take both from one version of Lightwell");
        }

        internal static void Check(int status)
        {
            if (status == 0) return;
            var text = lw_last_error(out var length);
            var bytes = new byte[(int)length];
            Marshal.Copy(text, bytes, 0, bytes.Length);
            throw new LightwellException((Status)status, Encoding.UTF8.GetString(bytes));
        }

        /// <summary>Calls a function twice: for the length, then for the text.</summary>
        internal static string Text(FillText fill)
        {
            var length = new UIntPtr[1];
            Check(fill(null, UIntPtr.Zero, length));
            var bytes = new byte[(int)length[0] + 1];
            Check(fill(bytes, Size(bytes.Length), length));
            return Encoding.UTF8.GetString(bytes, 0, Array.IndexOf(bytes, (byte)0));
        }

        [DllImport(Library)] internal static extern uint lw_abi_version();
        [DllImport(Library)] internal static extern IntPtr lw_last_error(out UIntPtr length);
        [DllImport(Library)] internal static extern long lw_now_ns();

        [DllImport(Library)] internal static extern int lw_probe_connect(
            [In] byte[] uri, UIntPtr length, ref COptions options, out ProbeHandle made);
        [DllImport(Library)] internal static extern void lw_probe_close(IntPtr probe);
        [DllImport(Library)] internal static extern int lw_probe_latest(ProbeHandle probe, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_latest_in_world(
            ProbeHandle probe, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_at(
            ProbeHandle probe, long hostTime, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_wait_for_next(
            ProbeHandle probe, [In] ulong[] seen, long timeout, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_get_info(ProbeHandle probe, ref ProbeInfo info);
        [DllImport(Library)] internal static extern int lw_probe_get_stats(ProbeHandle probe, ref LinkStats stats);
        [DllImport(Library)] internal static extern int lw_probe_text(
            ProbeHandle probe, int kind, [Out] byte[] text, UIntPtr capacity, [Out] UIntPtr[] length);
        [DllImport(Library)] internal static extern int lw_estimator_config_defaults(ref EstimatorConfig config);
        [DllImport(Library)] internal static extern int lw_probe_get_estimator(
            ProbeHandle probe, ref EstimatorConfig config);
        [DllImport(Library)] internal static extern int lw_probe_get_estimator_kind(ProbeHandle probe, out int kind);
        [DllImport(Library)] internal static extern int lw_probe_change_estimator(
            ProbeHandle probe, ref EstimatorConfig config, ulong fields);
        [DllImport(Library)] internal static extern int lw_probe_set_estimator(
            ProbeHandle probe, ref EstimatorConfig config);
        [DllImport(Library)] internal static extern int lw_probe_report_lux(
            ProbeHandle probe, double lux, ref Vec3 normal, out double factor);

        [DllImport(Library)] internal static extern int lw_lighting_create(out LightingHandle made);
        [DllImport(Library)] internal static extern void lw_lighting_release(IntPtr lighting);
        [DllImport(Library)] internal static extern int lw_lighting_copy(LightingHandle lighting, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_decode(
            [In] byte[] bytes, UIntPtr length, long age, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_rotated(
            LightingHandle lighting, ref Rotation q, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_in_world(
            LightingHandle lighting, [In] double[] position, ref Rotation q, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_get_info(
            LightingHandle lighting, ref LightingInfo info);
        [DllImport(Library)] internal static extern int lw_lighting_reason(
            LightingHandle lighting, [Out] byte[] text, UIntPtr capacity, [Out] UIntPtr[] length);
        [DllImport(Library)] internal static extern int lw_lighting_irradiance(
            LightingHandle lighting, ref Vec3 normal, ref Answer answer);
        [DllImport(Library)] internal static extern int lw_lighting_radiance(
            LightingHandle lighting, ref Vec3 direction, float roughness, ref Answer answer);
        [DllImport(Library)] internal static extern int lw_lighting_irradiance_batch(
            LightingHandle lighting, [In] Vec3[] normals, UIntPtr normalStride, UIntPtr count, [In, Out] Rgb[] values,
            UIntPtr valueStride, ref Answer about);
        [DllImport(Library)] internal static extern int lw_lighting_radiance_batch(
            LightingHandle lighting, [In] Vec3[] directions, UIntPtr directionStride, UIntPtr count, float roughness,
            [In, Out] Rgb[] values, UIntPtr valueStride, ref Answer about);
        [DllImport(Library)] internal static extern int lw_lighting_harmonics(
            LightingHandle lighting, int quantity, int maxBand, [In, Out] Rgb[] coefficients, out int band);
        [DllImport(Library)] internal static extern int lw_lighting_lights(
            LightingHandle lighting, [In, Out] LightSource[] lights, UIntPtr lightSize, UIntPtr capacity,
            out UIntPtr count);
        [DllImport(Library)] internal static extern int lw_lighting_to_unity(
            LightingHandle lighting, int pipeline, int mainLight, ref CConversionOptions options,
            ref UnityLighting unity);
        [DllImport(Library)] internal static extern int lw_lighting_environment(
            LightingHandle lighting, ref CEnvironment environment);
        [DllImport(Library)] internal static extern int lw_lighting_environment_radiance(
            LightingHandle lighting, uint level, [In, Out] Rgb[] rgb, UIntPtr capacity);
    }
}
