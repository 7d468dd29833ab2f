// Light estimates of the managed client against the results of C++. Format: answers/estimate_answers.hpp.
using System;
using System.IO;
using System.Linq;
using Lightwell;
using Lightwell.Managed;

internal static partial class ManagedTest
{
    private static void EstimatesAreThoseOfCpp(string folder)
    {
        Lighting light = null;
        int estimates = 0, temperatures = 0, weights = 0;
        foreach (var line in File.ReadLines(folder + "/estimates.txt"))
        {
            var words = line.Split(' ');
            if (words[0] == "message")
            {
                light = new Lighting(Descriptor.Decode(Bytes(words[1])));
                continue;
            }
            var v = words.Skip(1).Select(Number).ToArray();
            if (words[0] == "estimate")
            {
                EstimateIsThatOfCpp(light, v);
                ++estimates;
            }
            else if (words[0] == "temperature")
            {
                var color = new Rgb((float)v[0], (float)v[1], (float)v[2]);
                var known = ColorTemperatures.TryGet(color, out var kelvin, out var duv);
                Check(known == v[3] > 0 && Math.Abs(kelvin - v[3]) <= 1e-9 * v[3], line);
                Check(Math.Abs(duv - v[4]) < 1e-12, line);
                ++temperatures;
            }
            else
            {
                Check(Math.Abs(Fade.Weight(v[0] / 1e6, v[1] / 1e6, v[2] / 1e6) - v[3]) < 1e-6, line);
                ++weights;
            }
        }
        Check(estimates > 500 && temperatures > 300 && weights > 70, "there are estimates");
        BadEstimateOptions(light);
    }

    private static void EstimateIsThatOfCpp(Lighting light, double[] v)
    {
        var e = light.Estimate((LightRequest)(uint)v[0], (float)v[1], (float)v[2]);
        var size = v[1] * Scale(light.Descriptor);
        Check((int)e.Validity == (int)v[3] && (uint)e.Available == (uint)v[4], "validity of an estimate");
        Near(e.AmbientLumens, v[5], size * 1000 / v[2], "ambient lumens");
        Near(e.MeanIlluminance, v[6], size, "illuminance");
        Near(e.ColorTemperature, v[7], v[7], "colour temperature");
        Near(e.Duv, v[8], 1, "Duv");
        Near(e.AmbientColor, v, 9, 1, "ambient colour");
        for (var i = 0; i < 9; ++i) Near(e.AmbientSphericalHarmonics[i], v, 12 + 3 * i, size, "harmonics");
        var d = e.MainLightDirection;
        Near(new Rgb(d.X, d.Y, d.Z), v, 39, 1, "direction of the main light");
        Near(e.MainLightColor, v, 42, 1, "colour of the main light");
        Near(e.MainLightLumens, v[45], size * 1000 / v[2], "lumens of the main light");
    }

    private static void BadEstimateOptions(Lighting light)
    {
        foreach (var bad in new[] { 0, -1, float.NaN, float.PositiveInfinity })
        {
            Check(light.Estimate(gain: bad).Validity == Validity.InvalidQuery, "gain " + bad);
            Check(light.Estimate(neutralIlluminance: bad).AmbientLumens == 0, "neutral illuminance " + bad);
        }
        Check(light.Estimate((LightRequest)32).Validity == Validity.InvalidQuery, "an unknown request");
        var none = new Lighting(null);
        Check(none.Estimate().Available == LightRequest.None && Fade.Weight(none) == 0, "no light, no values");
        Check(Fade.Weight(light) == 1, "light of now");
        foreach (var times in new[] { new[] { -1.0, 0 }, new[] { 0, double.NaN } })
        {
            var refused = false;
            try { Fade.Weight(0, times[0], times[1]); }
            catch (ArgumentOutOfRangeException) { refused = true; }
            Check(refused, "times that are not allowed");
        }
    }
}
