// The light around a probe as a cube map for C#: the part of Lightwell.cs over cube_map.h. Needs Lightwell.cs.
using System;
using System.Runtime.InteropServices;

namespace Lightwell
{
    /// <summary>Of a texel: 8, 16 and 4 bytes.</summary>
    public enum CubeFormat { Rgba16F, Rgba32F, Rgb9E5 }

    /// <summary>Whether the discrete lights are in the map, as caps of uniform radiance.</summary>
    public enum CubeLights { With, Without }

    /// <summary>Zero in a field is its default.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct CubeMapOptions
    {
        internal uint size;
        /// <summary>Texels along an edge of a face, 1 to 64. Default: 64.</summary>
        public int Edge;
        public CubeFormat Format;
        public CubeLights Lights;
        /// <summary>Texel value = scale * radiance, above 0. Default: 1.</summary>
        public float Scale;
        private uint reserved;

        /// <summary>Of all six faces.</summary>
        public int Bytes =>
            6 * (Edge == 0 ? 64 : Edge) * (Edge == 0 ? 64 : Edge) *
            (Format == CubeFormat.Rgba16F ? 8 : Format == CubeFormat.Rgba32F ? 16 : 4);
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct CubeMapSummary
    {
        internal uint size;
        public Validity Validity { get; }
        public long AgeNs { get; }
        private IntPtr reason;
        /// <summary>As Answer.ErrorBound.</summary>
        public float ErrorBound { get; }
        public LightFlags Flags { get; }
        /// <summary>Texels with a channel above the largest value of the format, which they have instead.</summary>
        public ulong Clamped { get; }

        /// <summary>Why it is not valid; empty if it is. Allocates a string.</summary>
        public string Reason => Marshal.PtrToStringAnsi(reason) ?? "";
    }

    public sealed partial class Lighting
    {
        /// <summary>Writes options.Bytes bytes of texels: faces +X, -X, +Y, -Y, +Z, -Z with the orientation of OpenGL,
        /// Vulkan and WebGPU, rows from t = 0, r, g, b and 1 (Rgb9E5: one number). A texel is the mean radiance over
        /// its solid angle, times the scale. Axes are the probe's, not Unity's. Takes milliseconds, makes no garbage.
        /// InvalidArgument: an option, or too few bytes.</summary>
        public CubeMapSummary CubeMap(CubeMapOptions options, byte[] texels)
        {
            options.size = (uint)Marshal.SizeOf(typeof(CubeMapOptions));
            var summary = new CubeMapSummary { size = (uint)Marshal.SizeOf(typeof(CubeMapSummary)) };
            Native.Check(Native.lw_lighting_cube_map(Handle, ref options, texels,
                Native.Size(texels == null ? 0 : texels.Length), ref summary));
            return summary;
        }
    }

    internal static partial class Native
    {
        [DllImport(Library)] internal static extern int lw_lighting_cube_map(
            LightingHandle lighting, ref CubeMapOptions options, [In, Out] byte[] texels, UIntPtr capacity,
            ref CubeMapSummary summary);
    }
}
