// A connection to one probe by WebSocket (firmware/link/web/README.md), without native code.
using System;
using System.Diagnostics;
using System.Net.WebSockets;
using System.Text.RegularExpressions;
using System.Threading;
using System.Threading.Tasks;

namespace Lightwell.Managed
{
    /// <summary>Options of a connection, in milliseconds.</summary>
    public sealed class ManagedProbeOptions
    {
        /// <summary>Identifies the client to a probe with access control. Sent over TLS, or to this machine,
        /// only.</summary>
        public string Token;
        /// <summary>Older answers of Latest are stale.</summary>
        public double MaxAgeMs = 250;
        /// <summary>Limit of Connect and of each later attempt.</summary>
        public int ConnectTimeoutMs = 2000;
        /// <summary>First and longest pause between attempts; pauses double, with 20 % jitter.</summary>
        public int RetryMinMs = 100, RetryMaxMs = 500;
        /// <summary>The connection is made again if nothing arrives from the probe for this long.</summary>
        public int SilenceLimitMs = 4000;
    }

    /// <summary>Counters since Connect.</summary>
    public struct ManagedLinkStats
    {
        /// <summary>Valid descriptors.</summary>
        public long Received;
        /// <summary>Messages above 64 KiB, dropped without decoding.</summary>
        public long Oversized;
        /// <summary>Messages that are neither a descriptor nor a response.</summary>
        public long Undecodable;
        /// <summary>Descriptors that were received again after a newer one.</summary>
        public long Replayed;
        /// <summary>Changes to a whole map that was not received.</summary>
        public long MapsWithoutKey;
        public long Reconnects;
        public LinkState State;
        /// <summary>Last error of the link or of a rejected message; empty if there was none.</summary>
        public string LastError;
    }

    /// <summary>A connection to one probe, with the newest descriptor. It reconnects by itself until Dispose. Latest
    /// and the properties can be used by any thread.</summary>
    public sealed class ManagedProbe : IDisposable
    {
        private const int DefaultPort = 7443, InfoPeriodMs = 1000, FirstInfoPeriodMs = 20, FirstRoundTrips = 8;
        private const int RefusedPauseMs = 5000;
        private static readonly Regex Address = new Regex(
            @"^(wss?)://(\[[0-9a-f:.]+\]|[^/?#@:\s\[\]]+)(?::(\d{1,5}))?/?$", RegexOptions.IgnoreCase);

        private readonly Uri uri;
        private readonly ManagedProbeOptions options;
        private readonly CancellationTokenSource ended = new CancellationTokenSource();
        private readonly object guard = new object();
        private readonly TaskCompletionSource<bool> connected =
            new TaskCompletionSource<bool>(TaskCreationOptions.RunContinuationsAsynchronously);
        private readonly Random random = new Random();
        private ManagedLinkStats stats;
        private volatile Arrival newest;
        private volatile string name = "", version = "", camera = "";
        // Only the task that follows the probe uses these.
        private readonly ClockMap clock = new ClockMap();
        private readonly EnvironmentKeeper keeper = new EnvironmentKeeper();
        private Descriptor order;
        private uint nextId = 1;
        private Task following;

        private sealed class Arrival
        {
            internal Descriptor Descriptor;
            internal EnvironmentMapView Environment;
            internal long HostMidExposure;
            internal readonly LazyReconstruction Reconstruction = new LazyReconstruction();
        }

        /// <summary>One WebSocket, from its opening to its end.</summary>
        private sealed class Session
        {
            internal ClientWebSocket Socket;
            internal long LastReceived, InfoSent;
            internal uint InfoId;
            internal int RoundTrips;
        }

        private ManagedProbe(Uri uri, ManagedProbeOptions options)
        {
            this.uri = uri;
            this.options = options;
            stats.LastError = "";
        }

        /// <summary>Connects to `wss://HOST:PORT` (TLS) or `ws://HOST:PORT`; default port 7443. The probe's certificate
        /// must be one that this machine trusts. Fails with LightwellException: InvalidArgument for an address or
        /// option, Unavailable if the probe does not respond within ConnectTimeoutMs, FailedPrecondition if it refuses
        /// this client.</summary>
        public static async Task<ManagedProbe> ConnectAsync(string address, ManagedProbeOptions options = null)
        {
            options = options ?? new ManagedProbeOptions();
            var probe = new ManagedProbe(UriOf(address, options.Token), options);
            if (options.ConnectTimeoutMs <= 0 || options.RetryMinMs <= 0 || options.RetryMaxMs <= 0 ||
                options.SilenceLimitMs <= 0 || !(options.MaxAgeMs > 0))
                throw new LightwellException(Status.InvalidArgument, "times must be positive, in milliseconds");
            probe.following = Task.Run(() => probe.Run());
            var limit = Task.Delay(options.ConnectTimeoutMs);
            var first = await Task.WhenAny(probe.connected.Task, limit).ConfigureAwait(false);
            try
            {
                if (first != probe.connected.Task)
                    throw new LightwellException(Status.Unavailable, "no answer within " + options.ConnectTimeoutMs +
                                                 " ms (" + probe.Stats.LastError + ")");
                await probe.connected.Task.ConfigureAwait(false);
                return probe;
            }
            catch
            {
                probe.Dispose();
                throw;
            }
        }

        /// <summary>The same for a thread that may wait.</summary>
        public static ManagedProbe Connect(string address, ManagedProbeOptions options = null) =>
            ConnectAsync(address, options).GetAwaiter().GetResult();

        public string Name => name;
        public string Version => version;
        public string Camera => camera;

        public ManagedLinkStats Stats
        {
            get
            {
                lock (guard) return stats;
            }
        }

        /// <summary>The newest light; Validity.None before the first descriptor, Stale when none arrives. Does not wait
        /// for the network.</summary>
        public Lighting Latest()
        {
            var last = newest;
            return last == null ? new Lighting(null)
                : new Lighting(last.Descriptor, (NowNs() - last.HostMidExposure) / 1e6, options.MaxAgeMs,
                    last.Environment,
                               last.Reconstruction);
        }

        /// <summary>Ends the connection. Latest keeps the last light, with its growing age.</summary>
        public void Dispose() => ended.Cancel();

        /// <summary>Completes after Dispose, as soon as the connection is closed.</summary>
        public Task Completion => following;

        /// <summary>This machine's monotonic clock.</summary>
        internal static long NowNs() => (long)(Stopwatch.GetTimestamp() * (1e9 / Stopwatch.Frequency));

        private static Uri UriOf(string address, string token)
        {
            if (address == null) throw new ArgumentNullException("address");
            var parts = Address.Match(address);
            if (!parts.Success) throw Refused(address, "write wss://HOST or wss://HOST:PORT (ws:// without TLS)");
            var port = parts.Groups[3].Success ? int.Parse(parts.Groups[3].Value) : DefaultPort;
            if (port < 1 || port > 65535) throw Refused(address, "the port must be a number from 1 to 65535");
            string scheme = parts.Groups[1].Value.ToLowerInvariant(), host = parts.Groups[2].Value;
            var local = Regex.IsMatch(host, @"^(localhost|127(\.\d+){3}|\[::1\])$", RegexOptions.IgnoreCase);
            if (token != null && scheme == "ws" && !local)
                throw Refused(address, "a token is sent only over TLS, because anyone on the network could read it; " +
                                       "write wss://");
            return new Uri(scheme + "://" + host + ":" + port + "/v1/descriptors");
        }

        private static LightwellException Refused(string address, string why) => new LightwellException(
            Status.InvalidArgument, "'" + LinkResponse.Printable(address) + "' is not a valid address of a probe: " +
                why);

        private async Task Run()
        {
            double pause = options.RetryMinMs;
            while (!ended.IsCancellationRequested)
            {
                SetState(LinkState.Connecting);
                string why;
                var refused = false;
                try
                {
                    why = await RunSession().ConfigureAwait(false);
                }
                catch (LightwellException e)
                {
                    refused = true;
                    why = e.Message;
                    connected.TrySetException(e);
                }
                catch (OperationCanceledException)
                {
                    why = ended.IsCancellationRequested ? "" : "no answer within ConnectTimeoutMs";
                }
                catch (Exception e)
                {
                    why = "no connection: " + e.GetBaseException().Message;
                }
                Report(why);
                bool was;
                lock (guard) was = stats.State == LinkState.Connected;
                SetState(LinkState.Waiting);
                if (was) pause = options.RetryMinMs;
                var wait = refused ? RefusedPauseMs : pause * (0.8 + 0.4 * random.NextDouble());
                pause = Math.Min(2 * pause, options.RetryMaxMs);
                await Task.Delay((int)wait, ended.Token).ContinueWith(_ => { }).ConfigureAwait(false);
            }
            SetState(LinkState.Ended);
        }

        /// <summary>One connection until its end. Returns why it ended; throws LightwellException if the probe refuses
        /// this client.</summary>
        private async Task<string> RunSession()
        {
            using (var socket = new ClientWebSocket())
            using (var stop = CancellationTokenSource.CreateLinkedTokenSource(ended.Token))
            {
                socket.Options.AddSubProtocol("lightwell.v1");
                stop.CancelAfter(options.ConnectTimeoutMs);
                await socket.ConnectAsync(uri, stop.Token).ConfigureAwait(false);
                var session = new Session { Socket = socket, LastReceived = NowNs() };
                order = null;
                var begin = options.Token == null ? SendInfo(session, stop.Token)
                    : Send(session, LinkRequest.Authenticate(nextId++, options.Token), stop.Token);
                await begin.ConfigureAwait(false);
                // One byte more than a message may have, to recognise larger ones.
                var buffer = new byte[Descriptor.MaxBytes + 1];
                var next = ReceiveMessage(socket, buffer, stop.Token);
                var waited = Task.Delay(FirstInfoPeriodMs, stop.Token);
                for (;;)
                {
                    var period = session.RoundTrips < FirstRoundTrips ? FirstInfoPeriodMs : InfoPeriodMs;
                    if (waited.IsCompleted) waited = Task.Delay(period, stop.Token);
                    if (await Task.WhenAny(next, waited).ConfigureAwait(false) == next)
                    {
                        var count = await next.ConfigureAwait(false);
                        if (count < 0) return Closed(session);
                        session.LastReceived = NowNs();
                        await Take(session, buffer, count, stop).ConfigureAwait(false);
                        next = ReceiveMessage(socket, buffer, stop.Token);
                    }
                    stop.Token.ThrowIfCancellationRequested();
                    if ((NowNs() - session.LastReceived) / 1e6 > options.SilenceLimitMs)
                        return "no data from the probe within SilenceLimitMs";
                    if (session.InfoId == 0 && session.RoundTrips > 0 && (NowNs() - session.InfoSent) / 1e6 >= period)
                        await SendInfo(session, stop.Token).ConfigureAwait(false);
                }
            }
        }

        private static string Closed(Session session)
        {
            var reason = LinkResponse.Printable(session.Socket.CloseStatusDescription ?? "");
            if (session.Socket.CloseStatus == WebSocketCloseStatus.PolicyViolation && session.RoundTrips == 0)
                throw new LightwellException(Status.FailedPrecondition, "the probe refused this client: " +
                                             (reason == "" ? "its token is missing, wrong or expired" : reason));
            return "the connection ended (" + (int?)session.Socket.CloseStatus + " " + reason + ")";
        }

        /// <summary>Size of the next message, which is in the buffer; one more than the largest if it is larger and was
        /// dropped; -1 at the end of the connection.</summary>
        private static async Task<int> ReceiveMessage(ClientWebSocket socket, byte[] buffer, CancellationToken stop)
        {
            for (var size = 0; ;)
            {
                // What is beyond the buffer's end overwrites its last byte.
                var room = Math.Min(size, buffer.Length - 1);
                var part = await socket.ReceiveAsync(new ArraySegment<byte>(buffer, room, buffer.Length - room), stop)
                    .ConfigureAwait(false);
                if (part.MessageType == WebSocketMessageType.Close) return -1;
                size = Math.Min(room + part.Count, buffer.Length);
                if (part.EndOfMessage) return part.MessageType == WebSocketMessageType.Text ? 0 : size;
            }
        }

        private async Task Take(Session session, byte[] bytes, int count, CancellationTokenSource stop)
        {
            if (count > Descriptor.MaxBytes)
            {
                lock (guard) ++stats.Oversized;
                Report("a message above " + Descriptor.MaxBytes + " bytes, which no descriptor has");
            }
            else if (count > 0 && bytes[0] == LinkResponse.Tag)
                await TakeResponse(session, bytes, count, stop).ConfigureAwait(false);
            // A probe responds before it sends descriptors, so only the first ones arrive while the clock is unknown.
            else if (clock.Known) TakeDescriptor(bytes, count);
        }

        private async Task TakeResponse(Session session, byte[] bytes, int count, CancellationTokenSource stop)
        {
            LinkResponse response;
            try
            {
                response = LinkResponse.Decode(bytes, count);
            }
            catch (DecodeException e)
            {
                Undecodable(e.Message);
                return;
            }
            if (response.Code != 0) Report("the probe refused a request: " + response.Text);
            if (session.InfoId == 0) // The response to Authenticate.
            {
                if (session.RoundTrips == 0) await SendInfo(session, stop.Token).ConfigureAwait(false);
                return;
            }
            if (response.Id != session.InfoId) return;
            session.InfoId = 0;
            if (!response.HasInfo) return;
            clock.Add(session.InfoSent, response.ClockNow, session.LastReceived);
            name = response.Name;
            version = response.Version;
            camera = response.Camera;
            if (++session.RoundTrips > 1) return;
            // From here on only silence ends the connection.
            stop.CancelAfter(Timeout.Infinite);
            SetState(LinkState.Connected);
            connected.TrySetResult(true);
        }

        private void TakeDescriptor(byte[] bytes, int count)
        {
            Descriptor descriptor;
            try
            {
                descriptor = Descriptor.Decode(bytes, count);
            }
            catch (DecodeException e)
            {
                Undecodable(e.Message);
                return;
            }
            // A restarted daemon counts from the start again, but the clock of its machine continues.
            if (order != null && descriptor.ProbeId == order.ProbeId && descriptor.Sequence <= order.Sequence &&
                descriptor.ProbeMidExposureNs <= order.ProbeMidExposureNs)
            {
                lock (guard) ++stats.Replayed;
                return;
            }
            order = descriptor;
            var understood = keeper.Take(descriptor);
            newest = new Arrival
            {
                Descriptor = descriptor, Environment = keeper.MapFor(descriptor),
                HostMidExposure = clock.ToHost(descriptor.ProbeMidExposureNs)
            };
            // Last: who reads the counter and then Latest gets this descriptor or a newer one.
            lock (guard)
            {
                ++stats.Received;
                if (!understood) ++stats.MapsWithoutKey;
            }
        }

        private Task SendInfo(Session session, CancellationToken stop)
        {
            session.InfoId = nextId;
            // 0 means none.
            nextId = nextId == uint.MaxValue ? 1 : nextId + 1;
            session.InfoSent = NowNs();
            return Send(session, LinkRequest.Info(session.InfoId), stop);
        }

        private static Task Send(Session session, byte[] bytes, CancellationToken stop) =>
            session.Socket.SendAsync(new ArraySegment<byte>(bytes), WebSocketMessageType.Binary, true, stop);

        private void Undecodable(string why)
        {
            lock (guard) ++stats.Undecodable;
            Report(why);
        }

        private void Report(string error)
        {
            lock (guard) stats.LastError = LinkResponse.Printable(error);
        }

        private void SetState(LinkState state)
        {
            lock (guard)
            {
                if (state == LinkState.Connected && stats.Received > 0) ++stats.Reconnects;
                stats.State = state;
            }
        }
    }
}
