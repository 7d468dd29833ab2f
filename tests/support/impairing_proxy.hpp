// A TCP proxy that impairs the network between a client and a server.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace lightwell::test {

enum class Direction : std::size_t { to_server = 0, to_client = 1 };

/// Impairment of each direction. Bytes are never lost or changed, as TCP retransmits them.
struct Impairment {
  std::chrono::nanoseconds delay{0};   ///< Added to every piece, in each direction.
  std::chrono::nanoseconds jitter{0};  ///< Maximum of a further, uniformly random delay; the order of bytes is kept.
  double bytes_per_s = 0;              ///< 0: no limit.
};

/// Forwards TCP connections from its own port to a server on the loopback address, in one thread, and records all
/// bytes.
class ImpairingProxy {
 public:
  explicit ImpairingProxy(int server_port, std::uint32_t seed = 1);
  ~ImpairingProxy();
  ImpairingProxy(const ImpairingProxy&) = delete;
  ImpairingProxy& operator=(const ImpairingProxy&) = delete;

  [[nodiscard]] int port() const { return port_; }

  /// Sets the impairment from now on; pieces in flight keep their delay.
  void impair(const Impairment& impairment);
  /// Stops forwarding without closing anything: connections stay open, new ones are accepted, and bytes are buffered.
  void hold();
  /// Forwards the buffered bytes and continues.
  void resume();
  /// Resets all connections and refuses new ones.
  void cut();
  /// Ends cut(): accepts new connections again.
  void restore();

  /// All bytes sent in that direction so far, connection after connection.
  [[nodiscard]] std::vector<std::byte> carried(Direction direction) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Piece {
    std::vector<std::byte> bytes;
    std::size_t written = 0;
    Clock::time_point due;
  };
  /// Bytes from one socket to the other.
  struct Flow {
    int from = -1, to = -1;
    bool ended = false;  ///< The sender has closed its side.
    std::deque<Piece> in_flight;
    std::size_t held_bytes = 0;
    Clock::time_point free_at{};  ///< When the rate limit allows the next bytes.
  };
  struct Pair {
    Flow flows[2];
    std::size_t number = 0;  ///< Index in carried_.
  };

  void run();
  void listen_again();
  void accept_one();
  void read_some(Pair& pair, std::size_t direction);
  /// False: the connection has ended.
  [[nodiscard]] bool write_due(Flow& flow);
  void close_all();

  const int server_port_;
  int port_ = 0, listener_ = -1, wake_[2] = {-1, -1};
  std::atomic<bool> stopping_{false}, held_{false}, cut_{false};
  mutable std::mutex mutex_;
  Impairment impairment_;                                       // under the mutex
  std::vector<std::array<std::vector<std::byte>, 2>> carried_;  // under the mutex; by connection
  std::mt19937 random_;
  std::list<Pair> pairs_;  // the thread's own
  std::thread thread_;     // last: it uses all of the above
};

}  // namespace lightwell::test
