// Maximum rate of descriptors that one Mosquitto delivers to many subscribers at QoS 0, and their latency: the rate is
// raised in steps until messages are lost or late. Publisher and subscribers are in this process, so that one clock
// times both ends. One JSON object per line for tests/figures: figure, value. Latency is from the publishing call to
// the subscriber's callback.
//   measure_mqtt [--subscribers 1000] [--seconds 5] [--bytes 213] [--rates 1,2,5,10,...]
// The knee is the highest step up to which all steps satisfy kDelivered and kLate.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <signal.h>
#include <spawn.h>
#include <sstream>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <lightwell/deleter.hpp>
#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>
#include <lightwell/time.hpp>

#include "measure/output.hpp"
#include "support/loopback.hpp"
#include "support/read_file.hpp"
#include "tools/command_line.hpp"

extern char** environ;

namespace {

using lightwell::monotonic_now_ns;
using lightwell::measure::print_figure;

constexpr double kDelivered = 0.999;
/// One and a half frame intervals at 30 per second: a later descriptor is outdated by the next one.
constexpr double kLateMs = 50;
constexpr const char* kTopic = "venue/probe/descriptor";
constexpr std::int64_t kSecond = 1'000'000'000;

struct Options {
  int subscribers = 1000;
  double seconds = 5;
  /// Maximum size of a descriptor of a real panorama without an environment map: README.md.
  std::size_t bytes = 213;
  std::vector<double> rates = {1, 2, 5, 10, 15, 20, 25, 30, 40, 50, 60, 80, 100, 130, 170, 220, 300, 400};
};

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_mqtt: %s\n", what.c_str());
  std::exit(1);
}

/// Runs a Mosquitto for this program.
class Broker {
 public:
  Broker() {
    const int s = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = lightwell::test::loopback(0);
    socklen_t size = sizeof address;
    if (::bind(s, reinterpret_cast<const sockaddr*>(&address), size) != 0) fail("no free port");
    ::getsockname(s, reinterpret_cast<sockaddr*>(&address), &size);
    ::close(s);
    port_ = ntohs(address.sin_port);
    file_ = (std::string(std::getenv("TMPDIR") != nullptr ? std::getenv("TMPDIR") : "/tmp") + "/measure_mqtt_" +
             std::to_string(::getpid()) + ".conf");
    std::ofstream(file_) << "listener " << port_
                         << " 127.0.0.1\nallow_anonymous true\nset_tcp_nodelay true\nlog_type none\n";
    std::array<const char*, 4> argv{LIGHTWELL_MOSQUITTO, "-c", file_.c_str(), nullptr};
    if (::posix_spawn(&pid_, argv[0], nullptr, nullptr, const_cast<char* const*>(argv.data()), environ) != 0)
      fail(std::string("cannot start ") + argv[0]);
    for (int i = 0; i < 500; ++i) {
      const int c = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      const bool there = ::connect(c, reinterpret_cast<const sockaddr*>(&address), size) == 0;
      ::close(c);
      if (there) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    fail("the broker does not listen");
  }
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;
  ~Broker() {
    ::kill(pid_, SIGTERM);
    ::waitpid(pid_, nullptr, 0);
    ::unlink(file_.c_str());
  }

  [[nodiscard]] int port() const { return port_; }
  /// CPU time so far in seconds.
  [[nodiscard]] double cpu_s() const {
    const std::string text = lightwell::test::read_file("/proc/" + std::to_string(pid_) + "/stat");
    std::istringstream fields(text.substr(text.rfind(')') + 2));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;
    double user = 0, system = 0;
    fields >> user >> system;
    return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }

 private:
  int port_ = 0;
  pid_t pid_ = -1;
  std::string file_;
};

double own_cpu_s() {
  rusage u{};
  ::getrusage(RUSAGE_SELF, &u);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(u.ru_utime) + s(u.ru_stime);
}

using Client = std::unique_ptr<mosquitto, lightwell::Deleter<mosquitto_destroy>>;

/// Results of one step, written by the subscribers' thread while it is the current step.
struct Step {
  std::uint32_t number = 0;
  std::vector<std::uint32_t> latency_us;
};

/// All subscribers, in one thread with one epoll instance.
class Subscribers {
 public:
  Subscribers(const Options& options, int port) : epoll_(::epoll_create1(EPOLL_CLOEXEC)) {
    for (int i = 0; i < options.subscribers; ++i) {
      clients_.emplace_back(mosquitto_new(("s" + std::to_string(i)).c_str(), true, this));
      mosquitto* const m = clients_.back().get();
      mosquitto_int_option(m, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
      mosquitto_int_option(m, MOSQ_OPT_TCP_NODELAY, 1);
      mosquitto_connect_callback_set(m, [](mosquitto* c, void*, int) { mosquitto_subscribe(c, nullptr, kTopic, 0); });
      mosquitto_subscribe_callback_set(
          m, [](mosquitto*, void* self, int, int, const int*) { ++static_cast<Subscribers*>(self)->ready_; });
      mosquitto_message_callback_set(m, [](mosquitto*, void* self, const mosquitto_message* message) {
        static_cast<Subscribers*>(self)->take(*message);
      });
      if (mosquitto_connect(m, "127.0.0.1", port, 60) != MOSQ_ERR_SUCCESS)
        fail("subscriber " + std::to_string(i) + " cannot connect");
      epoll_event event{EPOLLIN, {.u64 = static_cast<std::uint64_t>(i)}};
      ::epoll_ctl(epoll_, EPOLL_CTL_ADD, mosquitto_socket(m), &event);
    }
    thread_ = std::thread([this] { run(); });
    const std::int64_t end = monotonic_now_ns() + 60 * kSecond;
    while (ready_ < options.subscribers)
      if (monotonic_now_ns() > end)
        fail("not all subscribers connected within a minute");
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  Subscribers(const Subscribers&) = delete;
  Subscribers& operator=(const Subscribers&) = delete;
  ~Subscribers() {
    stopping_ = true;
    thread_.join();
    ::close(epoll_);
  }

  /// Makes messages of this step count from now on; to be called while nothing is published.
  void begin(Step& step) { step_ = &step; }
  [[nodiscard]] std::uint64_t received() const { return received_; }
  void end() { step_ = nullptr; }

 private:
  void run() {
    std::vector<epoll_event> events(256);
    std::int64_t next_misc = monotonic_now_ns();
    while (!stopping_) {
      const int n = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 20);
      for (int i = 0; i < n; ++i) {
        mosquitto* const m = clients_[events[static_cast<std::size_t>(i)].data.u64].get();
        mosquitto_loop_read(m, 1);
        if (mosquitto_want_write(m)) mosquitto_loop_write(m, 1);
        if (mosquitto_socket(m) < 0) fail("the broker dropped a subscriber");
      }
      if (monotonic_now_ns() < next_misc) continue;
      next_misc = monotonic_now_ns() + 5 * kSecond;
      for (const Client& client : clients_) mosquitto_loop_misc(client.get());
    }
  }

  void take(const mosquitto_message& message) {
    std::int64_t sent = 0;
    std::uint32_t number = 0;
    std::memcpy(&sent, message.payload, sizeof sent);
    std::memcpy(&number, static_cast<const char*>(message.payload) + sizeof sent, sizeof number);
    Step* const step = step_;
    if (step == nullptr || step->number != number) return;
    step->latency_us.push_back(static_cast<std::uint32_t>((monotonic_now_ns() - sent) / 1'000));
    ++received_;
  }

  const int epoll_;
  std::vector<Client> clients_;
  std::atomic<int> ready_{0};
  std::atomic<std::uint64_t> received_{0};
  std::atomic<Step*> step_{nullptr};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

class Publisher {
 public:
  explicit Publisher(int port) : client_(mosquitto_new("publisher", true, nullptr)) {
    mosquitto_int_option(client_.get(), MOSQ_OPT_TCP_NODELAY, 1);
    if (mosquitto_connect(client_.get(), "127.0.0.1", port, 60) != MOSQ_ERR_SUCCESS)
      fail("the publisher cannot connect");
    turn(monotonic_now_ns() + kSecond / 5);
  }

  /// Publishes at a rate; returns the number of published messages.
  std::uint64_t publish(const Options& options, double rate, std::uint32_t step) {
    std::string payload(std::max<std::size_t>(options.bytes, 12), 'x');
    const auto count = static_cast<std::uint64_t>(std::max(1.0, std::round(rate * options.seconds)));
    const std::int64_t begin = monotonic_now_ns();
    for (std::uint64_t i = 0; i < count; ++i) {
      turn(begin + static_cast<std::int64_t>(static_cast<double>(i) / rate * 1e9));
      const std::int64_t now = monotonic_now_ns();
      std::memcpy(payload.data(), &now, sizeof now);
      std::memcpy(payload.data() + sizeof now, &step, sizeof step);
      if (mosquitto_publish(client_.get(), nullptr, kTopic, static_cast<int>(payload.size()), payload.data(), 0,
                            true) != MOSQ_ERR_SUCCESS)
        fail("the publisher lost the broker");
    }
    return count;
  }

 private:
  void turn(std::int64_t until_ns) {
    do {
      const std::int64_t left_ms = (until_ns - monotonic_now_ns()) / 1'000'000;
      if (left_ms > 0)
        mosquitto_loop(client_.get(), static_cast<int>(std::min<std::int64_t>(left_ms, 100)), 1);
      else if (until_ns > monotonic_now_ns())
        std::this_thread::sleep_for(std::chrono::nanoseconds(until_ns - monotonic_now_ns()));
    } while (monotonic_now_ns() < until_ns);
    mosquitto_loop(client_.get(), 0, 1);
  }

  Client client_;
};

double quantile_ms(std::vector<std::uint32_t>& latency_us, double share) {
  return latency_us.empty() ? INFINITY : 1e-3 * lightwell::lower_quantile(latency_us, share);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{
      "Maximum rate of descriptors that one Mosquitto delivers to many subscribers at QoS 0, and their latency.",
      "measure_mqtt"};
  app.add_option("--subscribers", options.subscribers, "Number of subscribers [1000]")->check(CLI::PositiveNumber);
  app.add_option("--seconds", options.seconds, "Duration of a step [5]")->check(CLI::PositiveNumber);
  app.add_option("--bytes", options.bytes, "Size of a descriptor [213]");
  app.add_option("--rates", options.rates, "Descriptors per second of the steps, with commas between")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  if (const auto exit = lightwell::parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  const auto wanted = static_cast<rlim_t>(options.subscribers + 64);
  if (files.rlim_cur < wanted) files.rlim_cur = std::min(files.rlim_max, wanted);
  if (::setrlimit(RLIMIT_NOFILE, &files) != 0 || files.rlim_cur < wanted)
    fail("the limit of open files is too low for so many subscribers: raise `ulimit -Hn`");
  mosquitto_lib_init();
  const Broker broker;
  // Created first: libmosquitto's loop uses select(), which supports only file descriptors below 1,024.
  Publisher publisher(broker.port());
  Subscribers subscribers(options, broker.port());

  const std::string name = "mqtt." + std::to_string(options.subscribers) + ".";
  double knee = 0, knee_p50 = INFINITY, knee_p99 = INFINITY;
  bool kept = true;
  std::uint32_t number = 0;
  for (const double rate : options.rates) {
    Step step;
    step.number = ++number;
    const double expected_most = (rate * options.seconds + 1) * options.subscribers;
    step.latency_us.reserve(static_cast<std::size_t>(expected_most));
    const std::uint64_t before = subscribers.received();
    const double cpu = own_cpu_s(), broker_cpu = broker.cpu_s();
    const std::int64_t begin = monotonic_now_ns();
    subscribers.begin(step);
    const std::uint64_t published = publisher.publish(options, rate, step.number);
    const double seconds = static_cast<double>(monotonic_now_ns() - begin) * 1e-9;
    const double expected = static_cast<double>(published) * options.subscribers;
    // Waits for late messages; those that are still missing have been dropped by the broker.
    const std::int64_t end = monotonic_now_ns() + 3 * kSecond;
    while (static_cast<double>(subscribers.received() - before) < expected && monotonic_now_ns() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    subscribers.end();
    // The subscribers' thread may still be in the last callback.
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const double all = static_cast<double>(monotonic_now_ns() - begin) * 1e-9;
    const double delivered = static_cast<double>(step.latency_us.size()) / expected;
    const double p50 = quantile_ms(step.latency_us, 0.5), p99 = quantile_ms(step.latency_us, 0.99);
    const std::string at = lightwell::formatted("at_%g.", rate);
    print_figure(name + at + "published_per_s", static_cast<double>(published) / std::max(seconds, options.seconds));
    print_figure(name + at + "delivered_share", delivered);
    print_figure(name + at + "deliveries_per_s",
                 static_cast<double>(step.latency_us.size()) / std::max(seconds, options.seconds));
    print_figure(name + at + "p50_ms", p50);
    print_figure(name + at + "p99_ms", p99);
    // CPU loads show which side is the bottleneck; 1 is one processor.
    print_figure(name + at + "broker_cpu", (broker.cpu_s() - broker_cpu) / all);
    print_figure(name + at + "load_cpu", (own_cpu_s() - cpu) / all);
    kept = kept && delivered >= kDelivered && p99 <= kLateMs;
    if (kept) {
      knee = rate;
      knee_p50 = p50;
      knee_p99 = p99;
    }
    if (delivered < 0.9 || p99 > 1'000) break;
  }
  print_figure(name + "knee_descriptors_per_s", knee);
  print_figure(name + "knee_deliveries_per_s", knee * options.subscribers);
  print_figure(name + "knee_p50_ms", knee_p50);
  print_figure(name + "knee_p99_ms", knee_p99);
  return 0;
}
