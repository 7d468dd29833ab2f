// Types that Lightwell.cs and the managed client (bindings/unity) have in common: no native code. Conventions are those
// at the head of Lightwell.cs.
using System;
using System.Runtime.InteropServices;

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

    /// <summary>One octahedral level of the environment map: +Y at the centre, u from x, v from z, rows from the top,
    /// without the lights.</summary>
    public sealed class EnvironmentLevel
    {
        public int Edge { get; set; }
        /// <summary>Perceptual roughness.</summary>
        public float Roughness { get; set; }
        public Rgb[] Radiance { get; set; }
    }

    /// <summary>Unit of a Unity light's intensity: irradiance over pi (built-in pipeline, URP) or lux (HDRP).</summary>
    public enum UnityPipeline { Universal, HighDefinition }

    /// <summary>How the strongest light is represented.</summary>
    public enum MainLight { Apart, InHarmonics }

    /// <summary>What an application wants to know of the light, with the numbers of AR Foundation's
    /// LightEstimation.</summary>
    [Flags]
    public enum LightRequest : uint
    {
        None = 0, AmbientIntensity = 1, AmbientColor = 2, AmbientSphericalHarmonics = 4, MainLightDirection = 8,
        MainLightIntensity = 16, All = 31
    }
}
