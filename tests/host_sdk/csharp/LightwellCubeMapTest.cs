// LightwellCubeMap.cs against the results of C++. Format of the file: answers/cube_answers.hpp.
using System;
using System.Globalization;
using System.IO;
using System.Linq;
using Lightwell;

internal static partial class LightwellTest
{
    private static void CubeMapsAreThoseOfCpp(string folder)
    {
        Lighting light = null;
        var maps = 0;
        foreach (var line in File.ReadLines(folder + "/cube_maps.txt"))
        {
            var words = line.Split(' ');
            if (words[0] == "message")
            {
                light = Lighting.Decode(Bytes(words[1]));
                continue;
            }
            var v = words.Skip(1).Select(w => double.Parse(w, CultureInfo.InvariantCulture)).ToArray();
            var options = new CubeMapOptions
            {
                Edge = (int)v[0], Format = CubeFormat.Rgba32F, Scale = (float)v[2],
                Lights = v[1] == 1 ? CubeLights.With : CubeLights.Without
            };
            var bytes = new byte[options.Bytes];
            var summary = light.CubeMap(options, bytes);
            var texels = new float[bytes.Length / 4];
            Buffer.BlockCopy(bytes, 0, texels, 0, bytes.Length);
            Check(summary.Clamped == (ulong)v[3] && summary.Validity == light.Info.Validity, "summary of a cube map");
            Check(v.Length == 4 + texels.Length / 4 * 3, "six faces");
            for (var i = 0; i < texels.Length; ++i)
                Check(texels[i] == (i % 4 == 3 ? 1 : (float)v[4 + i / 4 * 3 + i % 4]), "texel " + i + " of a cube map");
            ++maps;
        }
        Check(maps > 20, "there are cube maps");
        Check(new CubeMapOptions().Bytes == 6 * 64 * 64 * 8, "64 texels of half floats by default");
        Check(Throws(Status.InvalidArgument, "edge",
              () => light.CubeMap(new CubeMapOptions { Edge = 65 }, new byte[9])), "an edge of 65");
        Check(Throws(Status.InvalidArgument, "room for", () => light.CubeMap(new CubeMapOptions(), new byte[9])),
              "too few bytes");
        Check(Throws(Status.InvalidArgument, "room for", () => light.CubeMap(new CubeMapOptions(), null)), "no bytes");
    }
}
