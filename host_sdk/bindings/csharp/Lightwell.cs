// Lightwell for C# over the C ABI (lightwell.h), for Unity and other applications. Put this file, LightwellValues.cs
// and LightwellNative.cs, and of LightwellPlanes.cs, LightwellProbeStatus.cs, LightwellEstimate.cs and
// LightwellCubeMap.cs what is needed, into the project with liblightwell.so beside them (Unity: Assets/Plugins). C# 7.2
// and .NET Standard 2.0 are enough; there is no unsafe code. Directions and normals are in the probe's frame:
// right-handed, +X right, +Y up, -Z forward, metres; they need not be normalised. UNITY'S AXES DIFFER: Lighting.ToUnity
// returns values in Unity's axes, and a normal (x, y, z) of Unity is (x, y, -z) here. Colours are linear Rec. 709, D65:
// the luminance of irradiance is in lux and of radiance in cd/m² if Units are Absolute.
//
// A render loop creates one Lighting and calls probe.Latest(light) every frame: lock-free, without waiting or garbage.
// Any thread may call anything, but a Lighting may be filled only while no other thread uses it.
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;

namespace Lightwell
{
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
}
