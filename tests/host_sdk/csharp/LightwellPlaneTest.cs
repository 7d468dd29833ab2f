// LightwellPlanes.cs against the results of C++. Format of the files: answers/plane_answers.hpp.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using Lightwell;

internal static partial class LightwellTest
{
    private static byte[] Bytes(string hex) =>
        Enumerable.Range(0, hex.Length / 2).Select(k => Convert.ToByte(hex.Substring(2 * k, 2), 16)).ToArray();

    /// <summary>The name of a StatusCode: "data_loss" for Status.DataLoss.</summary>
    private static string StatusOf(Action action)
    {
        try
        {
            action();
        }
        catch (LightwellException e)
        {
            return string.Concat(e.Status.ToString().Select((c, k) =>
                char.IsUpper(c) ? (k == 0 ? "" : "_") + char.ToLowerInvariant(c) : c.ToString()));
        }
        return "ok";
    }

    private static void AnswerIs(PlaneAnswer answer, double[] row, int at, string what)
    {
        Check((int)answer.Validity == (int)row[at] && (uint)answer.Flags == (uint)row[at + 1],
              what + ": " + answer.Validity + " " + answer.Flags);
        Same(answer.Value, row, at + 2, what);
    }

    private static void InfoIs(PlaneInfo info, double[] v)
    {
        Check((int)info.Validity == (int)v[0] && info.Revision == (ulong)v[1] && info.MissingTiles == (ulong)v[2] &&
              info.Capture == (uint)v[3] && info.TextureEdge == (int)v[4], "validity, revision, sizes of a plane");
        if (info.Revision == 0) return;
        Check(info.Side == v[5] && info.TexturePosition.X == v[6] && info.TexturePosition.Y == v[7] &&
              info.TextureRotation == v[8] && info.TextureScale == v[9], "where the texture lies");
        Check((info.GlossAlpha ?? -1) == (float)v[10] && (info.F0 ?? -1) == (float)v[11], "gloss");
        Check((int)info.Units == (int)v[12], "units");
    }

    /// <summary>Draws with the camera of the line; `rgb` and `flags` get the pixels.</summary>
    private static void CameraIs(Plane plane, double[] v, out Rgb[] rgb, out byte[] flags)
    {
        var camera = new PlaneCamera
        {
            Width = (int)v[0], Height = (int)v[1], Fx = v[2], Fy = v[3], Cx = v[4], Cy = v[5],
            Position = new Vec3d(v[6], v[7], v[8]), Orientation = new Rotation(v[9], v[10], v[11], v[12])
        };
        rgb = new Rgb[camera.Width * camera.Height];
        flags = new byte[rgb.Length];
        var about = plane.Render(camera, (PlaneLayers)(int)v[13], rgb, flags);
        Check((int)about.Validity == (int)v[14] && (int)about.Flags == (int)v[15] && about.Pixels == (ulong)v[16] &&
              about.Flagged == (ulong)v[17], "a rendering");
    }

    private static bool Is(Vec3d got, double[] v, int at) => got.X == v[at] && got.Y == v[at + 1] && got.Z == v[at + 2];

    private static void PlanesAreThoseOfCpp(string folder)
    {
        Rgb[] picture = null, texture = null;
        byte[] pictureFlags = null, textureFlags = null;
        var words = new HashSet<string>();
        using (var reader = new PlaneReader())
        using (var plane = new Plane())
        {
            foreach (var line in File.ReadLines(Path.Combine(folder, "planes.txt")))
            {
                var parts = line.Split(' ');
                words.Add(parts[0]);
                if (parts[0] == "take")
                {
                    var at = long.Parse(parts[2]) * 1000000;
                    Check(StatusOf(() => reader.Take(Bytes(parts[3]), at)) == parts[1], "a message at " + parts[2]);
                    continue;
                }
                var v = parts.Skip(1).Select(p => double.Parse(p, CultureInfo.InvariantCulture)).ToArray();
                switch (parts[0])
                {
                    case "snapshot":
                        reader.Snapshot((long)v[0] * 1000000, plane);
                        textureFlags = new byte[plane.Info.TextureEdge * plane.Info.TextureEdge];
                        texture = plane.Texture(textureFlags);
                        break;
                    case "info":
                        InfoIs(plane.Info, v);
                        break;
                    case "pose":
                        var q = plane.Info.Orientation;
                        Check(plane.Info.PoseKnown && Is(plane.Info.Position, v, 0) && q.X == v[3] && q.Y == v[4] &&
                              q.Z == v[5] && q.W == v[6], "pose of a plane");
                        break;
                    case "radiance":
                        AnswerIs(plane.Radiance(new PlanePoint(v[1], v[2]), new Vec3d(v[3], v[4], v[5]),
                                                (PlaneLayers)(int)v[0]), v, 6, line);
                        break;
                    case "specular":
                        AnswerIs(plane.Specular(new Vec3d(v[0], v[1], v[2])), v, 3, line);
                        break;
                    case "texel":
                        var texel = texture[(int)v[0]];
                        Check(textureFlags[(int)v[0]] == (byte)v[1], "flags of a texel");
                        Check(Math.Abs(texel.R - v[2]) <= 1e-5 * v[2] && Math.Abs(texel.B - v[4]) <= 1e-5 * v[4], line);
                        break;
                    case "guidance":
                        var guidance = plane.Guidance;
                        Check((int)guidance.Progress == (int)v[0] && guidance.Seen == v[1] && guidance.Gap == v[2] &&
                              Is(guidance.Next, v, 3) && guidance.Circle == v[6], "guidance");
                        break;
                    case "probe":
                        Check(Is(plane.Guidance.Probe, v, 0), "direction of the probe");
                        break;
                    case "coverage":
                        var coverage = plane.Coverage;
                        var node = (int)v[0];
                        Check(coverage.Disc[2 * node] == (float)v[1] && coverage.Disc[2 * node + 1] == (float)v[2] &&
                              coverage.Seen[node] == (byte)v[3], "coverage");
                        break;
                    case "camera":
                        CameraIs(plane, v, out picture, out pictureFlags);
                        break;
                    case "pixel":
                        Check(pictureFlags[(int)v[0]] == (byte)v[1], "flags of a pixel");
                        Same(picture[(int)v[0]], v, 2, "a pixel");
                        break;
                    default:
                        Check(false, "a line of a known kind: " + parts[0]);
                        break;
                }
            }
        }
        Check(words.Count == 12, "all kinds of lines: " + string.Join(" ", words));
    }

    private static void DamagedPlanesAreRefusedAsInCpp(string folder)
    {
        var count = new Dictionary<string, int>();
        foreach (var line in File.ReadLines(Path.Combine(folder, "plane_mutants.txt")))
        {
            var parts = line.Split(' ');
            if (parts[0] != "mutant") continue;
            using (var reader = new PlaneReader())
            {
                var found = StatusOf(() => reader.Take(Bytes(parts[2]), 0));
                Check(found == parts[1], line);
                count.TryGetValue(found, out var before);
                count[found] = before + 1;
            }
        }
        Check(count.Count == 3 && count.Values.All(n => n > 300), "each kind was met often");
    }

    private static void AProbeHasThePlaneOfARecording(string folder)
    {
        var uri = "replay:" + folder + "/planes.lwrec?speed=0";
        using (var plane = new Plane())
        {
            using (var probe = Probe.Connect(uri, new ProbeOptions { Plane = true }))
            {
                PlayOut(probe);
                probe.Plane(plane);
            }
            Check(plane.Info.Capture == 8 && plane.Info.Validity == Validity.Valid, "the last plane of the recording");
            using (var copy = plane.Copy()) Check(copy.Info.Capture == 8, "a copy");
            using (var probe = Probe.Connect(uri))
            {
                PlayOut(probe);
                probe.Plane(plane);
            }
            Check(plane.Info.Validity == Validity.None && plane.Texture() == null, "planes only on request");
        }
    }
}
