// Age of descriptors when latest() returns them, for clients of a running lightwelld on this machine, some of which
// never read. One JSON object per line for tests/figures: p50, p99, largest (ms, over all reading clients, from
// encoding to latest()), received, gaps, and the probe's counters over the same time: frames, captures_dropped,
// coalesced. Several URIs of one lightwelld are measured at the same time, with the same frames: a line for each.
//   measure_latency URI... [--clients N] [--stalled N] [--seconds S] [--repeats N]
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>

#include <lightwell/probe.hpp>
#include <lightwell/quantile.hpp>
#include <lightwell/v1/probe_service.grpc.pb.h>

#include "bench/memcpy_speed.hpp"
#include "measure/output.hpp"
#include "support/loopback.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_latency: %s\n", what.c_str());
  std::exit(1);
}

/// A client that never reads.
class Stalled {
 public:
  Stalled() = default;
  Stalled(const Stalled&) = delete;
  Stalled& operator=(const Stalled&) = delete;
  virtual ~Stalled() = default;
};

/// Opens a WebSocket by hand; its socket is never read.
class StalledWebSocket final : public Stalled {
 public:
  explicit StalledWebSocket(int port) {
    const sockaddr_in to = test::loopback(port);
    const std::string request =
        "GET /v1/descriptors HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Protocol: lightwell.v1\r\n\r\n";
    constexpr int kSmall = 1024;
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kSmall, sizeof kSmall);
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
        ::send(socket_, request.data(), request.size(), MSG_NOSIGNAL) < 0)
      fail("a WebSocket that is not read cannot be opened");
  }
  ~StalledWebSocket() override { ::close(socket_); }

 private:
  const int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

/// Opens a stream of gRPC and never reads from it.
class StalledStream final : public Stalled {
 public:
  explicit StalledStream(const std::string& host_port) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    // A small buffer for a few descriptors, so that the stream stalls within a second instead of after 64 kB.
    arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1024);
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    stub_ =
        v1::ProbeService::NewStub(grpc::CreateCustomChannel(host_port, grpc::InsecureChannelCredentials(), arguments));
    stream_ = stub_->StreamDescriptors(&context_, {});
  }
  ~StalledStream() override {
    context_.TryCancel();
    v1::LightingDescriptor rest;
    while (stream_->Read(&rest)) {
    }
    (void)stream_->Finish();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::ProbeService::Stub> stub_;
  std::unique_ptr<grpc::ClientReader<v1::LightingDescriptor>> stream_;
};

/// A client, and what its reader thread recorded.
struct Client {
  std::mutex mutex;
  std::vector<double> latency_ms;
  std::optional<Probe> probe;
};

/// Connects clients to a URI. They record while `counting`.
std::vector<std::unique_ptr<Client>> connect(const std::string& uri, int count, const std::atomic<bool>& counting) {
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < count; ++i) {
    Client* mine = clients.emplace_back(std::make_unique<Client>()).get();
    mine->latency_ms.reserve(100'000);
    ProbeOptions options;
    options.connect_timeout = Duration::from_seconds(20);
    options.on_descriptor = [mine, &counting](const Arrival& a) {
      if (!counting) return;
      // The probe uses this machine's clock, so no clock estimation adds errors.
      const std::int64_t made_ns = a.descriptor.time.mid_exposure.ns + a.descriptor.time.encoded_after.ns;
      const std::lock_guard lock(mine->mutex);
      mine->latency_ms.push_back(1e-6 * static_cast<double>(a.stored.ns - made_ns));
    };
    Result<Probe> probe = Probe::connect(uri, options);
    if (!probe) fail(probe.status().message());
    mine->probe.emplace(std::move(*probe));
  }
  return clients;
}

/// What they recorded since the last call.
std::vector<double> recorded(const std::vector<std::unique_ptr<Client>>& clients) {
  std::vector<double> all;
  for (const auto& client : clients) {
    const std::lock_guard lock(client->mutex);
    all.insert(all.end(), client->latency_ms.begin(), client->latency_ms.end());
    client->latency_ms.clear();
  }
  return all;
}

std::uint64_t gaps_of(const std::vector<std::unique_ptr<Client>>& clients) {
  std::uint64_t gaps = 0;
  for (const auto& client : clients) gaps += client->probe->stats().gaps;
  return gaps;
}

/// The probe's counters, which the SDK requests about once a second.
Counters settled_counters(const Probe& probe) {
  std::this_thread::sleep_for(std::chrono::milliseconds(1300));
  return probe.info().counters;
}

}  // namespace

int main(int argc, char** argv) {
  int clients = 1, stalled = 0, repeats = 1;
  double seconds = 5;
  std::vector<std::string> uris;
  CLI::App app{"Age of descriptors when latest() returns them, for clients of a running lightwelld on this machine.",
               "measure_latency"};
  app.add_option("URI", uris, "grpc://HOST:PORT or ws://127.0.0.1:PORT; several: of one lightwelld")->required();
  app.add_option("--clients", clients, "Number of clients of each URI that read [1]")->check(CLI::PositiveNumber);
  app.add_option("--stalled", stalled, "Number of clients of the first URI that never read [0]")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--seconds", seconds, "Duration of a measurement [5]")->check(CLI::PositiveNumber);
  app.add_option("--repeats", repeats, "Number of measurements [1]")->check(CLI::PositiveNumber);
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  for (const std::string& uri : uris)
    if (!uri.starts_with("grpc://") && !uri.starts_with("ws://127.0.0.1:"))
      return wrong_usage(app, "'" + uri + "' is not grpc://HOST:PORT or ws://127.0.0.1:PORT");
  const double memcpy_gb_per_s = bench::memcpy_speed(4 << 20).gigabytes_per_s;

  std::atomic<bool> counting{false};
  std::vector<std::vector<std::unique_ptr<Client>>> of_uri;
  for (const std::string& uri : uris) of_uri.push_back(connect(uri, clients, counting));
  const Probe& first = *of_uri[0][0]->probe;
  std::vector<std::unique_ptr<Stalled>> rude;
  for (int i = 0; i < stalled; ++i) {
    if (uris[0].starts_with("ws://"))
      rude.push_back(std::make_unique<StalledWebSocket>(std::stoi(uris[0].substr(uris[0].rfind(':') + 1))));
    else
      rude.push_back(std::make_unique<StalledStream>(uris[0].substr(std::strlen("grpc://"))));
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));

  for (int repeat = 0; repeat < repeats; ++repeat) {
    const Counters before = settled_counters(first);
    std::vector<std::uint64_t> gaps_before;
    for (const auto& group : of_uri) gaps_before.push_back(gaps_of(group));
    counting = true;
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    counting = false;
    const Counters after = settled_counters(first);
    for (std::size_t k = 0; k < uris.size(); ++k) {
      std::vector<double> all = recorded(of_uri[k]);
      const auto quantile = [&](double share) { return all.empty() ? 0 : upper_quantile(all, share); };
      measure::print_line({{"figure", "latency." + std::to_string(clients) + "." + std::to_string(stalled)},
                           {"uri", uris[k]},
                           {"p50", quantile(0.5)},
                           {"p99", quantile(0.99)},
                           {"largest", quantile(1)},
                           {"received", all.size()},
                           {"gaps", gaps_of(of_uri[k]) - gaps_before[k]},
                           {"frames", after.frames - before.frames},
                           {"captures_dropped", after.captures_dropped - before.captures_dropped},
                           {"coalesced", after.descriptors_coalesced - before.descriptors_coalesced},
                           {"memcpy_gb_per_s", memcpy_gb_per_s}});
    }
  }
  return 0;
}
