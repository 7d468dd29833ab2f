// Lightwell.cs against the results of C++, and its own features: finalised handles, exceptions, no garbage.
// usage: LightwellTest.exe ANSWERS_FOLDER
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Threading;
using Lightwell;

internal static partial class LightwellTest
{
    private static readonly TimeSpan Patience = TimeSpan.FromSeconds(60);
    private static int checks, wrong;

    private static void Check(bool so, string what)
    {
        ++checks;
        if (so) return;
        ++wrong;
        if (wrong < 20) Console.Error.WriteLine("not so: " + what);
    }

    private static void Same(Rgb got, double[] row, int at, string what)
    {
        // Nine digits identify a float: bit-exact comparison.
        Check(got.R == (float)row[at] && got.G == (float)row[at + 1] && got.B == (float)row[at + 2], what);
    }

    private static Vec3 Vector(double[] row, int at)
    {
        return new Vec3((float)row[at], (float)row[at + 1], (float)row[at + 2]);
    }

    private static bool Throws(Status status, string words, Action action)
    {
        try
        {
            action();
        }
        catch (LightwellException e)
        {
            if (e.Status == status && e.Message.Contains(words)) return true;
            Console.Error.WriteLine("thrown instead: " + e.Status + " " + e.Message);
        }
        return false;
    }

    private static Lighting PlayOut(Probe probe)
    {
        Lighting light = null;
        ulong? seen = null;
        try
        {
            for (;;)
            {
                light = probe.WaitForNext(seen, Patience);
                seen = light.Info.Sequence;
            }
        }
        catch (LightwellException e)
        {
            Check(e.Status == Status.FailedPrecondition, "the recording ends: " + e.Message);
        }
        return light;
    }

    private static void Line(Lighting light, string word, double[] v, int lightNumber, int levelNumber)
    {
        switch (word)
        {
            case "irradiance":
                Same(light.Irradiance(Vector(v, 0)).Value, v, 3, word);
                break;
            case "radiance":
                var answer = light.Radiance(Vector(v, 0), (float)v[3]);
                Same(answer.Value, v, 4, word);
                Check(answer.LightsIncluded == v[3] > 0, "lights are included but at roughness 0");
                break;
            case "coefficient":
                var all = v[0] == 0 ? light.RadianceCoefficients(6) : light.IrradianceCoefficients(6);
                Same(all[(int)v[1]], v, 2, word);
                break;
            case "light":
                var l = light.Lights[lightNumber];
                Same(new Rgb(l.Direction.X, l.Direction.Y, l.Direction.Z), v, 0, "direction of a light");
                Same(l.Irradiance, v, 3, "irradiance of a light");
                var c = l.DirectionCovariance;
                Same(new Rgb(c.X, c.Y, c.Z), v, 7, "covariance of a light");
                Check(l.AngularRadius == (float)v[6] && l.Track == (uint)v[10], "radius and track of a light");
                Check(l.Distance == (float)v[11] && l.DistanceSigma == (float)v[12], "distance of a light");
                Check(l.Position.HasValue == v[11] > 0, "a position where there is a distance");
                var at = l.Position ?? new Vec3();
                // A position is computed as double and rounded to float here.
                for (var k = 0; k < 3; ++k)
                    Check(Math.Abs(new[] { at.X, at.Y, at.Z }[k] - v[13 + k]) <= 1e-6 * (1 + Math.Abs(v[13 + k])),
                          "position of a light");
                break;
            case "origin":
                OriginIsThatOfCpp(light, v);
                break;
            case "map":
                var map = light.Environment;
                Check((map == null ? 0 : map.Levels.Length) == (int)v[0], "levels of the map");
                break;
            case "level":
                var level = light.Environment.Levels[levelNumber];
                Check(level.Edge == (int)v[0] && level.Roughness == (float)v[1], "edge and roughness of a level");
                break;
            case "texel":
                Same(light.Environment.Levels[(int)v[0]].Radiance[(int)v[1]], v, 2, word);
                break;
            case "rotated":
                using (var turned = light.Rotated(new Rotation(v[0], v[1], v[2], v[3])))
                {
                    var e = turned.Irradiance(Vector(v, 4)).Value;
                    for (var k = 0; k < 3; ++k)
                        Check(Math.Abs(new[] { e.R, e.G, e.B }[k] - v[7 + k]) <= 1e-5 * (Math.Abs(v[7 + k]) + 1e4),
                              word);
                }
                break;
            default:
                Check(false, "a line of a known kind: " + word);
                break;
        }
    }

    private static void OriginIsThatOfCpp(Lighting light, double[] v)
    {
        var info = light.Info;
        var o = info.OriginOrientation;
        var got = new[] { info.OriginX, info.OriginY, info.OriginZ, o.X, o.Y, o.Z, o.W };
        // Nine digits of numbers below 1.
        for (var k = 0; k < 7; ++k) Check(Math.Abs(got[k] - v[k]) < 1e-8, "origin");
        using (var world = light.InWorld(1, 2, 3, new Rotation(0, 0, 0, 1)))
        {
            Check(Math.Abs(world.Info.OriginY - v[1] - 2) < 1e-8, "the origin moves with the world");
            var lamps = light.Lights;
            for (var k = 0; k < lamps.Length; ++k)
                Check(!lamps[k].Position.HasValue ||
                      Math.Abs(world.Lights[k].Position.Value.Z - lamps[k].Position.Value.Z - 3) < 1e-5, "and lamps");
        }
    }

    private static void NumbersAreThoseOfCpp(string folder)
    {
        Lighting light = null;
        int lightNumber = 0, levelNumber = 0, messages = 0;
        foreach (var line in File.ReadLines(folder + "/answers.txt"))
        {
            var words = line.Split(' ');
            if (words[0] == "message" || words[0] == "final")
            {
                if (light != null) light.Dispose();
                lightNumber = levelNumber = 0;
                ++messages;
                if (words[0] == "message")
                    light = Lighting.Decode(Enumerable.Range(0, words[1].Length / 2)
                        .Select(i => Convert.ToByte(words[1].Substring(2 * i, 2), 16)).ToArray());
                else
                    using (var probe = Probe.Connect("replay:" + folder + "/answers.lwrec?speed=0"))
                    {
                        PlayOut(probe).Dispose();
                        light = probe.Latest();
                        Check(probe.Name == "attic" && probe.Version == "0.1.0" && probe.LastError == "", "texts");
                        Check(probe.Info.Id == 7 && probe.Info.CalibrationId == 9, "ProbeInfo");
                        var stats = probe.Stats;
                        Check(stats.State == LinkState.Ended && stats.Received == 14 && stats.Maps == 2, "LinkStats");
                    }
                continue;
            }
            if (words[0] == "engine")
            {
                if (words[1] == "unity") UnityIsThatOfCpp(light, words.Skip(2).Select(Number).ToArray());
                continue;
            }
            var v = words.Skip(1).Select(Number).ToArray();
            if (words[0] == "info")
            {
                var info = light.Info;
                Check(info.Sequence == ulong.Parse(words[1], CultureInfo.InvariantCulture), "sequence");
                Check((int)info.Units == (int)v[1] && (uint)info.Flags == (uint)v[2], "units, flags");
                Check(info.Sequence != 105 || info.Flags == LightFlags.Unsure, "a flag by its name");
                Check(info.BoundTotal == (float)v[3] && info.Coverage == (float)v[6], "bound, coverage");
                Check(info.Band == (int)v[4] && info.LightCount == (uint)v[5], "band, lights");
                continue;
            }
            Line(light, words[0], v, lightNumber, levelNumber);
            if (words[0] == "light") ++lightNumber;
            if (words[0] == "level") ++levelNumber;
        }
        light.Dispose();
        Check(messages > 15 && checks > 2000, "many answers were compared");
    }

    private static void UnityIsThatOfCpp(Lighting light, double[] v)
    {
        var unity = light.ToUnity((UnityPipeline)(int)v[0], (MainLight)(int)v[1]);
        Check((int)unity.Validity == (int)v[2] && unity.Residual == (float)v[3], "validity and residual for Unity");
        for (var i = 0; i < 27; ++i) Check(unity.SphericalHarmonicsL2[i] == (float)v[4 + i], "harmonics for Unity");
        Same(new Rgb(unity.Forward.X, unity.Forward.Y, unity.Forward.Z), v, 31, "forward for Unity");
        Same(unity.Color, v, 34, "colour for Unity");
        Check(unity.Intensity == (float)v[37] && v.Length == 38, "intensity for Unity");
        var twice = light.ToUnity((UnityPipeline)(int)v[0], (MainLight)(int)v[1], 2);
        Check(twice.Intensity == 2 * unity.Intensity, "exposure for Unity");
    }

    private static double Number(string text)
    {
        return text == "inf" ? double.PositiveInfinity : double.Parse(text, CultureInfo.InvariantCulture);
    }

    private static void BatchesAndBadQuestions(string folder)
    {
        // At the original speed, because extrapolation by At needs descriptors as far back as it extrapolates.
        using (var probe = Probe.Connect("replay:" + folder + "/answers.lwrec"))
        using (var light = PlayOut(probe))
        {
            var normals = new[] { new Vec3(0, 1, 0), new Vec3(), new Vec3(float.NaN, 0, 1), new Vec3(-1, 2, 3) };
            var values = new Rgb[4];
            var about = light.Irradiance(normals, values);
            Check(about.Refused == 2 && about.Validity == Validity.InvalidQuery && about.Reason != "", "refused");
            Check(values[1].R == 0 && values[2].G == 0, "no question, no light");
            var one = light.Irradiance(normals[3]);
            // Batch queries sum in another order.
            Check(Math.Abs(one.Value.R - values[3].R) < 1e-5 * one.Value.R &&
                  Math.Abs(one.Value.B - values[3].B) < 1e-5 * one.Value.B && one.Validity == Validity.Valid, "batch");
            Check(one.Reason == "" && one.Units == Units.Absolute && one.ErrorBound > 0, "what an answer carries");
            Check(Math.Abs(one.Value.Luminance - (0.2126 * one.Value.R + 0.7152 * one.Value.G + 0.0722 * one.Value.B)) <
                  1e-2, "luminance");
            about = light.Radiance(normals, 0.35f, values);
            Check(about.Refused == 2 && values[3].R == light.Radiance(normals[3], 0.35f).Value.R, "batch of radiance");
            Check(light.Irradiance(new Vec3[0], new Rgb[0]).Refused == 0, "a batch of none");
            Check(light.Radiance(normals[0], float.NaN).Validity == Validity.InvalidQuery, "roughness NaN");
            using (var turned = light.Rotated(new Rotation(0, 0, 0, 0)))
                Check(turned.Info.Validity == Validity.InvalidQuery && turned.Reason != "", "no rotation");
            try
            {
                light.Irradiance(normals, new Rgb[3]);
                Check(false, "lengths that differ are refused");
            }
            catch (ArgumentException) { }
            using (var empty = new Lighting())
                Check(empty.Info.Validity == Validity.None && empty.Reason == "no descriptor has come yet" &&
                      empty.Lights.Length == 0 && empty.Environment == null, "empty says why");
            Check(probe.At(0).Info.Validity == Validity.BeforeHistory, "before history");
            Check(probe.At(Probe.NowNs).Info.Sequence == 113, "now");
            Check(probe.At(light.Info.MidExposureNs).Info.Derivation == Derivation.Measured, "measured");
            Check(probe.At(light.Info.MidExposureNs + 1000000).Info.Derivation == Derivation.Extrapolated, "moved on");
            Check(probe.At(light.Info.MidExposureNs + 500000000).Info.Derivation == Derivation.Held, "held");
        }
    }

    private static void FailuresSayHow(string folder)
    {
        var quick = new ProbeOptions { ConnectTimeout = TimeSpan.FromMilliseconds(200) };
        Check(Throws(Status.InvalidArgument, "grpc://", () => Probe.Connect("http://here")), "uri");
        Check(Throws(Status.NotFound, "nowhere/ä", () => Probe.Connect("replay:/nowhere/ä")), "missing file, in UTF-8");
        Check(Throws(Status.Unavailable, "lightwelld", () => Probe.Connect("grpc://127.0.0.1:1", quick)), "nobody");
        Check(Throws(Status.InvalidArgument, "history", () =>
            Probe.Connect("replay:" + folder + "/answers.lwrec", new ProbeOptions { History = 5000 })), "options");
        Check(Throws(Status.DataLoss, "descriptor", () => Lighting.Decode(new byte[] { 1, 2, 3 })), "no message");
        using (var probe = Probe.Connect("replay:" + folder + "/answers.lwrec?speed=0"))
        {
            var config = EstimatorConfig.Defaults();
            Check(config.Band == 6 && config.MaxLights == 16 && config.Epsilon == 0.01 && config.EnvironmentRate == 5,
                  "defaults");
            Check(Throws(Status.FailedPrecondition, "recording", () => probe.SetEstimator(config)), "set_estimator");
            Check(Throws(Status.FailedPrecondition, "recording", () => probe.EstimatorConfig()), "estimator");
            Check(Throws(Status.FailedPrecondition, "recording", () => probe.EstimatorKind()), "kind");
            AChangeNamesItsFields(probe);
            config.Band = 9;
            Check(Throws(Status.InvalidArgument, "band", () => probe.SetEstimator(config)), "band 9");
            Check(Throws(Status.FailedPrecondition, "recording", () => probe.ReportLux(9, new Vec3(0, 1, 0))), "lux");
            Check(Throws(Status.InvalidArgument, "normal", () => probe.ReportLux(9, new Vec3())), "no normal");
        }
        var closed = Probe.Connect("replay:" + folder + "/answers.lwrec?speed=0");
        closed.Dispose();
        closed.Dispose();
        try
        {
            closed.Latest();
            Check(false, "a disposed probe is refused");
        }
        catch (ObjectDisposedException) { }
    }

    private static void AChangeNamesItsFields(Probe probe)
    {
        Check(Throws(Status.FailedPrecondition, "recording",
            () => probe.ChangeEstimator(new EstimatorUpdate { Epsilon = 0.02, Band = 0 })), "a change");
        Check(Throws(Status.InvalidArgument, "no field", () => probe.ChangeEstimator(new EstimatorUpdate())), "none");
        var wrong = new Dictionary<string, EstimatorUpdate> {
            { "estimator.band", new EstimatorUpdate { Band = 9 } },
            { "max_lights", new EstimatorUpdate { MaxLights = 65 } },
            { "setting", new EstimatorUpdate { Setting = 257 } },
            { "unseen", new EstimatorUpdate { Unseen = 4 } },
            { "smoothing", new EstimatorUpdate { Smoothing = 3 } },
            { "environment_edge", new EstimatorUpdate { EnvironmentEdge = 7 } },
            { "light_threshold", new EstimatorUpdate { LightThreshold = 1 } },
            { "panorama.epsilon", new EstimatorUpdate { Epsilon = 2 } },
            { "radiance_epsilon", new EstimatorUpdate { RadianceEpsilon = 2 } },
            { "environment_rate", new EstimatorUpdate { EnvironmentRate = -1 } },
            { "marker.decimation", new EstimatorUpdate { MarkerDecimation = 9 } },
            { "marker.search_decimation", new EstimatorUpdate { MarkerSearchDecimation = 9 } },
            { "marker.max_faces", new EstimatorUpdate { MarkerMaxFaces = -1 } },
            { "specular.environment_edge", new EstimatorUpdate { SpecularEnvironmentEdge = 7 } },
            { "interleave", new EstimatorUpdate { Interleave = 17 } },
            { "max_bytes", new EstimatorUpdate { MaxBytes = 95 } }
        };
        foreach (var field in wrong)
            Check(Throws(Status.InvalidArgument, field.Key, () => probe.ChangeEstimator(field.Value)), field.Key);
    }

    private static void ALoopMakesNoGarbage(string folder)
    {
        using (var probe = Probe.Connect("replay:" + folder + "/answers.lwrec?speed=0"))
        using (var light = new Lighting())
        {
            PlayOut(probe).Dispose();
            var normals = new Vec3[4];
            for (var i = 0; i < normals.Length; ++i) normals[i] = new Vec3(i, 1, 3);
            var values = new Rgb[4];
            float sum = 0;
            Action frame = () =>
            {
                probe.Latest(light);
                light.Irradiance(normals, values);
                sum += light.Irradiance(normals[3]).Value.R + light.Info.BoundTotal;
            };
            frame();
            // The collector counts in blocks; garbage of many frames would fill thousands of them.
            var before = GC.CollectionCount(0);
            for (var i = 0; i < 200000; ++i) frame();
            Check(GC.CollectionCount(0) == before, "200,000 frames make nothing for the collector: " +
                  (GC.CollectionCount(0) - before) + " collections");
            Check(sum > 0, "the frames were lit");
        }
    }

    private static void ThreadsAndTheCollector(string folder)
    {
        int torn = 0, seen = 0;
        var probe = Probe.Connect("replay:" + folder + "/threads.lwrec");
        var threads = new List<Thread>();
        for (var i = 0; i < 3; ++i)
            threads.Add(new Thread(() =>
            {
                ulong last = 0;
                while (last < 3000 && probe.Stats.State != LinkState.Ended)
                {
                    // Never disposed: finalisers release them.
                    var light = probe.Latest();
                    var info = light.Info;
                    if (info.Validity == Validity.None) continue;
                    if (info.Sequence < last) Interlocked.Increment(ref torn);
                    if (Math.Abs(light.Lights[0].Irradiance.R / info.Sequence - 1) > 1e-3)
                        Interlocked.Increment(ref torn);
                    last = info.Sequence;
                    Interlocked.Increment(ref seen);
                }
            }));
        foreach (var thread in threads) thread.Start();
        foreach (var thread in threads) thread.Join();
        Check(torn == 0 && seen > 100, "whole and in order: " + torn + " of " + seen);
        probe.Dispose();
        GC.Collect();
        GC.WaitForPendingFinalizers();

        // Dispose while another thread waits: its call fails.
        var slow = Probe.Connect("replay:" + folder + "/threads.lwrec?speed=0.0001");
        var sequence = slow.WaitForNext(null, Patience).Info.Sequence;
        Exception caught = null;
        var waiting = new Thread(() =>
        {
            try { slow.WaitForNext(sequence, TimeSpan.FromHours(1)); }
            catch (Exception e) { caught = e; }
        });
        waiting.Start();
        Thread.Sleep(50);
        slow.Dispose();
        Check(waiting.Join(Patience) && caught is ObjectDisposedException, "a wait ends with its probe: " + caught);
    }

    private static int Main(string[] arguments)
    {
        if (arguments[0] == "--status") return ProbeStatus.Print(arguments[1]);
        NumbersAreThoseOfCpp(arguments[0]);
        BatchesAndBadQuestions(arguments[0]);
        FailuresSayHow(arguments[0]);
        ALoopMakesNoGarbage(arguments[0]);
        ThreadsAndTheCollector(arguments[0]);
        CubeMapsAreThoseOfCpp(arguments[0]);
        EstimatesAreThoseOfCpp(arguments[0]);
        PlanesAreThoseOfCpp(arguments[0]);
        DamagedPlanesAreRefusedAsInCpp(arguments[0]);
        AProbeHasThePlaneOfARecording(arguments[0]);
        Console.WriteLine(checks + " checks, " + wrong + " wrong");
        return wrong == 0 ? 0 : 1;
    }
}
