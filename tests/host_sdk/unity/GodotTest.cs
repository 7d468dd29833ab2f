// examples/godot_light against closed forms and a real probe. usage: GodotTest.exe ANSWERS_FOLDER [ADDRESS]
using System;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Threading;
using Lightwell;
using Lightwell.Managed;
using Environment = Godot.Environment;

internal static class GodotTest
{
    private static int checks, wrong;

    private static void Check(bool so, string what)
    {
        ++checks;
        if (so) return;
        ++wrong;
        Console.Error.WriteLine("not so: " + what);
    }

    private static float[] PictureOf(ProbeLight node)
    {
        var material = (Godot.PanoramaSkyMaterial)node.Surroundings.Sky.SkyMaterial;
        var image = ((Godot.ImageTexture)material.Panorama).Shown;
        var values = new float[image.Data.Length / 4];
        Buffer.BlockCopy(image.Data, 0, values, 0, image.Data.Length);
        Check(image.Width == 32 && image.Height == 16 && values.Length == 3 * 32 * 16, "size of the sky");
        return values;
    }

    /// <summary>Of the message, as the daemon would send it.</summary>
    private static void TheSkyAndTheLightAreThoseOf(Descriptor descriptor)
    {
        var node = new ProbeLight { Surroundings = new Environment(), NeutralIlluminance = 500 };
        var e = new Lighting(descriptor).Estimate(neutralIlluminance: 500);
        node.Show(e, 1);
        var d = e.MainLightDirection;
        Check(node.Target.X == -d.X && node.Target.Y == -d.Y && node.Target.Z == -d.Z, "it shines away from the light");
        var whole = PictureOf(node);
        // What the picture and the light give to a surface above and below, against the irradiance of the queries.
        foreach (var up in new[] { 1, -1 })
        {
            double sum = 0;
            for (var row = 0; row < 16; ++row)
                for (var column = 0; column < 32; ++column)
                {
                    double theta0 = Math.PI * row / 16, theta1 = Math.PI * (row + 1) / 16;
                    var solidAngle = 2 * Math.PI / 32 * (Math.Cos(theta0) - Math.Cos(theta1));
                    var cosine = up * Math.Cos(Math.PI * (row + 0.5) / 16);
                    sum += solidAngle * Math.Max(0, cosine) * whole[3 * (32 * row + column) + 1];
                }
            var direct = node.LightEnergy * e.MainLightColor.G * Math.PI * Math.Max(0, up * d.Y);
            var expected = new Lighting(descriptor).Irradiance(new Vec3(0, up, 0)).Value.G * Math.PI / 500;
            // Texels of 11 degrees.
            Check(Math.Abs(sum + direct - expected) < 0.02 * expected,
                  "irradiance " + (sum + direct) + ", not " + expected);
        }
        node.Show(e, 0.5f);
        Check(Math.Abs(PictureOf(node)[0] - whole[0] / 2) < 1e-6 * whole[0], "half the sky");
        Check(node.Surroundings.AmbientLightSource == Environment.AmbientSource.Sky, "ambient light of the sky");
    }

    private static void TheNodeOf(string address)
    {
        var node = new ProbeLight { Address = address, Surroundings = new Environment(), Inside = true };
        node._EnterTree();
        for (var i = 0; i < 1000 && node.Surroundings.Sky == null; ++i)
        {
            node._Process(0.01);
            Thread.Sleep(10);
        }
        Check(node.Surroundings.Sky != null && PictureOf(node).Max() > 0, "the sky of a probe");
        Console.WriteLine("sky " + PictureOf(node).Max());
        var probe = (ManagedProbe)typeof(ProbeLight).GetField("probe", BindingFlags.Instance | BindingFlags.NonPublic)
            .GetValue(node);
        node._ExitTree();
        Check(probe.Completion.Wait(5000), "the connection is closed");
        node._Process(0.01);
    }

    private static int Main(string[] arguments)
    {
        // The scene of a bright surrounding with one light: sequence number 101.
        var lines = File.ReadAllLines(arguments[0] + "/answers.txt");
        var line = lines[Array.FindIndex(lines, l => l.StartsWith("info 101 ")) - 1];
        var hex = line.Substring(8);
        TheSkyAndTheLightAreThoseOf(Descriptor.Decode(Enumerable.Range(0, hex.Length / 2)
            .Select(i => Convert.ToByte(hex.Substring(2 * i, 2), 16)).ToArray()));
        if (arguments.Length > 1) TheNodeOf(arguments[1]);
        Console.WriteLine(checks + " checks, " + wrong + " wrong");
        return wrong == 0 ? 0 : 1;
    }
}
