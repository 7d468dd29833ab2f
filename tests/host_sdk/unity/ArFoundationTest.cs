// Samples~/ArFoundation against the values of the managed client. usage: ArFoundationTest.exe ANSWERS_FOLDER [ADDRESS]
using System;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Threading;
using Lightwell;
using Lightwell.Managed;
using UnityEngine.XR.ARSubsystems;

internal static class ArFoundationTest
{
    private static int checks, wrong;

    private static void Check(bool so, string what)
    {
        ++checks;
        if (so) return;
        ++wrong;
        Console.Error.WriteLine("not so: " + what);
    }

    private static bool Has(XRCameraFrame frame, XRCameraFrameProperties part) => (frame.properties & part) == part;

    private static bool Near(double a, double b) => Math.Abs(a - b) <= 1e-5 * Math.Max(1, Math.Abs(b));

    private static void AllOfTheLight(Lighting light)
    {
        var e = light.Estimate(neutralIlluminance: 1000);
        var frame = LightwellCameraSubsystem.FrameOf(light, LightRequest.All, 7);
        Check(frame.Timestamp == 7 && Near(frame.Lumens, e.AmbientLumens) && e.AmbientLumens > 0, "lumens");
        Check(frame.Kelvin == e.ColorTemperature && Near(frame.Correction.g, e.AmbientColor.G), "colour");
        Check(Has(frame, XRCameraFrameProperties.AverageColorTemperature) == e.ColorTemperature > 0, "temperature");
        var d = e.MainLightDirection;
        Check(frame.Direction.x == -d.X && frame.Direction.y == -d.Y && frame.Direction.z == d.Z, "direction");
        Check(Near(frame.MainLumens, e.MainLightLumens) && Near(frame.MainColor.r, e.MainLightColor.R), "main light");
        var unity = light.ToUnity(UnityPipeline.Universal, MainLight.Apart, Math.PI / 1000);
        for (var i = 0; i < 27; ++i)
            Check(Near(frame.Harmonics[i / 9, i % 9], unity.SphericalHarmonicsL2[i]), "harmonics");
        Check(Has(frame, XRCameraFrameProperties.AverageIntensityInLumens | XRCameraFrameProperties.MainLightDirection |
                         XRCameraFrameProperties.MainLightIntensityLumens | XRCameraFrameProperties.MainLightColor |
                         XRCameraFrameProperties.AmbientSphericalHarmonics), "all is included");
    }

    private static void WhatIsNotRequestedIsNotIncluded(Lighting light)
    {
        var request = LightwellCameraSubsystem.RequestOf(Feature.LightEstimationAmbientSphericalHarmonics);
        Check(request == LightRequest.AmbientSphericalHarmonics, "one feature");
        var frame = LightwellCameraSubsystem.FrameOf(light, request, 0);
        const XRCameraFrameProperties alone =
            XRCameraFrameProperties.Timestamp | XRCameraFrameProperties.AmbientSphericalHarmonics;
        Check(frame.properties == alone, "harmonics alone");
        var whole = light.ToUnity(UnityPipeline.Universal, MainLight.InHarmonics, Math.PI / 1000);
        Check(Near(frame.Harmonics[0, 0], whole.SphericalHarmonicsL2[0]), "they hold the main light, too");
        var all = Feature.LightEstimationAmbientIntensity | Feature.LightEstimationAmbientColor |
                  Feature.LightEstimationAmbientSphericalHarmonics | Feature.LightEstimationMainLightDirection |
                  Feature.LightEstimationMainLightIntensity;
        Check(LightwellCameraSubsystem.RequestOf(all) == LightRequest.All, "all features");
        Check(LightwellCameraSubsystem.RequestOf(Feature.None) == LightRequest.None, "no feature");
    }

    private static void OldLightFades(Descriptor descriptor)
    {
        var now = LightwellCameraSubsystem.FrameOf(new Lighting(descriptor), LightRequest.All, 0);
        var half = LightwellCameraSubsystem.FrameOf(new Lighting(descriptor, 500), LightRequest.All, 0);
        Check(Near(half.Lumens, now.Lumens / 2) && Near(half.Harmonics[0, 0], now.Harmonics[0, 0] / 2), "half");
        Check(half.Kelvin == now.Kelvin, "colours stay");
        foreach (var gone in new[] { new Lighting(descriptor, 5000), new Lighting(null) })
            Check(LightwellCameraSubsystem.FrameOf(gone, LightRequest.All, 0).properties ==
                  XRCameraFrameProperties.Timestamp, "no light");
    }

    /// <summary>The provider as AR Foundation calls it, with a real probe.</summary>
    private static void TheProviderOf(string address)
    {
        LightwellCameraSubsystem.Address = address;
        var provider = (XRCameraSubsystem.Provider)Activator.CreateInstance(
            XRCameraSubsystemDescriptor.Registered.providerType, true);
        provider.requestedLightEstimation = Feature.LightEstimationAmbientIntensity;
        XRCameraFrame frame;
        Check(!provider.TryGetFrame(new XRCameraParams(), out frame), "no frame before the start");
        var start = LightwellCameraSubsystem.NowNs();
        provider.Start();
        for (var i = 0; i < 1000; ++i)
        {
            if (provider.TryGetFrame(new XRCameraParams(), out frame) &&
                Has(frame, XRCameraFrameProperties.AverageIntensityInLumens)) break;
            Thread.Sleep(10);
        }
        Check(Has(frame, XRCameraFrameProperties.AverageIntensityInLumens) && frame.Lumens > 0, "light of a probe");
        var passed = (frame.Timestamp - start) * 1e-9;
        Check(start > 0 && passed >= 0 && passed < 30, "ns of the monotonic clock: " + passed + " s passed");
        Check(provider.currentLightEstimation == Feature.LightEstimationAmbientIntensity, "what is estimated");
        Console.WriteLine("lumens " + frame.Lumens);
        var probe = (ManagedProbe)provider.GetType().GetField("probe", BindingFlags.Instance | BindingFlags.NonPublic)
            .GetValue(provider);
        provider.Stop();
        Check(probe.Completion.Wait(5000), "the connection is closed");
        Check(!provider.TryGetFrame(new XRCameraParams(), out frame), "no frame after the end");
    }

    private static int Main(string[] arguments)
    {
        // The last message of the file has lights.
        var last = File.ReadLines(arguments[0] + "/estimates.txt").Last(line => line.StartsWith("message "));
        var hex = last.Substring(8);
        var descriptor = Descriptor.Decode(Enumerable.Range(0, hex.Length / 2)
            .Select(i => Convert.ToByte(hex.Substring(2 * i, 2), 16)).ToArray());
        AllOfTheLight(new Lighting(descriptor));
        WhatIsNotRequestedIsNotIncluded(new Lighting(descriptor));
        OldLightFades(descriptor);
        typeof(LightwellCameraSubsystem).GetMethod("Register", BindingFlags.Static | BindingFlags.NonPublic)
            .Invoke(null, null);
        var registered = XRCameraSubsystemDescriptor.Registered;
        Check(registered.id == LightwellCameraSubsystem.Id, "registered");
        Check(registered.supportsAverageIntensityInLumens, "what it supports");
        if (arguments.Length > 1) TheProviderOf(arguments[1]);
        Console.WriteLine(checks + " checks, " + wrong + " wrong");
        return wrong == 0 ? 0 : 1;
    }
}
