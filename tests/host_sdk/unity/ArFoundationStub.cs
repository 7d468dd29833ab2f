// The part of AR Foundation 6 (UnityEngine.XR.ARSubsystems) and UnityEngine that Samples~/ArFoundation uses, with its
// signatures, so that the sample is compiled and run without Unity.
using System;

namespace UnityEngine
{
    public enum RuntimeInitializeLoadType { SubsystemRegistration = 4 }

    [AttributeUsage(AttributeTargets.Method)]
    public sealed class RuntimeInitializeOnLoadMethod : Attribute
    {
        public RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType type) { }
    }

    public struct Matrix4x4
    {
        public static Matrix4x4 identity => new Matrix4x4();
    }
}

namespace UnityEngine.XR.ARSubsystems
{
    [Flags]
    public enum Feature : ulong
    {
        None = 0, LightEstimationAmbientIntensity = 1 << 7, LightEstimationAmbientColor = 1 << 8,
        LightEstimationAmbientSphericalHarmonics = 1 << 9, LightEstimationMainLightDirection = 1 << 10,
        LightEstimationMainLightIntensity = 1 << 11
    }

    public enum TrackingState { None, Limited, Tracking }

    public struct XRTextureDescriptor { }

    public struct XRCameraParams { }

    [Flags]
    public enum XRCameraFrameProperties
    {
        Timestamp = 1 << 0, AverageBrightness = 1 << 1, AverageColorTemperature = 1 << 2, ColorCorrection = 1 << 3,
        AverageIntensityInLumens = 1 << 6, MainLightDirection = 1 << 9, MainLightColor = 1 << 10,
        MainLightIntensityLumens = 1 << 11, AmbientSphericalHarmonics = 1 << 12
    }

    public struct XRCameraFrame
    {
        public readonly long Timestamp;
        public readonly float Kelvin, Lumens, MainLumens;
        public readonly Color Correction, MainColor;
        public readonly Vector3 Direction;
        public readonly Rendering.SphericalHarmonicsL2 Harmonics;

        public XRCameraFrameProperties properties { get; }

        public XRCameraFrame(long timestamp, float averageBrightness, float averageColorTemperature,
            Color colorCorrection, Matrix4x4 projectionMatrix, Matrix4x4 displayMatrix, TrackingState trackingState,
            IntPtr nativePtr, XRCameraFrameProperties properties, float averageIntensityInLumens,
            double exposureDuration, float exposureOffset, float mainLightIntensityInLumens, Color mainLightColor,
            Vector3 mainLightDirection, Rendering.SphericalHarmonicsL2 ambientSphericalHarmonics,
            XRTextureDescriptor cameraGrain, float noiseIntensity)
        {
            Timestamp = timestamp;
            Kelvin = averageColorTemperature;
            Correction = colorCorrection;
            this.properties = properties;
            Lumens = averageIntensityInLumens;
            MainLumens = mainLightIntensityInLumens;
            MainColor = mainLightColor;
            Direction = mainLightDirection;
            Harmonics = ambientSphericalHarmonics;
        }
    }

    public class XRCameraSubsystem
    {
        public class Provider
        {
            public virtual bool permissionGranted => false;
            public virtual Feature currentLightEstimation => Feature.None;
            public virtual Feature requestedLightEstimation { get => Feature.None; set { } }
            public virtual void Start() { }
            public virtual void Stop() { }
            public virtual void Destroy() { }
            public virtual bool TryGetFrame(XRCameraParams cameraParams, out XRCameraFrame cameraFrame)
            {
                cameraFrame = default(XRCameraFrame);
                return false;
            }
        }
    }

    public class XRCameraSubsystemDescriptor
    {
        public static Cinfo Registered;

        public struct Cinfo
        {
            public string id { get; set; }
            public Type providerType { get; set; }
            public Type subsystemTypeOverride { get; set; }
            public bool supportsAverageColorTemperature { get; set; }
            public bool supportsAverageIntensityInLumens { get; set; }
            public bool supportsColorCorrection { get; set; }
            public bool supportsTimestamp { get; set; }
            public bool supportsWorldTrackingAmbientIntensityLightEstimation { get; set; }
            public bool supportsWorldTrackingHDRLightEstimation { get; set; }
        }

        public static void Register(Cinfo info) => Registered = info;
    }
}
