using System;
using System.Diagnostics;
using Lightwell;
using Lightwell.Managed;
using UnityEngine;
using UnityEngine.Rendering;
using UnityEngine.XR.ARSubsystems;

/// <summary>A camera subsystem of AR Foundation 6 that gives the light of a probe, and no picture: an ARCameraManager
/// then raises frameReceived with lightEstimation. For headsets whose own plug-in has no camera subsystem: an XR loader
/// creates this one by its id. The world has the probe's axes, with +Z where the probe's -Z is.</summary>
public sealed class LightwellCameraSubsystem : XRCameraSubsystem
{
    public const string Id = "Lightwell-Camera";

    /// <summary>Before the subsystem starts.</summary>
    public static string Address = "wss://probe.local", Token = "";
    /// <summary>Lux at which light is neutral: 1000 "lumens", and a white surface has the value 1.</summary>
    public static float NeutralIlluminance = 1000;
    /// <summary>Factor on all light, above 0.</summary>
    public static float Gain = 1;

    [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
    private static void Register() => XRCameraSubsystemDescriptor.Register(new XRCameraSubsystemDescriptor.Cinfo
    {
        id = Id, providerType = typeof(LightProvider), subsystemTypeOverride = typeof(LightwellCameraSubsystem),
        supportsAverageColorTemperature = true, supportsAverageIntensityInLumens = true, supportsColorCorrection = true,
        supportsTimestamp = true, supportsWorldTrackingAmbientIntensityLightEstimation = true,
        supportsWorldTrackingHDRLightEstimation = true
    });

    /// <summary>What an application requests of AR Foundation.</summary>
    public static LightRequest RequestOf(Feature features)
    {
        var request = LightRequest.None;
        Action<Feature, LightRequest> add = (feature, part) => request |= (features & feature) != 0 ? part : 0;
        add(Feature.LightEstimationAmbientIntensity, LightRequest.AmbientIntensity);
        add(Feature.LightEstimationAmbientColor, LightRequest.AmbientColor);
        add(Feature.LightEstimationAmbientSphericalHarmonics, LightRequest.AmbientSphericalHarmonics);
        add(Feature.LightEstimationMainLightDirection, LightRequest.MainLightDirection);
        add(Feature.LightEstimationMainLightIntensity, LightRequest.MainLightIntensity);
        return request;
    }

    /// <summary>The frame for a lighting, faded by its age; only the time if there is no light.</summary>
    public static XRCameraFrame FrameOf(Lighting light, LightRequest requested, long timestampNs)
    {
        var properties = XRCameraFrameProperties.Timestamp;
        var weight = Fade.Weight(light);
        var e = light.Estimate(weight > 0 ? requested : LightRequest.None, Math.Max(weight, 1e-6f) * Gain,
                               NeutralIlluminance);
        Func<LightRequest, XRCameraFrameProperties, bool> has = (part, flags) =>
        {
            var known = (e.Available & part) == part;
            if (known) properties |= flags;
            return known;
        };
        has(LightRequest.AmbientIntensity, XRCameraFrameProperties.AverageIntensityInLumens);
        has(LightRequest.AmbientColor, XRCameraFrameProperties.ColorCorrection |
            (e.ColorTemperature > 0 ? XRCameraFrameProperties.AverageColorTemperature : 0));
        has(LightRequest.MainLightDirection, XRCameraFrameProperties.MainLightDirection);
        has(LightRequest.MainLightIntensity, XRCameraFrameProperties.MainLightIntensityLumens |
            XRCameraFrameProperties.MainLightColor);
        var harmonics = new SphericalHarmonicsL2();
        if (has(LightRequest.AmbientSphericalHarmonics, XRCameraFrameProperties.AmbientSphericalHarmonics))
        {
            const LightRequest main = LightRequest.MainLightDirection | LightRequest.MainLightIntensity;
            // Without the main light only if the application draws it.
            var unity = light.ToUnity(UnityPipeline.Universal,
                                      (requested & main) == main ? MainLight.Apart : MainLight.InHarmonics,
                                      Math.PI / NeutralIlluminance * weight * Gain);
            for (var rgb = 0; rgb < 3; ++rgb)
                for (var i = 0; i < 9; ++i) harmonics[rgb, i] = unity.SphericalHarmonicsL2[9 * rgb + i];
        }
        // Unity's +Z is Lightwell's -Z; AR Foundation's direction is that in which the light shines.
        var shines = new Vector3(-e.MainLightDirection.X, -e.MainLightDirection.Y, e.MainLightDirection.Z);
        return new XRCameraFrame(timestampNs, 0, e.ColorTemperature, ColorOf(e.AmbientColor), Matrix4x4.identity,
            Matrix4x4.identity, TrackingState.Tracking, IntPtr.Zero, properties, e.AmbientLumens, 0, 0,
            e.MainLightLumens, ColorOf(e.MainLightColor), shines, harmonics, default(XRTextureDescriptor), 0);
    }

    /// <summary>Of frames: this machine's monotonic clock (Stopwatch), ns.</summary>
    public static long NowNs() => (long)(Stopwatch.GetTimestamp() * (1e9 / Stopwatch.Frequency));

    private static Color ColorOf(Rgb c) => new Color(c.R, c.G, c.B);

    private sealed class LightProvider : Provider
    {
        private ManagedProbe probe;
        private bool running;

        public override Feature requestedLightEstimation { get; set; }
        public override Feature currentLightEstimation =>
            probe == null ? Feature.None : requestedLightEstimation;
        public override bool permissionGranted => true;

        public override async void Start()
        {
            running = true;
            try
            {
                var made = await ManagedProbe.ConnectAsync(Address,
                    new ManagedProbeOptions { Token = Token == "" ? null : Token });
                if (running) probe = made;
                else made.Dispose();
            }
            catch (LightwellException e)
            {
                UnityEngine.Debug.LogError("Lightwell: " + e.Message, null);
            }
        }

        public override void Stop()
        {
            running = false;
            if (probe != null) probe.Dispose();
            probe = null;
        }

        public override void Destroy() => Stop();

        public override bool TryGetFrame(XRCameraParams cameraParams, out XRCameraFrame frame)
        {
            frame = default(XRCameraFrame);
            if (probe == null) return false;
            frame = FrameOf(probe.Latest(), RequestOf(requestedLightEstimation), NowNs());
            return true;
        }
    }
}
