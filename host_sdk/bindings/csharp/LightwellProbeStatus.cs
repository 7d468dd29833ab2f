// The recording and the calibration of a probe for C#: the part of Lightwell.cs over probe_status.h. Needs
// Lightwell.cs.
using System;
using System.Runtime.InteropServices;
using System.Text;

namespace Lightwell
{
    /// <summary>The recording that runs on the probe, otherwise its last one.</summary>
    public sealed class Recording
    {
        public bool Running { get; internal set; }
        /// <summary>Name in the probe's folder; empty before the first recording.</summary>
        public string File { get; internal set; }
        public ulong Bytes { get; internal set; }
        public ulong Descriptors { get; internal set; }
        /// <summary>Messages that are missing in the file, because the disk was too slow.</summary>
        public ulong Lost { get; internal set; }
        /// <summary>Why it ended although no client stopped it; otherwise empty.</summary>
        public string EndReason { get; internal set; }
        /// <summary>Recordings that a fault or a limit ended, since the start of the daemon.</summary>
        public ulong Faults { get; internal set; }
    }

    /// <summary>What the calibration of a lens covers.</summary>
    public sealed class Lens
    {
        /// <summary>Of the picture that it is for, px.</summary>
        public uint Width { get; internal set; }
        public uint Height { get; internal set; }
        /// <summary>"kannala_brandt".</summary>
        public string Model { get; internal set; }
        /// <summary>Half the field of view.</summary>
        public double MaxAngleDeg { get; internal set; }
        /// <summary>"linear", "srgb", "table" or "gamma".</summary>
        public string Response { get; internal set; }
        /// <summary>It is corrected.</summary>
        public bool Vignetting { get; internal set; }
        /// <summary>Read or shot noise is known.</summary>
        public bool Noise { get; internal set; }
        /// <summary>Largest angle from the axis at which boards were seen; null without a report.</summary>
        public double? SeenDeg { get; internal set; }
        /// <summary>Largest uncertainty of a direction up to SeenDeg, three standard deviations; null without a report.
        /// </summary>
        public double? Direction3SigmaDeg { get; internal set; }
    }

    /// <summary>How a calibration was measured. Times: seconds since 1970 (UTC), 0: not known.</summary>
    public sealed class CalibrationReport
    {
        public long GeometryTimeS { get; internal set; }
        /// <summary>RMS of the residuals of both coordinates.</summary>
        public double RmsPx { get; internal set; }
        public uint Points { get; internal set; }
        public long PhotometryTimeS { get; internal set; }
    }

    /// <summary>What a probe's calibration covers, and how well.</summary>
    public sealed class Calibration
    {
        /// <summary>LightingInfo.CalibrationId.</summary>
        public uint Id { get; internal set; }
        /// <summary>Name without its folder; empty: the camera's own calibration.</summary>
        public string File { get; internal set; }
        /// <summary>cd/m² of a pixel value are known.</summary>
        public bool Absolute { get; internal set; }
        public Lens[] Lenses { get; internal set; }
        /// <summary>null: the file has none.</summary>
        public CalibrationReport Report { get; internal set; }
    }

    public sealed partial class Probe
    {
        /// <summary>More lenses than a rig has.</summary>
        private const int MaxLenses = 16;

        /// <summary>The recording that runs on the probe, otherwise its last one; null if the probe has no folder for
        /// recordings. At most about a second old. Blocks briefly.</summary>
        public Recording Recording =>
            Recorded((ref Native.CRecording r) => Native.lw_probe_get_recording(handle, ref r));

        /// <summary>Starts a recording of all descriptors by the probe, in the folder that its owner has configured;
        /// the file stays there. Blocks until the probe responds. FailedPrecondition: no such folder, or one runs
        /// already. ResourceExhausted: the owner's limits.</summary>
        public Recording StartRecording() =>
            Recorded((ref Native.CRecording r) => Native.lw_probe_start_recording(handle, ref r));

        /// <summary>Ends it. FailedPrecondition: none runs.</summary>
        public Recording StopRecording() =>
            Recorded((ref Native.CRecording r) => Native.lw_probe_stop_recording(handle, ref r));

        /// <summary>Blocks and fails as EstimatorConfig().</summary>
        public Calibration Calibration()
        {
            var size = Marshal.SizeOf(typeof(Native.CLens));
            var lenses = Marshal.AllocHGlobal(MaxLenses * size);
            try
            {
                var c = Native.Filled(
                    new Native.CCalibration { size = (uint)Marshal.SizeOf(typeof(Native.CCalibration)) },
                    (ref Native.CCalibration filled) => Native.lw_probe_get_calibration(
                        handle, ref filled, lenses, Native.Size(size), Native.Size(MaxLenses)));
                var hasReport = c.hasReport != 0;
                var made = new Calibration
                {
                    Id = c.id, File = Native.Chars(c.file), Absolute = c.absolute != 0,
                    Lenses = new Lens[Math.Min((int)c.lensCount, MaxLenses)],
                    Report = !hasReport ? null : new CalibrationReport
                    {
                        GeometryTimeS = c.geometryTime, RmsPx = c.rms, Points = c.points,
                        PhotometryTimeS = c.photometryTime
                    }
                };
                for (var k = 0; k < made.Lenses.Length; ++k)
                {
                    var l = (Native.CLens)Marshal.PtrToStructure(IntPtr.Add(lenses, k * size), typeof(Native.CLens));
                    made.Lenses[k] = new Lens
                    {
                        Width = l.width, Height = l.height, Model = Native.Chars(l.model), MaxAngleDeg = l.maxAngle,
                        Response = Native.Chars(l.response), Vignetting = l.vignetting != 0, Noise = l.noise != 0,
                        SeenDeg = hasReport ? l.seen : (double?)null,
                        Direction3SigmaDeg = hasReport ? l.direction : (double?)null
                    };
                }
                return made;
            }
            finally
            {
                Marshal.FreeHGlobal(lenses);
            }
        }

        private static Recording Recorded(Native.FillStruct<Native.CRecording> fill)
        {
            var sized = new Native.CRecording { size = (uint)Marshal.SizeOf(typeof(Native.CRecording)) };
            var r = Native.Filled(sized, fill);
            return r.available == 0 ? null : new Recording
            {
                Running = r.running != 0, File = Native.Chars(r.file), Bytes = r.bytes, Descriptors = r.descriptors,
                Lost = r.lost, EndReason = Native.Chars(r.endReason), Faults = r.faults
            };
        }
    }

    internal static partial class Native
    {
        [StructLayout(LayoutKind.Sequential)]
        internal struct CRecording
        {
            internal uint size;
            internal int available, running, reserved;
            internal ulong bytes, descriptors, lost, faults;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 256)] internal byte[] file;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 1024)] internal byte[] endReason;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct CCalibration
        {
            internal uint size, id;
            internal int absolute, hasReport;
            internal long geometryTime, photometryTime;
            internal double rms;
            internal uint points, lensCount;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 256)] internal byte[] file;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct CLens
        {
            internal uint size, width, height;
            internal int vignetting, noise, reserved;
            internal double maxAngle, seen, direction;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 32)] internal byte[] model;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 32)] internal byte[] response;
        }

        /// <summary>Zero-terminated UTF-8.</summary>
        internal static string Chars(byte[] text) => Encoding.UTF8.GetString(text, 0, Array.IndexOf(text, (byte)0));

        [DllImport(Library)] internal static extern int lw_probe_get_recording(
            ProbeHandle probe, ref CRecording recording);
        [DllImport(Library)] internal static extern int lw_probe_start_recording(
            ProbeHandle probe, ref CRecording recording);
        [DllImport(Library)] internal static extern int lw_probe_stop_recording(
            ProbeHandle probe, ref CRecording recording);
        [DllImport(Library)] internal static extern int lw_probe_get_calibration(
            ProbeHandle probe, ref CCalibration calibration, IntPtr lenses, UIntPtr lensSize, UIntPtr capacity);
    }
}
