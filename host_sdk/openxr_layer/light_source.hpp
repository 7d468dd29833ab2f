// The connection to the probe, made and watched by a thread of its own.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include <lightwell/geometry.hpp>
#include <lightwell/lightwell.h>

#include "configuration.hpp"
#include "messages.hpp"

namespace lightwell::xr {

/// Connected while it has users, the light estimators. Tries again, with growing pauses, until the probe answers; after
/// that the SDK reconnects. Errors go to Messages.
class LightSource {
 public:
  /// Older light is invalid: the latest report of a probe that has gone, within half a second.
  static constexpr std::int64_t kMaxAgeNs = 400'000'000;

  /// Both outlive this.
  LightSource(const Configuration& configuration, Messages& messages);
  /// Ends the thread: up to a second where a connection attempt is in progress.
  ~LightSource();
  LightSource(const LightSource&) = delete;
  LightSource& operator=(const LightSource&) = delete;

  void add_user();
  void remove_user();

  struct Connection {
    std::shared_ptr<lw_probe> probe;  ///< Null while there is none.
    Pose T_space_probe;               ///< Pose of the probe in Configuration::space.
  };
  /// Never waits for the network.
  [[nodiscard]] Connection connection() const;

 private:
  void run();
  [[nodiscard]] std::shared_ptr<lw_probe> connect();
  /// Mounting and state of the link.
  void watch(lw_probe* probe);

  const Configuration& configuration_;
  Messages& messages_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  int users_ = 0;
  enum class Phase { running, stopping } phase_ = Phase::running;
  std::shared_ptr<lw_probe> probe_;
  Pose T_space_probe_;
  std::thread thread_;  ///< Last: it uses the others. Started with the first user.
};

}  // namespace lightwell::xr
