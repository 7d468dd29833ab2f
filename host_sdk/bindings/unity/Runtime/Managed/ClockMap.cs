// Offset and drift between the probe's and the host's clock, estimated from round trips: method and numbers as in
// host_sdk/src/core/clock_map.hpp.
using System;
using System.Collections.Generic;

namespace Lightwell.Managed
{
    /// <summary>Each round trip bounds the offset to an interval of its duration. The feasible set is all lines
    /// (offset, drift) that pass through all intervals; the estimate is the centre of the feasible offsets, and the
    /// uncertainty half their width, which is a hard bound. If no line is feasible, a clock was reset: then only the
    /// newest round trip is used. All times in ns.</summary>
    internal sealed class ClockMap
    {
        /// <summary>Largest drift between two quartz clocks of 50 ppm each; largest change of it among the stored round
        /// trips.</summary>
        private const double MaxDrift = 100e-6, MaxDriftChange = 1e-6, Rounding = 0.5;
        private const int MaxRoundTrips = 32;
        /// <summary>Of two round trips within this time the shorter is kept, so that 32 of them reach back two
        /// minutes.</summary>
        private const long MinSpacing = 4000000000;
        /// <summary>73 years: larger clock values are invalid.</summary>
        private const long Far = 1L << 61;

        private struct RoundTrip
        {
            internal long At, Offset, Half;
        }

        /// <summary>Offset at the newest round trip (ns, minus its own offset) and drift.</summary>
        private struct Corner
        {
            internal double Offset, Drift;
        }

        private readonly List<RoundTrip> kept = new List<RoundTrip>();
        private List<Corner> corners = new List<Corner>();

        internal bool Known => kept.Count > 0;

        private RoundTrip Newest => kept[kept.Count - 1];

        /// <summary>Adds a round trip: the host sent at `sent` and received the response at `received`; in between the
        /// probe read `probe` from its clock. Ignored if the times are not in order.</summary>
        internal void Add(long sent, long probe, long received)
        {
            if (!IsTime(sent) || !IsTime(probe) || !IsTime(received)) return;
            if (received < sent || (Known && received < Newest.At)) return;
            var half = (received - sent) / 2;
            var trip = new RoundTrip { At = received, Offset = probe - (sent + half), Half = half + 1 };
            if (kept.Count >= 2)
            {
                RoundTrip last = Newest, before = kept[kept.Count - 2];
                if (last.At - before.At < MinSpacing) kept.RemoveAt(kept.Count - (last.Half < before.Half ? 2 : 1));
            }
            if (kept.Count == MaxRoundTrips) kept.RemoveAt(0);
            kept.Add(trip);
            if (Fit()) return;
            kept.Clear();
            kept.Add(trip);
            Fit();
        }

        /// <summary>Probe time minus host time at `now`; zero if not known.</summary>
        internal long Offset(long now)
        {
            if (!Known) return 0;
            Offsets(now, out var low, out var high);
            return Newest.Offset + (long)Math.Round((low + high) / 2);
        }

        /// <summary>Maximum error of Offset(now); zero if not known.</summary>
        internal long Uncertainty(long now)
        {
            if (!Known) return 0;
            Offsets(now, out var low, out var high);
            return (long)Math.Ceiling((high - low) / 2) + 1;
        }

        /// <summary>A time of the probe on the host's clock.</summary>
        internal long ToHost(long probe)
        {
            if (!Known) return probe;
            var time = Math.Max(-Far, Math.Min(probe, Far));
            // Offset() needs the host time that is being computed; one iteration has a relative error of 100 ppm
            // squared.
            return time - Offset(time - Newest.Offset);
        }

        private static bool IsTime(long ns) => ns >= -Far && ns <= Far;

        /// <summary>Computes the feasible set of the stored round trips; false if it is empty.</summary>
        private bool Fit()
        {
            var newest = Newest;
            corners = new List<Corner>
            {
                new Corner { Offset = -newest.Half, Drift = -MaxDrift }, new Corner { Offset = newest.Half,
                    Drift = -MaxDrift },
                new Corner { Offset = newest.Half, Drift = MaxDrift }, new Corner { Offset = -newest.Half,
                    Drift = MaxDrift }
            };
            for (var i = 0; i + 1 < kept.Count; ++i)
            {
                double t = kept[i].At - newest.At, seen = kept[i].Offset - newest.Offset;
                var most = kept[i].Half + MaxDriftChange * Math.Abs(t);
                Clip(1, t, seen, most);
                Clip(-1, t, seen, most);
            }
            return corners.Count > 0;
        }

        /// <summary>Clips by a half-plane (Sutherland and Hodgman 1974): sign (offset + drift t - seen) &lt;=
        /// most.</summary>
        private void Clip(int sign, double t, double seen, double most)
        {
            var inside = new List<Corner>();
            for (var i = 0; i < corners.Count; ++i)
            {
                Corner a = corners[i], b = corners[(i + 1) % corners.Count];
                double ofA = sign * (a.Offset + a.Drift * t - seen) - most;
                double ofB = sign * (b.Offset + b.Drift * t - seen) - most;
                if (ofA <= Rounding) inside.Add(a);
                if (ofA <= Rounding == ofB <= Rounding || ofA == ofB) continue;
                var f = Cap.Clamp(ofA / (ofA - ofB), 0, 1);
                inside.Add(new Corner
                {
                    Offset = a.Offset + f * (b.Offset - a.Offset), Drift = a.Drift + f * (b.Drift - a.Drift)
                });
            }
            corners = inside;
        }

        /// <summary>Range of the feasible offsets at `now`, minus the offset of the newest round trip.</summary>
        private void Offsets(long now, out double low, out double high)
        {
            double t = now - Newest.At, margin = MaxDriftChange * Math.Abs(t) + Rounding;
            low = double.PositiveInfinity;
            high = double.NegativeInfinity;
            foreach (var corner in corners)
            {
                low = Math.Min(low, corner.Offset + corner.Drift * t);
                high = Math.Max(high, corner.Offset + corner.Drift * t);
            }
            low -= margin;
            high += margin;
        }
    }
}
