using System;
using System.Threading;
using Lightwell;
using Lightwell.Managed;

internal static class PrintLight
{
    private static void Main(string[] arguments)
    {
        using (var probe = ManagedProbe.Connect(arguments.Length > 0 ? arguments[0] : "ws://127.0.0.1:7443"))
        {
            while (probe.Latest().Validity == Validity.None) Thread.Sleep(10);
            var light = probe.Latest();
            var up = light.Irradiance(new Vec3(0, 1, 0));
            Console.WriteLine("{0}: irradiance from above {1:F3} {2:F3} {3:F3}, error at most {4:P1}", up.Validity,
                              up.Value.R, up.Value.G, up.Value.B, up.ErrorBound);
            foreach (var one in light.Descriptor.Lights)
                Console.WriteLine("light {0:F3} {1:F3} {2:F3}", one.Direction.X, one.Direction.Y, one.Direction.Z);
        }
    }
}
