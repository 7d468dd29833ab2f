// The managed client (host_sdk/bindings/unity) against the results of C++: golden messages, a recording with changes of
// a map, damaged messages. usage: ManagedTest.exe ANSWERS_FOLDER
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using Lightwell;
using Lightwell.Managed;

internal static partial class ManagedTest
{
    /// <summary>Relative to the largest value that all light together can give.</summary>
    private const double Tolerance = 1e-6;
    private static int checks, wrong;
    private static double worst;

    private static void Check(bool so, string what)
    {
        ++checks;
        if (so) return;
        ++wrong;
        if (wrong < 20) Console.Error.WriteLine("not so: " + what);
    }

    private static double Number(string text) =>
        text == "inf" ? double.PositiveInfinity : double.Parse(text, CultureInfo.InvariantCulture);

    private static byte[] Bytes(string hex) => Enumerable.Range(0, hex.Length / 2)
        .Select(i => Convert.ToByte(hex.Substring(2 * i, 2), 16)).ToArray();

    private static Vec3 Vector(double[] v, int at) => new Vec3((float)v[at], (float)v[at + 1], (float)v[at + 2]);

    private static void Near(double got, double expected, double size, string what)
    {
        var error = Math.Abs(got - expected) / (size > 0 ? size : 1);
        worst = Math.Max(worst, error);
        Check(error <= Tolerance, what + ": " + got + " is not " + expected);
    }

    private static void Near(Rgb got, double[] v, int at, double size, string what)
    {
        Near(got.R, v[at], size, what);
        Near(got.G, v[at + 1], size, what);
        Near(got.B, v[at + 2], size, what);
    }

    /// <summary>Nine digits identify a float: bit-exact comparison.</summary>
    private static void Same(float got, double expected, string what) =>
        Check(got == (float)expected, what + ": " + got + " is not " + expected);

    private static void Same(Rgb got, double[] v, int at, string what)
    {
        Same(got.R, v[at], what);
        Same(got.G, v[at + 1], what);
        Same(got.B, v[at + 2], what);
    }

    /// <summary>What all coefficients and lights could add up to at most.</summary>
    private static double Scale(Descriptor d)
    {
        Func<Rgb, double> most = c => Math.Max(Math.Abs(c.R), Math.Max(Math.Abs(c.G), Math.Abs(c.B)));
        return d.Radiance.Sum(most) + d.Lights.Sum(light => most(light.Irradiance));
    }

    private static int unityCompared, radianceCompared, texelsCompared;

    private static void Line(Lighting light, string word, string name, double[] v, int lightNumber, int levelNumber)
    {
        var d = light.Descriptor;
        var size = Scale(d);
        switch (word)
        {
            case "info":
                Check((double)d.Sequence == v[0] && (int)d.Units == (int)v[1] && (uint)d.Flags == (uint)v[2], "info");
                Same(d.ErrorBound, v[3], "bound");
                Check(d.Band == (int)v[4] && d.Lights.Length == (int)v[5], "band and number of lights");
                Same(d.Coverage, v[6], "coverage");
                break;
            case "irradiance":
                Near(light.Irradiance(Vector(v, 0)).Value, v, 3, size, word);
                break;
            case "radiance":
                var answer = light.Radiance(Vector(v, 0), (float)v[3]);
                // A narrow lobe shows a light magnified: relative to the answer, too.
                Near(answer.Value, v, 4, Math.Max(size, Math.Max(v[4], Math.Max(v[5], v[6]))), word);
                Check(answer.LightsIncluded == v[3] > 0, "lights are included but at roughness 0");
                ++radianceCompared;
                break;
            case "coefficient":
                if (v[0] == 0 && (int)v[1] < d.Radiance.Length) Same(d.Radiance[(int)v[1]], v, 2, word);
                break;
            case "light":
                LightIsThatOfCpp(d.Lights[lightNumber], v);
                break;
            case "origin":
                var o = d.OriginOrientation;
                var got = new[] { d.OriginX, d.OriginY, d.OriginZ, o.X, o.Y, o.Z, o.W };
                for (var k = 0; k < 7; ++k) Check(Math.Abs(got[k] - v[k]) < 1e-8, word);
                break;
            case "map":
                Check((light.Environment == null ? 0 : light.Environment.LevelCount) == (int)v[0], "levels of the map");
                break;
            case "level":
                var level = light.Environment.Level(levelNumber);
                Check(level.Edge == (int)v[0], "edge of a level");
                Same(level.Roughness, v[1], "roughness of a level");
                break;
            case "texel":
                Same(light.Environment.Level((int)v[0]).Radiance[(int)v[1]], v, 2, word);
                ++texelsCompared;
                break;
            case "engine":
                if (name == "unity") UnityIsThatOfCpp(light, v, size);
                break;
            case "rotated":
                break; // This client has no rotation.
            default:
                Check(false, "a line of a known kind: " + word);
                break;
        }
    }

    private static void LightIsThatOfCpp(DiscreteLight l, double[] v)
    {
        Same(new Rgb(l.Direction.X, l.Direction.Y, l.Direction.Z), v, 0, "direction of a light");
        Same(l.Irradiance, v, 3, "irradiance of a light");
        Same(l.AngularRadius, v[6], "radius of a light");
        var c = l.DirectionCovariance;
        Same(new Rgb(c.X, c.Y, c.Z), v, 7, "covariance of a light");
        Check(l.Track == (uint)v[10], "track of a light");
        Same(l.Distance, v[11], "distance of a light");
        Same(l.DistanceSigma, v[12], "sigma of the distance");
        Check(l.Position.HasValue == v[11] > 0, "a position where there is a distance");
        var at = l.Position ?? new Vec3();
        for (var k = 0; k < 3; ++k)
            Check(Math.Abs(new[] { at.X, at.Y, at.Z }[k] - v[13 + k]) <= 1e-6 * (1 + Math.Abs(v[13 + k])), "position");
    }

    private static void UnityIsThatOfCpp(Lighting light, double[] v, double size)
    {
        var unity = light.ToUnity((UnityPipeline)v[0], (MainLight)v[1]);
        Check(unity.Validity == (Validity)v[2], "validity for Unity");
        for (var k = 0; k < 27; ++k) Near(unity.SphericalHarmonicsL2[k], v[4 + k], size, "harmonics for Unity");
        var f = unity.Forward;
        Near(new Rgb(f.X, f.Y, f.Z), v, 31, 1, "direction for Unity");
        Near(unity.Color, v, 34, 1, "colour for Unity");
        Near(unity.Intensity, v[37], size, "intensity for Unity");
        ++unityCompared;
    }

    private static int NumbersAreThoseOfCpp(string folder)
    {
        Lighting light = null;
        int messages = 0, lightNumber = 0, levelNumber = 0;
        foreach (var line in File.ReadLines(Path.Combine(folder, "answers.txt")))
        {
            var words = line.Split(' ');
            if (words[0] == "message" || words[0] == "final")
            {
                if (words[0] == "message")
                {
                    var d = Descriptor.Decode(Bytes(words[1]));
                    var keeper = new EnvironmentKeeper();
                    keeper.Take(d);
                    light = new Lighting(d, 0, 250, keeper.MapFor(d));
                }
                else light = EndOfRecording(Path.Combine(folder, "answers.lwrec"));
                ++messages;
                lightNumber = levelNumber = 0;
                continue;
            }
            var named = words[0] == "engine";
            var numbers = words.Skip(named ? 2 : 1).Select(Number).ToArray();
            Line(light, words[0], named ? words[1] : "", numbers, lightNumber, levelNumber);
            if (words[0] == "light") ++lightNumber;
            if (words[0] == "level") ++levelNumber;
        }
        return messages;
    }

    /// <summary>The last lighting of a recording: magic, then records of size, checksum, time and payload; the first is
    /// a header.</summary>
    private static Lighting EndOfRecording(string path)
    {
        var file = File.ReadAllBytes(path);
        var keeper = new EnvironmentKeeper();
        var all = new List<Descriptor>();
        var record = 0;
        for (var at = 8; at < file.Length; ++record)
        {
            var size = BitConverter.ToInt32(file, at);
            if (record > 0)
            {
                all.Add(Descriptor.Decode(file.Skip(at + 16).Take(size).ToArray()));
                Check(keeper.Take(all.Last()), "a map that is understood");
            }
            at += 16 + size;
        }
        Check(all.Count == 14, "fourteen messages");
        Check(keeper.MapFor(all[0]) == null, "a map that is newer than the light does not apply");
        Check(!new EnvironmentKeeper().Take(all[9]), "changes without their whole map");
        return new Lighting(all.Last(), 0, 250, keeper.MapFor(all.Last()));
    }

    private static void DamagedMessagesAreRefusedAsInCpp(string folder)
    {
        Descriptor d = null;
        int accepted = 0, torn = 0, invalid = 0, newer = 0;
        foreach (var line in File.ReadLines(Path.Combine(folder, "mutants.txt")))
        {
            var words = line.Split(' ');
            if (words[0] != "mutant")
            {
                var v = words.Skip(1).Select(Number).ToArray();
                if (words[0] == "irradiance")
                    Near(new Lighting(d).Irradiance(Vector(v, 0)).Value, v, 3, Scale(d), "irradiance of a mutant");
                else if (words[0] == "flags") Check((uint)d.Flags == (uint)v[0], "flags of a mutant");
                else if (words[0] == "distances")
                    Check(d.Lights.Select(l => l.Distance).SequenceEqual(v.Select(x => (float)x)),
                        "distances of a mutant");
                else if (words[0] == "origin")
                    Check(Math.Abs(d.OriginY - v[1]) <= 1e-6 * Math.Max(1, Math.Abs(v[1])), "origin of a mutant");
                if (words[0] == "flags" && (d.Flags & LightFlags.Newer) != 0) ++newer;
                continue;
            }
            var found = "ok";
            try
            {
                d = Descriptor.Decode(Bytes(words.Length > 2 ? words[2] : ""));
            }
            catch (DecodeException e)
            {
                found = e.Status == Status.DataLoss ? "data_loss" : "invalid_argument";
            }
            Check(found == words[1], found + " is not " + words[1] + " of " + line);
            if (found == "ok") ++accepted;
            else if (found == "data_loss") ++torn;
            else ++invalid;
        }
        Console.WriteLine(accepted + " accepted, " + torn + " torn, " + invalid + " invalid");
        Check(accepted > 300 && torn > 300 && invalid > 300 && newer > 0, "each kind was met often");
    }

    private static void HostileSizes()
    {
        Func<byte[], string> code = bytes =>
        {
            try
            {
                Descriptor.Decode(bytes);
                return "ok";
            }
            catch (DecodeException e)
            {
                return e.Status.ToString();
            }
        };
        Check(code(new byte[65537]) == "DataLoss", "too long");
        Check(code(new byte[0]) == "InvalidArgument", "empty");
        Check(code(new byte[] { 0x2a, 0xff, 0xff, 0xff, 0xff, 0x07 }) == "DataLoss", "a part of 2 GiB");
        Check(code(new byte[] { 0x2a, 0xff, 0xff, 0xff, 0xff, 0x0f }) == "DataLoss", "a part of less than nothing");
        Check(code(Enumerable.Repeat((byte)0xa3, 60000).ToArray()) == "DataLoss", "groups without end");
        Check(code(Enumerable.Range(0, 65536).Select(i =>
            (byte)(i % 2 == 0 ? 0x32 : 0)).ToArray()) == "InvalidArgument",
              "32768 lights");
        var none = new Lighting(null);
        Check(none.Irradiance(new Vec3(0, 1, 0)).Validity == Validity.None && none.Radiance(new Vec3(0, 1, 0),
            0.5f).Value.R == 0
              && none.ToUnity(UnityPipeline.Universal).Intensity == 0, "no light without a descriptor");
    }

    private static void BadQuestionsAndAges(string folder)
    {
        var line = File.ReadLines(Path.Combine(folder, "answers.txt")).First(l => l.StartsWith("message "));
        var d = Descriptor.Decode(Bytes(line.Split(' ')[1]));
        var light = new Lighting(d, 251);
        Check(light.Validity == Validity.Stale && new Lighting(d, 249).Validity == Validity.Valid, "age");
        Check(new Lighting(d, double.NaN).Validity == Validity.Stale, "an age of NaN");
        foreach (var x in new[] { 0, float.NaN, float.PositiveInfinity })
        {
            var bad = light.Irradiance(new Vec3(x, 0, 0));
            Check(bad.Validity == Validity.InvalidQuery && bad.Value.R == 0, "a bad normal");
        }
        Check(light.Radiance(new Vec3(0, 1, 0), float.NaN).Validity == Validity.InvalidQuery, "a roughness of NaN");
        Check(light.ToUnity(UnityPipeline.Universal, MainLight.Apart, double.NaN).Validity == Validity.InvalidQuery,
            "exposure");
    }

    private static void ALoopMakesNoGarbage(string folder)
    {
        var line = File.ReadLines(Path.Combine(folder, "answers.txt")).First(l => l.StartsWith("message "));
        var light = new Lighting(Descriptor.Decode(Bytes(line.Split(' ')[1])));
        float sum = 0;
        light.Irradiance(new Vec3(0, 1, 0));
        var before = GC.CollectionCount(0);
        for (var i = 0; i < 1000000; ++i) sum += light.Irradiance(new Vec3(0, 1, i)).Value.R;
        Check(GC.CollectionCount(0) == before && sum > 0, "a million queries allocate nothing");
    }

    private static int Main(string[] arguments)
    {
        var messages = NumbersAreThoseOfCpp(arguments[0]);
        Check(messages > 15 && unityCompared == 4 * messages && radianceCompared > 100 && texelsCompared > 20,
              "compared: " + messages + " " + unityCompared + " " + radianceCompared + " " + texelsCompared);
        EstimatesAreThoseOfCpp(arguments[0]);
        DamagedMessagesAreRefusedAsInCpp(arguments[0]);
        HostileSizes();
        BadQuestionsAndAges(arguments[0]);
        ALoopMakesNoGarbage(arguments[0]);
        Console.WriteLine(checks + " checks, " + wrong + " wrong, largest difference " + worst.ToString("E1"));
        return wrong == 0 ? 0 : 1;
    }
}
