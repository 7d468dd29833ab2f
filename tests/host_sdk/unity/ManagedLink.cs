// The managed client in a process of its own, for tests/e2e/unity: prints what it has, a line of numbers at a time.
// usage: ManagedLink.exe link ADDRESS [TOKEN]      state, counters and light, until the standard input ends
//        ManagedLink.exe component ADDRESS TOKEN   what Samples~/ProbeLight sets in Unity
using System;
using System.Globalization;
using System.Reflection;
using System.Threading;
using Lightwell;
using Lightwell.Managed;
using UnityEngine;

internal static class ManagedLink
{
    private static volatile bool over;

    private static int Main(string[] arguments)
    {
        CultureInfo.DefaultThreadCurrentCulture = CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
        new Thread(() =>
        {
            while (Console.In.Read() >= 0) { }
            over = true;
        }) { IsBackground = true }.Start();
        return arguments[0] == "link" ? Link(arguments) : Component(arguments);
    }

    private static int Link(string[] arguments)
    {
        try
        {
            var options = new ManagedProbeOptions { Token = arguments.Length > 2 ? arguments[2] : null };
            var probe = ManagedProbe.Connect(arguments[1], options);
            Console.WriteLine("name " + probe.Name);
            while (!over)
            {
                var stats = probe.Stats;
                var light = probe.Latest();
                var up = light.Irradiance(new Vec3(0, 1, 0));
                Console.WriteLine("{0} {1} received {2} oversized {3} undecodable {4} replayed {5} reconnects {6} " +
                                  "up {7:F4} error {8}", stats.State, light.Validity, stats.Received, stats.Oversized,
                                  stats.Undecodable, stats.Replayed, stats.Reconnects, up.Value.R, stats.LastError);
                Thread.Sleep(20);
            }
            probe.Dispose();
            Console.WriteLine(probe.Completion.Wait(5000) ? "closed" : "still open");
            return 0;
        }
        catch (LightwellException e)
        {
            Console.WriteLine("failed " + e.Status + " " + e.Message);
            return 1;
        }
    }

    private static int Component(string[] arguments)
    {
        var component = new ProbeLight { address = arguments[1], token = arguments[2], exposure = 0.5f };
        Action<string> call = name => typeof(ProbeLight).GetMethod(name, BindingFlags.Instance | BindingFlags.NonPublic)
            .Invoke(component, null);
        call("OnEnable");
        while (!over)
        {
            call("Update");
            var forward = component.transform.forward;
            var sun = component.GetComponent<UnityEngine.Light>();
            Console.WriteLine("forward {0:F4} {1:F4} {2:F4} intensity {3:F4} ambient {4:F4}", forward.x, forward.y,
                              forward.z, sun.intensity, RenderSettings.ambientProbe[0, 0]);
            Thread.Sleep(20);
        }
        call("OnDisable");
        return 0;
    }
}
