// Prints the calibration of a probe, and what starting and stopping a recording gives:
// tests/e2e/bindings_status_test.cpp.
using System;
using System.Linq;
using Lightwell;

internal static class ProbeStatus
{
    private static string Flag(bool v) => v ? "1" : "0";
    private static string Micro(double v) => Math.Round(v * 1e6).ToString("F0");

    private static string Name(Status status) => string.Concat(status.ToString().Select((c, k) =>
        char.IsUpper(c) ? (k == 0 ? "" : "_") + char.ToLowerInvariant(c) : c.ToString()));

    private static void Try(string what, Action action)
    {
        try
        {
            action();
        }
        catch (LightwellException e)
        {
            Console.WriteLine(what + " " + Name(e.Status) + ": " + e.Message);
        }
    }

    private static void Write(string what, Recording r)
    {
        Console.WriteLine(r == null ? what + " none" : what + " " + Flag(r.Running) + " " + Flag(r.File != "") + " " +
                          Flag(r.Bytes > 0) + " " + r.Lost + " " + r.Faults + " [" + r.EndReason + "]");
    }

    internal static int Print(string uri)
    {
        using (var probe = Probe.Connect(uri))
        {
            Try("calibration", () =>
            {
                var c = probe.Calibration();
                Console.WriteLine("calibration " + c.Id + " " + Flag(c.Absolute) + " [" + c.File + "]");
                foreach (var l in c.Lenses)
                    Console.WriteLine("lens " + l.Width + " " + l.Height + " " + l.Model + " " + Micro(l.MaxAngleDeg) +
                        " " + l.Response + " " + Flag(l.Vignetting) + " " + Flag(l.Noise) + " " +
                        (l.SeenDeg.HasValue ? Micro(l.SeenDeg.Value) + " " + Micro(l.Direction3SigmaDeg.Value)
                                            : "none"));
                var r = c.Report;
                Console.WriteLine(r == null ? "report none" : "report " + r.GeometryTimeS + " " + Micro(r.RmsPx) + " " +
                                  r.Points + " " + r.PhotometryTimeS);
            });
            Write("before", probe.Recording);
            Try("start", () => Write("start", probe.StartRecording()));
            Try("again", () => Write("again", probe.StartRecording()));
            Try("stop", () => Write("stop", probe.StopRecording()));
            Try("stop2", () => Write("stop2", probe.StopRecording()));
        }
        return 0;
    }
}
