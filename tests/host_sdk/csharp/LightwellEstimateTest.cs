// LightwellEstimate.cs against the results of C++. Format of the file: answers/estimate_answers.hpp.
using System;
using System.Globalization;
using System.IO;
using System.Linq;
using Lightwell;

internal static partial class LightwellTest
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
                light = Lighting.Decode(Bytes(words[1]));
                continue;
            }
            var v = words.Skip(1).Select(w => double.Parse(w, CultureInfo.InvariantCulture)).ToArray();
            if (words[0] == "estimate")
            {
                EstimateIsThatOfCpp(light, v);
                ++estimates;
            }
            else if (words[0] == "temperature")
            {
                var color = new Rgb((float)v[0], (float)v[1], (float)v[2]);
                var known = LightEstimates.TryColorTemperature(color, out var kelvin, out var duv);
                // Mono's parser may be off by the last digit of a double.
                Check(known == v[3] > 0 && Math.Abs(kelvin - v[3]) <= 1e-12 * v[3], line);
                Check(Math.Abs(duv - v[4]) <= 1e-14, line);
                ++temperatures;
            }
            else
            {
                Check(LightEstimates.FadeWeight((long)v[0], (long)v[1], (long)v[2]) == (float)v[3], line);
                ++weights;
            }
        }
        Check(estimates > 500 && temperatures > 300 && weights > 70, "there are estimates");
        foreach (var bad in new[] { 0, -1, float.NaN, float.PositiveInfinity })
        {
            Check(Throws(Status.InvalidArgument, "gain", () => light.Estimate(gain: bad)), "gain " + bad);
            Check(Throws(Status.InvalidArgument, "neutral_illuminance",
                  () => light.Estimate(neutralIlluminance: bad)), "neutral illuminance " + bad);
        }
        Check(Throws(Status.InvalidArgument, "hold", () => light.FadeWeight(-1)), "a negative time");
        Check(light.FadeWeight() == 1 && new Lighting().FadeWeight() == 0, "weights of lightings");
        Check(new Lighting().Estimate().Available == LightRequest.None, "no light, no values");
    }

    private static void EstimateIsThatOfCpp(Lighting light, double[] v)
    {
        var e = light.Estimate((LightRequest)(uint)v[0], (float)v[1], (float)v[2]);
        Check((int)e.Validity == (int)v[3] && (uint)e.Available == (uint)v[4], "validity of an estimate");
        Check(e.AmbientLumens == (float)v[5] && e.MeanIlluminance == (float)v[6], "intensity");
        Check(e.ColorTemperature == (float)v[7] && e.Duv == (float)v[8], "colour temperature");
        Same(e.AmbientColor, v, 9, "ambient colour");
        for (var i = 0; i < 9; ++i) Same(e.AmbientSphericalHarmonics[i], v, 12 + 3 * i, "harmonics of an estimate");
        var d = e.MainLightDirection;
        Same(new Rgb(d.X, d.Y, d.Z), v, 39, "direction of the main light");
        Same(e.MainLightColor, v, 42, "colour of the main light");
        Check(e.MainLightLumens == (float)v[45] && v.Length == 46, "intensity of the main light");
    }
}
