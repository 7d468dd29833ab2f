// A network between a client and a server that the test may make as bad as it likes.
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

/// What happens to each direction's bytes. They are never lost or changed: TCP would send them again.
struct Impairment {
  std::chrono::nanoseconds delay{0};   ///< Of every piece, each way.
  std::chrono::nanoseconds jitter{0};  ///< Up to so much more, evenly at random; order is kept, as TCP keeps it.
  double bytes_per_s = 0;              ///< 0: no limit.
};

/// TCP from a port of its own to a server on the loopback address. One thread; counts what it carried.
class ImpairingProxy {
 public:
  explicit ImpairingProxy(int server_port, std::uint32_t seed = 1);
  ~ImpairingProxy();
  ImpairingProxy(const ImpairingProxy&) = delete;
  ImpairingProxy& operator=(const ImpairingProxy&) = delete;

  [[nodiscard]] int port() const { return port_; }

  /// From now on; pieces under way keep the delay that they had.
  void impair(const Impairment& impairment);
  /// Nothing is carried any more, and nobody is told: connections stay open, new ones are taken, and bytes pile up.
  void hold();
  /// What piled up goes on its way.
  void resume();
  /// Connections are reset, new ones refused.
  void cut();
  /// After cut(): new ones are taken again.
  void restore();

  /// All that went that way so far, each connection's in one piece.
  [[nodiscard]] std::vector<std::byte> carried(Direction direction) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Piece {
    std::vector<std::byte> bytes;
    std::size_t written = 0;
    Clock::time_point due;
  };
  /// From one socket to the other.
  struct Flow {
    int from = -1, to = -1;
    bool ended = false;  ///< The sender will send no more.
    std::deque<Piece> under_way;
    std::size_t held_bytes = 0;
    Clock::time_point free_at{};  ///< Of the throttle.
  };
  struct Pair {
    Flow ways[2];
    std::size_t number = 0;  ///< In carried_.
  };

  void run();
  void listen_again();
  void accept_one();
  void read_some(Pair& pair, std::size_t direction);
  /// False where the connection is over.
  [[nodiscard]] bool write_due(Flow& way);
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
