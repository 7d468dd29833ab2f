// Captured planes for C#: the part of Lightwell.cs over plane_appearance.h. Needs Lightwell.cs.
// Points, eyes and directions are in the plane's frame: right-handed, m, origin in the middle of the captured square,
// +Z its normal on the viewer's side, +X right, +Y to the top of the texture. Colours are linear Rec. 709; luminance is
// in cd/m² if Units are Absolute.
//
// A render loop creates one Plane and calls probe.Plane(plane) every frame: lock-free, without waiting or garbage. A
// Plane may be filled only while no other thread uses it.
using System;
using System.Runtime.InteropServices;
using Microsoft.Win32.SafeHandles;

namespace Lightwell
{
    /// <summary>Which parts of the radiance are wanted: Diffuse is what is seen where a virtual object hides the mirror
    /// image of the room, Specular is the mirror image alone.</summary>
    public enum PlaneLayers { All, Diffuse, Specular }

    /// <summary>Why a radiance may be wrong: no frame saw the plane from that direction, or one of the four texels; or
    /// they were saturated, and the radiance is a lower bound.</summary>
    [Flags]
    public enum PlaneFlags : uint
    {
        UnseenDirection = 1 << 0, ClippedDirection = 1 << 1, UnseenTexel = 1 << 2, ClippedTexel = 1 << 3
    }

    /// <summary>Whether a capture can be ended.</summary>
    public enum CaptureProgress { KeepMoving, Enough }

    /// <summary>A point of the plane, m.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PlanePoint
    {
        public double X, Y;

        public PlanePoint(double x, double y) { X = x; Y = y; }
    }

    /// <summary>A position or a direction in the plane's frame.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Vec3d
    {
        public double X, Y, Z;

        public Vec3d(double x, double y, double z) { X = x; Y = y; Z = z; }
    }

    /// <summary>What holds for the whole plane.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PlaneInfo
    {
        internal uint size;
        public Validity Validity { get; }
        /// <summary>Since the newest message.</summary>
        public long AgeNs { get; }
        /// <summary>Of the newest update; 0: nothing was received, and all that follows is 0.</summary>
        public ulong Revision { get; }
        /// <summary>Tiles whose newest content has not arrived.</summary>
        public ulong MissingTiles { get; }
        public uint Capture { get; }
        /// <summary>Texels along a side; 0: the probe sends no texture.</summary>
        public int TextureEdge { get; }
        /// <summary>Of the newest frame that contributed, in the probe's clock.</summary>
        public long MidExposureNs { get; }
        /// <summary>Of the captured square, m.</summary>
        public double Side { get; }
        /// <summary>Of the texture's frame in the plane's: translation, rotation from +X to +Y (rad), scale.</summary>
        public PlanePoint TexturePosition { get; }
        public double TextureRotation { get; }
        public double TextureScale { get; }
        /// <summary>Of T_probe_plane, m; zero if it is not known.</summary>
        public Vec3d Position { get; }
        public Rotation Orientation { get; }
        private int poseKnown;
        public Units Units { get; }
        private float glossAlpha, f0;

        public bool PoseKnown => poseKnown != 0;
        /// <summary>GGX alpha; null: not known.</summary>
        public float? GlossAlpha => glossAlpha < 0 ? (float?)null : glossAlpha;
        /// <summary>Specular reflectance at normal incidence; null: not known.</summary>
        public float? F0 => f0 < 0 ? (float?)null : f0;
    }

    /// <summary>A radiance. Its value is zero if Validity is None or InvalidQuery.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PlaneAnswer
    {
        internal uint size;
        public Validity Validity { get; }
        public Rgb Value { get; }
        public PlaneFlags Flags { get; }
        public Units Units { get; }
        private uint reserved;
    }

    /// <summary>A pinhole camera: +X right, +Y up, -Z forward; the centre of the top left pixel is (0, 0).</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PlaneCamera
    {
        internal uint size;
        public int Width, Height;
        private uint reserved;
        /// <summary>Focal lengths and principal point, pixels.</summary>
        public double Fx, Fy, Cx, Cy;
        /// <summary>Of T_plane_camera, m.</summary>
        public Vec3d Position;
        /// <summary>Of T_plane_camera. All zero: the identity.</summary>
        public Rotation Orientation;
    }

    /// <summary>What Render wrote.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PlaneRendering
    {
        internal uint size;
        /// <summary>Of all pixels together: the worst.</summary>
        public Validity Validity { get; }
        public PlaneFlags Flags { get; }
        private uint reserved;
        /// <summary>Number of pixels that show the plane, and of these with a flag.</summary>
        public ulong Pixels { get; }
        public ulong Flagged { get; }
    }

    /// <summary>From how many directions the plane was seen, and where to move next. Directions are unit vectors from
    /// the plane to the viewer.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PlaneGuidance
    {
        internal uint size;
        public CaptureProgress Progress { get; }
        /// <summary>Share of the directions that count, 0 to 1.</summary>
        public double Seen { get; }
        /// <summary>Angle from Next to the nearest seen direction, rad.</summary>
        public double Gap { get; }
        /// <summary>Zero: all was seen.</summary>
        public Vec3d Next { get; }
        /// <summary>Where the newest frame that contributed was taken; zero: not known, or behind the plane.</summary>
        public Vec3d Probe { get; }
        /// <summary>Radius on the unit disc of the circle of directions that count.</summary>
        public double Circle { get; }
    }

    /// <summary>Directions towards the viewer from which frames were taken, for a drawing.</summary>
    public sealed class PlaneCoverage
    {
        /// <summary>Of each node, x and y on the unit disc (stereographic): 2 Seen.Length numbers.</summary>
        public float[] Disc { get; internal set; }
        /// <summary>1 where the node was seen.</summary>
        public byte[] Seen { get; internal set; }
    }

    /// <summary>One moment of a captured plane. It is not updated automatically: Probe.Plane fills it again.</summary>
    public sealed class Plane : IDisposable
    {
        internal readonly PlaneHandle Handle;

        /// <summary>Empty: Validity.None.</summary>
        public Plane()
        {
            Native.CheckVersion();
            Native.Check(Native.lw_plane_create(out var made));
            Handle = made;
        }

        public void Dispose() => Handle.Dispose();

        public Plane Copy()
        {
            var made = new Plane();
            Native.Check(Native.lw_plane_copy(Handle, made.Handle));
            return made;
        }

        public PlaneInfo Info =>
            Native.Filled(new PlaneInfo { size = (uint)Marshal.SizeOf(typeof(PlaneInfo)) },
                          (ref PlaneInfo info) => Native.lw_plane_get_info(Handle, ref info));

        /// <summary>Radiance from a point of the plane towards an eye (m, in front of the plane).</summary>
        public PlaneAnswer Radiance(PlanePoint point, Vec3d eye, PlaneLayers layers = PlaneLayers.All)
        {
            var answer = new PlaneAnswer { size = Native.SizeOfPlaneAnswer };
            Native.Check(Native.lw_plane_radiance(Handle, ref point, ref eye, (int)layers, ref answer));
            return answer;
        }

        /// <summary>The diffuse part at a point.</summary>
        public PlaneAnswer Diffuse(PlanePoint point)
        {
            var answer = new PlaneAnswer { size = Native.SizeOfPlaneAnswer };
            Native.Check(Native.lw_plane_diffuse(Handle, ref point, ref answer));
            return answer;
        }

        /// <summary>The specular part towards a viewer; need not be normalised.</summary>
        public PlaneAnswer Specular(Vec3d toViewer)
        {
            var answer = new PlaneAnswer { size = Native.SizeOfPlaneAnswer };
            Native.Check(Native.lw_plane_specular(Handle, ref toViewer, ref answer));
            return answer;
        }

        /// <summary>Draws the plane. rgb: Width Height elements, rows from the top; pixels that do not show the plane
        /// are left alone. flags: null, or as many elements for PlaneFlags. The arrays are not copied.</summary>
        public PlaneRendering Render(PlaneCamera camera, PlaneLayers layers, Rgb[] rgb, byte[] flags = null)
        {
            if (rgb == null) throw new ArgumentNullException("rgb");
            camera.size = (uint)Marshal.SizeOf(typeof(PlaneCamera));
            var about = new PlaneRendering { size = (uint)Marshal.SizeOf(typeof(PlaneRendering)) };
            Native.Check(Native.lw_plane_render(Handle, ref camera, (int)layers, rgb, Native.Size(3 * rgb.Length),
                                                flags, Native.Size(flags == null ? 0 : flags.Length), ref about));
            return about;
        }

        /// <summary>The diffuse radiance of each texel, rows from the top; null if the probe sends no texture. flags:
        /// as Render; TextureEdge² elements.</summary>
        public Rgb[] Texture(byte[] flags = null)
        {
            var info = Info;
            var edge = info.TextureEdge;
            if (edge == 0) return null;
            // Seen from straight above: pixel centres are the centres of texels.
            var camera = new PlaneCamera
            {
                Width = edge, Height = edge, Fx = edge, Fy = edge, Cx = 0.5 * (edge - 1), Cy = 0.5 * (edge - 1),
                Position = new Vec3d(info.TexturePosition.X, info.TexturePosition.Y, info.Side * info.TextureScale),
                Orientation = new Rotation(0, 0, Math.Sin(info.TextureRotation / 2), Math.Cos(info.TextureRotation / 2))
            };
            var texture = new Rgb[edge * edge];
            Render(camera, PlaneLayers.Diffuse, texture, flags);
            return texture;
        }

        public PlaneCoverage Coverage
        {
            get
            {
                Native.Check(Native.lw_plane_coverage(Handle, null, null, UIntPtr.Zero, out var count));
                var coverage = new PlaneCoverage { Disc = new float[2 * (int)count], Seen = new byte[(int)count] };
                Native.Check(Native.lw_plane_coverage(Handle, coverage.Disc, coverage.Seen, count, out count));
                return coverage;
            }
        }

        /// <summary>About 1 ms.</summary>
        public PlaneGuidance Guidance =>
            Native.Filled(new PlaneGuidance { size = (uint)Marshal.SizeOf(typeof(PlaneGuidance)) },
                          (ref PlaneGuidance guidance) =>
                              Native.lw_plane_get_guidance(Handle, IntPtr.Zero, ref guidance));
    }

    /// <summary>Collects the messages (PlaneUpdate) of one captured plane that were received without a Probe. Order,
    /// duplicates and losses do not matter. One thread at a time.</summary>
    public sealed class PlaneReader : IDisposable
    {
        private readonly PlaneReaderHandle handle;

        public PlaneReader()
        {
            Native.CheckVersion();
            Native.Check(Native.lw_plane_reader_create(out handle));
        }

        public void Dispose() => handle.Dispose();

        /// <summary>One message; receivedNs: by Probe.NowNs. Throws for one that is not valid or contradicts earlier
        /// ones; then nothing has changed.</summary>
        public void Take(byte[] message, long receivedNs)
        {
            if (message == null) throw new ArgumentNullException("message");
            Native.Check(Native.lw_plane_reader_take(handle, message, Native.Size(message.Length), receivedNs));
        }

        /// <summary>The plane as received so far.</summary>
        public void Snapshot(long nowNs, Plane into) =>
            Native.Check(Native.lw_plane_reader_snapshot(handle, nowNs, into.Handle));
    }

    public sealed partial class Probe
    {
        /// <summary>The newest complete state of the plane that the probe captures, into an existing object, for render
        /// loops. Validity.None without ProbeOptions.Plane, before the first, and for a recording without
        /// planes.</summary>
        public void Plane(Plane into) => Native.Check(Native.lw_probe_plane(handle, into.Handle));
    }

    internal sealed class PlaneHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        private PlaneHandle() : base(true) { }

        protected override bool ReleaseHandle()
        {
            Native.lw_plane_release(handle);
            return true;
        }
    }

    internal sealed class PlaneReaderHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        private PlaneReaderHandle() : base(true) { }

        protected override bool ReleaseHandle()
        {
            Native.lw_plane_reader_release(handle);
            return true;
        }
    }

    internal static partial class Native
    {
        internal static readonly uint SizeOfPlaneAnswer = (uint)Marshal.SizeOf(typeof(PlaneAnswer));

        [DllImport(Library)] internal static extern int lw_plane_create(out PlaneHandle made);
        [DllImport(Library)] internal static extern void lw_plane_release(IntPtr plane);
        [DllImport(Library)] internal static extern int lw_plane_copy(PlaneHandle plane, PlaneHandle into);
        [DllImport(Library)] internal static extern int lw_plane_get_info(PlaneHandle plane, ref PlaneInfo info);
        [DllImport(Library)] internal static extern int lw_plane_radiance(
            PlaneHandle plane, ref PlanePoint point, ref Vec3d eye, int layers, ref PlaneAnswer answer);
        [DllImport(Library)] internal static extern int lw_plane_diffuse(
            PlaneHandle plane, ref PlanePoint point, ref PlaneAnswer answer);
        [DllImport(Library)] internal static extern int lw_plane_specular(
            PlaneHandle plane, ref Vec3d toViewer, ref PlaneAnswer answer);
        [DllImport(Library)] internal static extern int lw_plane_render(
            PlaneHandle plane, ref PlaneCamera camera, int layers, [In, Out] Rgb[] rgb, UIntPtr rgbCount,
            [In, Out] byte[] flags, UIntPtr flagCount, ref PlaneRendering about);
        [DllImport(Library)] internal static extern int lw_plane_get_guidance(
            PlaneHandle plane, IntPtr options, ref PlaneGuidance guidance);
        [DllImport(Library)] internal static extern int lw_plane_coverage(
            PlaneHandle plane, [In, Out] float[] xy, [In, Out] byte[] seen, UIntPtr capacity, out UIntPtr count);

        [DllImport(Library)] internal static extern int lw_plane_reader_create(out PlaneReaderHandle made);
        [DllImport(Library)] internal static extern void lw_plane_reader_release(IntPtr reader);
        [DllImport(Library)] internal static extern int lw_plane_reader_take(
            PlaneReaderHandle reader, [In] byte[] message, UIntPtr length, long received);
        [DllImport(Library)] internal static extern int lw_plane_reader_snapshot(
            PlaneReaderHandle reader, long now, PlaneHandle into);
        [DllImport(Library)] internal static extern int lw_probe_plane(ProbeHandle probe, PlaneHandle into);
    }
}
