// Prefiltered environment map for reflections: octahedral levels, each prefiltered with one GGX lobe, without the
// lights.
using System;
using System.Collections.Generic;

namespace Lightwell.Managed
{
    /// <summary>A map of the wire: whole, or changes to a whole one (no levels).</summary>
    internal sealed class MapMessage
    {
        private const int MaxTexels = 8192, MaxLevels = 8, MaxEdge = 64, MaxLights = 64;

        internal readonly List<int> Edges = new List<int>();
        internal readonly List<float> Roughness = new List<float>();
        internal readonly List<uint> Runs = new List<uint>();
        internal uint Key, KeyIntervalMs;
        internal int Exponent;
        /// <summary>RGB9E5, red in the lowest bits: level by level, rows from the top; of changes, the changed
        /// ones.</summary>
        internal uint[] Texels;
        /// <summary>Tracks of the lights that texels show better than caps, ascending; and the first level with them:
        /// run lengths, alternately of texels as in the map and of those in LightTexels. Empty where there are none.
        /// </summary>
        internal readonly List<uint> LightTracks = new List<uint>(), LightRuns = new List<uint>();
        internal uint[] LightTexels;
        private byte[] bytes = new byte[0], lightBytes = new byte[0];
        private uint encoding;

        internal bool IsWhole => Edges.Count > 0;

        internal void Read(WireReader wire)
        {
            while (wire.Next(out var field))
                switch (field)
                {
                    case 1: wire.Fixed32(ref Key); break;
                    case 2: wire.UInt32(ref encoding); break;
                    case 3: if (wire.Message(out var part)) ReadLevel(part); break;
                    case 4: wire.SInt32(ref Exponent); break;
                    case 5: wire.UInt32(ref KeyIntervalMs); break;
                    case 6: wire.ByteString(ref bytes); break;
                    case 7: wire.UInt32s(Runs); break;
                    case 8: wire.UInt32s(LightTracks); break;
                    case 9: wire.UInt32s(LightRuns); break;
                    case 10: wire.ByteString(ref lightBytes); break;
                    default: wire.Skip(); break;
                }
        }

        private void ReadLevel(WireReader wire)
        {
            uint edge = 0;
            float roughness = 0;
            while (wire.Next(out var field))
                switch (field)
                {
                    case 1: wire.UInt32(ref edge); break;
                    case 2: wire.Float(ref roughness); break;
                    default: wire.Skip(); break;
                }
            Edges.Add(edge > 64 ? 0 : (int)edge);
            Roughness.Add(roughness);
        }

        /// <summary>Throws DecodeException if the map violates the specification.</summary>
        internal void Check()
        {
            if (encoding != 1) throw DecodeException.Invalid("environment.encoding is not known");
            Texels = Unpacked(bytes, "texels");
            LightTexels = Unpacked(lightBytes, "light_texels");
            if (Key == 0) throw DecodeException.Invalid("environment.key is 0");
            if (IsWhole) CheckWhole();
            else CheckChanges();
            bytes = lightBytes = null;
        }

        private static uint[] Unpacked(byte[] bytes, string name)
        {
            if (bytes.Length % 4 != 0)
                throw DecodeException.Invalid("environment." + name + ": the length is not a multiple of 4 bytes");
            var texels = new uint[bytes.Length / 4];
            Buffer.BlockCopy(bytes, 0, texels, 0, bytes.Length);
            return texels;
        }

        private void CheckWhole()
        {
            if (Edges.Count > MaxLevels) throw DecodeException.Invalid("environment.levels: there are more than 8");
            var count = 0;
            for (var k = 0; k < Edges.Count; ++k)
            {
                var edge = Edges[k];
                if (edge != 8 && edge != 16 && edge != 32 && edge != 64)
                    throw DecodeException.Invalid("environment.levels: an edge must be 8, 16, 32 or 64");
                if (!(Roughness[k] >= 0 && Roughness[k] <= 1))
                    throw DecodeException.Invalid("environment.levels: a roughness must be 0 to 1");
                if (k > 0 && edge > Edges[k - 1])
                    throw DecodeException.Invalid("environment.levels: an edge is larger than the one before");
                if (k > 0 && !(Roughness[k] > Roughness[k - 1]))
                    throw DecodeException.Invalid("environment.levels: roughness must increase");
                count += edge * edge;
            }
            if (count > MaxTexels) throw DecodeException.Invalid("environment.levels have more than 8192 texels");
            if (Texels.Length != count)
                throw DecodeException.Invalid("environment.texels: the length does not match the levels");
            Scaled.CheckExponent(Exponent, "environment.exponent");
            if (Runs.Count > 0) throw DecodeException.Invalid("environment.runs: not allowed in a whole map");
            CheckLights(Edges[0] * Edges[0]);
            if (Key != KeyOfContent())
                throw DecodeException.Invalid("environment.key does not match the content of the map");
        }

        private void CheckChanges()
        {
            if (Exponent != 0) throw DecodeException.Invalid("environment.exponent: not allowed in changes");
            if (KeyIntervalMs != 0)
                throw DecodeException.Invalid("environment.key_interval_ms: not allowed in changes");
            CheckRuns("runs", Runs, MaxTexels);
            if (Texels.Length != Changed(Runs))
                throw DecodeException.Invalid("environment.texels: the length does not match the runs");
            CheckLights(MaxEdge * MaxEdge);
        }

        /// <summary>`limit`: most texels over which the runs may reach.</summary>
        private static void CheckRuns(string name, List<uint> runs, int limit)
        {
            if (runs.Count % 2 != 0)
                throw DecodeException.Invalid("environment." + name + ": the number is odd; they are pairs");
            for (var k = 1; k < runs.Count; ++k)
                if (runs[k] == 0) throw DecodeException.Invalid("environment." + name + ": one is empty");
            if (Reach(runs) > limit)
                throw DecodeException.Invalid("environment." + name + ": they exceed the size of any map");
        }

        private void CheckLights(int limit)
        {
            if (LightTracks.Count > MaxLights)
                throw DecodeException.Invalid("environment.light_tracks: there are more than 64");
            for (var k = 0; k < LightTracks.Count; ++k)
            {
                if (LightTracks[k] == 0) throw DecodeException.Invalid("environment.light_tracks: 0 is not a track");
                if (k > 0 && LightTracks[k] <= LightTracks[k - 1])
                    throw DecodeException.Invalid("environment.light_tracks: they must ascend");
            }
            CheckRuns("light_runs", LightRuns, limit);
            if (LightTexels.Length != Changed(LightRuns))
                throw DecodeException.Invalid("environment.light_texels: the length does not match light_runs");
            if ((LightTracks.Count == 0) != (LightTexels.Length == 0))
                throw DecodeException.Invalid("environment.light_tracks and light_texels: one is empty");
        }

        private static long Reach(List<uint> runs)
        {
            long sum = 0;
            foreach (var run in runs) sum += run;
            return sum;
        }

        private static long Changed(List<uint> runs)
        {
            long sum = 0;
            for (var k = 1; k < runs.Count; k += 2) sum += runs[k];
            return sum;
        }

        private uint KeyOfContent()
        {
            var content = new List<byte>(4 + 8 * Edges.Count + bytes.Length);
            content.AddRange(BitConverter.GetBytes(Exponent));
            for (var k = 0; k < Edges.Count; ++k)
            {
                content.AddRange(BitConverter.GetBytes(Edges[k]));
                content.AddRange(BitConverter.GetBytes(Roughness[k]));
            }
            content.AddRange(bytes);
            var key = Crc32C.Of(content.ToArray());
            return key == 0 ? 1 : key;
        }

        /// <summary>The texels of this whole map after changes to it; null if they do not apply.</summary>
        internal uint[] With(MapMessage changes)
        {
            if (changes.Key != Key || Reach(changes.Runs) > Texels.Length ||
                Reach(changes.LightRuns) > Edges[0] * Edges[0]) return null;
            var texels = (uint[])Texels.Clone();
            Replace(changes.Runs, changes.Texels, texels);
            return texels;
        }

        /// <summary>The first level of `map`, the texels of a whole map with this one's changes, with the lights of
        /// LightTracks in it.</summary>
        internal uint[] FirstLevelWithLights(uint[] map, int edge)
        {
            var level = new uint[edge * edge];
            Array.Copy(map, level, level.Length);
            Replace(LightRuns, LightTexels, level);
            return level;
        }

        private static void Replace(List<uint> runs, uint[] from, uint[] to)
        {
            int at = 0, next = 0;
            for (var k = 0; k < runs.Count; ++k)
            {
                var run = (int)runs[k];
                if (k % 2 == 1)
                {
                    Array.Copy(from, next, to, at, run);
                    next += run;
                }
                at += run;
            }
        }
    }

    /// <summary>Assembles the current map of one probe from descriptors with a whole map, with changes, or without a
    /// map. For one thread.</summary>
    public sealed class EnvironmentKeeper
    {
        private MapMessage whole;
        private uint[] texels;
        private Mirror mirror;
        private Descriptor from;

        /// <summary>Processes a received descriptor. False if it has changes to a whole map that was not received: the
        /// last map is kept.</summary>
        public bool Take(Descriptor descriptor)
        {
            var came = descriptor.Map;
            if (came == null) return true;
            var content = came.IsWhole ? came.Texels : whole == null ? null : whole.With(came);
            if (content == null) return false;
            if (came.IsWhole) whole = came;
            texels = content;
            mirror = came.LightTracks.Count == 0 ? null
                : new Mirror(came.LightTracks, came.FirstLevelWithLights(content, whole.Edges[0]));
            from = descriptor;
            return true;
        }

        /// <summary>The newest map if it applies to the descriptor: same probe, calibration and units, not newer, and
        /// not older than three of its key intervals; otherwise null.</summary>
        public EnvironmentMapView MapFor(Descriptor descriptor)
        {
            if (from == null || from.Units != descriptor.Units || from.ProbeId != descriptor.ProbeId ||
                from.CalibrationId != descriptor.CalibrationId) return null;
            var older = (decimal)descriptor.ProbeMidExposureNs - from.ProbeMidExposureNs;
            if (older < 0 || older > 3000000m * whole.KeyIntervalMs) return null;
            Rotation now = descriptor.OriginOrientation, then = from.OriginOrientation;
            // A lamp that was switched off since the map must not stay in mirrors.
            var shown = mirror != null && mirror.AllShine(descriptor.Lights) ? mirror : null;
            return new EnvironmentMapView(whole, texels, shown, Rotations.Same(now, then)
                ? new Rotation(0, 0, 0, 1) : Rotations.Composed(now, Rotations.Inverse(then)));
        }
    }

    /// <summary>The first level of a map with the lights that its texels show better than caps do.</summary>
    internal sealed class Mirror
    {
        private readonly HashSet<uint> tracks;
        internal readonly uint[] Texels;

        internal Mirror(IEnumerable<uint> tracks, uint[] texels)
        {
            this.tracks = new HashSet<uint>(tracks);
            Texels = texels;
        }

        internal bool Shows(DiscreteLight light) => tracks.Contains(light.Track);

        internal bool AllShine(IEnumerable<DiscreteLight> lights)
        {
            var missing = new HashSet<uint>(tracks);
            foreach (var light in lights) missing.Remove(light.Track);
            return missing.Count == 0;
        }
    }

    /// <summary>A whole map in the axes of a lighting; immutable.</summary>
    public sealed class EnvironmentMapView
    {
        private readonly MapMessage map;
        private readonly uint[] texels;
        /// <summary>Null: caps show all lights.</summary>
        private readonly Mirror mirror;

        internal EnvironmentMapView(MapMessage map, uint[] texels, Mirror mirror, Rotation rotation)
        {
            this.map = map;
            this.texels = texels;
            this.mirror = mirror;
            Rotation = rotation;
        }

        /// <summary>p_lighting = Rotation p_map.</summary>
        public Rotation Rotation { get; }
        public uint Key => map.Key;
        public int LevelCount => map.Edges.Count;

        /// <summary>Level `k`, in order of increasing roughness: +Y at the centre, u from x, v from z, rows from the
        /// top. Allocates.</summary>
        public EnvironmentLevel Level(int k)
        {
            if (k < 0 || k >= LevelCount) throw new ArgumentOutOfRangeException("k", k, "there is no such level");
            var radiance = new Rgb[map.Edges[k] * map.Edges[k]];
            for (int i = 0, first = FirstTexel(k); i < radiance.Length; ++i)
            {
                var texel = Texel(texels, first + i);
                radiance[i] = new Rgb((float)texel.X, (float)texel.Y, (float)texel.Z);
            }
            return new EnvironmentLevel { Edge = map.Edges[k], Roughness = map.Roughness[k], Radiance = radiance };
        }

        /// <summary>radiance(d, r) without the lights; zero for a direction that is zero or not finite.</summary>
        internal Double3 Radiance(Double3 direction, double roughness)
        {
            var turned = Rotations.Rotate(Rotations.Inverse(Rotation), direction);
            var floats = new Double3((float)turned.X, (float)turned.Y, (float)turned.Z);
            if (!Double3.TryNormalizeFloats(floats, out var d)) return new Double3();
            Octahedral(d, out var u, out var v);
            double r = (float)roughness;
            var upper = 0;
            while (upper + 1 < LevelCount && !(r <= map.Roughness[upper])) ++upper;
            if (upper == 0 || !(r < map.Roughness[upper])) return Bilinear(upper, u, v);
            double low = map.Roughness[upper - 1];
            var share = (r - low) / (map.Roughness[upper] - low);
            return Mixed(Bilinear(upper - 1, u, v), Bilinear(upper, u, v), share);
        }

        /// <summary>Whether texels of the first level show the light instead of a cap.</summary>
        internal bool ShownInMirror(DiscreteLight light) => mirror != null && mirror.Shows(light);

        /// <summary>Share of the first level in radiance(d, r), where its texels show lights; otherwise 0.</summary>
        internal double MirrorShare(double roughness)
        {
            if (mirror == null) return 0;
            double r = (float)roughness, first = map.Roughness[0];
            if (LevelCount < 2 || r <= first) return 1;
            return Math.Max(0, 1 - (r - first) / (map.Roughness[1] - first));
        }

        /// <summary>What the first level's texels add to the map where they show lights. Only where MirrorShare() is
        /// above 0.</summary>
        internal Double3 LightInMirror(Double3 direction)
        {
            var turned = Rotations.Rotate(Rotations.Inverse(Rotation), direction);
            var floats = new Double3((float)turned.X, (float)turned.Y, (float)turned.Z);
            if (!Double3.TryNormalizeFloats(floats, out var d)) return new Double3();
            Octahedral(d, out var u, out var v);
            Double3 with = Bilinear(mirror.Texels, 0, map.Edges[0], u, v), without = Bilinear(0, u, v);
            return new Double3(with.X - without.X, with.Y - without.Y, with.Z - without.Z);
        }

        private int FirstTexel(int level)
        {
            var first = 0;
            for (var k = 0; k < level; ++k) first += map.Edges[k] * map.Edges[k];
            return first;
        }

        private Double3 Texel(uint[] of, int index)
        {
            var texel = of[index];
            var unit = Math.Pow(2, (int)(texel >> 27) - 24 + map.Exponent);
            return new Double3((float)((texel & 511) * unit), (float)((texel >> 9 & 511) * unit),
                               (float)((texel >> 18 & 511) * unit));
        }

        private static Double3 Mixed(Double3 a, Double3 b, double share) => new Double3(
            a.X * (1 - share) + b.X * share, a.Y * (1 - share) + b.Y * share, a.Z * (1 - share) + b.Z * share);

        private Double3 Bilinear(int level, double u, double v) =>
            Bilinear(texels, FirstTexel(level), map.Edges[level], u, v);

        private Double3 Bilinear(uint[] of, int first, int edge, double u, double v)
        {
            double x = Double3.F(Double3.F(u * edge) - 0.5), y = Double3.F(Double3.F(v * edge) - 0.5);
            int i = (int)Math.Floor(x), j = (int)Math.Floor(y);
            Func<int, int, Double3> at = (column, row) => Texel(of, first + At(edge, column, row));
            var top = Mixed(at(i, j), at(i + 1, j), x - i);
            var bottom = Mixed(at(i, j + 1), at(i + 1, j + 1), x - i);
            return Mixed(top, bottom, y - j);
        }

        /// <summary>Beyond an edge of the square the sphere continues at the same edge with the order of texels
        /// reversed.</summary>
        private static int At(int edge, int i, int j)
        {
            if (i < 0 || i >= edge)
            {
                i = i < 0 ? -1 - i : 2 * edge - 1 - i;
                j = edge - 1 - j;
            }
            if (j < 0 || j >= edge)
            {
                j = j < 0 ? -1 - j : 2 * edge - 1 - j;
                i = edge - 1 - i;
            }
            return j * edge + i;
        }

        /// <summary>Octahedral coordinates, 0 to 1, with the map's centre at +Y (Cigolle et al. 2014, listing 1).
        /// Rounded to float as in C++, because between texels that differ much the interpolation is sensitive to the
        /// coordinates.</summary>
        private static void Octahedral(Double3 d, out double u, out double v)
        {
            var sum = Double3.F(Double3.F(Math.Abs(d.X) + Math.Abs(d.Y)) + Math.Abs(d.Z));
            double a = Double3.F(d.X / sum), b = Double3.F(d.Z / sum);
            if (d.Y < 0)
            {
                var folded = Double3.F(Double3.F(1 - Math.Abs(b)) * Sign(a));
                b = Double3.F(Double3.F(1 - Math.Abs(a)) * Sign(b));
                a = folded;
            }
            u = Double3.F(0.5 * Double3.F(a + 1));
            v = Double3.F(0.5 * Double3.F(b + 1));
        }

        private static double Sign(double v) => v < 0 || (v == 0 && double.IsNegativeInfinity(1 / v)) ? -1 : 1;
    }
}
