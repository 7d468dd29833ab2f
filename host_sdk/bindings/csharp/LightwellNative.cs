// The functions and handles of lightwell.h for Lightwell.cs.
using System;
using System.Runtime.InteropServices;
using System.Text;
using Microsoft.Win32.SafeHandles;

namespace Lightwell
{
    internal sealed class LightingHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        private LightingHandle() : base(true) { }

        protected override bool ReleaseHandle()
        {
            Native.lw_lighting_release(handle);
            return true;
        }
    }

    internal sealed class ProbeHandle : SafeHandleZeroOrMinusOneIsInvalid
    {
        private ProbeHandle() : base(true) { }

        protected override bool ReleaseHandle()
        {
            Native.lw_probe_close(handle);
            return true;
        }
    }

    /// <summary>The functions of lightwell.h. Arrays of plain structs are pinned, not copied.</summary>
    internal static partial class Native
    {
        private const string Library = "lightwell";

        /// <summary>LW_ABI_VERSION of the header for which this file is written.</summary>
        private const uint AbiVersion = 0x00010009;

        internal static readonly uint SizeOfAnswer = (uint)Marshal.SizeOf(typeof(Answer));
        internal static readonly uint SizeOfLightingInfo = (uint)Marshal.SizeOf(typeof(LightingInfo));

        [StructLayout(LayoutKind.Sequential)]
        internal struct COptions
        {
            internal uint size;
            internal int history;
            internal long maxAge, extrapolation, connectTimeout, retryMin, retryMax, silenceLimit;
            internal IntPtr credentialsFolder, mqttCaFile, mqttCertificateFile, mqttKeyFile, mqttUser, mqttPassword;
            internal int plane, reserved;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct CEnvironment
        {
            internal uint size, levelCount;
            internal ulong sequence;
            internal long olderBy;
            internal Rotation rotation;
            internal uint key;
            internal int exponent;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 8)] internal uint[] edge;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 8)] internal float[] roughness;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct CConversionOptions
        {
            internal uint size;
            internal int residual;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 9)] internal float[] color;
        }

        internal delegate int FillStruct<T>(ref T value);

        /// <summary>`value`, with its size set, after a function of the C ABI has filled it.</summary>
        internal static T Filled<T>(T value, FillStruct<T> fill)
        {
            Check(fill(ref value));
            return value;
        }

        internal delegate int FillText(byte[] text, UIntPtr capacity, UIntPtr[] length);

        internal static UIntPtr Size(int n) => new UIntPtr((uint)n);

        internal static void CheckVersion()
        {
            var found = lw_abi_version();
            if (found >> 16 == AbiVersion >> 16 && found >= AbiVersion) return;
            throw new LightwellException(Status.FailedPrecondition,
                "liblightwell.so has the ABI 0x" + found.ToString("x8") + ", Lightwell.cs needs 0x" +
                AbiVersion.ToString("x8") + ": take both from one version of Lightwell");
        }

        internal static void Check(int status)
        {
            if (status == 0) return;
            var text = lw_last_error(out var length);
            var bytes = new byte[(int)length];
            Marshal.Copy(text, bytes, 0, bytes.Length);
            throw new LightwellException((Status)status, Encoding.UTF8.GetString(bytes));
        }

        /// <summary>Calls a function twice: for the length, then for the text.</summary>
        internal static string Text(FillText fill)
        {
            var length = new UIntPtr[1];
            Check(fill(null, UIntPtr.Zero, length));
            var bytes = new byte[(int)length[0] + 1];
            Check(fill(bytes, Size(bytes.Length), length));
            return Encoding.UTF8.GetString(bytes, 0, Array.IndexOf(bytes, (byte)0));
        }

        [DllImport(Library)] internal static extern uint lw_abi_version();
        [DllImport(Library)] internal static extern IntPtr lw_last_error(out UIntPtr length);
        [DllImport(Library)] internal static extern long lw_now_ns();

        [DllImport(Library)] internal static extern int lw_probe_connect(
            [In] byte[] uri, UIntPtr length, ref COptions options, out ProbeHandle made);
        [DllImport(Library)] internal static extern void lw_probe_close(IntPtr probe);
        [DllImport(Library)] internal static extern int lw_probe_latest(ProbeHandle probe, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_latest_in_world(
            ProbeHandle probe, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_at(
            ProbeHandle probe, long hostTime, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_wait_for_next(
            ProbeHandle probe, [In] ulong[] seen, long timeout, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_probe_get_info(ProbeHandle probe, ref ProbeInfo info);
        [DllImport(Library)] internal static extern int lw_probe_get_stats(ProbeHandle probe, ref LinkStats stats);
        [DllImport(Library)] internal static extern int lw_probe_text(
            ProbeHandle probe, int kind, [Out] byte[] text, UIntPtr capacity, [Out] UIntPtr[] length);
        [DllImport(Library)] internal static extern int lw_estimator_config_defaults(ref EstimatorConfig config);
        [DllImport(Library)] internal static extern int lw_probe_get_estimator(
            ProbeHandle probe, ref EstimatorConfig config);
        [DllImport(Library)] internal static extern int lw_probe_get_estimator_kind(ProbeHandle probe, out int kind);
        [DllImport(Library)] internal static extern int lw_probe_change_estimator(
            ProbeHandle probe, ref EstimatorConfig config, ulong fields);
        [DllImport(Library)] internal static extern int lw_probe_set_estimator(
            ProbeHandle probe, ref EstimatorConfig config);
        [DllImport(Library)] internal static extern int lw_probe_report_lux(
            ProbeHandle probe, double lux, ref Vec3 normal, out double factor);

        [DllImport(Library)] internal static extern int lw_lighting_create(out LightingHandle made);
        [DllImport(Library)] internal static extern void lw_lighting_release(IntPtr lighting);
        [DllImport(Library)] internal static extern int lw_lighting_copy(LightingHandle lighting, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_decode(
            [In] byte[] bytes, UIntPtr length, long age, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_rotated(
            LightingHandle lighting, ref Rotation q, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_in_world(
            LightingHandle lighting, [In] double[] position, ref Rotation q, LightingHandle into);
        [DllImport(Library)] internal static extern int lw_lighting_get_info(
            LightingHandle lighting, ref LightingInfo info);
        [DllImport(Library)] internal static extern int lw_lighting_reason(
            LightingHandle lighting, [Out] byte[] text, UIntPtr capacity, [Out] UIntPtr[] length);
        [DllImport(Library)] internal static extern int lw_lighting_irradiance(
            LightingHandle lighting, ref Vec3 normal, ref Answer answer);
        [DllImport(Library)] internal static extern int lw_lighting_radiance(
            LightingHandle lighting, ref Vec3 direction, float roughness, ref Answer answer);
        [DllImport(Library)] internal static extern int lw_lighting_irradiance_batch(
            LightingHandle lighting, [In] Vec3[] normals, UIntPtr normalStride, UIntPtr count, [In, Out] Rgb[] values,
            UIntPtr valueStride, ref Answer about);
        [DllImport(Library)] internal static extern int lw_lighting_radiance_batch(
            LightingHandle lighting, [In] Vec3[] directions, UIntPtr directionStride, UIntPtr count, float roughness,
            [In, Out] Rgb[] values, UIntPtr valueStride, ref Answer about);
        [DllImport(Library)] internal static extern int lw_lighting_harmonics(
            LightingHandle lighting, int quantity, int maxBand, [In, Out] Rgb[] coefficients, out int band);
        [DllImport(Library)] internal static extern int lw_lighting_lights(
            LightingHandle lighting, [In, Out] LightSource[] lights, UIntPtr lightSize, UIntPtr capacity,
            out UIntPtr count);
        [DllImport(Library)] internal static extern int lw_lighting_to_unity(
            LightingHandle lighting, int pipeline, int mainLight, ref CConversionOptions options,
            ref UnityLighting unity);
        [DllImport(Library)] internal static extern int lw_lighting_environment(
            LightingHandle lighting, ref CEnvironment environment);
        [DllImport(Library)] internal static extern int lw_lighting_environment_radiance(
            LightingHandle lighting, uint level, [In, Out] Rgb[] rgb, UIntPtr capacity);
    }
}
