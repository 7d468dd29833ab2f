// Samples~/LightGrid with the files of make_light_grids: irradiance by Unity's formula against that of the field.
// usage: LightGridTest.exe FOLDER
using System;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Text.RegularExpressions;
using UnityEngine;
using UnityEngine.Rendering;

internal static class LightGridTest
{
    private static int checks, wrong;

    private static void Check(bool so, string what)
    {
        ++checks;
        if (so) return;
        ++wrong;
        Console.Error.WriteLine("not so: " + what);
    }

    /// <summary>SphericalHarmonicsL2.Evaluate: after the packing into unity_SHAr ... unity_SHC, SampleSH9 of
    /// SphericalHarmonics.hlsl (com.unity.render-pipelines.core).</summary>
    private static double Evaluate(SphericalHarmonicsL2 sh, int rgb, double x, double y, double z)
    {
        var linear = sh[rgb, 3] * x + sh[rgb, 1] * y + sh[rgb, 2] * z + (sh[rgb, 0] - sh[rgb, 6]);
        var quadratic = sh[rgb, 4] * x * y + sh[rgb, 5] * y * z + 3 * sh[rgb, 6] * z * z + sh[rgb, 7] * z * x;
        return linear + quadratic + sh[rgb, 8] * (x * x - y * y);
    }

    private static Vector3 Place(LightGrid grid, int i) =>
        new Vector3(grid.positions[3 * i], grid.positions[3 * i + 1], grid.positions[3 * i + 2]);

    private static bool Same(SphericalHarmonicsL2 a, Func<int, double> b) =>
        Enumerable.Range(0, 27).All(k => Math.Abs(a[k / 9, k % 9] - b(k)) < 1e-4 * (1 + Math.Abs(b(k))));

    /// <summary>A line of irradiances.txt: point, normal and irradiance in the field's axes, -Z forward.</summary>
    private static void TheIrradianceIsThatOfTheField(LightGrid grid, string file)
    {
        var lines = File.ReadAllLines(file)
            .Select(l => l.Split(' ').Select(n => double.Parse(n, CultureInfo.InvariantCulture)).ToArray());
        var points = 0;
        foreach (var point in lines.GroupBy(l => l[0]))
        {
            var i = (int)point.Key;
            double difference = 0, whole = 0;
            foreach (var l in point)
            {
                SphericalHarmonicsL2 sh;
                Check(grid.Sample(new Vector3((float)l[1], (float)l[2], -(float)l[3]), out sh), "light at " + l[0]);
                for (var rgb = 0; rgb < 3; ++rgb)
                {
                    var off = Math.PI * Evaluate(sh, rgb, l[4], l[5], -l[6]) - l[7 + rgb];
                    difference += off * off;
                    whole += l[7 + rgb] * l[7 + rgb];
                }
            }
            // 64 normals, other ones than those of the residual: within a third of it.
            var error = Math.Sqrt(difference / whole);
            Check(Math.Abs(error - grid.residual[i]) < 0.33 * grid.residual[i] + 1e-3,
                  "error " + error + " at " + i + ", residual " + grid.residual[i]);
            ++points;
        }
        Check(points == grid.validity.Sum() && points == 17, "irradiances of " + points + " points");
    }

    private static void BetweenPointsItIsTheirMean(LightGrid grid)
    {
        SphericalHarmonicsL2 sh;
        var a = Place(grid, 0);
        var between = new Vector3(a.x + grid.spacing[0] / 4, a.y, a.z);
        Check(grid.Sample(between, out sh), "between two points");
        Check(Same(sh, k => 0.75 * grid.sphericalHarmonicsL2[k] + 0.25 * grid.sphericalHarmonicsL2[27 + k]), "a mean");
        Check(grid.Sample(Place(grid, grid.validity.Length - 1), out sh), "the last corner");
        foreach (var out1 in new[] { -0.1f, float.NaN, float.PositiveInfinity, 1e30f })
            Check(!grid.Sample(new Vector3(a.x + out1, a.y, a.z), out sh) && sh[0, 0] == 0, "outside: " + out1);
    }

    private static void APointInALampIsNoLight(LightGrid grid)
    {
        var lamp = Array.IndexOf(grid.validity, 0);
        Check(lamp >= 0 && grid.validity.Count(v => v == 0) == 1 && (grid.flags[lamp] & 8) != 0, "one point in a lamp");
        SphericalHarmonicsL2 sh;
        Check(!grid.Sample(Place(grid, lamp), out sh) && sh[1, 0] == 0, "no light in it");
        var beside = Place(grid, lamp);
        beside.x += grid.spacing[0] / 2;
        Check(grid.Sample(beside, out sh), "light beside it");
        Check(Same(sh, k => grid.sphericalHarmonicsL2[27 * (lamp + 1) + k]), "of the other point alone");
    }

    private static void DamagedFilesAreRefused(string json)
    {
        var damaged = new[] {
            "", "{}", "[]", "nonsense", json.Substring(0, json.Length / 2), json.Replace("unity_grid", "other"),
            json.Replace("\"version\":1", "\"version\":2"), json.Replace("\"counts\":[", "\"counts\":[9,"),
            json.Replace("\"counts\":[", "\"counts\":[-1,"), json.Replace("\"counts\":[", "\"counts\":[2000000000,"),
            json.Replace("\"validity\":[", "\"validity\":[1,"), json.Replace("\"bound\":[", "\"unknown\":["),
            json.Replace("\"sphericalHarmonicsL2\":[", "\"sphericalHarmonicsL2\":[0,"),
            Regex.Replace(json, "(L2\":\\[)[^,]*", "${1}1e39"),
            Regex.Replace(json, "(\"origin\":\\[)[^,]*", "${1}1e39"),
            json.Replace("\"spacing\":[", "\"spacing\":[-"),
            json.Replace("\"lights\":[", "\"lights\":[{\"type\":\"Point\"}") };
        for (var i = 0; i < damaged.Length; ++i)
        {
            try
            {
                LightGrid.Parse(damaged[i]);
                Check(false, "damage " + i + " is refused");
            }
            catch (FormatException e)
            {
                Check(e.Message.Contains("grid"), e.Message);
                var own = new[] { "not finite", "not finite", "spacing", "a light" };
                var last = i - (damaged.Length - own.Length);
                Check(last < 0 || e.Message.Contains(own[Math.Max(last, 0)]), "damage " + i + ": " + e.Message);
            }
        }
    }

    private static void Enable(LightGridProbes component) =>
        typeof(LightGridProbes).GetMethod("OnEnable", BindingFlags.Instance | BindingFlags.NonPublic)
            .Invoke(component, null);

    private static void TheComponentSetsLightProbes(LightGrid grid, string json)
    {
        var component = new LightGridProbes { file = new TextAsset { text = json }, exposure = 0.5f };
        component.transform.position = new Vector3(10, 0, 0);
        LightmapSettings.lightProbes = null;
        Enable(component); // An error, and nothing else.
        var inside = Place(grid, 1);
        inside.x += 10;
        var baked = new SphericalHarmonicsL2();
        baked[0, 0] = 7;
        LightmapSettings.lightProbes = new LightProbes { positions = new[] { inside, new Vector3(99, 0, 0) },
                                                         bakedProbes = new[] { baked, baked } };
        Enable(component);
        var set = LightmapSettings.lightProbes.bakedProbes;
        Check(component.Lit == 1 && set[1][0, 0] == 7, "a probe outside keeps its light");
        Check(Same(set[0], k => 0.5 * grid.sphericalHarmonicsL2[27 + k]), "the light of the file times the exposure");
        Check(component.transform.childCount == 0, "no lights: they are in the harmonics");
    }

    private static void TheComponentAddsLights(string json)
    {
        var grid = LightGrid.Parse(json);
        Check(grid.lights.Length == 3, "two lamps and the sun");
        var component = new LightGridProbes { file = new TextAsset { text = json }, exposure = 2 };
        component.highDefinition = true;
        LightmapSettings.lightProbes = new LightProbes { positions = new Vector3[0],
                                                         bakedProbes = new SphericalHarmonicsL2[0] };
        Enable(component);
        Enable(component);
        Check(component.transform.childCount == 3, "each light once");
        for (var i = 0; i < 3; ++i)
        {
            var light = (Light)component.transform.children[i].gameObject.component;
            Check(light.type == (grid.lights[i].type == "Point" ? LightType.Point : LightType.Directional), "its type");
            var candela = 2 * Math.PI * grid.lights[i].intensity;
            Check(Math.Abs(light.intensity - candela) < 1e-4 * candela, "twice the candela");
            Check(component.transform.children[i].localPosition.z == grid.lights[i].position[2], "its place");
        }
    }

    private static int Main(string[] arguments)
    {
        var json = File.ReadAllText(arguments[0] + "/grid.json");
        var grid = LightGrid.Parse(json);
        TheIrradianceIsThatOfTheField(grid, arguments[0] + "/irradiances.txt");
        BetweenPointsItIsTheirMean(grid);
        APointInALampIsNoLight(grid);
        DamagedFilesAreRefused(json);
        TheComponentSetsLightProbes(grid, json);
        TheComponentAddsLights(File.ReadAllText(arguments[0] + "/apart.json"));
        Console.WriteLine(checks + " checks, " + wrong + " wrong");
        return wrong == 0 ? 0 : 1;
    }
}
